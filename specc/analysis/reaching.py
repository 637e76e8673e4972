"""Reaching definitions of single numbers, through lets, constants, memory and buffers."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from specc.analysis.machine import Machine
from specc.analysis.reads import Dependence, ExpressionText, TextOwner, text_of
from specc.lang import ranges
from specc.lang.evaluate import range_of_parts
from specc.lang.ranges import ANY, Range
from specc.model.expr import (
    Binary,
    Choice,
    Compare,
    Component,
    ConstantRef,
    Expr,
    Input,
    Items,
    LetRef,
    MemoryRef,
    Unary,
    Unwrap,
    children,
    walk,
)
from specc.model.requirement import Reading
from specc.model.system import Constant, Subsystem
from specc.model.types import Int, PartialOf, Real, Type
from specc.model.wires import Wires


@dataclass(frozen=True, slots=True)
class ScalarExpr:
    """A number, as an expression in a text of `subsystem`; a formula has none, ""."""

    subsystem: str
    expr: Expr
    text: ExpressionText


@dataclass(frozen=True, slots=True)
class ReportedScalar:
    """The number at `index` of an element that a device reports, `agent.E.device.element`.

    What is observed of the plant is reported by `plant`.
    """

    element: str
    index: int


ScalarDefinition = ScalarExpr | ReportedScalar


def component(expr: Expr, index: int) -> Expr:
    """The number at an index of a vector; arithmetic on vectors becomes arithmetic on numbers."""
    components = _vector(expr.type).components
    type_ = components[index] if index < len(components) else expr.type
    match expr:
        case Items(items=items):
            return items[index]
        case Unwrap(value=value):
            return component(value, index)
        case Unary(op="-", operand=operand):
            return Unary("-", component(operand, index), type=type_, span=expr.span)
        case Binary(op="+" | "-" | "*" | "/" as op, left=left, right=right):
            sides = (_of_side(left, index), _of_side(right, index))
            return Binary(op, *sides, type=type_, span=expr.span)
        case Choice(test=test, then=then, otherwise=otherwise):
            branches = component(then, index), component(otherwise, index)
            return Choice(test, *branches, type=type_, span=expr.span)
    return Component(expr, index, type=type_, span=expr.span)


def _of_side(expr: Expr, index: int) -> Expr:
    return component(expr, index) if _vector(expr.type).components else expr


def _vector(type_: Type) -> Type:
    return type_.value if isinstance(type_, PartialOf) else type_


class ReachingDefinitions:
    """Finds the definitions whose values reach a number, in the subsystems without errors."""

    def __init__(
        self,
        wires: Wires,
        subsystems: Iterable[Subsystem],
        constants: Iterable[Constant],
        readings: Iterable[Reading] = (),
    ) -> None:
        """`constants` are those of the system; `readings` are what formulas name."""
        self._wires = wires
        self._subsystems = {s.qualified_name: s for s in subsystems}
        self._constants: Mapping[str, Constant] = {each.name: each for each in constants}
        self._readings = {reading.name: reading for reading in readings}

    def of(self, scalar: ScalarExpr) -> list[ScalarDefinition] | None:
        """The definitions that give a number its value, unchanged.

        None where it is computed, or a literal; none where nothing is known.
        """
        expr: Expr = scalar.expr
        if isinstance(expr, Component):
            expr = component(expr.value, expr.index)
            if not isinstance(expr, Component):
                return [replace(scalar, expr=expr)]
        match expr:
            case Unwrap(value=value):
                return [replace(scalar, expr=value)]
            case Choice(then=then, otherwise=otherwise):
                return [replace(scalar, expr=then), replace(scalar, expr=otherwise)]
            case Component(value=value, index=index):
                return self._of_whole(scalar, value, index)
        return self._of_whole(scalar, expr, None)

    def _of_whole(
        self, scalar: ScalarExpr, expr: Expr, index: int | None
    ) -> list[ScalarDefinition] | None:
        subsystem = self._subsystems.get(scalar.subsystem)
        match expr:
            case ConstantRef(name=name):
                own = subsystem.constants if subsystem else ()
                constant = next((c for c in own if c.name == name), self._constants.get(name))
                return [*_each([constant] if constant else [], scalar.subsystem, index)]
            case LetRef(name=name) if subsystem:
                lets = [let for let in subsystem.lets if let.name == name]
                return [*_each(lets, scalar.subsystem, index)]
            case MemoryRef(name=name) if subsystem:
                return [*self._of_memory(subsystem, name, index)]
            case MemoryRef(name=name) if name in self._readings:
                return [*self._of_reading(self._readings[name], index)]
            case Input(peer=peer, element=element) if subsystem:
                return [*self._of_input(subsystem, (peer, element), index)]
        return None

    def _of_memory(
        self, subsystem: Subsystem, name: str, index: int | None
    ) -> Iterator[ScalarDefinition]:
        first = [item for item in subsystem.memory if item.name == name]
        yield from _each(first, subsystem.qualified_name, index)
        yield from self.sent(subsystem, ("", name), index)

    def sent(
        self, subsystem: Subsystem, target: tuple[str, str], index: int | None
    ) -> Iterator[ScalarDefinition]:
        """Yield what states assign to an output (peer, element), or to memory with the peer ""."""
        behaviours = {s.behaviour.name: s.behaviour for s in subsystem.states}.values()
        every = (item for behaviour in behaviours for item in behaviour.assignments)
        writing = {id(item): item for item in every if (item.peer, item.name) == target}
        yield from _each(writing.values(), subsystem.qualified_name, index)

    def _of_input(
        self, reader: Subsystem, key: tuple[str, str], index: int | None
    ) -> Iterator[ScalarDefinition]:
        peer, name = key
        if device := self._wires.measuring_device(reader.qualified_name, peer):
            yield ReportedScalar(f"{device}.{name}", index or 0)
            return
        element = reader.inputs.get(key)
        if element is not None and element.init is not None:
            yield from _each([element], reader.qualified_name, index)
        sender, output = self._wires.sender(reader.qualified_name, key) or ("", ("", ""))
        if sender in self._subsystems:
            yield from self.sent(self._subsystems[sender], output, index)

    def _of_reading(self, reading: Reading, index: int | None) -> Iterator[ScalarDefinition]:
        owner = self._subsystems.get(reading.subsystem)
        if reading.asks_presence or reading.kind == "state":
            return
        if reading.kind == "observed":
            yield ReportedScalar(reading.name, index or 0)
        elif owner and reading.kind == "memory":
            yield from self._of_memory(owner, reading.element[0], index)
        elif owner and reading.kind == "reported":
            yield from self._of_input(owner, (reading.element[0], reading.element[1]), index)
        elif owner:
            yield from self.sent(owner, (reading.element[0], reading.element[1]), index)


def _each(
    owners: Iterable[TextOwner], subsystem: str, index: int | None
) -> Iterator[ScalarDefinition]:
    for owner in owners:
        text = text_of(owner)
        expr = text.expr if index is None else component(text.expr, index)
        yield ScalarExpr(subsystem, expr, text)


_DEEPEST = 100
"""Definitions on one way that are followed."""


class ReportedScalars:
    """The numbers of devices that reach a number, at most scaled or added to others.

    An instance answers one question, since it cuts loops through memory.
    """

    def __init__(self, definitions: ReachingDefinitions) -> None:
        self._definitions = definitions
        self._known: dict[ScalarExpr, frozenset[ReportedScalar]] = {}

    def of(self, scalar: ScalarExpr, depth: int = 0) -> frozenset[ReportedScalar]:
        """See the class."""
        if scalar not in self._known:
            self._known[scalar] = frozenset()
            if depth <= _DEEPEST:
                self._known[scalar] = self._found(scalar, depth + 1)
        return self._known[scalar]

    def _found(self, scalar: ScalarExpr, depth: int) -> frozenset[ReportedScalar]:
        definitions = self._definitions.of(scalar)
        if definitions is not None:
            inside = (self.of(d, depth) for d in definitions if isinstance(d, ScalarExpr))
            ends = (each for each in definitions if isinstance(each, ReportedScalar))
            return frozenset(ends).union(*inside)
        match scalar.expr:
            case Unary(op="-", operand=operand):
                return self.of(replace(scalar, expr=operand), depth)
            case Binary(op="+" | "-" | "*" | "/" as op, left=left, right=right):
                one, other = (self.of(replace(scalar, expr=e), depth) for e in (left, right))
                # A product of two measured numbers is another quantity.
                return frozenset() if op in "*/" and one and other else one | other
        return frozenset()


_MOST_NESTED = 100
"""Definitions on one way, and parts of expressions, that are followed."""
_MOST_RANGES = 16
"""Of a part of an expression: of more, their union counts."""
_MOST_STEPS = 20_000
"""Of one question."""
_Ranges = dict[ScalarExpr, tuple[Range, ...]]


class ScalarRanges:
    """The ranges of a number, one for each definition that reaches it; answers one question.

    A value that a test may exclude has any range.
    """

    def __init__(self, definitions: ReachingDefinitions, machine: Callable[[str], Machine]) -> None:
        """`machine` gives that of a subsystem by its qualified name."""
        self._definitions = definitions
        self._machine = machine
        self._visiting: set[ScalarExpr] = set()
        self._budget = _MOST_STEPS

    def of(self, scalar: ScalarExpr) -> _Ranges:
        """Ranges by the expressions that compute the number, or are literals."""
        self._budget -= 1
        if scalar in self._visiting or len(self._visiting) > _MOST_NESTED or self._budget < 0:
            return {scalar: (self._fallback_range(scalar),)}
        if self._is_tested(scalar):
            return {scalar: (ANY,)}
        self._visiting.add(scalar)
        found: _Ranges = {}
        definitions = self._definitions.of(scalar)
        for each in definitions or ():
            found |= self.of(each) if isinstance(each, ScalarExpr) else {scalar: (ANY,)}
        if definitions is None:
            found[scalar] = tuple(dict.fromkeys(self._computed(scalar)))
        self._visiting.remove(scalar)
        return found

    def _fallback_range(self, scalar: ScalarExpr) -> Range:
        """The range of a number that is not followed further: the bounds of its memory, else any.

        A number is not followed on a cycle, or beyond the depth or the budget.
        """
        if isinstance(scalar.expr, MemoryRef) and scalar.subsystem:
            return self._machine(scalar.subsystem).value_ranges.bounds.of(scalar.expr)
        return ANY

    def _computed(self, scalar: ScalarExpr) -> Iterator[Range]:
        """A range for each definition that reaches one part, with all values of the other parts."""
        expr = scalar.expr
        parts = [self._of_part(replace(scalar, expr=part)) for part in children(expr)]
        unions = [ranges.union(*each) for each in parts]
        yield range_of_parts(expr, unions)
        for index, each in enumerate(parts):
            for one in each if len(each) <= _MOST_RANGES else ():
                yield range_of_parts(expr, [*unions[:index], one, *unions[index + 1 :]])

    def _of_part(self, scalar: ScalarExpr) -> list[Range]:
        if not isinstance(scalar.expr.type, (Int, Real)):
            return [ANY]
        every = (range_ for found in self.of(scalar).values() for range_ in found)
        return list(dict.fromkeys(every)) or [ANY]

    def _is_tested(self, scalar: ScalarExpr) -> bool:
        """Whether a choice or a condition of the machine may exclude some values."""
        if not scalar.subsystem:
            return False
        machine, expr = self._machine(scalar.subsystem), scalar.expr
        of = machine.dependences.of
        if isinstance(expr, Choice):
            return any(_shared(of(expr.test), of(b)) for b in (expr.then, expr.otherwise))
        core = expr.value if isinstance(expr, Component) else expr
        if not isinstance(core, (Input, MemoryRef)):
            return False
        conditions = (condition.when for condition in machine.subsystem.exit_conditions)
        return any(
            any(isinstance(part, Compare) for part in walk(when)) and _shared(of(when), of(core))
            for when in conditions
        )


def _shared(one: Dependence, other: Dependence) -> bool:
    return bool(one.values & other.values or one.memory & other.memory)
