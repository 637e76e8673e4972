"""The values of all subsystems, and of the plant, that formulas name."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Literal

from specc.diagnostics.nearest import nearest
from specc.lang import FOLLOW_UP, ExprError
from specc.lang.builtins import BUILTIN_NAMES
from specc.lang.parse import nodes_of, span
from specc.lang.syntax import Root
from specc.model.bindings import PLANT
from specc.model.expr import Offsets
from specc.model.requirement import Reading
from specc.model.system import Agent, Device, Element, Plant, Subsystem
from specc.model.types import Bool, Enum
from specc.model.wires import Direction, Wires
from specc.resolve.context import suggest
from specc.resolve.definitions import Groups
from specc.source import Place


@dataclass(frozen=True, slots=True)
class World:
    """What formulas speak of.

    `many` are the groups that one `for` stands for: those of agents by "", those of what is
    observed by "plant". What is missing in an `uncertain` subsystem may be so by its errors.
    """

    agents: Sequence[Agent]
    wires: Wires
    plant: Plant | None
    groups: Mapping[Root, Groups]
    uncertain: frozenset[str]


def formula_error(node: ast.expr, message: str, help: str = "", code: str = "E0335") -> ExprError:
    """An error in a formula, at a part of it."""
    return ExprError(message, *span(node), help, code)


class Names(ast.NodeTransformer):
    """Puts one name in the place of every value of an agent, and notes the value."""

    def __init__(
        self, text: str, world: World, readings: dict[str, Reading], others: Sequence[str]
    ) -> None:
        """`others` are names that no value of an agent begins with.

        `uses` are the names that were found, by their columns, each with what it names.
        """
        self.uses: dict[Offsets, Place] = {}
        agents, plant = world.agents, world.plant
        self._text = text
        self._others = set(others)
        self._agents = {agent.name: agent.place for agent in agents}
        self._groups, self._seen = world.groups.get("", {}), world.groups.get(PLANT, {})
        self._observed = {item.name: item for item in plant.observed} if plant else {}
        self._roots = {*self._agents, PLANT} if plant else {*self._agents}
        self._wires = world.wires
        self._subsystems, self._devices = self._wires.subsystems, self._wires.devices
        owners = self._subsystems.items()
        states = {state.name for _, owner in owners for state in owner.states}
        modes = {mode.name: name for name, owner in owners for mode in owner.modes}
        self._modes = {name: owner for name, owner in modes.items() if name not in states}
        self._readings = readings
        self._uncertain = world.uncertain

    def visit_Call(self, node: ast.Call) -> ast.expr:
        """Replace `state(agent.subsystem)` and `present(value)`, which are values themselves."""
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name not in ("state", "present") or len(node.args) != 1:
            self.generic_visit(node)
            return node
        argument = node.args[0]
        steps = self._path(argument)
        if name == "state":
            owner = self._subsystem(".".join(steps) or _quoted(self._text, argument), argument)
            states = Enum("", tuple(state.name for state in owner.states))
            text = f"state({owner.qualified_name})"
            return self._named(node, Reading(text, "state", *_of(owner), states, owner.place))
        self._refuse_unknown(steps, argument)
        known = self._reading(steps, argument)
        return self._named(
            node, replace(known, name=f"present({known.name})", type=Bool(), asks_presence=True)
        )

    def visit_Compare(self, node: ast.Compare) -> ast.expr:
        """Note states and modes of a subsystem, which stand beside `state(agent.subsystem)`.

        A mode is replaced by its states.
        """
        self._note_states(node)
        written = self._with_states_of_modes(node)
        self.generic_visit(written)
        return written

    def _with_states_of_modes(self, node: ast.Compare) -> ast.Compare:
        """The comparison of a state with one of several, where one side names a mode."""
        sides, (op, *others) = [node.left, *node.comparators], node.ops
        if others or not isinstance(op, ast.Eq | ast.NotEq | ast.In | ast.NotIn):
            return node
        for one, other in (sides, sides[::-1]):
            owner = self._state_owner(one)
            names = other.elts if isinstance(other, ast.Set) else [other]
            modes = {mode.name: mode.states for mode in owner.modes} if owner else {}
            if owner and modes:
                self._refuse_misspelt_modes(owner, names)
            if any(getattr(name, "id", "") in modes for name in names):
                states = [
                    ast.copy_location(ast.Name(state, ast.Load()), name) if state else name
                    for name in names
                    for state in modes.get(getattr(name, "id", ""), ("",))
                ]
                is_in = isinstance(op, ast.Eq | ast.In)
                members = ast.copy_location(ast.Set(states), other)
                found = ast.Compare(one, [ast.In() if is_in else ast.NotIn()], [members])
                return ast.copy_location(found, node)
        return node

    def _refuse_misspelt_modes(self, owner: Subsystem, names: Sequence[ast.expr]) -> None:
        """Report a name beside a state of a subsystem that is nearly that of a mode."""
        modes = [mode.name for mode in owner.modes]
        known = [*(state.name for state in owner.states), *modes]
        for node in names:
            match node:
                case ast.Name(id=name) if name not in (*known, *self._others, *self._modes):
                    if nearest(name, modes):
                        raise self._unknown("state or mode", name, known, node, owner, "E0201")

    def visit_Name(self, node: ast.Name) -> ast.expr:
        """Report a mode that stands elsewhere than beside the state of its subsystem."""
        owner = self._modes.get(node.id)
        if owner and node.id not in (*self._others, *self._roots, *BUILTIN_NAMES):
            message = f"`{node.id}` is a mode of `{owner}`, and not a value"
            raise formula_error(node, message, f"write `state({owner}) == {node.id}`")
        return node

    def _state_owner(self, node: ast.expr) -> Subsystem | None:
        """The subsystem that `state(agent.subsystem)` asks for."""
        match node:
            case ast.Call(func=ast.Name(id="state"), args=[of]):
                return self._subsystems.get(".".join(_steps(of)))
        return None

    def _note_states(self, node: ast.Compare) -> None:
        sides = [node.left, *node.comparators]
        for side in sides:
            if (owner := self._state_owner(side)) is not None:
                places = {state.name: state.place for state in owner.states}
                places |= {mode.name: mode.place for mode in owner.modes}
                for name in (n for s in sides for n in getattr(s, "elts", (s,))):
                    self._note(name, places.get(getattr(name, "id", "")))

    def _path(self, node: ast.expr) -> list[str]:
        """The names of `a.b.c`, with a note of agent and subsystem; none of anything else."""
        steps = _steps(node)
        owner = self._subsystems.get(".".join(steps[:2]))
        agent = self._agents.get(steps[0]) if steps else None
        self._note(node, agent, owner.place if owner else None)
        return steps

    def _note(self, node: ast.expr, *of: Place | None) -> None:
        """Note what the first names of `a.b.c` name; what stands for another text has no name."""
        parts = [node]
        while isinstance(parts[0], ast.Attribute):
            parts.insert(0, parts[0].value)
        for part, place in zip(parts, of, strict=False):
            begin, end = span(part)
            name = getattr(part, "id", "")
            if isinstance(part, ast.Attribute) and span(part.value)[1] < end:
                name, begin = part.attr, end - len(part.attr)
            if place and name == self._text[begin:end]:
                self.uses[begin, end] = place

    def note_others(self, tree: ast.expr) -> None:
        """Note what names name in a formula that has an error somewhere."""
        for node in nodes_of(tree):
            with suppress(ExprError):
                if isinstance(node, ast.Compare):
                    self._note_states(node)
                elif isinstance(node, ast.Attribute) and (steps := self._path(node)):
                    self._reading(steps, node)

    def note_groups(self, tree: ast.expr) -> None:
        """Note the names that one `for` gives to many, which are written out later."""
        for node in nodes_of(tree):
            match node:
                case ast.Name(id=name) if members := self._groups.get(name):
                    self._note(node, self._agents.get(next(iter(members.values()))))
                case ast.Attribute(ast.Name(id="plant"), name) if name in self._seen:
                    item = self._observed.get(next(iter(self._seen[name].values())))
                    self._note(node, None, item.place if item else None)

    def refuse_unknown_groups(self, tree: ast.expr) -> None:
        """Report what a quantifier goes over that is neither written out nor a constant."""
        calls = [node for node in nodes_of(tree) if isinstance(node, ast.Call)]
        if not calls:
            return
        names = [node for node in nodes_of(tree) if isinstance(node, ast.Name)]
        known = self._others | {name.id for name in names if isinstance(name.ctx, ast.Store)}
        for node in calls:
            match node:
                case ast.Call(
                    func=ast.Name(id=function),
                    args=[
                        ast.GeneratorExp(generators=[ast.comprehension(iter=ast.Name() as over)])
                    ],
                ) if function in BUILTIN_NAMES and over.id not in known:
                    what = "group of agents"
                    raise self._unknown(what, over.id, self._groups, over, None, "E0201")

    def visit_GeneratorExp(self, node: ast.GeneratorExp) -> ast.expr:
        """Hide the variable of a quantifier, which is no agent."""
        targets = (part.target for part in node.generators)
        self._others |= {target.id for target in targets if isinstance(target, ast.Name)}
        self.generic_visit(node)
        return node

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """Replace a value of a subsystem or device; its components and fields stay."""
        steps = self._path(node)
        self._refuse_unknown(steps, node)
        if not steps or steps[0] not in self._roots or len(steps) > self._length(steps):
            self.generic_visit(node)
            return node
        return self._named(node, self._reading(steps, node))

    def _refuse_unknown(self, steps: list[str], node: ast.expr) -> None:
        """Report a value of an agent that is not there."""
        if steps and steps[0] not in (*self._roots, *self._others):
            raise self._unknown("agent", steps[0], self._agents, node, None, "E0201")

    def _named(self, node: ast.expr, reading: Reading) -> ast.expr:
        self._readings.setdefault(reading.name, reading)
        return ast.copy_location(ast.Name(reading.name, ast.Load()), node)

    def _length(self, steps: Sequence[str]) -> int:
        if steps[0] not in self._agents or (steps[0] == PLANT and steps[1] in self._observed):
            return 2
        if ".".join(steps[:2]) not in self._subsystems and steps[1:2] in (["E"], ["R"]):
            return 4
        return 5 if steps[2:3] in (["x"], ["y"]) else 3

    def _reading(self, steps: list[str], node: ast.expr) -> Reading:
        name = ".".join(steps)
        if len(steps) < 2 or len(steps) != self._length(steps):
            message = f"`{_quoted(self._text, node)}` is not a value"
            help = (
                "name memory `agent.subsystem.name`, a buffer `agent.subsystem.x.peer.element`, "
                "a device `agent.E.device.element`, what is observed `plant.name`, or "
                "`state(agent.subsystem)`"
            )
            raise formula_error(node, message, help)
        if len(steps) == 2:
            item = self._observed.get(steps[1])
            if item is None:
                known = self._observed
                raise self._unknown("value to observe", steps[1], known, node, None, "E0201")
            self._note(node, None, item.place)
            return Reading(name, "observed", "", (steps[1],), item.type, item.place)
        if len(steps) == 4:
            return self._of_device(name, steps, node)
        owner = self._subsystem(".".join(steps[:2]), node)
        if len(steps) == 5:
            return self._of_buffer(name, owner, steps, node)
        memory = {item.name: item for item in owner.memory if item.name.isidentifier()}
        if steps[2] in [mode.name for mode in owner.modes]:
            message = f"`{steps[2]}` is a mode of `{owner.qualified_name}`, and not a value"
            help = f"write `state({owner.qualified_name}) == {steps[2]}`"
            raise formula_error(node, message, help)
        if steps[2] not in memory:
            raise self._unknown("memory element", steps[2], memory, node, owner, "E0201")
        element = memory[steps[2]]
        self._note(node, None, None, element.place)
        return Reading(name, "memory", *_of(owner, element.name), element.type, element.place)

    def _of_buffer(self, name: str, owner: Subsystem, steps: list[str], node: ast.expr) -> Reading:
        _, _, side, peer, element = steps
        port = owner.port(side, peer)
        if port is None:
            peers = [p.peer for p in owner.ports if p.direction == side]
            raise self._unknown(
                f"{'input' if side == 'x' else 'output'} buffer", peer, peers, node, owner, "E0201"
            )
        self._note(node, None, None, None, self._wires.peer_place(owner, port))
        item = port.element(element)
        if item is None:
            known = [e.name for e in port.elements]
            raise self._unknown("element", element, known, node, owner, "E0201")
        self._note(node, None, None, None, None, item.place)
        place = item.type, item.place
        if side == "y":
            return Reading(name, "sent", *_of(owner, peer, element), *place)
        wire = self._wires.input_wire(owner.qualified_name, peer)
        if wire and wire.peer_device:
            return Reading(name, "reported", *_of(owner, peer, element), *place)
        # What a subsystem has in its buffer is what was sent there last, or its initial value.
        if wire is None or wire.peer_port is None or not wire.peer_port.element(element):
            raise ExprError("", *span(node), code=FOLLOW_UP)  # the ends differ, which is reported
        initial = (owner.qualified_name, peer, element) if item.init is not None else None
        return Reading(
            name, "sent", wire.peer_name, (wire.peer_port.peer, element), *place, initial
        )

    def _of_device(self, name: str, steps: list[str], node: ast.expr) -> Reading:
        device = self._devices.get(".".join(steps[:3]))
        if device is None:
            wanted = ".".join(steps[:3])
            raise self._unknown("device", wanted, self._devices, node, None, "E0201")
        self._note(node, None, None, device.place)
        ways: tuple[tuple[Literal["sent", "reported"], Direction, tuple[Element, ...]], ...]
        ways = ("sent", "y", device.x), ("reported", "x", device.y)
        for kind, direction, elements in ways:
            item = next((e for e in elements if e.name == steps[3]), None)
            if item is not None:
                self._note(node, None, None, None, item.place)
                for wire in self._wires.wires_of_element(
                    device.qualified_name, direction, item.name
                ):
                    found = _of(wire.subsystem, wire.port.peer, item.name)
                    return Reading(name, kind, *found, item.type, item.place)
                raise ExprError("", *span(node), code=FOLLOW_UP)  # an unused device is reported
        known = [e.name for e in (*device.x, *device.y)]
        raise self._unknown("element", steps[3], known, node, device, "E0201")

    def _subsystem(self, name: str, node: ast.expr) -> Subsystem:
        found = self._subsystems.get(name)
        if found is None:
            raise self._unknown("subsystem", name, self._subsystems, node, None, "E0201")
        return found

    def _unknown(
        self,
        what: str,
        name: str,
        known: object,
        node: ast.expr,
        owner: Subsystem | Device | None,
        code: str,
    ) -> ExprError:
        place = owner.qualified_name if owner else name
        # An agent may be lost as a whole, with a description that cannot be used.
        doubtful = not self._uncertain.isdisjoint((place, place.partition(".")[0]))
        help = suggest(name, sorted(known))  # type: ignore[call-overload]  # any iterable of names
        code = FOLLOW_UP if doubtful else code
        return formula_error(node, f"unknown {what} `{name}`", help, code)


def _of(owner: Subsystem, *element: str) -> tuple[str, tuple[str, ...]]:
    return owner.qualified_name, element


def _steps(node: ast.expr) -> list[str]:
    """The names of `a.b.c`; none of anything else."""
    names: list[str] = []
    while isinstance(node, ast.Attribute):
        names.append(node.attr)
        node = node.value
    return [*names, node.id][::-1] if isinstance(node, ast.Name) else []


def _quoted(text: str, node: ast.expr) -> str:
    start, end = span(node)
    return text[start:end]
