"""The expressions of a subsystem: where they stand, and what they refer to."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TypeVar

from specc.model.expr import (
    BoundVariable,
    Clock,
    ConstantRef,
    Expr,
    Fresh,
    Input,
    Lag,
    LetRef,
    Live,
    MemoryRef,
    Present,
    Truth,
    children,
    walk,
)
from specc.model.fsm import Assignment, Axiom, Condition
from specc.model.requirement import expressions_in
from specc.model.system import Constant, Element, Let, Memory, Subsystem, System
from specc.proof import InputName
from specc.reachable import reachable
from specc.source import Place

Name = TypeVar("Name")
T = TypeVar("T")

# The expressions of a subsystem with the texts in which they stand.


@dataclass(frozen=True, slots=True)
class ExpressionText:
    """An expression that is the text at `key` of a part, or its short form.

    Without a key it is the text of the part itself.
    """

    expr: Expr
    part: Place
    key: str

    def place(self, node: Expr) -> Place:
        """Where a part of the expression stands."""
        text = self.part.below(self.key) if self.key else self.part
        return text.within(*node.span)


TextOwner = Constant | Element | Let | Memory | Condition | Assignment | Axiom
_INIT = "init", "init"
_TEXTS = {Element: _INIT, Memory: _INIT, Condition: ("when", "when"), Axiom: ("that", "")}
"""The field of the expression, and the key of its text, of parts that do not have a `value`."""


def text_of(part: TextOwner) -> ExpressionText:
    """The expression of a part, and its text."""
    name, key = _TEXTS.get(type(part), ("value", "is"))
    return ExpressionText(getattr(part, name), part.place, key)


def _stored_on_subsystem(
    find: Callable[[Subsystem], Iterable[T]],
) -> Callable[[Subsystem], Sequence[T]]:
    """Store the result on the subsystem, since many checks ask for it."""

    def answer(subsystem: Subsystem) -> Sequence[T]:
        stored = vars(subsystem)
        if find.__name__ not in stored:
            stored[find.__name__] = tuple(find(subsystem))
        return stored[find.__name__]  # type: ignore[no-any-return]  # what was kept

    return answer


@_stored_on_subsystem
def texts(subsystem: Subsystem) -> Iterator[ExpressionText]:
    """All expressions of a subsystem."""
    first = (e for port in subsystem.ports for e in port.elements if e.init is not None)
    assigned = (item for function in subsystem.functions for item in function.assignments)
    own = subsystem.constants, first, subsystem.memory, subsystem.lets, subsystem.conditions
    every: Iterator[TextOwner] = chain(*own, assigned, subsystem.axioms)
    return map(text_of, every)


@_stored_on_subsystem
def nodes(subsystem: Subsystem) -> Iterator[Expr]:
    """Every part of every expression of a subsystem."""
    return (node for text in texts(subsystem) for node in walk(text.expr))


def texts_of_system(system: System) -> Iterator[ExpressionText]:
    """The expressions of the constants and formulas of a system."""
    yield from map(text_of, system.constants)
    for item in system.formulas:
        yield from (ExpressionText(part, item.place, "") for part in expressions_in(item.formula))
    for let in system.formula_lets:
        if let.value is not None:
            yield ExpressionText(let.value, let.place, "is")


# What expressions refer to.


def inputs_read(subsystem: Subsystem) -> frozenset[InputName]:
    """Inputs that some expression reads or tests for arrival."""
    return frozenset(node.key for node in nodes(subsystem) if isinstance(node, Input))


def inputs_tested_for_arrival(subsystem: Subsystem) -> frozenset[InputName]:
    """Inputs that some expression tests for a new value."""
    return frozenset(node.input.key for node in nodes(subsystem) if isinstance(node, Fresh))


def live_constants(system: System, subsystem: Subsystem) -> list[Constant]:
    """The constants that may change and that a subsystem reads, or shows to formulas.

    One that formulas alone read is shown by the fastest subsystems.
    """
    changing = [constant for constant in system.constants if constant.initial is not None]
    if not changing:
        return []
    read = _live_in(subsystem, system)
    if subsystem.rate_hz == max(each.rate_hz for each in system.subsystems):
        shown = live_in_formulas(system)
        others = (_live_in(each, system) for each in system.subsystems) if shown else ()
        read |= shown - frozenset[str]().union(*others)
    return [constant for constant in changing if constant.name in read]


def live_in_formulas(system: System) -> frozenset[str]:
    """The constants that may change and that formulas about runs name."""
    parts = (part for item in system.formulas for part in expressions_in(item.formula))
    shared = {constant.name: constant.value for constant in system.constants}
    return live_names((node for part in parts for node in walk(part)), shared)


def _live_in(subsystem: Subsystem, system: System) -> frozenset[str]:
    constants = (*system.constants, *subsystem.constants)
    given = (node for b in subsystem.behaviours for each in b.arguments for node in walk(each))
    every = chain(nodes(subsystem), given)
    return live_names(every, {each.name: each.value for each in constants})


def live_names(nodes: Iterable[Expr], constants: Mapping[str, Expr]) -> frozenset[str]:
    """The constants that may change and that nodes of expressions name, also through others."""

    def behind(node: Expr) -> Iterable[Expr]:
        if isinstance(node, ConstantRef) and node.is_live and node.name in constants:
            return walk(constants[node.name])
        return ()

    named: Iterable[Expr] = (node for node in nodes if isinstance(node, (Live, ConstantRef)))
    return frozenset(node.name for node in reachable(named, behind) if isinstance(node, Live))


@dataclass(frozen=True, slots=True)
class Dependence:
    """What the value of an expression depends on.

    Of its `inputs`, it reads `values` and tests whether `arrivals` are fresh.
    """

    inputs: frozenset[InputName] = frozenset()
    values: frozenset[InputName] = frozenset()
    arrivals: frozenset[InputName] = frozenset()
    memory: frozenset[str] = frozenset()
    constants: frozenset[str] = frozenset()
    is_stable: bool = True
    """It changes with the memory only.

    No input, clock, constant that may change, or variable of a quantifier is in it.
    """
    has_clock: bool = False
    has_lag: bool = False
    """How far an input is behind is in it, which changes without anything new."""
    has_live: bool = False
    """A constant is in it that may change while something runs."""
    has_literal: bool = False
    """`True` or `False` is in it."""


_NOTHING = Dependence()


class Dependences:
    """What expressions depend on, directly or through lets."""

    def __init__(self, lets: Mapping[str, Expr]) -> None:
        """`lets` by name, in order of dependence."""
        self._lets: dict[str, Dependence] = {}
        self._values = lets
        for name, value in lets.items():
            self._lets[name] = self.of(value)

    def of(self, expr: Expr) -> Dependence:
        """The dependences of one expression."""
        match expr:
            case MemoryRef(name=name):
                return Dependence(memory=frozenset((name,)))
            case ConstantRef(name=name, is_live=changes):
                named = frozenset((name,))
                return Dependence(constants=named, is_stable=not changes, has_live=changes)
            case Live():
                return Dependence(is_stable=False, has_live=True)
            case Truth():
                return Dependence(has_literal=True)
            case Clock(name="elapsed" | "entered"):
                return Dependence(is_stable=False, has_clock=True)
            case Input() | Fresh() | Present() | Lag():
                element = expr if isinstance(expr, Input) else expr.input
                key, nothing = frozenset((element.key,)), frozenset[InputName]()
                return Dependence(
                    key,
                    key if isinstance(expr, Input) else nothing,
                    key if isinstance(expr, Fresh) else nothing,
                    is_stable=False,
                    has_lag=isinstance(expr, Lag),
                )
            case BoundVariable():
                return Dependence(is_stable=False)
            case LetRef(name=name) if name in self._lets:
                return self._lets[name]
        return self.all(children(expr))

    def lets(self, exprs: Iterable[Expr]) -> dict[str, Expr]:
        """The lets that expressions use, directly or through lets, in order of dependence."""

        def named(exprs: Iterable[Expr]) -> Iterator[str]:
            nodes = (node for expr in exprs for node in walk(expr))
            return (node.name for node in nodes if isinstance(node, LetRef))

        used = reachable(named(exprs), lambda name: named([self._values[name]]))
        return {name: value for name, value in self._values.items() if name in used}

    def all(self, exprs: Iterable[Expr]) -> Dependence:
        """The joint dependences of some expressions."""
        found = map(self.of, exprs)
        parts = [part for part in found if part is not _NOTHING]
        if len(parts) < 2:
            return parts[0] if parts else _NOTHING
        return Dependence(
            _any_of(part.inputs for part in parts),
            _any_of(part.values for part in parts),
            _any_of(part.arrivals for part in parts),
            _any_of(part.memory for part in parts),
            _any_of(part.constants for part in parts),
            all(part.is_stable for part in parts),
            any(part.has_clock for part in parts),
            any(part.has_lag for part in parts),
            any(part.has_live for part in parts),
            any(part.has_literal for part in parts),
        )


def _any_of(names: Iterable[frozenset[Name]]) -> frozenset[Name]:
    return frozenset[Name]().union(*names)
