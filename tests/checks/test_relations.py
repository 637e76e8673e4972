"""Questions that have to do with each other are not taken for independent ones."""

from __future__ import annotations

import itertools
import random
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction

import pytest

from specc.proof import Prover
from specc.proof.decide import is_satisfiable
from specc.proof.formula import atoms_of
from specc.proof.solver import Theory
from tests.checks.conditions import machine
from tests.checks.texts import condition, prove, prover

PROVED = {
    "whole numbers beside thresholds between them": ["n < 1", "n > 0.5"],
    "floats without room between them": ["d <= 0.1", "d >= 0.10000000000000002"],
    "periods": ["elapsed <= 1[s]", "elapsed >= 2[s]"],
    "a period has passed": ["elapsed >= 1[s]"],
    "conditions come after the first period": ["not entered"],
    "the period is a number": ["elapsed < 3 * period", "elapsed >= 3[s]"],
    "tolerances of poses": [
        "near(X, Y, 1[mm], 1[deg])",
        "near(X, Y, 2[mm], 2[deg]) and not near(X, Y, 1[mm], 1[deg])",
        "not near(X, Y, 2[mm], 2[deg])",
    ],
    "vectors by component": [
        "near(q, r, 1)",
        "not near(q, r, 1) and abs(q[0] - r[0]) <= 1",
        "abs(q[0] - r[0]) > 1",
    ],
    "equal vectors": ["b == [u, u, u]", "any(v != u for v in b)"],
    "a component and all of them": [
        "all(v == u for v in b)",
        "b[0] == c",
        "b[0] != c and any(v != u for v in b)",
    ],
    "the length of a list": [
        "len(l) == 0",
        "any(v > 1 for v in l)",
        "len(l) > 0 and all(v <= 1 for v in l)",
    ],
    "one item has one value": [
        "len(l) == 1 and any(v > 1 for v in l)",
        "len(l) == 1 and any(v <= 1 for v in l)",
        "len(l) != 1",
    ],
    "same arguments": ["n == k and P(n)", "n == k and not P(k)", "n != k"],
    "same members": ["m == u and Q(m)", "m == u and not Q(u)", "m != u"],
    "same texts": ['t == "a" and t == w and w != "a"', 'not (t == "a" and t == w and w != "a")'],
    "chosen numbers": ["(d if p else e) + 1 < 2", "p and d + 1 >= 2", "not p and e + 1 >= 2"],
    "an order": ["d < e and e < f and f < d", "not (d < e and e < f and f < d)"],
    "larger than something": ["max(d, 0) >= 0"],
    "squares": ["d ** 2 >= 0"],
    "no age is negative": ["age(x.s.i) >= 0", "age(x.s.i) < -1[s]"],
    "nor are two": ["age(x.s.i) + age(x.s.j) >= 0"],
    "lateness counts periods": ["late(x.s.i) < 1", "late(x.s.i) > 0.5"],
    "one age in one period": ["age(x.s.i) < 1[s]", "age(x.s.i) >= 1[s]"],
}
REFUTED = {
    "real arguments are more than their order": [
        "d <= e and e <= d and R(d)",
        "d <= e and e <= d and not R(e)",
        "not (d <= e and e <= d)",
    ],
    "an empty list": ["all(v > 1 for v in l)", "any(v > 1 for v in l)"],
    "items of one list": ["any(v > 1 for v in l)", "any(v <= 1 for v in l)", "len(l) == 0"],
    "other tolerances": ["near(X, Y, 1[mm], 2[deg])", "not near(X, Y, 2[mm], 1[deg])"],
    "lists of other names": ["any(v > 1 for v in l) and len(i) == 0", "len(l) > 0", "len(l) == 0"],
    "ages of two inputs": ["age(x.s.i) < 1[s]", "age(x.s.j) >= 1[s]"],
    "ages of equal values": ["late(x.s.i) == late(x.s.j)", "x.s.i != x.s.j"],
    "between two periods": ["elapsed <= 1[s]", "elapsed >= 3[s]"],
}


@pytest.mark.parametrize("rows", PROVED.values(), ids=PROVED)
def test_proved(rows: list[str]) -> None:
    decision = prove(*rows).decision
    assert decision.proved, (decision.gap, decision.overlap, decision.unknown)


@pytest.mark.parametrize("rows", REFUTED.values(), ids=REFUTED)
def test_refuted(rows: list[str]) -> None:
    decision = prove(*rows).decision
    assert decision.gap or decision.overlap


ROUNDED = {
    "sums on both sides": ["d + e < f", "d >= f - e"],
    "an order of sums": ["d + e + f < 1", "f + e + d >= 1"],
    "a sum is not undone": ["d + 1 - 1 < e", "d >= e"],
    "large products": ["d * 2 - d <= e", "d > e"],
    "thirds": ["d / 3 * 3 < e", "d >= e"],
}
EXACT = {
    "doubled": ["d * 2 < e", "d + d >= e"],
    "differences have the sign of the order": ["d - e < 0", "d >= e"],
    "one and the same sum": ["d + e < f", "not e + d < f"],
    "rounding keeps order": ["d + e < f", "d + e >= f and d >= 0", "d + e >= f and d < 0"],
    "room for rounding": ["d + e < 1 and d > 1 - e + 0.001 and abs(e) < 100",
                          "not (d + e < 1 and d > 1 - e + 0.001 and abs(e) < 100)"],
    "whole numbers": ["n + k < 5", "n >= 5 - k"],
}  # fmt: skip


