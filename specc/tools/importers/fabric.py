"""`specc import fabric`: subsystem definitions of FABRIC become agents of a specification.

As in FABRIC, a predicate depends on what was read (`input_data`) and on the components of the
subsystem (`components`); a behaviour updates the components, which give the outputs. The text is
`templates/import/fabric.yaml.j2`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from specc.lang.packages import PACKAGES
from specc.model.expr import FALSE, TRUE, BoundVariable, Expr, Unary
from specc.reachable import grouped
from specc.tools.importers.fabric_reader import (
    IN_ERROR,
    OK,
    Buffer,
    FabricState,
    FabricSubsystem,
    NextState,
    read_definition,
)
from specc.tools.importers.logic import render, substitute
from specc.tools.importers.reading import Notes
from specc.tools.importers.writing import PEERS, Data, SpecNames, rate

DEFAULT_PERIOD_S = Fraction(1, 1000)
_WAITING = "a subsystem of specc steps every period, whether or not data has come"
_TIME = "whether time is simulated or real is decided by `specc run`"
_CONVERTER = "messages are opaque; convert them in the operators"
_REASONS = {
    ("buffer_groups", ""): _WAITING,
    ("trigger_methods", ""): _WAITING,
    ("new_data_on_buffer", ""): _WAITING,
    ("no_data_on_buffer", ""): _WAITING,
    ("interval", "first"): _WAITING,
    ("interval", "first_sim"): _WAITING,
    ("interval", "next"): _WAITING,
    ("buffer_group", "name"): _WAITING,
    ("buffer_group", "first_timeout"): _WAITING,
    ("buffer_group", "next_timeout"): _WAITING,
    ("buffer_group", "first_timeout_sim"): _TIME,
    ("buffer_group", "min_period_sim"): _TIME,
    ("buffer_group", "used_time"): _TIME,
    ("simulation", ""): _TIME,
    ("in", "converter"): _CONVERTER,
    ("out", "converter"): _CONVERTER,
}
_PARTS = "_parts"
"""The module with the predicates and components of subsystem `a` is `a_parts`."""
BufferId = tuple[str, str]
"""Name of a subsystem and alias of one of its buffers."""


def import_fabric(
    paths: Sequence[str],
    *,
    name: str = "",
    period: Fraction | None = None,
    wires: Iterable[tuple[BufferId, BufferId]] = (),
) -> Notes:
    """The specification of the subsystems that some files define.

    `name` is that of the system; `period`, in seconds, replaces the periods in the files; `wires`
    are pairs of buffers that are connected, beyond what is evident.
    """
    notes = Notes()
    definitions: list[FabricSubsystem] = []
    for path in dict.fromkeys(paths):
        root = notes.read(path, "subsystem_definition")
        definition = read_definition(root, notes) if root is not None else None
        if definition is not None:
            if any(d.name == definition.name for d in definitions):
                message = f"two files define a subsystem `{definition.name}`"
                help = "rename one of the files: subsystems are called as their files or packages"
                notes.error("E0803", message, definition.root.place, help)
            definitions.append(definition)
    if notes.failed:
        return notes
    wiring = _connect(definitions, wires, notes)
    if notes.failed:
        return notes
    names, shared = SpecNames(PEERS), SharedDefinitions()
    for definition in definitions:
        names.of(definition.name)
    agents = []
    for definition in definitions:
        own = rate(_period(definition, period, notes))
        agents.append(_Agent(definition, own, names, shared, wiring, notes))
        _report_assumptions(definition, notes)
        notes.report_unused(definition.root, _REASONS)
    wish = name or (definitions[0].name if len(definitions) == 1 else "fabric")
    modules = ", ".join(shared.modules)
    notes.write(
        "import/fabric.yaml.j2",
        {"system": SpecNames(PACKAGES).of(wish), "shared": shared, "agents": agents},
        "Made by `specc import fabric`.",
        f"What `specc build` makes of it imports, and you provide, the modules {modules}.",
    )
    return notes


def _report_assumptions(definition: FabricSubsystem, notes: Notes) -> None:
    """Report what holds of every import: the two work cycles differ in little."""
    place = definition.root.place
    notes.change(
        "conditions are not evaluated in the first period; FABRIC evaluates them there too", place
    )
    if definition.buffers_of(inputs=False):
        notes.change("every behaviour is taken to write every output buffer", place)
    if definition.buffers_of(inputs=True):
        message = "an input buffer keeps its last message, and holds an empty one before the first"
        notes.change(message, place)


def _period(definition: FabricSubsystem, fixed: Fraction | None, notes: Notes) -> Fraction:
    """The period of a subsystem: `fixed`, or the shortest of those of its states."""
    if fixed is not None:
        return fixed
    periods = [s.period_s for s in definition.states if s.period_s]
    periods += [definition.period_s] if definition.period_s else []
    if not periods:
        text = f"{float(DEFAULT_PERIOD_S * 1000):g} ms"
        message = f"`{definition.name}` has no period; {text} is assumed"
        notes.change(message, definition.root.place, "give one with `--period`")
        return DEFAULT_PERIOD_S
    shortest = min(periods)
    waiting = [s for s in definition.states if not s.period_s and not definition.period_s]
    slower = [s for s in definition.states if s.period_s and s.period_s != shortest]
    for state in slower or waiting:
        message = f"the period is {float(shortest * 1000):g} ms in all states"
        notes.change(f"{message}; state `{state.name}` has another one", state.element.place)
    return shortest


# Which buffers are connected.
#
# The files do not say it: the deployer of FABRIC connects them. Two buffers match if their message
# type is the same, one is an output and the other an input, and one is on the bottom side and the
# other on the top side of another subsystem. They are taken to be connected if they have one name,
# or else match no other buffer that is not connected.


@dataclass(eq=False, slots=True)
class Wiring:
    """Connections of buffers; a buffer that is in neither table is connected outside the files."""

    readers: dict[BufferId, list[BufferId]] = field(default_factory=dict)
    """Output buffer -> input buffers, of different subsystems."""
    sender: dict[BufferId, BufferId] = field(default_factory=dict)
    """Input buffer -> output buffer."""

    def add(self, output: BufferId, input_: BufferId) -> None:
        """Connect two buffers."""
        self.readers.setdefault(output, []).append(input_)
        self.sender[input_] = output


def _connect(
    definitions: Sequence[FabricSubsystem],
    wires: Iterable[tuple[BufferId, BufferId]],
    notes: Notes,
) -> Wiring:
    """The connections of the user, then those that are evident."""
    wiring = Wiring()
    by_name = {d.name: d for d in definitions}
    for first, second in wires:
        _add_wire(by_name, first, second, wiring, notes)
    while evident := [*_evident_wires(definitions, wiring)]:
        for output, input_ in evident:
            wiring.add(output, input_)
    for (name, alias), others in _matches(definitions, wiring).items():
        if others:
            listed = ", ".join(f"`{other}.{theirs}`" for other, theirs in others)
            notes.change(
                f"`{name}.{alias}` could be connected with {listed}; it ends outside instead",
                by_name[name].buffers[alias].element.place,
                f"choose with `--connect {name}.{alias}={others[0][0]}.{others[0][1]}`",
            )
    return wiring


def _evident_wires(
    definitions: Sequence[FabricSubsystem], wiring: Wiring
) -> Iterator[tuple[BufferId, BufferId]]:
    """Outputs and inputs that match under one name, or without these those that match no other.

    Several subsystems may read an output under its name.
    """
    matches = _matches(definitions, wiring)
    named = {e: [o for o in others if o[1] == e[1]] for e, others in matches.items()}
    outputs = [(d.name, b.alias) for d in definitions for b in d.buffers_of(inputs=False)]
    for choice in (named, matches):
        found = [
            (output, input_)
            for output in outputs
            if (inputs := choice.get(output, []))
            and (choice is named or len(inputs) == 1)
            and all(choice[input_] == [output] for input_ in inputs)
            for input_ in inputs
        ]
        if found:
            yield from found
            return


def _matches(
    definitions: Sequence[FabricSubsystem], wiring: Wiring
) -> dict[BufferId, list[BufferId]]:
    """The buffers that are not connected, each with those that it matches."""
    unconnected = {
        (definition.name, alias): buffer
        for definition in definitions
        for alias, buffer in definition.buffers.items()
        if not ({(definition.name, alias)} & (wiring.readers.keys() | wiring.sender.keys()))
    }
    alike = grouped(((b.type, b.is_input, b.side), end) for end, b in unconnected.items())
    opposite = {"top": "bottom", "bottom": "top"}
    return {
        end: [
            other
            for other in alike.get((b.type, not b.is_input, opposite[b.side]), ())
            if other[0] != end[0]
        ]
        for end, b in unconnected.items()
    }


def _add_wire(
    by_name: Mapping[str, FabricSubsystem],
    first: BufferId,
    second: BufferId,
    wiring: Wiring,
    notes: Notes,
) -> None:
    found = []
    for name, alias in (first, second):
        if name not in by_name or alias not in by_name[name].buffers:
            place = next(iter(by_name.values())).root.place
            message = f"there is no buffer `{name}.{alias}`"
            notes.error("E0803", message, place, "correct the `--connect`")
            return
        found.append(by_name[name].buffers[alias])
    a, b = found
    output, input_ = (second, first) if a.is_input else (first, second)
    readers = {name for name, _ in wiring.readers.get(output, ())}
    both = f"`{first[0]}.{a.alias}` {{}} `{second[0]}.{b.alias}`"
    if a.type != b.type or a.is_input == b.is_input or first[0] == second[0]:
        help = "connect an input with an output of the same type in another subsystem"
        notes.error("E0803", f"{both.format('and')} cannot be connected", b.element.place, help)
    elif input_ in wiring.sender or input_[0] in readers:
        help = "correct the `--connect`"
        notes.error("E0803", f"{both.format('or')} is connected twice", b.element.place, help)
    else:
        wiring.add(output, input_)


# What the template prints.


@dataclass(eq=False, slots=True)
class SharedDefinitions:
    """Types and operators of all subsystems, and the Python modules that the user provides."""

    types: dict[str, Data] = field(default_factory=dict)
    operators: dict[str, Data] = field(default_factory=dict)
    modules: dict[str, None] = field(default_factory=dict)
    names: SpecNames = field(default_factory=SpecNames)

    def message(self, type: str) -> str:
        """The name of a message type of ROS, which is opaque."""
        name = self.names.of(type)
        if name not in self.types:
            self.types[name] = {"opaque": True, "python": self._python(type), "title": type}
        return name

    def empty(self, type: str) -> str:
        """The expression of an empty message, which stands before the first one."""
        name = self.names.of(f"empty {self.names.of(type)}")
        signature, title = f"() -> {self.message(type)}", "an empty message"
        python = self._python(type)
        self.operators[name] = {"signature": signature, "python": python, "title": title}
        return f"{name}()"

    def _python(self, type: str) -> str:
        package, _, message = type.partition("::")
        self.modules[f"{package}.msg"] = None
        return f"{package}.msg:{message}"

    def opaque(self, name: str, module: str, title: str) -> str:
        """A type that only operators look into; its name."""
        own = self.names.of(f"{module.removesuffix(_PARTS)} {name}")
        self.modules[module] = None
        self.types[own] = {"opaque": True, "python": f"{module}:{name}", "title": title}
        return own

    def operator(self, name: str, module: str, signature: str, title: str) -> str:
        """An operator; its name."""
        name = SpecNames().of(name)
        own, python = self.names.of(f"{module.removesuffix(_PARTS)} {name}"), f"{module}:{name}"
        self.operators[own] = {"signature": signature, "python": python, "title": title}
        return own


class _Agent:
    """The agent of one definition, and a stub for each side on which a buffer is not connected."""

    def __init__(
        self,
        definition: FabricSubsystem,
        rate: str,
        agents: SpecNames,
        shared: SharedDefinitions,
        wiring: Wiring,
        notes: Notes,
    ) -> None:
        self._definition, self._agents, self._wiring = definition, agents, wiring
        self._shared, self._notes = shared, notes
        self.rate, self.title, self.name = rate, definition.name, agents.of(definition.name)
        self._module = self.name + _PARTS
        self._let_names = SpecNames(("components",))
        self.let: dict[str, Data] = {}
        self._input_data = self._opaque("InputData", "what the subsystem has read")
        self.components = self._opaque("Components", "the components with their state")
        self._add_input_data()
        self._predicates = {name: self._predicate(name) for name in self._used_predicates()}
        self._add_machine()
        self.functions = {
            name: self._function(name, state.behaviours) for name, state in self._running.items()
        }
        title = "components at the start"
        self.start = self._operator("components", f"() -> {self.components}", title)
        self.x, self.y = self._buffers(inputs=True), self._buffers(inputs=False)
        self.stubs = [*self._stubs()]

    def _opaque(self, name: str, title: str) -> str:
        return self._shared.opaque(name, self._module, title)

    def _operator(self, name: str, signature: str, title: str) -> str:
        return self._shared.operator(name, self._module, signature, title)

    # Values: input data, predicates, components.

    def _add_input_data(self) -> None:
        """`input_data` gathers every input buffer and whether something new came into it."""
        parameters, arguments = [], []
        names = SpecNames()
        for buffer in self._definition.buffers_of(inputs=True):
            alias = names.of(buffer.alias)
            value = f"x.{self._peers(buffer)[0]}.{self._element(buffer)}"
            parameters += [f"{alias}: {self._shared.message(buffer.type)}"]
            parameters += [f"{names.new(alias + '_new')}: bool"]
            arguments += [value, f"fresh({value})"]
        signature = f"({', '.join(parameters)}) -> {self._input_data}"
        operator = self._operator("input_data", signature, "what predicates and components see")
        self.let[self._let_names.of("input_data")] = f"{operator}({', '.join(arguments)})"

    def _used_predicates(self) -> list[str]:
        states, behaviours = self._definition.states, self._definition.behaviours.values()
        elements = [each.element for each in behaviours]
        elements += [arc.element for state in states for arc in state.arcs]
        uses_ok = any(OK in text for e in elements for text in e.attributes.values())
        return [*([OK] if uses_ok else []), *self._definition.predicates]

    def _predicate(self, name: str) -> str:
        let = self._let_names.of(name)
        if name == OK:
            signature = f"(components: {self.components}) -> bool"
            title = "whether the components that must run do, and no others"
            self.let[let] = f"{self._operator(name, signature, title)}(components)"
            return let
        signature = f"(input_data: {self._input_data}, components: {self.components}) -> bool"
        operator = self._operator(name, signature, f"predicate {name}")
        self.let[let] = f"{operator}({self._let_names.of('input_data')}, components)"
        if let != name:
            message = f"predicate `{name}` is called `{let}`"
            self._notes.change(message, self._definition.root.place)
        return let

    def _function(self, name: str, behaviours: tuple[str, ...]) -> dict[str, Data]:
        """One update of the components that a behaviour runs, and the outputs they give."""
        declared = self._definition.behaviours
        components = dict.fromkeys(c for each in behaviours for c in declared[each].components)
        parameters = f"(components: {self.components}, input_data: {self._input_data})"
        title = f"one update of {', '.join(components)}" if components else "nothing runs"
        operator = self._operator(f"run_{name}", f"{parameters} -> {self.components}", title)
        let = self._let_names.new(f"components_after_{name}")
        self.let[let] = f"{operator}(components, {self._let_names.of('input_data')})"
        targets: dict[str, Data] = {"components": let}
        for buffer in self._definition.buffers_of(inputs=False):
            output = f"(components: {self.components}) -> {self._shared.message(buffer.type)}"
            gives = self._operator(buffer.alias, output, f"contents of {buffer.alias}")
            for peer in self._peers(buffer):
                targets[f"y.{peer}.{self._element(buffer)}"] = f"{gives}({let})"
        return targets

    # The state machine.

    def _add_machine(self) -> None:
        definition = self._definition
        self._conditions: dict[str, dict[str, Data]] = {"initial": {}, "terminal": {}, "error": {}}
        self.behaviours: dict[str, Data] = {}
        self.transitions: list[Data] = []
        self._running: dict[str, FabricState] = {}
        """Behaviour -> the first state of FABRIC whose behaviours run together in it."""
        self._condition_names = {k: SpecNames(("always", "never")) for k in self._conditions}
        self._known_conditions: dict[tuple[str, str, str], str] = {}
        behaviour_names, state_names = SpecNames(), SpecNames()
        self.states: dict[str, Data] = {}
        for state in definition.states:
            name = behaviour_names.of(" and ".join(state.behaviours))
            self.states[state_names.of(state.name)] = name
            if name not in self._running:
                self._running[name] = state
                ends = definition.ends(state)
                self.behaviours[name] = {
                    "functions": [name],
                    "terminal": self._condition("terminal", ends["terminal"], f"{name}_stops"),
                    "error": self._condition("error", ends["error"], f"{name}_fails"),
                }
        self.initial = state_names.of(definition.initial)
        for state in definition.states:
            for arc in state.arcs:
                ends_of_row = state_names.of(state.name), state_names.of(arc.target)
                self._add_rows(state, arc, *ends_of_row)
        self.conditions = {kind: named for kind, named in self._conditions.items() if named}
        executed = {name for state in definition.states for name in state.behaviours}
        for name, behaviour in definition.behaviours.items():
            if name not in executed:
                message = f"behavior `{name}` is not carried over: no state executes it"
                self._notes.loss(message, behaviour.element.value_place("name"))
        for old, new in state_names.renamed.items():
            place = next(s.element.place for s in definition.states if s.name == old)
            self._notes.change(f"state `{old}` is called `{new}`", place)

    def _add_rows(self, state: FabricState, arc: NextState, source: str, target: str) -> None:
        """A row for each cause under which the arc can be taken."""
        ends = self._definition.ends(state)
        conditions = {
            cause: substitute(arc.condition, {IN_ERROR: cause == "error"}) for cause in ends
        }
        possible = {cause: c for cause, c in conditions.items() if c != FALSE}
        if not possible:
            message = f"the arc from `{state.name}` to `{arc.target}` is never taken"
            self._notes.loss(message, arc.element.value_place("init_cond"))
        # An arc that no cause can lead to stays, so that `specc validate` shows it.
        occurring = {cause: c for cause, c in possible.items() if ends[cause] != FALSE} or possible
        for cause, condition in occurring.items():
            wish = f"{state.name}_to_{arc.target}" + ("_in_error" if cause == "error" else "")
            name = self._condition("initial", condition, wish)
            self.transitions.append([source, cause, name, target])

    def _condition(self, kind: str, logic: Expr, wish: str) -> str:
        """The name of a condition; a single predicate gives its own name everywhere."""
        if logic in (TRUE, FALSE):
            return "always" if logic == TRUE else "never"
        match logic:
            case BoundVariable(name=predicate):
                wish = predicate
            case Unary(operand=BoundVariable(name=predicate)):
                wish = f"not_{predicate}"
        text = render(logic, self._predicates.__getitem__)
        key = kind, text, wish
        if key not in self._known_conditions:
            name = self._known_conditions[key] = self._condition_names[kind].new(wish)
            self._conditions[kind][name] = text
        return self._known_conditions[key]

    # Buffers, by the agents at their other ends.

    def _buffers(self, *, inputs: bool) -> dict[str, Data]:
        found: dict[str, dict[str, Data]] = {}
        for buffer in self._definition.buffers_of(inputs=inputs):
            element: dict[str, Data] = {"type": self._shared.message(buffer.type)}
            if inputs:
                element["init"] = self._shared.empty(buffer.type)
            name = self._element(buffer)
            if name != buffer.alias:
                element["title"] = buffer.alias
            for peer in self._peers(buffer):
                found.setdefault(peer, {})[name] = element
        return {**found}

    def _peers(self, buffer: Buffer) -> list[str]:
        """The agents at the other ends: of an input one, of an output one or more."""
        outside = f"{self._definition.name} {buffer.side}"
        return [self._agents.of(name) for name, _ in self._other_ends(buffer) or [(outside, "")]]

    def _element(self, buffer: Buffer) -> str:
        """Both ends of a connection have the name that the sender gives the buffer."""
        others = self._other_ends(buffer)
        return SpecNames().of(others[0][1] if others and buffer.is_input else buffer.alias)

    def _other_ends(self, buffer: Buffer) -> list[BufferId]:
        own = self._definition.name, buffer.alias
        if not buffer.is_input:
            return self._wiring.readers.get(own, [])
        return [self._wiring.sender[own]] if own in self._wiring.sender else []

    def _stubs(self) -> Iterator[dict[str, object]]:
        """A stub agent sends empty messages and stores every input; its behaviour is unknown."""
        for side in ("top", "bottom"):
            outside = [
                buffer
                for buffer in self._definition.buffers.values()
                if buffer.side == side and not self._other_ends(buffer)
            ]
            if outside:
                yield {
                    "name": self._peers(outside[0])[0],
                    "side": side,
                    "sent": [self._stub_buffer(b) for b in outside if b.is_input],
                    "received": [self._stub_buffer(b) for b in outside if not b.is_input],
                }

    def _stub_buffer(self, buffer: Buffer) -> dict[str, str]:
        return {
            "element": self._element(buffer),
            "alias": buffer.alias,
            "type": self._shared.message(buffer.type),
            "empty": self._shared.empty(buffer.type),
        }
