"""Typed expressions, and conditions that are made of conditions. Equality ignores places.

Every node has `type` and `span`, the offsets of its text inside the YAML scalar it comes from.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, fields, replace
from functools import cache
from typing import Any, Literal, TypeVar

from specc.model.types import Bool, Type
from specc.reachable import reachable

Offsets = tuple[int, int]


@dataclass(frozen=True, slots=True)
class Node:
    _: KW_ONLY
    type: Type
    span: Offsets = field(default=(0, 0), compare=False)


@dataclass(frozen=True, slots=True)
class Number(Node):
    """A literal in SI units. `value` is an int for type int, else a float.

    0.0 and -0.0 are two literals: they have other angles.
    """

    value: float

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Number):
            return NotImplemented
        value, like = self.value, other.value
        same = value == like and self.type == other.type
        return same and (value != 0 or math.copysign(1, value) == math.copysign(1, like))

    def __hash__(self) -> int:
        return hash((self.value, self.type))


@dataclass(frozen=True, slots=True)
class Truth(Node):
    value: bool


@dataclass(frozen=True, slots=True)
class TextLiteral(Node):
    value: str


@dataclass(frozen=True, slots=True)
class Member(Node):
    """A member of an enum, as a value."""

    name: str


@dataclass(frozen=True, slots=True)
class Unused(Node):
    """The paper's dash, spelt `_`: a component that the chosen mode does not use."""


@dataclass(frozen=True, slots=True)
class Nothing(Node):
    """`None`: what an optional value is when there is none."""


LITERALS = (Number, Truth, TextLiteral, Member, Unused, Nothing)


@dataclass(frozen=True, slots=True)
class Input(Node):
    """An element of an input buffer, `x.peer.element`."""

    peer: str
    element: str

    @property
    def key(self) -> tuple[str, str]:
        """Peer and element."""
        return self.peer, self.element


@dataclass(frozen=True, slots=True)
class MemoryRef(Node):
    name: str


@dataclass(frozen=True, slots=True)
class LetRef(Node):
    name: str


@dataclass(frozen=True, slots=True)
class ConstantRef(Node):
    """A constant of the system, or a parameter of a reused description.

    It `is_live` if its value depends on a constant that may change while something runs.
    """

    name: str
    is_live: bool = False


@dataclass(frozen=True, slots=True)
class Live(Node):
    """The value of a constant that may change while something runs, by its name in the system.

    It lies between `low` and `high`, and is the same throughout a period.
    """

    name: str
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class FileRef(Node):
    """A file, by its name in the system."""

    name: str


@dataclass(frozen=True, slots=True)
class ParameterRef(Node):
    """A parameter of a behaviour or function, where that is declared: calls have its argument."""

    name: str


@dataclass(frozen=True, slots=True)
class BoundVariable(Node):
    """The variable of a quantifier."""

    name: str


@dataclass(frozen=True, slots=True)
class Clock(Node):
    """`elapsed`: seconds since the state was entered; `entered`: its first period; `period`: s."""

    name: Literal["elapsed", "entered", "period"]


@dataclass(frozen=True, slots=True)
class Fresh(Node):
    """The paper's predicate P: a value became visible since the previous time stamp."""

    input: Input


@dataclass(frozen=True, slots=True)
class Present(Node):
    """Whether the element has received a value at least once."""

    input: Input


LagName = Literal["age", "late"]
LAGS: tuple[LagName, ...] = ("age", "late")


@dataclass(frozen=True, slots=True)
class Lag(Node):
    """How far an input is behind: the `age` of the oldest measurement behind its value, in s; for
    how many periods in a row its sender has been `late`.
    """

    name: LagName
    input: Input


@dataclass(frozen=True, slots=True)
class Call(Node):
    """An operator, by its name in the system, applied to arguments."""

    operator: str
    args: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class Builtin(Node):
    """A function of the language itself; the table is in `specc.lang.builtins`."""

    name: str
    args: tuple[Expr, ...]


LENGTH, JOINED, REST, NEAR, FLOAT, FINITE = "len", "joined", "rest", "near", "float", "finite"
"""Functions that the compiler calls itself."""
INVERSE = "inverse"
FRAMELESS = IDENTITY, TRANSLATION, ROTATION, RPY, POSE = (
    "identity",
    "translation",
    "rotation",
    "rpy",
    "pose",
)
"""Functions whose result is a pose in the frames of its place."""


