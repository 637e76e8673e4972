"""Comparisons with `elapsed` are decided for the floats of whole periods, arithmetic included."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction

import pytest

from specc.lang import Environment, evaluate
from specc.proof import Decision, Prover
from tests.checks.texts import condition, machine
from tests.seeds import Seeds, blocks

PERIODS = 1100
TERMS = (
    "elapsed", "elapsed + 0.1[s]", "elapsed - 0.1[s]", "2 * elapsed", "elapsed / 3", "-elapsed",
    "0.7[s] - elapsed", "elapsed + elapsed", "max(elapsed, 0.3[s])", "elapsed + period",
    "min(elapsed + 0.2[s], 0.6[s])", "0.1 * elapsed", "elapsed - 2 * elapsed",
    "elapsed * elapsed / 1[s]", "elapsed**2 / 1[s]", "0.1[s**2] / elapsed", "abs(elapsed - 0.4[s])",
    "sqrt(elapsed * 1[s])", "elapsed * elapsed / 1[s] - elapsed",
    "(elapsed if elapsed < 0.3[s] else 0.5[s] - elapsed)",
)  # fmt: skip
LIMITS = (
    "0.3[s]",
    "0.35[s]",
    "0.4[s]",
    "0.1[s] + 0.2[s]",
    "0.6[s]",
    "0.02[s]",
    "-0.2[s]",
    "period",
)


def decided(rows: list[str], rate_hz: Fraction) -> Decision:
    subsystem = replace(machine([condition(row) for row in rows]), rate_hz=rate_hz)
    return Prover(subsystem, {}).prove_rows("S", "terminal").decision


def counts(rows: list[str], rate_hz: Fraction) -> set[int]:
    """How many rows hold, over all periods."""
    found = set()
    for periods in range(1, PERIODS):
        elapsed_s = periods * rate_hz.denominator / rate_hz.numerator
        world = Environment(clock={"elapsed": elapsed_s, "period": float(1 / rate_hz)})
        found.add(sum(evaluate(condition(row), world) for row in rows))
    return found


def test_a_sum_is_decided_like_the_time_itself() -> None:
    assert decided(["elapsed + 0.1[s] <= 0.4[s]", "elapsed > 0.35[s]"], Fraction(10)).proved


@pytest.mark.parametrize(
    "seeds", blocks(range(2), also=[*range(2, 10), 5985851, 204988933], long=10, each=40)
)
def test_rows_about_the_time_are_proved_or_refuted_as_a_run_has_it(seeds: Seeds) -> None:
    for seed in seeds:
        decided_as_counted(seed)


def decided_as_counted(seed: int) -> None:
    rng = random.Random(seed)
    rate_hz = Fraction(rng.choice((10, 20, 30, Fraction(100, 3), 100)))
    a, b = (f"{rng.choice(TERMS)} {{}} {rng.choice(LIMITS)}" for _ in range(2))
    op = rng.choice(("<", "<=", ">", ">="))
    rows = rng.choice(
        ([a.format("<="), b.format(op)], [a.format(op), f"not {a.format(op)}"],
         [f"{a.format(op)} and {b.format('<')}", f"not {a.format(op)}", b.format(">=")])
    )  # fmt: skip
    decision, held = decided(rows, rate_hz), counts(rows, rate_hz)
    if decision.unknown and any("**" in row for row in rows):
        return  # a limit may lie between two floats to which libraries round a power
    assert decision.proved == (held == {1}), (seed, rows)
    assert (decision.gap is not None) == (0 in held), (seed, rows)
    assert (decision.overlap is not None) == any(count > 1 for count in held), (seed, rows)


def test_time_that_rises_and_falls_is_decided_where_it_turns() -> None:
    rows = ["near(elapsed, 0.5[s], 0.1[s])", "elapsed < 0.4[s]", "elapsed > 0.6[s]"]
    assert counts(rows, Fraction(10)) == {1}
    assert decided(rows, Fraction(10)).proved
    decision = decided(rows[:2], Fraction(10))
    assert decision.gap and not decision.overlap


@pytest.mark.parametrize(
    "rows",
    [
        ["norm([elapsed, 0[s], 0[s]]) < 1[s]", "elapsed >= 1[s]"],
        ["elapsed - elapsed * elapsed / elapsed + 1[s] > 0.5[s]"],
        ["(1 if p else 2) * elapsed > 0[s]"],
        ["d * elapsed > 0[s]", "d <= 0"],
        ["any(elapsed * d > v for v in [0.3[s], 1[s]])", "elapsed <= 0.3[s]"],
    ],
)
def test_what_proofs_do_not_follow_refutes_nothing(rows: list[str]) -> None:
    decision = decided(rows, Fraction(10))
    assert not decision.gap and not decision.overlap
    assert decision.unknown and "elapsed" in decision.way_out
    assert all(decision.satisfiable)


def test_sums_of_time_and_other_numbers_are_refuted() -> None:
    assert decided(["elapsed / 1[s] + d > 3", "elapsed / 1[s] + d <= 2"], Fraction(10)).gap
