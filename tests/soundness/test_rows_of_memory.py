"""What is proved of rows by the bounds of memory holds in every step, with rounding as well."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest

from tests.seeds import Seeds, blocks
from tests.soundness.open_inputs import Findings, tried
from tests.soundness.running import compiled
from tests.soundness.specifications import Tree
from tests.soundness.test_accepted import small
from tests.soundness.test_rounding import ROUGH

EDGES = (*range(4), 2**53 - 1, 2**53, 2**53 + 1)
REALS = ("0.1", "0.3", "0.1 + 0.2", "1", "1e300", "5e-324", "9007199254740992")


def counted(rng: Random) -> tuple[str, list[str], list[str]]:
    """The start of a counter, what it is given, and rows about it; they may miss its last value."""
    first, count = rng.choice(EDGES), rng.randrange(1, 4)
    last = first + count
    given = rng.choice(
        [
            [f"n + 1 if n < {last} else {first}"],
            [f"{first} if n >= {last} else n + 1"],
            [f"clamp(n + 1, {first}, {last})", f"{first}"],
            [f"n + 1 if n != {last} else {first}"],
            [f"n + 1 if n < {last} and x.E.p > 0 else {first}", f"min(n + 1, {last})"],
            [f"n + 1 if n < d else {first}"],
            [f"n + 1 if not d <= n else {first}"],
        ]
    )
    until = last + rng.choice((0, 0, 1))
    rows = [f"n == {value}" for value in range(first, until)]
    return str(first), given, [*rows, rng.choice((f"n >= {until}", f"n == {until}"))]


def measured(rng: Random) -> tuple[str, list[str], list[str]]:
    """The same of a real number."""
    low, high = (rng.choice(REALS) for _ in "ab")
    given = rng.choice(
        [
            [f"clamp(x.E.p, min({low}, {high}), max({low}, {high}))"],
            [f"min(d + {low}, {high})"],
            [f"d + {low} if d + {low} < {high} else 0"],
            [f"x.E.p if x.E.p > {low} and x.E.p < {high} else d"],
            [f"max(d, {low})", f"d if d < n else {high}"],
            [f"n if n > d else {low}"],
        ]
    )
    rows = rng.choice(
        [
            [f"d <= {high}"],
            [f"d < {low}", f"{low} <= d and d <= {high}"],
            [f"d <= {low}", f"d > {low} and d < {high} + {low}"],
            ["d < n", "d >= n"],
        ]
    )
    return rng.choice(("0", low, high)), given, rows


def table(rng: Random) -> Tree:
    """A machine whose states write memory and whose rows ask about it."""
    n, d = counted(rng), measured(rng)
    asked = rng.choice((n, n, d))[2]
    tree = small({f"r{i}": row for i, row in enumerate(asked)})
    part = tree["agents"]["a"]["virtual_effectors"]["m"]
    part["memory"] = {"n": {"type": "int", "init": n[0]}, "d": {"type": "real", "init": d[0]}}
    part["functions"]["count"] = {"n": n[1][0], "d": d[1][0]}
    part["functions"]["turn"] = {"n": n[1][-1], "d": d[1][-1]}
    part["behaviours"]["drive"]["functions"].append("count")
    part["behaviours"]["turn"] = {"functions": ["turn"], "terminal": "always"}
    part["states"]["S1"] = "turn"
    part["transitions"] = [
        [state, "terminal", name, f"S{rng.randrange(2)}"]
        for state in ("S0", "S1")
        for name in part["conditions"]["initial"]
    ]
    return tree


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 8), long=20, each=60))
def test_rows_about_memory_decide(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        result = compiled(table(Random(seed)), tmp_path)
        assert result.system is not None
        findings = Findings()
        tried(result, str(seed), 100, findings, odd=ROUGH)
        assert findings.faults == [], seed


@pytest.mark.long
def test_rows_about_memory_are_proved_in_some_tables_only(tmp_path: Path) -> None:
    """The random tests see both kinds; of twenty fresh seeds all may be of one kind by chance."""
    tables = (compiled(table(Random(seed)), tmp_path) for seed in range(40))
    proved = sum(each.proofs.is_proved("a.m", "S0", "terminal") for each in tables)
    assert 0 < proved < 40
