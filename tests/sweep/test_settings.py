"""What is swept, as it is written on the command line."""

from __future__ import annotations

import pytest

from specc.tools.sweep.running import figures_of
from specc.tools.sweep.table import SweepError, combinations, parse_axis, parse_seeds

UNITS = {"d": "kg/s", "n": ""}


def values(name: str, text: str) -> tuple[str, ...]:
    return parse_axis(name, text, UNITS.get(name, "")).values


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("d", "100:1000:4", ("100[kg/s]", "400[kg/s]", "700[kg/s]", "1000[kg/s]")),
        ("d", "100[kg/s]:200[kg/s]:2", ("100[kg/s]", "200[kg/s]")),
        ("d", "100:200[kg/s]:2", ("100[kg/s]", "200[kg/s]")),
        ("d", "100[kg/s]:200:2", ("100[kg/s]", "200[kg/s]")),
        ("d", "0.1:0.3:3", ("0.1[kg/s]", "0.2[kg/s]", "0.3[kg/s]")),
        ("d", "1e-3:-1e-3:3", ("0.001[kg/s]", "0[kg/s]", "-0.001[kg/s]")),
        ("n", "1,2.5, 7", ("1", "2.5", "7")),
        ("d", "300", ("300[kg/s]",)),
        ("d", "300[g/s]", ("300[g/s]",)),
        ("d", "2 * a, b", ("2 * a", "b")),
        ("v", "[0, 1[m]],[1[m], 2[m]]", ("[0, 1[m]]", "[1[m], 2[m]]")),
        ("b", "True,False", ("True", "False")),
    ],
)
def test_values(name: str, text: str, expected: tuple[str, ...]) -> None:
    assert values(name, text) == expected


@pytest.mark.parametrize(
    "text",
    [
        "1:2",
        "1:2:3:4",
        "1:2:1",
        "1:2:x",
        "1:2:0.5",
        "1[m]:2[s]:3",
        "a:b:2",
        "1,1",
        "1,,2",
        "1:1:2",
        "1,1.0",
        "1,1[]",
        "1,1[1]",
        "2000[ms],2[s]",
        "1:2[m]:3",
        "1e999:2:3",
        f"0:{'9' * 5000}:3",
        f"0:1:{'0' * 9}{'9' * 9}",
    ],
)
def test_what_is_no_list_of_values(text: str) -> None:
    with pytest.raises(SweepError):
        values("n", text)


def test_numbers_of_one_unit_are_numbers_of_the_table() -> None:
    axis = parse_axis("d", "1:2:3", "kg/s")
    assert (axis.title, [axis.cell_value(v) for v in axis.values]) == ("d [kg/s]", [1.0, 1.5, 2.0])
    axis = parse_axis("d", "1[g/s],2[kg/s]", "kg/s")
    assert (axis.title, [axis.cell_value(v) for v in axis.values]) == ("d", ["1[g/s]", "2[kg/s]"])


def test_no_constant_hides_a_column_of_the_table() -> None:
    report = {
        **{"ended": "completed", "simulated_s": 1.0, "cycles": [], "faults": [], "subsystems": {}},
        **{"records_sha256": "", "wall_s": 1.0},
    }
    assert parse_axis("cycle.time_s", "1,2").title == "parameter cycle.time_s"
    for column in (*figures_of(report, 0), "seed", "runs"):
        assert parse_axis(column, "1,2").title == f"constant {column}"


@pytest.mark.parametrize(
    ("text", "expected"), [("0:3", (0, 1, 2)), ("4", (4,)), ("5, 1,5", (5, 1)), ("7:8", (7,))]
)
def test_seeds(text: str, expected: tuple[int, ...]) -> None:
    assert parse_seeds(text) == expected


@pytest.mark.parametrize("text", ["", "3:3", "1:2:3", "1:2,4", "-1", "1.5", "²", "0:9" + "9" * 20])
def test_what_are_no_seeds(text: str) -> None:
    with pytest.raises(SweepError):
        parse_seeds(text)


def test_every_combination_once() -> None:
    axes = [parse_axis("d", "1,2", "kg/s"), parse_axis("n", "3,4")]
    found = combinations(axes, [0])
    assert [tuple(s.values()) for s in found] == [
        ("1[kg/s]", "3"),
        ("1[kg/s]", "4"),
        ("2[kg/s]", "3"),
        ("2[kg/s]", "4"),
    ]
    assert combinations([], [0]) == [{}]
    many = [parse_axis(name, "1:2:200") for name in "ab"]
    with pytest.raises(SweepError, match="more than"):
        combinations(many, [0])