@pytest.mark.parametrize("rows", ROUNDED.values(), ids=ROUNDED)
def test_what_rounding_can_break_is_not_proved_and_says_so(rows: list[str]) -> None:
    decision = prove(*rows).decision
    assert "rounded" in decision.unknown
    assert not decision.gap
    assert not decision.overlap


@pytest.mark.parametrize("rows", EXACT.values(), ids=EXACT)
def test_what_rounding_cannot_break_is_proved(rows: list[str]) -> None:
    assert prove(*rows).proved


NUMBERS = {
    "complements": ["d < 1", "d >= 1"],
    "a quantifier": ["all(v < 1 for v in q)", "any(v >= 1 for v in q)"],
    "the difference of a thing and itself": ["d - d <= 0", "d - d > 0"],
    "the length of a vector": ["norm(q) < 1", "norm(q) >= 1"],
    "two numbers": ["d < e", "e <= d"],
    "a thing and itself": ["d <= d"],
    "near": ["near(q, r, 1)", "not near(q, r, 1)"],
    "poses": ["near(X, Y, 1[m], 1[deg])", "not near(X, Y, 1[m], 1[deg])"],
    "time": ["elapsed < 2[s]", "elapsed >= 2[s]"],
}


@pytest.mark.parametrize("rows", NUMBERS.values(), ids=NUMBERS)
def test_every_number_is_finite(rows: list[str]) -> None:
    assert prove(*rows).proved


def test_axioms_count_that_are_related_by_their_numbers_only() -> None:
    rows = "d < f", "p and d >= f"
    assert prove(*rows, axioms=("d < e", "e < f")).proved
    assert not prove(*rows, axioms=("d < e",)).proved


@pytest.mark.parametrize(
    ("rows", "proved"),
    [
        (("elapsed <= 0.3[s]", "elapsed >= 0.4[s]"), True),
        (("elapsed < 0.3[s]", "elapsed > 0.3[s]"), False),
        (("elapsed < 0.3[s]", "elapsed >= 0.30000000000000004[s]"), False),
        (("elapsed <= 0.3[s]", "elapsed >= 0.30000000000000004[s]"), True),
        (("elapsed < 0.1[s]", "elapsed >= 0.1[s]"), True),
        (("elapsed > 0.1[s]",), False),
    ],
)
def test_time_is_counted_in_decimals(rows: tuple[str, ...], proved: bool) -> None:
    subsystem = replace(machine([condition(row) for row in rows]), rate_hz=Fraction(10))
    assert Prover(subsystem, {}).prove_rows("S", "terminal").proved == proved


def _sum(rng: random.Random, leaves: Sequence[str]) -> str:
    """A sum of a few numbers, which may cancel each other."""
    parts = [f"{rng.choice('+-')} {rng.choice(leaves)}" for _ in range(rng.randint(1, 3))]
    text = " ".join(["0", *parts])
    return rng.choice([text, text, f"abs({text})", f"min({text}, {rng.choice(leaves)})"])


def _compared(rng: random.Random) -> str:
    leaves = rng.choice([("n", "k", "x.s.i", "2"), ("d", "e", "q[0]", "q[1]", "n", "0.5", "d * 2")])
    sides = _sum(rng, leaves), rng.choice([_sum(rng, leaves), "1", "-1"])
    return rng.choice(["<", "<=", ">", ">="]).join(sides)


def independent(texts: Sequence[str]) -> None:
    """What tables find possible of unrelated conditions the solver finds possible, too."""
    known = prover("True")
    formulas = tuple(known._formula(condition(text)) for text in texts)
    atoms = list(atoms_of(formulas))
    if known._dependencies.are_related(atoms):
        return
    theory = Theory(known.numbering, atoms, exact=False)
    make = known._translator.make
    for signs in itertools.product((False, True), repeat=len(formulas)):
        pairs = zip(formulas, signs, strict=True)
        parts = [each if yes else make.negation(each) for each, yes in pairs]
        possible = theory.find_model(make.conjunction(parts)) is not None
        assert is_satisfiable(parts) == possible, (texts, signs)


@pytest.mark.parametrize("seed", range(8))
def test_sums_that_can_have_any_value_are_as_the_solver_has_them(seed: int) -> None:
    rng = random.Random(seed)
    for _ in range(4):
        one, other = _compared(rng), _compared(rng)
        independent([one])
        independent([one, other])


@pytest.mark.parametrize(
    ("rows", "related"),
    [
        (("q[0] > 1", "q[1] > 1"), False),
        (("q[0] > 1", "q[0] + d > 1"), True),
        (("q[0] > 1", "near(q, r, 1)"), True),
        (("b[0] == u", "all(v == u for v in b)"), True),
    ],
)
def test_components_alone_do_not_need_the_solver(rows: tuple[str, str], related: bool) -> None:
    asked = prover("True")
    atoms = list(atoms_of(asked._formula(condition(row)) for row in rows))
    assert asked._dependencies.are_related(atoms) == related


@pytest.mark.parametrize("seed", range(8))
def test_components_are_told_apart_as_the_solver_has_them(seed: int) -> None:
    rng = random.Random(seed)
    asked = [
        "q[0] > 1",
        "q[1] <= 1",
        "q[0] < q[1]",
        "norm(q) < 1",
        "near(q, r, 1)",
        "r[1] > q[1]",
        "any(v > 1 for v in q)",
        "all(v <= 1 for v in q)",
        "abs(q[2]) < 1",
        "r[0] > 4",
    ]
    for _ in range(4):
        independent(rng.sample(asked, 3))
