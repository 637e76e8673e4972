"""What is proved of numbers holds of the floats of a run, which are finite."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

import pytest

from specc.lang import Environment, evaluate
from tests.checks.texts import agree, condition, prove, prover, solved
from tests.seeds import Seeds, blocks

SUMS = (
    "d", "e", "d + e", "d - e", "e + d", "d * 2", "d + d", "d / 3", "d * 3", "d + 0.1",
    "d + 0.1 + 0.2", "d + 0.3", "d * 0.1", "n", "n + d", "n / 3", "n * 2", "n + k", "f - e",
    "abs(d)", "abs(d - e)", "max(d, e)", "min(d, n)", "(d if p else e) + 1", "d * e", "d / 2",
    "q[0]", "q[1] + d", "(q - r)[0]", "(2 * q)[1]", "norm(q)", "size(d)", "-(d + e)",
    "(n if p else 0.5)", "max(n, 1.5)", "max(n, d)", "(n if n > 5 else d)", "min(n, k)",
)  # fmt: skip
LIMITS = (
    "0", "1", "0.3", "-0.5", "1e300", "d", "e", "f", "n", "9007199254740992", "9007199254740993",
    "q[0]", "f - d",
)  # fmt: skip
WHOLES = ("near(q, r, 1)", "near(d, e, 0.1)", "all(v < 1 for v in q)", "any(v >= d for v in r)")
OPS = ("<", "<=", ">", ">=")
VALUES = (
    0.0, -0.0, 1.0, 0.1, 0.2, 0.3, 0.1 + 0.2, -0.5, 1 / 3, 5e-324, 1e-300, 1e16, 1e300, -1e300,
    1.7e308, -1.7e308, math.nextafter(1.0, 2.0), 2.0**53,
)  # fmt: skip
WHOLE_VALUES = (0, 1, -1, 2, 7, 2**53, 2**53 + 1, 2**60 - 1, -(2**53) - 1)


def comparison(rng: random.Random) -> str:
    if rng.random() < 0.2:
        return rng.choice(WHOLES)
    return f"{rng.choice(SUMS)} {rng.choice(OPS)} {rng.choice(LIMITS)}"


def rows(rng: random.Random) -> list[str]:
    """Rows that often decide: of one comparison, or of two that look alike, and their negations."""
    a, b = comparison(rng), comparison(rng)
    left, right = rng.choice(SUMS), rng.choice((*LIMITS, *SUMS))
    tables = (
        [f"{left} < {right}", f"{left} >= {right}"],
        [f"{left} < {right}", f"not {left} < {right}"],
        [f"{left} <= {right}", f"{right} < {left}"],
        [f"{left} < {right}", f"{left} - {right} >= 0"],
        [a, f"not ({a})"],
        [f"({a}) and ({b})", f"not ({a})", f"({a}) and not ({b})"],
        [f"({a}) or ({b})", f"not ({a}) and not ({b})"],
        [a, b],
        [f"({a}) and ({b})", f"not (({a}) and ({b}))"],
        [f"({a}) and d < e", f"({a}) and d >= e", f"not ({a})"],
        [f"max(n, d) > {right}", f"n <= {right} and d <= {right}"],
        [f"(n if p else d) > {right}", f"p and n <= {right} or not p and d <= {right}"],
    )
    return list(rng.choice(tables))


def worlds(rng: random.Random, count: int) -> Iterator[Environment]:
    def number() -> float:
        value = rng.choice(VALUES)
        if rng.random() < 0.3:
            value = rng.uniform(-3.0, 3.0)
        return value

    for _ in range(count):
        memory = {name: number() for name in "def"}
        if rng.random() < 0.4:
            memory["f"] = memory["d"] + memory["e"]
        memory |= {name: rng.choice(WHOLE_VALUES) for name in "nk"} | {"p": rng.random() < 0.5}
        memory |= {name: tuple(number() for _ in range(3)) for name in "qr"}
        yield Environment(memory=memory, operators={"size": lambda d: d * d - 1.0})


def holding(texts: list[str], world: Environment) -> int | None:
    """How many rows hold; None where computing fails."""
    try:
        return sum(bool(evaluate(condition(text), world)) for text in texts)
    except (ArithmeticError, ValueError):
        return None


@pytest.mark.parametrize(
    "seeds", blocks(range(6), also=[*range(6, 90), 54129723], long=30, each=90)
)
def test_what_is_proved_holds_of_floats(seeds: Seeds) -> None:
    for seed in seeds:
        what_is_proved_holds_of_floats(seed)


def what_is_proved_holds_of_floats(seed: int) -> None:
    rng = random.Random(seed)
    texts = rows(rng)
    if not prove(*texts).proved:
        return
    for world in worlds(rng, 250):
        assert holding(texts, world) in (None, 1), (texts, world.memory)


@pytest.mark.parametrize("seeds", blocks(range(4), also=range(4, 16), long=180, each=90))
def test_solver_and_tables_agree_near_rounding(seeds: Seeds) -> None:
    """Where a table is too large, the solver alone gives the verdict that a table gives."""
    for seed in seeds:
        solver_and_tables_agree_near_rounding(seed)


def solver_and_tables_agree_near_rounding(seed: int) -> None:
    known = prover(*rows(random.Random(seed)))
    verdict = known.prove_rows("S", "terminal")
    assert agree(known, solved(verdict).decision, [row.condition.when for row in verdict.rows])
