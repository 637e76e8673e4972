"""Random well-typed expressions over a fixed scope, and random values for their names.

`expressions(type)` and `conditions()` make trees directly, in the form that the checker gives:
`expression(show(tree), SCOPE, tree.type) == tree`. `environments()` has a value for every name in
`SCOPE`, as plain Python values (see `specc.lang.evaluate`); its operators are `OPERATORS`.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from fractions import Fraction

from hypothesis import strategies as st

from specc.lang import (
    Environment,
    Scope,
    TypeNames,
    declarations,
    enums_by_member,
    parse_signature,
    parse_type,
)
from specc.lang.values import compose, pose, translation
from specc.model import expr as m
from specc.model.fsm import Trace
from specc.model.system import Operator
from specc.model.types import (
    Bool,
    Enum,
    Int,
    ListOf,
    PartialOf,
    Pose,
    Real,
    Record,
    Spatial,
    Type,
    Vector,
)
from specc.model.units import METRE, RADIAN, SECOND
from specc.source import Place

MODE = Enum("Mode", ("u", "c", "g", "s"))
FINGERS = Enum("Fingers", ("open", "closed"))
READING = Record("Reading", (), (("d", Real(METRE)), ("mode", MODE)), "tests.strategies:Reading")
NAMES = TypeNames(
    frames={name: name for name in "BEKO"},
    types={"Mode": lambda _: MODE, "Fingers": lambda _: FINGERS, "Reading": lambda _: READING},
)


def typed(text: str) -> Type:
    """A type of the fixed scope."""
    return parse_type(text, NAMES)


def _types(**texts: str) -> dict[str, Type]:
    return {name: typed(text) for name, text in texts.items()}


def _operator(name: str, signature: str) -> Operator:
    names = TypeNames(NAMES.frames, NAMES.types, variables_allowed=True)
    parameters, result = parse_signature(signature, names)
    return Operator(name, parameters, result, "tool:f", "", Trace(), Place(""))


INPUTS = {
    ("c", name): type
    for name, type in _types(
        T_d="pose[B, E]",
        b="vector[6, Mode]",
        d_d="real[m]",
        go="bool",
        mode="Mode",
        n="int",
        F_d="partial[wrench[E]]",
    ).items()
} | {
    ("E", name): type
    for name, type in _types(m_m="vector[6, rad]", F_m="wrench[E]", F="Fingers").items()
}
LAGS = [
    m.Lag(name, m.Input("c", element, type=INPUTS["c", element]), type=type)
    for element in ("T_d", "n")
    for name, type in (("age", Real(SECOND)), ("late", Int()))
]
MEMORY = _types(
    q_p="vector[6, rad]",
    p="vector[3, m]",
    count="int",
    X_EO="pose[E, O]",
    seen="list[Reading]",
    push="partial[vector[3, N]]",
)
LETS = _types(T_c="pose[B, E]", ratio="real", distances="list[real[m]]", F_c="wrench[E]")
CONSTANTS = _types(tolerance="real[m]", turn_limit="real[rad]", best="Reading", X_KB="pose[K, B]")


def widen(d_m: float, ratio: float) -> float:
    """A product that stays finite, as an operator that keeps its word."""
    return max(-sys.float_info.max, min(d_m * ratio, sys.float_info.max))


OPERATORS = {
    "widen": widen,
    "far": lambda d_m: d_m > 1.0,
    "chain": compose,
    "lift": lambda X_EO: compose(translation(0.0, 0.0, 0.1), X_EO),
}
SIGNATURES = {
    "widen": "(d: real[m], ratio: real) -> real[m]",
    "far": "(d: real[m]) -> bool",
    "chain": "(X: pose[X, Y], Z: pose[Y, Z]) -> pose[X, Z]",
    "lift": "(X_EO: pose[E, O]) -> pose[E, O]",
}
SCOPE = Scope(
    memory=declarations(MEMORY),
    lets=declarations(LETS),
    constants=declarations(CONSTANTS),
    enums=enums_by_member([MODE, FINGERS]),
    operators={name: _operator(name, text) for name, text in SIGNATURES.items()},
    inputs=declarations(INPUTS),
    allow_clock=True,
)
TYPES: tuple[Type, ...] = tuple(
    dict.fromkeys([Bool(), Real(SECOND), *INPUTS.values(), *MEMORY.values(), *LETS.values()])
)
_FACTORS = (Real().unit, METRE, SECOND, METRE / SECOND)


def conditions(depth: int = 3) -> st.SearchStrategy[m.Expr]:
    """Expressions of type bool."""
    return expressions(Bool(), depth)


@st.composite
def expressions(draw: st.DrawFn, type: Type | None = None, depth: int = 3) -> m.Expr:
    """Expressions of a type; of any type if none is given."""
    wanted = draw(st.sampled_from(TYPES)) if type is None else type
    return _Maker(draw, {}).make(wanted, depth)


def numbers(type: Type) -> st.SearchStrategy[m.Expr]:
    """Number literals of a real or integer type."""
    if isinstance(type, Int):
        return st.integers(-9, 9).map(lambda n: m.Number(n, type=type))
    values = st.floats(-1e3, 1e3, allow_subnormal=False) | st.sampled_from([0.0, 1.0, 1e-9])
    return values.map(lambda value: m.Number(value, type=type))


@dataclass(frozen=True)
class _Maker:
    """Makes expressions; `rooted` ones say their type themselves, wherever they stand."""

    draw: st.DrawFn
    bound: dict[str, Type]

    def make(self, type: Type, depth: int, rooted: bool = False) -> m.Expr:
        ways = [self.leaf]
        if depth > 0:
            ways += [self.composite] * 5 + [self.choice]
        way = self.draw(st.sampled_from(ways))
        return way(type, depth, rooted)

    def rooted(self, type: Type, depth: int) -> m.Expr:
        return self.make(type, depth, rooted=True)

    def leaf(self, type: Type, depth: int, rooted: bool) -> m.Expr:
        choices = self.named(type)
        match type:
            case Bool():
                choices += [st.booleans().map(lambda v: m.Truth(v, type=type))]
                choices += [st.sampled_from(self.events())]
            case Int() | Real():
                choices.append(numbers(type))
            case Enum():
                members = st.sampled_from(type.members)
                choices.append(members.map(lambda name: m.Member(name, type=type)))
            case Vector():
                choices.append(st.just(type).map(self.items))
            case Spatial() | ListOf() | PartialOf() if not rooted:
                choices.append(st.just(type).map(self.items))
            case Pose() if not rooted:
                choices.append(st.just(m.Builtin("identity", (), type=type)))
        return self.draw(self.draw(st.sampled_from(choices)))

    def named(self, type: Type) -> list[st.SearchStrategy[m.Expr]]:
        found: list[m.Expr] = [
            m.Input(peer, name, type=t) for (peer, name), t in INPUTS.items() if t == type
        ]
        for kind, names in (
            (m.MemoryRef, MEMORY),
            (m.LetRef, LETS),
            (m.ConstantRef, CONSTANTS),
            (m.BoundVariable, self.bound),
        ):
            found += [kind(name, type=t) for name, t in names.items() if t == type]
        if type == Real(SECOND):
            found += [m.Clock("elapsed", type=type), m.Clock("period", type=type)]
            found += [lag for lag in LAGS if lag.name == "age"]
        if type == Int():
            found += [lag for lag in LAGS if lag.name == "late"]
        return [st.sampled_from(found)] if found else []

    def events(self) -> list[m.Expr]:
        inputs = [m.Input(peer, name, type=t) for (peer, name), t in INPUTS.items()]
        kinds = (m.Fresh, m.Present)
        found: list[m.Expr] = [kind(i, type=Bool()) for kind in kinds for i in inputs]
        return [*found, m.Clock("entered", type=Bool())]

    def items(self, type: Type, depth: int = 0) -> m.Expr:
        match type.value if isinstance(type, PartialOf) else type:
            case Vector(size=size, element=element):
                types: list[Type] = [element] * size
            case Spatial(linear=linear, angular=angular):
                types = [Real(linear)] * 3 + [Real(angular)] * 3
            case _:
                assert isinstance(type, ListOf)
                types = [type.element] * self.draw(st.integers(0, 3))
        made = [self.item(t, depth) for t in types]
        if isinstance(type, PartialOf):
            missing = self.draw(st.integers(0, len(made) - 1))
            made[missing] = m.Unused(type=types[missing])
        if isinstance(type, ListOf):
            type = ListOf(type.element, nonempty=bool(made))
        return m.Items(tuple(made), type=type)

    def item(self, type: Type, depth: int) -> m.Expr:
        if depth > 0 and self.draw(st.booleans()):
            return self.make(type, depth - 1, rooted=True)
        return self.leaf(type, 0, True)

    def choice(self, type: Type, depth: int, rooted: bool) -> m.Expr:
        test = self.make(Bool(), depth - 1)
        then = self.make(type, depth - 1, rooted)
        otherwise = self.make(type, depth - 1, rooted)
        if isinstance(then.type, ListOf) and isinstance(otherwise.type, ListOf):
            nonempty = then.type.nonempty and otherwise.type.nonempty
            type = ListOf(then.type.element, nonempty=nonempty)
        return m.Choice(test, then, otherwise, type=type)

    def composite(self, type: Type, depth: int, rooted: bool) -> m.Expr:
        match type:
            case Bool():
                ways = [self.logic, self.negation, self.comparison, self.equality, self.among]
                ways += [self.quantifier, self.near, self.far]
            case Int():
                ways = [self.sum, self.whole_product, self.minus, self.count, self.extreme]
            case Real():
                ways = [self.sum, self.product, self.minus, self.extreme, self.magnitude]
                ways += [self.component, self.root, self.ratio]
                ways += [self.widened, self.reading] if type == Real(METRE) else []
            case Vector(element=Real()) | Spatial():
                ways = [self.sum, self.minus, self.scaled]
            case Pose():
                ways = [self.composed, self.inverse]
            case _:
                return self.leaf(type, depth, rooted)
        return self.draw(st.sampled_from(ways))(type, depth - 1)

    def logic(self, type: Type, depth: int) -> m.Expr:
        count = self.draw(st.integers(2, 3))
        operands = tuple(self.make(Bool(), depth) for _ in range(count))
        return m.Logic(self.draw(st.sampled_from(["and", "or"])), operands, type=type)

    def negation(self, type: Type, depth: int) -> m.Expr:
        return m.Unary("not", self.make(Bool(), depth), type=type)

    def comparison(self, type: Type, depth: int) -> m.Expr:
        of = self.draw(st.sampled_from([Int(), Real(), Real(METRE), Real(RADIAN), Real(SECOND)]))
        op = self.draw(st.sampled_from(["<", "<=", ">", ">="]))
        return m.Compare(op, self.rooted(of, depth), self.rooted(of, depth), type=type)

    def equality(self, type: Type, depth: int) -> m.Expr:
        of = self.draw(st.sampled_from([Int(), Bool(), MODE, FINGERS, INPUTS["c", "b"]]))
        op = self.draw(st.sampled_from(["==", "!="]))
        return m.Compare(op, self.rooted(of, depth), self.make(of, depth), type=type)

    def among(self, type: Type, depth: int) -> m.Expr:
        members = frozenset(self.draw(st.sets(st.sampled_from(MODE.members), min_size=1)))
        return m.IsOneOf(self.rooted(MODE, depth), members, type=type)

    def quantifier(self, type: Type, depth: int) -> m.Expr:
        over = self.draw(st.sampled_from([INPUTS["c", "b"], MEMORY["p"], LETS["distances"]]))
        variable = f"v{len(self.bound)}"
        inner = _Maker(self.draw, {**self.bound, variable: over.element})
        kind = self.draw(st.sampled_from(["all", "any"]))
        body = inner.make(Bool(), depth)
        return m.Quantifier(kind, variable, self.rooted(over, depth), body, type=type)

    def near(self, type: Type, depth: int) -> m.Expr:
        of = self.draw(st.sampled_from([Real(METRE), Real(), MEMORY["p"], LETS["T_c"]]))
        sides = self.rooted(of, depth), self.make(of, depth)
        units = (METRE, RADIAN) if isinstance(of, Pose) else (_unit(of),)
        tolerances = tuple(self.make(Real(unit), depth) for unit in units)
        return m.Builtin("near", (*sides, *tolerances), type=type)

    def far(self, type: Type, depth: int) -> m.Expr:
        return m.Call("far", (self.make(Real(METRE), depth),), type=type)

    def sum(self, type: Type, depth: int) -> m.Expr:
        op = self.draw(st.sampled_from(["+", "-"]))
        return m.Binary(op, self.rooted(type, depth), self.make(type, depth), type=type)

    def minus(self, type: Type, depth: int) -> m.Expr:
        operand = self.rooted(type, depth)
        if isinstance(operand, m.Number):
            return m.Number(-operand.value, type=type)
        return m.Unary("-", operand, type=type)

    def whole_product(self, type: Type, depth: int) -> m.Expr:
        if self.draw(st.booleans()):
            exponent = m.Number(self.draw(st.integers(0, 3)), type=Int())
            return m.Binary("**", self.rooted(type, depth), exponent, type=type)
        return m.Binary("*", self.rooted(type, depth), self.rooted(type, depth), type=type)

    def count(self, type: Type, depth: int) -> m.Expr:
        return m.Builtin("len", (self.rooted(MEMORY["seen"], depth),), type=type)

    def extreme(self, type: Type, depth: int) -> m.Expr:
        name = self.draw(st.sampled_from(["min", "max"]))
        rest = [self.make(type, depth) for _ in range(self.draw(st.integers(1, 2)))]
        return m.Builtin(name, (self.rooted(type, depth), *rest), type=type)

    def product(self, type: Type, depth: int) -> m.Expr:
        factor = self.draw(st.sampled_from(_FACTORS))
        op = self.draw(st.sampled_from(["*", "/"]))
        other = _unit(type) / factor if op == "*" else _unit(type) * factor
        left, right = self.rooted(Real(other), depth), self.rooted(Real(factor), depth)
        return m.Binary(op, left, right, type=type)

    def ratio(self, type: Type, depth: int) -> m.Expr:
        """A real from integers where the unit allows it, else a power."""
        if type == Real():
            return m.Binary("/", self.rooted(Int(), depth), self.rooted(Int(), depth), type=type)
        exponent = m.Number(-1, type=Int())
        return m.Binary("**", self.rooted(Real(_unit(type) ** -1), depth), exponent, type=type)

    def root(self, type: Type, depth: int) -> m.Expr:
        return m.Builtin("sqrt", (self.rooted(Real(_unit(type) ** 2), depth),), type=type)

    def magnitude(self, type: Type, depth: int) -> m.Expr:
        if self.draw(st.booleans()):
            return m.Builtin("abs", (self.rooted(type, depth),), type=type)
        return m.Builtin("norm", (self.rooted(Vector(3, type), depth),), type=type)

    def component(self, type: Type, depth: int) -> m.Expr:
        wrench = LETS["F_c"]
        assert isinstance(wrench, Spatial)
        for index, unit in ((2, wrench.linear), (5, wrench.angular)):
            if type == Real(unit):
                return m.Component(self.rooted(wrench, depth), index, type=type)
        index = self.draw(st.integers(0, 2))
        return m.Component(self.rooted(Vector(3, type), depth), index, type=type)

    def widened(self, type: Type, depth: int) -> m.Expr:
        return m.Call("widen", (self.make(type, depth), self.make(Real(), depth)), type=type)

    def reading(self, type: Type, depth: int) -> m.Expr:
        return m.FieldOf(m.ConstantRef("best", type=READING), "d", type=type)

    def scaled(self, type: Type, depth: int) -> m.Expr:
        vector, factor = self.rooted(type, depth), self.rooted(Real(), depth)
        if self.draw(st.booleans()):
            return m.Binary("*", factor, vector, type=type)
        return m.Binary("/", vector, factor, type=type)

    def composed(self, type: Type, depth: int) -> m.Expr:
        assert isinstance(type, Pose)
        middle = self.draw(st.sampled_from(self.meetings(type)))
        left = self.pose(Pose(type.parent, middle), depth)
        right = self.pose(Pose(middle, type.child), depth)
        if self.draw(st.booleans()):
            return m.Call("chain", (left, right), type=type)
        return m.Binary("@", left, right, type=type)

    def meetings(self, type: Pose) -> list[str]:
        return [f for f in "BEKO" if f not in (type.parent, type.child)]

    def inverse(self, type: Type, depth: int) -> m.Expr:
        assert isinstance(type, Pose)
        return m.Builtin("inverse", (self.pose(Pose(type.child, type.parent), depth),), type=type)

    def pose(self, type: Pose, depth: int) -> m.Expr:
        """A pose that says its frames itself: a chain of named ones where none is named so."""
        if self.named(type):
            return self.rooted(type, depth)
        first, *rest = [_LINKS[a, b] for a, b in _path(type.parent, type.child)]
        for link in rest:
            assert isinstance(first.type, Pose)
            assert isinstance(link.type, Pose)
            joined = Pose(first.type.parent, link.type.child)
            first = m.Binary("@", first, link, type=joined)
        return first


def _unit(type: Type):
    if isinstance(type, Vector):
        type = type.element
    assert isinstance(type, Real)
    return type.unit


def _links() -> dict[tuple[str, str], m.Expr]:
    """Every step along K - B - E - O, as a name or its inverse."""
    named: list[m.Expr] = [
        m.ConstantRef("X_KB", type=CONSTANTS["X_KB"]),
        m.LetRef("T_c", type=LETS["T_c"]),
        m.MemoryRef("X_EO", type=MEMORY["X_EO"]),
    ]
    found: dict[tuple[str, str], m.Expr] = {}
    for name in named:
        assert isinstance(name.type, Pose)
        a, b = name.type.parent, name.type.child
        found[a, b] = name
        found[b, a] = m.Builtin("inverse", (name,), type=Pose(b, a))
    return found


def _path(start: str, end: str) -> list[tuple[str, str]]:
    """Steps from frame to frame; a pose of a frame in itself goes there and back."""
    line = "KBEO"
    i, j = line.index(start), line.index(end)
    if i == j:
        other = line[i - 1] if i else line[1]
        return [(start, other), (other, start)]
    step = 1 if j > i else -1
    return [(line[k], line[k + step]) for k in range(i, j, step)]


_LINKS = _links()


@dataclass(frozen=True, slots=True)
class Reading:
    """A value of the record type of the fixed scope."""

    d: float
    mode: str


def values(type: Type) -> st.SearchStrategy[object]:
    """Plain Python values of a type: small numbers, rotations about random axes."""
    match type:
        case Bool():
            return st.booleans()
        case Int():
            return st.integers(-5, 5)
        case Real():
            return st.floats(-3, 3, allow_subnormal=False)
        case Enum():
            return st.sampled_from(type.members)
        case Vector():
            return st.tuples(*[values(type.element)] * type.size)
        case Spatial():
            return st.tuples(*[values(Real())] * 6)
        case PartialOf(value=inner):
            return values(inner)
        case ListOf():
            return st.lists(values(type.element), max_size=3).map(tuple)
        case Record():
            return st.builds(Reading, values(Real()), values(MODE))
    assert isinstance(type, Pose)
    axis = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 0.1)
    quaternion = st.builds(lambda a, w: (*a, w), axis, st.floats(-1, 1))
    return st.builds(pose, st.tuples(*[values(Real())] * 3), quaternion)


def lags() -> st.SearchStrategy[dict[tuple[str, str, str], float]]:
    """How far behind inputs are, of which it is asked."""
    seconds, periods = st.integers(0, 24).map(lambda n: n / 8), st.integers(0, 3)
    return st.fixed_dictionaries(
        {
            (lag.name, lag.input.peer, lag.input.element): seconds if lag.name == "age" else periods
            for lag in LAGS
        }
    )


@st.composite
def environments(draw: st.DrawFn) -> Environment:
    """A value for every name in `SCOPE`; which inputs are fresh and present is random too."""
    inputs = {key: draw(values(type)) for key, type in INPUTS.items()}
    groups = [{name: draw(values(t)) for name, t in g.items()} for g in (MEMORY, LETS, CONSTANTS)]
    keys = st.sets(st.sampled_from(sorted(INPUTS)))
    clock = {
        "elapsed": draw(st.floats(0, 10)),
        "entered": draw(st.booleans()),
        "period": float(Fraction(1, 500)),
    }
    return Environment(
        inputs=inputs,
        fresh=draw(keys),
        present=draw(keys),
        lags=draw(lags()),
        memory=groups[0],
        lets=groups[1],
        constants=groups[2],
        clock=clock,
        operators=OPERATORS,
    )
