"""Verdicts about rows agree with trying every value of a small world."""

from __future__ import annotations

import random
import sys

import pytest

from specc.lang import Environment, evaluate, show
from specc.model.expr import (
    FALSE,
    TRUE,
    Binary,
    Builtin,
    Call,
    Clock,
    Compare,
    ConstantRef,
    Expr,
    Fresh,
    Input,
    LetRef,
    Logic,
    MemoryRef,
    Number,
    Quantifier,
    Unary,
)
from specc.model.types import Bool, Int, ListOf, Pose, Real
from specc.proof import Prover, RowVerdict
from tests.checks.conditions import (
    BOOL,
    COUNT,
    FLAG,
    INT,
    condition,
    machine,
    with_lets,
    worlds,
)
from tests.checks.texts import solved
from tests.seeds import Seeds, blocks

WORLDS = list(worlds())
REAL = Real()


def prove(rows: list[Expr], **context: object) -> RowVerdict:
    subsystem = machine(rows, **context)  # type: ignore[arg-type]  # passed on as they are
    return solved(Prover(subsystem, {}).prove_rows("S", subsystem.transitions[0].cause))


def negation(expr: Expr) -> Expr:
    return Unary("not", expr, type=BOOL)


def both(*parts: Expr) -> Expr:
    return Logic("and", parts, type=BOOL)


def either(*parts: Expr) -> Expr:
    return Logic("or", parts, type=BOOL)


def compare(op: str, left: Expr, right: Expr) -> Expr:
    return Compare(op, left, right, type=BOOL)  # type: ignore[arg-type]  # one of the six


def whole(value: int) -> Expr:
    return Number(value, type=INT)


def situations(
    terminal: Expr, error: Expr, axioms: tuple[Expr, ...], lets: dict[str, Expr]
) -> list[Environment]:
    """The worlds in which a state ends by its terminal condition and the axioms hold."""
    found = []
    for bare in WORLDS:
        world = with_lets(bare, lets)
        ended = evaluate(terminal, world) and not evaluate(error, world)
        if ended and all(evaluate(axiom, world) for axiom in axioms):
            found.append(world)
    return found


def possible(axiom: Expr, lets: dict[str, Expr]) -> bool:
    return bool(situations(TRUE, FALSE, (axiom,), lets))


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 12), long=12, each=25))
def test_verdicts_agree_with_trying_everything(seeds: Seeds) -> None:
    for seed in seeds:
        verdicts_agree_with_trying_everything(seed)


def verdicts_agree_with_trying_everything(seed: int) -> None:
    rng = random.Random(seed)
    lets: dict[str, Expr] = {}
    for name in ("l", "m"):
        lets[name] = condition(rng, 2, lets)
    first = condition(rng, 2, lets)
    rows = [first, condition(rng, 2, lets), negation(first)][: rng.randint(1, 3)]
    terminal, error = condition(rng, 1, lets), condition(rng, 1, lets)
    axioms = (next(a for a in iter(lambda: condition(rng, 1, lets), None) if possible(a, lets)),)
    verdict = prove(rows, terminal=terminal, error=error, axioms=axioms, lets=lets).decision

    met = situations(terminal, error, axioms, lets)
    enabled = [[bool(evaluate(row, world)) for row in rows] for world in met]
    assert not verdict.unknown
    assert verdict.possible == bool(met)
    assert (verdict.gap is not None) == any(sum(row) == 0 for row in enabled)
    assert (verdict.overlap is not None) == any(sum(row) > 1 for row in enabled)
    assert verdict.satisfiable == tuple(any(column) for column in zip(*enabled, strict=True)) or (
        not met and not any(verdict.satisfiable)
    )


@pytest.mark.parametrize(
    "seeds", blocks(range(3), also=[*range(3, 25), 77310195], long=30, each=25)
)
def test_every_situation_of_a_witness_is_a_fault(seeds: Seeds) -> None:
    for seed in seeds:
        every_situation_of_a_witness_is_a_fault(seed)


