"""Intervals hold what they promise, and plots say the same with the same bytes."""

from __future__ import annotations

import random
from math import comb
from pathlib import Path

import pytest

from specc.tools.sweep.summary import (
    as_rows,
    as_text,
    cells_of,
    median,
    plot,
    rarely_triggered,
    rate,
    reasons,
)
from tests.seeds import short


def covering(count: int, share: float) -> float:
    """How probable it is that the interval of a rate holds the true share."""
    return sum(
        comb(count, hits) * share**hits * (1 - share) ** (count - hits)
        for hits in range(count + 1)
        if (found := rate(hits, count)).low <= share <= found.high
    )


@pytest.mark.parametrize("count", [10, 20, 100])
def test_intervals_of_rates_hold_the_share(count: int) -> None:
    shares = [i / 200 for i in range(1, 200)]
    coverings = [covering(count, share) for share in shares]
    assert min(coverings) > 0.83  # near 0 and 1, as is known of this interval
    assert sum(coverings) / len(coverings) == pytest.approx(0.95, abs=0.01)


def test_published_intervals() -> None:
    """Newcombe (1998), table I, method 3."""
    for hits, count, low, high in (
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ):
        found = rate(hits, count)
        assert (found.low, found.high) == (
            pytest.approx(low, abs=5e-5),
            pytest.approx(high, abs=5e-5),
        )


@pytest.mark.parametrize(
    ("count", "ranks"), [(6, (1, 6)), (10, (2, 9)), (20, (6, 15)), (100, (40, 61))]
)
def test_order_statistics_around_the_median(count: int, ranks: tuple[int, int]) -> None:
    numbers = [float(i) for i in range(1, count + 1)]
    random.Random(0).shuffle(numbers)
    found = median(numbers)
    assert (found.low, found.value, found.high) == (ranks[0], (count + 1) / 2, ranks[1])


@pytest.mark.long
def test_order_statistics_of_very_many_numbers() -> None:
    """n / 2 - z / 2 * sqrt(n), as the normal distribution has it."""
    found = median([float(i) for i in range(1, 1_000_001)])
    assert (found.low, found.high) == (pytest.approx(499_020, abs=2), pytest.approx(500_981, abs=2))


def test_five_numbers_are_too_few() -> None:
    assert median([3.0, 1.0, 2.0, 5.0, 4.0]).value == 3.0
    assert median([3.0, 1.0, 2.0, 5.0, 4.0]).low is None


ROWS = [
    {
        "d [kg/s]": d,
        "seed": seed,
        "success": seed < 7 or d > 1,
        "reason": "" if seed < 7 or d > 1 else "too hard",
        "cycle.max_force_N": d + seed / 10 if seed else None,
        "records_sha256": "",
        "wall_s": 1.0,
    }
    for d in (1.0, 2.0, 3.0)
    for seed in range(8)
]


def test_cells() -> None:
    first, *_ = cells = cells_of(ROWS, ["d [kg/s]"])
    assert [(cell.values, cell.runs) for cell in cells] == [((d,), 8) for d in (1.0, 2.0, 3.0)]
    assert set(first.estimates) == {"success", "cycle.max_force_N"}
    assert first.estimates["success"].value == 7 / 8
    force = first.estimates["cycle.max_force_N"]
    assert (force.count, force.value, force.low, force.high) == (7, 1.4, 1.1, 1.7)
    row = as_rows(cells, ["d [kg/s]"])[0]
    assert (row["cycle.max_force_N high"], row["cycle.max_force_N runs"], row["runs"]) == (
        1.7,
        7,
        8,
    )
    assert [(why, len(rows)) for why, rows in reasons(ROWS)] == [("not successful: too hard", 1)]
    undecided = [{"success": None, "reason": "undecided: p"}] * 2
    assert reasons(undecided) == [("undecided: p", [0, 1])]


def test_what_was_seldom_asked_is_told() -> None:
    rows = [
        {"verdict of p": "met", "asked of p": seed < 3, "verdict of q": "met", "asked of q": True}
        | {"verdict of r": "unknown", "asked of r": False, "success": True}
        for seed in range(20)
    ]
    assert list(rarely_triggered(rows)) == [
        "p: met in 20 of 20, asked in 3",
        "r: met in 0 of 20, asked in none",
    ]
    assert cells_of(rows, [])[0].estimates["asked of p"] == rate(3, 20)


def test_what_is_not_decided_is_no_success() -> None:
    verdicts = ("met", "violated", "unknown", "unknown")
    successes = (True, False, None, None)
    rows = [
        {"success": success, "reason": "", "verdict of p": verdict}
        for success, verdict in zip(successes, verdicts, strict=True)
    ]
    cells = cells_of(rows, [])
    assert cells[0].estimates["success"] == cells[0].estimates["verdict of p"] == rate(1, 2)
    head, line = as_text(cells, [])
    assert dict(zip(head, line, strict=True)).items() >= {"runs": "4", "undecided": "2"}.items()
    head, line = as_text(cells_of(rows[2:], []), [])
    assert line == ["2", "", "", "2"]
    assert as_text(cells_of(rows[:2], []), [])[0] == ["runs", "success", "95 %"]


@pytest.mark.parametrize("names", short([["d [kg/s]"], ["d [kg/s]", "m"]], 1))
@pytest.mark.long
def test_the_same_cells_are_the_same_pictures(names: list[str], tmp_path: Path) -> None:
    rows = [{**row, "m": word} for row in ROWS for word in ("a", "b")]
    made = []
    for folder in (tmp_path / "one", tmp_path / "two"):
        files = plot(cells_of(rows, names), names, folder)
        made.append({path.name: path.read_bytes() for path in files})
    assert made[0] == made[1]
    wanted = {"success", "cycle.max_force_N"}
    assert set(made[0]) == {f"{name}.{end}" for name in wanted for end in ("png", "svg")}


def test_three_constants_have_no_picture(tmp_path: Path) -> None:
    assert plot(cells_of(ROWS, []), [], tmp_path / "none") == []


@pytest.mark.long
def test_columns_that_begin_alike_or_are_no_mathematics_have_a_picture_each(tmp_path: Path) -> None:
    columns = [f"{'ä' * 300} $\\frac{{{end}" for end in "ab"]
    rows = [{**row, **dict.fromkeys(columns, row["d [kg/s]"])} for row in ROWS]
    files = plot(cells_of(rows, ["d [kg/s]"]), ["d [kg/s]"], tmp_path)
    assert len(set(files)) == len(files) == 2 * 4
    assert all(path.is_file() for path in files)
