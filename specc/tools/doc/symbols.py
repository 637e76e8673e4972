"""What formulas call the parts of a system: buffers, memory, constants, operators, states."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from specc.lang.notation import MathSymbol, notation_of, symbol_of
from specc.model.expr import Truth, source_name
from specc.model.fsm import Behaviour, Condition, mode_of
from specc.model.system import (
    Constant,
    Device,
    Element,
    Operator,
    Port,
    Subsystem,
    System,
)
from specc.model.types import Frame, Type
from specc.model.wires import Wires
from specc.reachable import grouped
from specc.tools.doc.markup import (
    EMPTY,
    Math,
    attached,
    bracketed,
    drawn,
    linked,
    listed,
    sign,
    word,
)
from specc.tools.graph.diagram import is_named

LETTERS = {"control": "c", "virtual_effector": "e", "virtual_receptor": "r"}
DEVICE_LETTERS = {"real_effector": "E", "real_receptor": "R"}
_OTHER_AGENT = "T"
_OPERATOR = re.compile(r"([A-Z]{1,4})(\d*)")
_STATE = re.compile(r"S(\d+)")
STAMP, NEXT_STAMP = sign("iota", 0.6), Math("iota/**/+/**/1", 2)


def name_math(name: str) -> Math:
    """A name of the file as an index: a letter in italics, else upright."""
    return drawn(MathSymbol(name)) if len(name) > 1 or not name.isdecimal() else word(name)


def indices(*names: str) -> Math:
    """Names as the indices of one symbol: `irp,m`."""
    return listed(word(name.replace("_", " ")) for name in names)


def frames_of(type_: Type) -> tuple[Frame, ...]:
    """The frame that a value is in, or the two that a pose lies between."""
    frames = tuple(dict.fromkeys(type_.frames)) if len(type_.frames) > 2 else type_.frames
    return frames if len(frames) < 3 else ()


def symbol_for(
    name: str, given: str, type_: Type, *, component: str = "", tilde: bool = False
) -> Math:
    """The symbol of a value: the one that is `given`, else by its name; with its frames."""
    frames = frames_of(type_)
    symbol = notation_of(given) if given else symbol_of(name)
    if not given and len(frames) == 2 and symbol.sub:
        prefix, (first, *rest) = "".join(frames), symbol.sub
        if first.base.startswith(prefix):
            rest_of_name = first.base[len(prefix) :]
            symbol = replace(
                symbol, sub=(*((MathSymbol(rest_of_name),) if rest_of_name else ()), *rest)
            )
    before: dict[str, Any] = dict(zip(("tl", "bl"), map(name_math, frames), strict=False))
    if component:
        before["bl"] = _axis(component)
    return drawn(symbol, tilde=tilde, **before)


def _axis(name: str) -> Math:
    return drawn(MathSymbol(name[0], sub=(MathSymbol(name[1:]),) if name[1:] else ()))


def operator_symbol(operator: Operator | None, name: str) -> Math:
    """Capital letters of operators are calligraphic, as in the paper; else they are words."""
    if operator is not None and operator.symbol:
        return drawn(notation_of(operator.symbol))
    short = source_name(name)
    found = _OPERATOR.fullmatch(short)
    if not found:
        return Math(word(short).text, 0.9 * len(short))
    return drawn(MathSymbol(found[1], "cal", (MathSymbol(found[2]),) if found[2] else ()))


@dataclass(frozen=True)
class SystemNames:
    """The names of a whole system."""

    system: System

    @cached_property
    def wires(self) -> Wires:
        """Who is at the other end of buffers."""
        return Wires(self.system.agents)

    @cached_property
    def operators(self) -> Mapping[str, Operator]:
        """By their names in the system."""
        return {operator.name: operator for operator in self.system.operators}

    @cached_property
    def constants(self) -> Mapping[str, Constant]:
        """The constants of the system."""
        return {constant.name: constant for constant in self.system.constants}

    @cached_property
    def subsystems(self) -> Mapping[str, SubsystemNames]:
        """The names of each subsystem."""
        return {s.qualified_name: SubsystemNames(self, s) for s in self.system.subsystems}

    def constant(self, name: str) -> Math:
        """A constant of the system."""
        item = self.constants.get(name)
        if item is None:
            return drawn(symbol_of(source_name(name)))
        return linked(f"constant.{name}", symbol_for(name, item.symbol, item.value.type))

    def operator(self, name: str) -> Math:
        """An operator."""
        return linked(f"operator.{name}", operator_symbol(self.operators.get(name), name))

    def device(self, device: Device) -> Math:
        """A device: E with its agent and name."""
        letter = sign(DEVICE_LETTERS[device.kind], 1)
        return attached(letter, br=indices(device.agent, device.name))


@dataclass(frozen=True)
class SubsystemNames:
    """The names of one subsystem."""

    outer: SystemNames
    subsystem: Subsystem

    @property
    def letter(self) -> str:
        """`c`, `e` or `r`."""
        return LETTERS[self.subsystem.kind]

    @property
    def own(self) -> tuple[str, ...]:
        """Agent and subsystem; of a control subsystem the agent alone."""
        s = self.subsystem
        return (s.agent,) if s.kind == "control" else (s.agent, s.name)

    @property
    def symbol(self) -> Math:
        """The subsystem itself."""
        return attached(sign(self.letter, 1), br=indices(*self.own))

    def id(self, *parts: str) -> str:
        """The name of a place of the document, which has no spaces."""
        return "_".join(".".join((self.subsystem.qualified_name, *parts)).split())

    # Buffers, memory and what is in them.

    def peer_letter(self, port: Port) -> str:
        """The letter of what is at the other end."""
        part = self._peers.get((port.direction, port.peer))
        if isinstance(part, Device):
            return DEVICE_LETTERS[part.kind]
        if part is None or part.agent != self.subsystem.agent:
            return _OTHER_AGENT
        return LETTERS[part.kind]

    @cached_property
    def _peers(self) -> Mapping[tuple[str, str], Subsystem | Device | None]:
        wires = self.outer.wires.wires_of(self.subsystem)
        return {(wire.port.direction, wire.port.peer): wire.peer for wire in wires}

    def buffer(self, port: Port, stamp: Math = EMPTY) -> Math:
        """A communication buffer, with a time stamp."""
        letter, is_control = self.peer_letter(port), self.subsystem.kind == "control"
        above = [sign(letter, 1)]
        names = (*self.own, port.peer) if is_control else self.own
        if not is_control and port.peer not in ("c", "E", "R"):
            above.append(word(port.peer))
        base = sign(self.letter, 1)
        return attached(
            base, tl=listed(above), bl=sign(port.direction, 1), br=indices(*names), tr=stamp
        )

    def memory(self, stamp: Math = EMPTY) -> Math:
        """The memory."""
        letter = sign(self.letter, 1)
        return attached(letter, tl=letter, br=indices(*self.own), tr=stamp)

    def port(self, direction: str, peer: str) -> Port | None:
        """A port by direction and peer."""
        return self.subsystem.port(direction, peer)

    def placeholder(self, direction: str, peer: str, name: str, stamp: Math = EMPTY) -> Math:
        """An element in its buffer; with the peer "" a memory element."""
        if not peer:
            item = next((m for m in self.subsystem.memory if m.name == name), None)
            if item is None:
                return self.memory(stamp) + bracketed(self.mode_memory(name), "[", "]")
            inner = symbol_for(name, item.symbol, item.type, tilde=True)
            if not name.isidentifier():
                inner = self.mode_memory(name)
            inner = linked(self.id("memory", name), inner)
            return self.memory(stamp) + bracketed(inner, "[", "]")
        port = self.port(direction, peer)
        element = port.element(name) if port else None
        if port is None or element is None:
            return bracketed(word(f"{direction}.{peer}.{name}"), "[", "]")
        inner = symbol_for(name, element.symbol, element.type, tilde=True)
        target = self.id(direction, peer, name)
        return self.buffer(port, stamp) + bracketed(linked(target, inner), "[", "]")

    def mode_memory(self, name: str) -> Math:
        """What a mode remembers: `elapsed(mode)` and its like."""
        for aspect in ("elapsed", "periods", "entered", "left"):
            if mode := mode_of(aspect, name):
                return word(aspect) + bracketed(word(mode))
        return word(name)

    def input(self, peer: str, name: str, component: str = "") -> Math:
        """The value of an input: its symbol alone, if nothing else has that."""
        element = self.subsystem.inputs.get((peer, name))
        if element is None:
            return word(f"x.{peer}.{name}")
        plain = symbol_for(name, element.symbol, element.type, component=component)
        shown = linked(self.id("x", peer, name), plain)
        port = self.port("x", peer)
        if port is None or not self._is_ambiguous(self._input_symbol(element)):
            return shown
        return self.buffer(port) + bracketed(shown, "[", "]")

    def _input_symbol(self, element: Element) -> str:
        return symbol_for(element.name, element.symbol, element.type).text

    def value(self, kind: str, name: str, component: str = "") -> Math:
        """The value of a memory element, a let or a constant."""
        item = self._values.get((kind, name))
        if item is None:
            return self.outer.constant(name) if kind == "constant" else self.mode_memory(name)
        symbol, type_ = item
        if not name.isidentifier():
            shown = self.mode_memory(name)
        else:
            shown = symbol_for(name, symbol, type_, component=component)
        return linked(self.id(kind, name), shown)

    @cached_property
    def _values(self) -> dict[tuple[str, str], tuple[str, Type]]:
        s = self.subsystem
        found = {("memory", m.name): (m.symbol, m.type) for m in s.memory}
        found |= {("let", let.name): (let.symbol, let.value.type) for let in s.lets}
        found |= {("constant", c.name): (c.symbol, c.value.type) for c in s.constants}
        return found

    def _is_ambiguous(self, symbol: str) -> bool:
        return self._symbols.get(symbol, 0) > 1

    @cached_property
    def _symbols(self) -> dict[str, int]:
        """How many values have a symbol."""
        own = [symbol_for(n, symbol, t).text for (_, n), (symbol, t) in self._values.items()]
        own += [self._input_symbol(element) for element in self.subsystem.inputs.values()]
        outer = self.outer.constants.values()
        own += [symbol_for(c.name, c.symbol, c.value.type).text for c in outer]
        return {symbol: len(each) for symbol, each in grouped((s, s) for s in own).items()}

    # States, behaviours and conditions.

    @cached_property
    def state_indices(self) -> dict[str, str]:
        """S1 has the index 1; other states have their names."""
        names = (state.name for state in self.subsystem.states)
        return {n: found[1] if (found := _STATE.fullmatch(n)) else n for n in names}

    @cached_property
    def behaviour_indices(self) -> dict[str, str]:
        """A behaviour has the number of its first state, else its name."""
        found: dict[str, str] = {}
        for state in self.subsystem.states:
            number = self.state_indices[state.name]
            behaviour = state.behaviour
            for name in (behaviour.name, *_generic_name(behaviour)):
                found.setdefault(name, number if number.isdecimal() else _short(name))
        for behaviour in self.subsystem.behaviours:
            for name in (behaviour.name, *_generic_name(behaviour)):
                found.setdefault(name, _short(name))
        return found

    def state(self, name: str) -> Math:
        """A state."""
        own = indices(*self.own, self.state_indices.get(name, name))
        shown = attached(Math('cal("S")', 1), tl=sign(self.letter, 1), br=own)
        return linked(self.id("state", name), shown)

    @property
    def current_state(self) -> Math:
        """The state in which it is."""
        return attached(Math('cal("S")', 1), tl=sign(self.letter, 1), br=indices(*self.own))

    def behaviour(self, behaviour: Behaviour | str) -> Math:
        """A behaviour."""
        name = behaviour if isinstance(behaviour, str) else behaviour.name
        own = indices(*self.own, self.behaviour_indices.get(name, _short(name)))
        shown = attached(Math('cal("B")', 1), tl=sign(self.letter, 1), br=own)
        return linked(self.id("behaviour", _short(name)), shown)

    @cached_property
    def condition_indices(self) -> dict[tuple[str, str], str]:
        """Kind and name -> the number of the only behaviour that has the condition, or its name."""
        uses: dict[tuple[str, str], set[str]] = {}
        for key, behaviour in self._uses():
            uses.setdefault(key, set()).add(self.behaviour_indices[behaviour])
        found = {}
        for (kind, name), behaviours in uses.items():
            number = min(behaviours) if len(behaviours) == 1 else ""
            found[kind, name] = number if number.isdecimal() else ""
        by_number = grouped(
            ((kind, number), name) for (kind, name), number in found.items() if number
        )
        clash = {
            (kind, name)
            for (kind, _), names in by_number.items()
            if len(names) > 1
            for name in names
        }
        return {
            key: number if number and key not in clash else _short(key[1])
            for key, number in found.items()
        }

    def _uses(self) -> Iterator[tuple[tuple[str, str], str]]:
        states = {state.name: state.behaviour.name for state in self.subsystem.states}
        for row in self.subsystem.transitions:
            if row.target in states:
                yield ("initial", row.condition.name), states[row.target]
        for behaviour in {s.behaviour.name: s.behaviour for s in self.subsystem.states}.values():
            yield ("terminal", behaviour.terminal.name), behaviour.name
            for _, error in behaviour.errors:
                yield ("error", error.name), behaviour.name

    def condition(self, condition: Condition, behaviour: Behaviour | None = None) -> Math:
        """A condition; one that stands in place is that of its behaviour."""
        kind = {"initial": "sigma", "terminal": "tau", "error": "epsilon"}[condition.kind]
        own = self.condition_indices.get((condition.kind, condition.name), "")
        is_constant = condition.name in ("always", "never")
        if is_constant and not condition.trace and isinstance(condition.when, Truth):
            return word("TRUE" if condition.when.value else "FALSE")
        if behaviour is not None and (not is_named(condition) or is_constant):
            own = self.behaviour_indices[behaviour.name]
        index = indices(*self.own, own or _short(condition.name))
        shown = attached(sign("f", 1), tl=sign(self.letter, 1), tr=sign(kind, 1), br=index)
        if is_constant and behaviour is None:
            return shown
        name = condition.name
        if behaviour is not None and is_constant:
            name = f"{_short(behaviour.name)}.{condition.kind}"
        return linked(self.id("condition", condition.kind, name), shown)

    def transition_function(self, peer: str, *own: str) -> Math:
        """A transition function by the peer that its result is for; "" for memory."""
        port = self.port("y", peer) if peer else None
        second = [sign(self.peer_letter(port) if port else self.letter, 1)]
        if port and (self.subsystem.kind == "control" or peer not in ("c", "E", "R")):
            second.append(word(peer))
        above = listed((sign(self.letter, 1), *second))
        return attached(sign("f", 1), tl=above, br=indices(*self.own, *own))


def _generic_name(behaviour: Behaviour) -> tuple[str, ...]:
    return (behaviour.generic.part.name,) if behaviour.generic else ()


def _short(name: str) -> str:
    """A name without what stands in its brackets."""
    return name.partition("(")[0] or name


def arguments_of(names: SubsystemNames, ports: Iterable[Port], has_memory: bool) -> Math:
    """The buffers that a function reads, in brackets."""
    parts = [names.memory(STAMP)] if has_memory else []
    parts += [names.buffer(port, STAMP) for port in ports]
    return bracketed(listed(parts))
