"""Random conditions over a small world, all values of that world, and subsystems to ask about."""

from __future__ import annotations

import itertools
import random
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

from specc.lang import Environment, evaluate
from specc.model.expr import (
    FALSE,
    TRUE,
    BoundVariable,
    Choice,
    Compare,
    Expr,
    Fresh,
    Input,
    IsOneOf,
    LetRef,
    Logic,
    Member,
    Number,
    Present,
    Quantifier,
    Truth,
    Unary,
)
from specc.model.fsm import Axiom, Behaviour, Condition, State, Trace, Transition
from specc.model.system import Let, Subsystem
from specc.model.types import Bool, Enum, Int, Vector
from specc.source import Place

MODE = Enum("Mode", ("u", "c", "s"))
BOOL, INT = Bool(), Int()
MODES = Vector(2, MODE)
HERE = Place("conditions.yaml")

ENUMS = [Input("p", name, type=MODE) for name in ("e", "f")]
FLAG = Input("p", "flag", type=BOOL)
COUNT = Input("p", "count", type=INT)
ITEMS = Input("p", "items", type=MODES)
ASKED = [FLAG]
DOMAINS: dict[str, tuple[Any, ...]] = {
    "e": MODE.members,
    "f": MODE.members,
    "flag": (False, True),
    "count": (-1, 0, 1, 2, 3),
    "items": tuple(itertools.product(MODE.members, repeat=2)),
}
PRESENCES = ("absent", "old", "fresh")


def worlds() -> Iterator[Environment]:
    """Every assignment of values and arrivals; values of absent elements take part as well."""
    for values in itertools.product(*DOMAINS.values()):
        inputs = {("p", name): value for name, value in zip(DOMAINS, values, strict=True)}
        for states in itertools.product(PRESENCES, repeat=len(ASKED)):
            arrived = {(i.peer, i.element): s for i, s in zip(ASKED, states, strict=True)}
            yield Environment(
                inputs=inputs,
                fresh={name for name, state in arrived.items() if state == "fresh"},
                present={name for name, state in arrived.items() if state != "absent"},
            )


def with_lets(world: Environment, lets: dict[str, Expr]) -> Environment:
    """The world with the values of the lets in it."""
    values: dict[str, Any] = {}
    for name, value in lets.items():
        values[name] = evaluate(value, Environment(**{**vars(world), "lets": dict(values)}))
    return Environment(**{**vars(world), "lets": values})


def condition(rng: random.Random, depth: int, lets: dict[str, Expr]) -> Expr:
    """A random expression of type bool."""
    if depth == 0 or rng.random() < 0.2:
        return _leaf(rng, lets)
    parts = [condition(rng, depth - 1, lets) for _ in range(rng.choice((2, 2, 3)))]
    match rng.randrange(5):
        case 0:
            return Unary("not", parts[0], type=BOOL)
        case 1 | 2:
            return Logic("and", tuple(parts), type=BOOL)
        case 3:
            return Logic("or", tuple(parts), type=BOOL)
    return Choice(parts[0], parts[1], parts[-1], type=BOOL)


def _leaf(rng: random.Random, lets: dict[str, Expr]) -> Expr:
    match rng.randrange(10):
        case 0:
            return Fresh(rng.choice(ASKED), type=BOOL)
        case 1:
            return Present(rng.choice(ASKED), type=BOOL)
        case 2:
            return IsOneOf(_item(rng), _members(rng), type=BOOL)
        case 3:
            return Compare(rng.choice(("==", "!=")), _item(rng), _item(rng), type=BOOL)
        case 4 | 5:
            return _threshold(rng)
        case 6:
            body = IsOneOf(BoundVariable("v", type=MODE), _members(rng), type=BOOL)
            return Quantifier(rng.choice(("all", "any")), "v", ITEMS, body, type=BOOL)
        case 7:
            member = Member(rng.choice(MODE.members), type=MODE)
            body_ = Compare(
                rng.choice(("==", "!=")), BoundVariable("w", type=MODE), member, type=BOOL
            )
            return Quantifier(rng.choice(("all", "any")), "w", ITEMS, body_, type=BOOL)
        case 8:
            return FLAG if rng.random() < 0.8 else Truth(rng.random() < 0.5, type=BOOL)
    return LetRef(rng.choice(list(lets)), type=BOOL) if lets else FLAG


def _threshold(rng: random.Random) -> Expr:
    op = rng.choice(("<", "<=", ">", ">=", "==", "!="))
    limit = Number(rng.choice((0, 1, 2)), type=INT)
    sides = (COUNT, limit) if rng.random() < 0.5 else (limit, COUNT)
    return Compare(op, *sides, type=BOOL)


def _item(rng: random.Random) -> Expr:
    match rng.randrange(4):
        case 0:
            return Member(rng.choice(MODE.members), type=MODE)
        case 1:
            return Choice(FLAG, ENUMS[0], ENUMS[1], type=MODE)
    return rng.choice(ENUMS)


def _members(rng: random.Random) -> frozenset[str]:
    return frozenset(rng.sample(MODE.members, rng.randint(1, len(MODE.members))))


def named(name: str, kind: Any, when: Expr) -> Condition:
    """A condition of a specification."""
    return Condition(name, kind, when, "", Trace(), HERE)


def machine(
    rows: list[Expr],
    terminal: Expr = TRUE,
    error: Expr = FALSE,
    axioms: tuple[Expr, ...] = (),
    lets: dict[str, Expr] | None = None,
    cause: Any = "terminal",
) -> Subsystem:
    """A subsystem whose state S has one row for each of the conditions."""
    end, failure = named("ended", "terminal", terminal), named("failed", "error", error)
    behaviour = Behaviour("b", (), end, (("error", failure),), "", Trace(), HERE)
    conditions = [named(f"row_{i}", "initial", when) for i, when in enumerate(rows)]
    return Subsystem(
        agent="a",
        name="s",
        kind="virtual_effector",
        title="",
        rate_hz=Fraction(1),
        ports=(),
        constants=(),
        memory=(),
        lets=tuple(Let(n, v, "", Trace(), HERE) for n, v in (lets or {}).items()),
        conditions=(end, failure, *conditions),
        functions=(),
        behaviours=(behaviour,),
        states=(State("S", behaviour, "", Trace(), HERE),),
        initial_state="S",
        transitions=tuple(Transition("S", cause, c, "S", Trace(), HERE) for c in conditions),
        axioms=tuple(Axiom(that, "it is so", HERE) for that in axioms),
        trace=Trace(),
        place=HERE,
    )