def every_situation_of_a_witness_is_a_fault(seed: int) -> None:
    rng = random.Random(1000 + seed)
    rows = [condition(rng, 2, {}) for _ in range(2)]
    axiom = next(a for a in iter(lambda: condition(rng, 1, {}), None) if possible(a, {}))
    verdict = prove(rows, axioms=(axiom,)).decision
    for witness in filter(None, (verdict.gap, verdict.overlap)):
        texts = {show(leaf): leaf for row in (*rows, axiom) for leaf in leaves(row)}
        facts = [(texts[text], answer) for text, answer in witness.facts if text in texts]
        met = [
            world
            for world in WORLDS
            if evaluate(axiom, world) and all(agrees(leaf, world, a) for leaf, a in facts)
        ]
        assert met
        if len(facts) == len(witness.facts):
            for world in met:
                holding = [i for i, row in enumerate(rows) if evaluate(row, world)]
                assert set(witness.holding) <= set(holding)
                assert bool(holding) == bool(witness.holding)


def leaves(expr: Expr) -> list[Expr]:
    """Everything inside an expression that a fact of a witness may be about."""
    from specc.model.expr import walk

    return list(walk(expr))


def agrees(expr: Expr, world: Environment, answer: str) -> bool:
    value = evaluate(expr, world)
    return value in answer.split(" or ") if isinstance(value, str) else value == (answer == "true")


@pytest.mark.parametrize("seeds", blocks(range(4), also=range(4, 10), long=40, each=20))
def test_the_order_of_rows_does_not_matter(seeds: Seeds) -> None:
    for seed in seeds:
        the_order_of_rows_does_not_matter(seed)


def the_order_of_rows_does_not_matter(seed: int) -> None:
    rng = random.Random(2000 + seed)
    rows = [condition(rng, 2, {}) for _ in range(3)]
    terminal = condition(rng, 1, {})
    one = prove(rows, terminal=terminal)
    other = prove(rows[::-1], terminal=terminal)
    assert one.proved == other.proved
    assert (one.decision.gap is None) == (other.decision.gap is None)
    assert (one.decision.overlap is None) == (other.decision.overlap is None)
    assert one.decision.satisfiable == other.decision.satisfiable[::-1]


X, Y = MemoryRef("x", type=REAL), MemoryRef("y", type=REAL)
OBJECTS = Input("p", "objects", type=ListOf(INT))
SIZE = Builtin("len", (OBJECTS,), type=INT)


def operator(name: str, *args: Expr) -> Expr:
    return Call(name, args, type=Bool())


def near(tolerance: float) -> Expr:
    return Builtin("near", (X, Y, Number(tolerance, type=REAL)), type=BOOL)


@pytest.mark.parametrize(
    "rows",
    [
        [compare("<=", X, Y), compare("<", Y, X)],
        [compare("==", COUNT, whole(1)), compare("!=", whole(1), COUNT)],
        [compare("<", COUNT, whole(2)), compare(">", COUNT, whole(1))],
        [compare("==", SIZE, whole(0)), compare(">=", SIZE, whole(1))],
        [compare("<", Unary("-", X, type=REAL), Number(-2.0, type=REAL)),
         compare("<=", X, Binary("+", Number(1.5, type=REAL), Number(0.5, type=REAL), type=REAL))],
        [operator("holds", X), negation(operator("holds", X))],
        [both(near(2.0), negation(near(1.0))), near(1.0), negation(near(2.0))],
        [compare(">=", Clock("elapsed", type=REAL), Number(0.0, type=REAL))],
    ],
    ids=["turned", "unequal", "next to each other", "sizes", "negative", "operators", "tolerances",
         "never negative"],
)  # fmt: skip
def test_rows_that_decide(rows: list[Expr]) -> None:
    assert prove(rows).proved


@pytest.mark.parametrize(
    "rows",
    [
        [compare("<", X, Number(2.0, type=REAL)), compare(">", X, Number(2.0, type=REAL))],
        [compare("<", X, Number(2.0, type=REAL)), compare(">=", X, Number(1.0, type=REAL))],
        [operator("holds", X), negation(operator("holds", Y))],
        [near(1.0), near(2.0)],
    ],
    ids=["equality is left out", "thresholds overlap", "other arguments", "one implies the other"],
)
def test_rows_that_do_not_decide(rows: list[Expr]) -> None:
    assert not prove(rows).proved


def over_objects(kind: str, body: Expr) -> Expr:
    return Quantifier(kind, "o", OBJECTS, body, type=BOOL)  # type: ignore[arg-type]  # all or any


def test_all_is_the_dual_of_any() -> None:
    body = operator("holds", X)
    assert prove([over_objects("all", body), over_objects("any", negation(body))]).proved