@dataclass(frozen=True, slots=True)
class Unary(Node):
    op: Literal["-", "not"]
    operand: Expr


@dataclass(frozen=True, slots=True)
class Binary(Node):
    op: Literal["+", "-", "*", "/", "**", "@"]
    left: Expr
    right: Expr


@dataclass(frozen=True, slots=True)
class Compare(Node):
    op: Literal["<", "<=", ">", ">=", "==", "!="]
    left: Expr
    right: Expr


COMPARISONS: dict[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
"""What a comparison says of two values."""
OPPOSITES = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
"""What holds where a comparison does not."""
MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "==", "!=": "!="}
"""The same comparison with its sides exchanged."""


@dataclass(frozen=True, slots=True)
class IsNone(Node):
    """`value is None`; an `is not` is a negated one."""

    value: Expr


@dataclass(frozen=True, slots=True)
class Unwrap(Node):
    """An optional value where there has to be one, or a list where there has to be an item.

    The types say which: that of `value` is optional, or this one's is a nonempty list.
    """

    value: Expr


@dataclass(frozen=True, slots=True)
class IsOneOf(Node):
    """`item in {a, b}` over the members of an enum; a `not in` is a negated one."""

    item: Expr
    members: frozenset[str]


@dataclass(frozen=True, slots=True)
class Logic(Node):
    op: Literal["and", "or"]
    operands: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class Choice(Node):
    """`then if test else otherwise`."""

    test: Expr
    then: Expr
    otherwise: Expr


@dataclass(frozen=True, slots=True)
class Items(Node):
    """A literal vector, spatial vector or list, as its type says."""

    items: tuple[Expr, ...]


@dataclass(frozen=True, slots=True)
class FieldOf(Node):
    value: Expr
    name: str


@dataclass(frozen=True, slots=True)
class Component(Node):
    """One component of a vector or spatial vector, `v[2]` or `v.z`."""

    value: Expr
    index: int


@dataclass(frozen=True, slots=True)
class Quantifier(Node):
    """`all(body for variable in over)` or `any(...)`; `over` is a vector or a list.

    `argmax` and `argmin` give the item for which the body is largest or smallest.
    """

    kind: Literal["all", "any", "argmax", "argmin"]
    variable: str
    over: Expr
    body: Expr


@dataclass(frozen=True, slots=True)
class Unknown(Node):
    """The meaning of a text that is missing or has an error in it: some unknown value.

    Nothing is generated from one. Two of one name are the same value.
    """

    name: str


Expr = (
    Number | Truth | TextLiteral | Member | Unused | Nothing | Input | MemoryRef | LetRef
    | ConstantRef | Live | FileRef | ParameterRef | BoundVariable | Clock | Fresh | Present | Lag
    | Call | Builtin | Unary | Binary | Compare | IsNone | Unwrap | IsOneOf | Logic | Choice
    | Items | FieldOf | Component | Quantifier | Unknown
)  # fmt: skip

TRUE = Truth(True, type=Bool())
FALSE = Truth(False, type=Bool())


def _subexpression_fields(kind: type[Any]) -> tuple[tuple[str, bool], ...]:
    holding = {"Expr": False, "Input": False, "tuple[Expr, ...]": True}
    return tuple((p.name, holding[p.type]) for p in fields(kind) if p.type in holding)


_fields_of: Callable[[Any], tuple[tuple[str, bool], ...]] = cache(_subexpression_fields)
"""The fields of a class that hold subexpressions, and whether each holds several."""


def children(expr: Expr) -> list[Expr]:
    """The direct subexpressions of `expr`, left to right."""
    found: list[Expr] = []
    for name, several in _fields_of(type(expr)):
        if several:
            found += getattr(expr, name)
        else:
            found.append(getattr(expr, name))
    return found


def source_name(name: str) -> str:
    """An operator or file as it is written, by its name in the system.

    The names differ where files of one system give several meanings to a name: `F@lib/arm.yaml`.
    """
    return name.partition("@")[0]


def walk(expr: Expr) -> Iterator[Expr]:
    """`expr` and all subexpressions, parents first."""
    return _walk(expr) if _fields_of(type(expr)) else iter((expr,))


def _walk(expr: Expr) -> Iterator[Expr]:
    waiting = [expr]
    while waiting:
        part = waiting.pop()
        yield part
        if _fields_of(type(part)):
            waiting += reversed(children(part))


def constant_names(expr: Expr) -> list[str]:
    """Names of the constants in an expression, as often as they stand there."""
    return [node.name for node in walk(expr) if isinstance(node, ConstantRef)]


def is_live(expr: Expr) -> bool:
    """Whether an expression depends on a constant that may change while something runs."""
    return any(
        isinstance(node, Live) or (isinstance(node, ConstantRef) and node.is_live)
        for node in walk(expr)
    )


def map_children(expr: Expr, change: Callable[[Expr], Expr]) -> Expr:
    """`expr` with its direct subexpressions changed; the same object if none changed."""
    kind: Any = type(expr)
    changed: dict[str, Any] = {}
    for name, several in _fields_of(kind):
        old = getattr(expr, name)
        if several:
            new: Any = tuple(map(change, old))
            new = old if all(map(operator.is_, new, old)) else new
        else:
            new = change(old)
        if new is not old:
            changed[name] = new
    return replace(expr, **changed) if changed else expr


def instantiate(body: Expr, variable: str, item: Expr) -> Expr:
    """The body of a quantifier with `variable` replaced by `item`."""
    if isinstance(body, BoundVariable):
        return item if body.name == variable else body
    return map_children(body, lambda part: instantiate(part, variable, item))


def has_free_variable(expr: Expr) -> bool:
    """Whether an expression is about the variable of a quantifier around it."""
    nodes = list(walk(expr))
    own = {node.variable for node in nodes if isinstance(node, Quantifier)}
    return any(isinstance(node, BoundVariable) and node.name not in own for node in nodes)


def has_unknown(expr: Expr) -> bool:
    """Whether a part of an expression is unknown."""
    return any(isinstance(node, Unknown) for node in walk(expr))


def truth(value: bool) -> Truth:
    """The condition that always, or never, holds."""
    return TRUE if value else FALSE


def negation(condition: Expr) -> Expr:
    """`not condition`."""
    match condition:
        case Truth(value=value):
            return truth(not value)
        case Unary(op="not", operand=operand):
            return operand
    return Unary("not", condition, type=Bool())


def opposite(condition: Expr) -> Expr:
    """The negation of a condition as one would write it."""
    if isinstance(condition, Compare):
        op = OPPOSITES[condition.op]
        return Compare(op, condition.left, condition.right, type=Bool())  # type: ignore[arg-type]  # one of six
    return negation(condition)


def junction(op: Literal["and", "or"], parts: Sequence[Expr]) -> Expr:
    """The conjunction or disjunction of some conditions."""
    if len(parts) < 2:
        return parts[0] if parts else truth(op == "and")
    return Logic(op, tuple(parts), type=Bool())


def conjuncts(condition: Expr) -> Iterator[Expr]:
    """The operands of a conjunction, or the negated operands of a negated disjunction."""
    match condition:
        case Logic(op="and", operands=operands):
            yield from _conjuncts_of(operands)
        case Unary(op="not", operand=Logic(op="or", operands=operands)):
            yield from _conjuncts_of(map(negation, operands))
        case _:
            yield condition


def _conjuncts_of(operands: Iterable[Expr]) -> Iterator[Expr]:
    for operand in operands:
        yield from conjuncts(operand)


T = TypeVar("T")


class LazyByDependence(Mapping[str, T]):
    """Lazy mapping from the names of expressions to `find(name)`.

    The names an expression uses are computed before it, without recursion.

    Those that it names come first: so `find` meets only names of which the answer is known, and no
    chain of them is followed by deep recursion.
    """

    def __init__(self, named: Mapping[str, Expr], find: Callable[[str], T]) -> None:
        """`named` in order of dependence: each names earlier ones only."""
        self._named = named
        self._find = find
        self._known: dict[str, T] = {}

    def __getitem__(self, name: str) -> T:
        if name not in self._known:
            missing = reachable([name], self._missing_in)
            for other in missing if len(missing) == 1 else filter(missing.__contains__, self):
                self._known[other] = self._find(other)
        return self._known[name]

    def _missing_in(self, name: str) -> Iterator[str]:
        nodes = walk(self._named[name])
        names = (node.name for node in nodes if isinstance(node, (LetRef, ConstantRef)))
        return (named for named in names if named in self._named and named not in self._known)

    def __contains__(self, name: object) -> bool:
        return name in self._named

    def __iter__(self) -> Iterator[str]:
        return iter(self._named)

    def __len__(self) -> int:
        return len(self._named)