def test_a_list_may_be_empty() -> None:
    body = operator("holds", X)
    assert not prove([over_objects("any", body), over_objects("any", negation(body))]).proved
    assert prove([over_objects("any", body), over_objects("any", negation(body))]).decision.gap


def test_any_of_an_alternative_is_an_alternative() -> None:
    p, q = operator("p", X), operator("q", X)
    either_way = either(over_objects("any", p), over_objects("any", q))
    assert prove([either_way, negation(over_objects("any", either(p, q)))]).proved


def test_constants_are_looked_through() -> None:
    limit = ConstantRef("limit", type=REAL)
    rows = [compare("<", X, limit), compare(">=", X, Number(2.0, type=REAL))]
    prover = Prover(machine(rows), {"limit": Number(2.0, type=REAL)})
    assert prover.prove_rows("S", "terminal").proved


def test_error_has_priority_over_the_terminal_condition() -> None:
    assert prove([negation(FLAG)], terminal=TRUE, error=FLAG).proved
    assert prove([FLAG], terminal=TRUE, error=FLAG, cause="error").proved
    assert not prove([negation(FLAG)], terminal=TRUE, error=FALSE).proved


def test_a_cause_that_cannot_occur_needs_no_rows() -> None:
    verdict = Prover(machine([], terminal=FLAG, error=FLAG), {}).prove_rows("S", "terminal")
    assert verdict.proved
    assert not verdict.decision.possible


def test_rows_ensure_the_inputs_that_their_conditions_ask_for() -> None:
    T, b = (Input("c", name, type=Pose("B", "E")) for name in ("T", "b"))
    fresh_T, fresh_b = Fresh(T, type=BOOL), Fresh(b, type=BOOL)
    rows = [fresh_T, both(negation(fresh_T), fresh_b), negation(either(fresh_T, fresh_b))]
    ensured = prove(rows).decision.ensures
    assert ensured == (frozenset({("c", "T")}), frozenset({("c", "b")}), frozenset())


def test_too_many_facts_are_the_solvers_matter() -> None:
    flags = [operator(f"p{i}", X) for i in range(19)]
    gap = prove([both(*flags), negation(both(*flags[1:]))]).decision.gap
    assert gap
    assert dict(gap.facts) == {
        show(flag): "false" if flag is flags[0] else "true" for flag in flags
    }


def test_too_many_facts_without_a_solver_are_unknown_and_say_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "specc.proof.solver", None)
    flags = [operator(f"p{i}", X) for i in range(19)]
    decision = prove([both(*flags), negation(both(*flags[1:]))]).decision
    assert not decision.gap
    assert "combinations" in decision.unknown


def test_a_large_context_does_not_hide_a_proof() -> None:
    flags = [operator(f"p{i}", X) for i in range(30)]
    assert prove([FLAG, negation(FLAG)], terminal=either(*flags)).proved


def test_sharing_of_lets_costs_no_more_than_the_lets() -> None:
    lets: dict[str, Expr] = {"l0": compare("<", X, Y)}
    for i in range(1, 200):
        before = LetRef(f"l{i - 1}", type=BOOL)
        lets[f"l{i}"] = Logic("or" if i % 2 else "and", (before, negation(before)), type=BOOL)
    last = LetRef("l199", type=BOOL)
    assert prove([last, negation(last)], lets=lets).proved


def test_contradicting_axioms_are_found_and_narrowed_down() -> None:
    axioms = (compare("<", COUNT, whole(1)), FLAG, compare(">", COUNT, whole(2)))
    assert Prover(machine([TRUE], axioms=axioms), {}).contradiction() == (0, 2)
    assert Prover(machine([TRUE], axioms=axioms[:2]), {}).contradiction() == ()


def test_implication() -> None:
    prover = Prover(
        machine([TRUE], axioms=(either(negation(FLAG), compare("<", COUNT, whole(1))),)), {}
    )
    assert prover.implies([FLAG], compare("<", COUNT, whole(2))) is True
    assert prover.implies([], compare("<", COUNT, whole(2))) is False
    assert prover.satisfiable([FLAG, compare("==", COUNT, whole(1))]) is False


def test_integers_have_no_room_between_neighbours() -> None:
    rows = [compare("<=", COUNT, whole(1)), compare(">=", COUNT, whole(2))]
    assert prove(rows).proved
    assert Int() == COUNT.type
