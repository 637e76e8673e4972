"""What is said of many peers, written out for each."""

import ast

import pytest

from specc.lang import ExprError, expand_groups, parse
from specc.lang.syntax import Root

ROBOTS = {"robots": {(1,): "robots_1", (2,): "robots_2", (4,): "robots_4"}}
GRID = {"cells": {(0, 0): "cells_0_0", (0, 1): "cells_0_1"}}


def written(text: str, groups: dict[str, dict[tuple[int, ...], str]] = ROBOTS) -> str:
    return ast.unparse(expand_groups(parse(text), groups))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("x.robots[4].e", "x.robots_4.e"),
        ("len(x.robots) > 2", "3 > 2"),
        ("any(r.e > r for r in x.robots)", "x.robots_1.e > 1 or x.robots_2.e > 2 or "
         "x.robots_4.e > 4"),
        (
            "not all(fresh(r.e) and any(v > r for v in r.l) for r in x.robots)",
            "not ((fresh(x.robots_1.e) and any((v > 1 for v in x.robots_1.l))) and "
            "(fresh(x.robots_2.e) and any((v > 2 for v in x.robots_2.l))) and "
            "(fresh(x.robots_4.e) and any((v > 4 for v in x.robots_4.l))))",
        ),
        (
            "argmax(r.e for r in x.robots)",
            "1 if x.robots_1.e >= x.robots_2.e and x.robots_1.e >= x.robots_4.e else "
            "2 if x.robots_2.e >= x.robots_4.e else 4",
        ),
        ("all(any(r.e > s.e for s in x.robots) for r in x.other)", None),
        (
            "any(any(r > 1 for r in r.l) for r in x.robots)",
            "any((r > 1 for r in x.robots_1.l)) or any((r > 1 for r in x.robots_2.l)) or "
            "any((r > 1 for r in x.robots_4.l))",
        ),
        ("x.other.e", "x.other.e"),
    ],
)  # fmt: skip
def test_each_member_is_written_out(text: str, expected: str | None) -> None:
    if expected is not None:
        assert ast.dump(ast.parse(written(text))) == ast.dump(ast.parse(expected))
    else:
        assert "robots_4.e" in written(text)


AGENTS = {"robots": {(1,): "robots_1", (2,): "robots_2"}}


@pytest.mark.parametrize(
    ("text", "root", "expected"),
    [
        ("any(r.c.n > r for r in robots)", "", "robots_1.c.n > 1 or robots_2.c.n > 2"),
        ("robots[2].c.n < len(robots)", "", "robots_2.c.n < 2"),
        ("all(state(r.c) == S0 for r in robots)", "",
         "state(robots_1.c) == S0 and state(robots_2.c) == S0"),
        ("all(v < plant.robots[1] for v in plant.robots)", "plant",
         "plant.robots_1 < plant.robots_1 and plant.robots_2 < plant.robots_1"),
        ("all(v.x > 0 for v in plant.robots)", "plant",
         "plant.robots_1.x > 0 and plant.robots_2.x > 0"),
    ],
)  # fmt: skip
def test_agents_and_what_is_observed_are_written_out_likewise(
    text: str, root: Root, expected: str
) -> None:
    found = ast.unparse(expand_groups(parse(text), AGENTS, root))
    assert ast.dump(ast.parse(found)) == ast.dump(ast.parse(expected))


def test_members_of_a_grid_have_two_numbers() -> None:
    assert written("x.cells[0][1].e", GRID) == "x.cells_0_1.e"
    with pytest.raises(ExprError, match="2 indices"):
        written("argmin(r.e for r in x.cells)", GRID)


def test_columns_are_those_of_the_text() -> None:
    text = "b or all(r.e for r in x.robots)"
    tree = expand_groups(parse(text), ROBOTS)
    columns = {n.col_offset for n in ast.walk(tree) if isinstance(n, ast.Attribute)}
    assert columns == {text.index("r.e")}


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("x.robots.e", "E0238"),
        ("x.robots", "E0238"),
        ("x.robots[3].e", "E0238"),
        ("x.robots[k].e", "E0238"),
        ("x.robots[1][2].e", "E0238"),
        ("x.robots[True].e", "E0238"),
        ("[v for v in x.robots]", "E0238"),
    ],
)
def test_many_peers_are_no_value(text: str, code: str) -> None:
    with pytest.raises(ExprError) as raised:
        expand_groups(ast.parse(text, mode="eval").body, ROBOTS)
    assert raised.value.code == code


def test_what_is_written_out_is_bounded() -> None:
    many = {"m": {(n,): f"m_{n}" for n in range(1000)}}
    with pytest.raises(ExprError, match="more than 10000 parts"):
        written("any(any(r.e > s.e for s in x.m) for r in x.m)", many)
    with pytest.raises(ExprError, match="at most 32 are compared"):
        written("argmin(r.e for r in x.m)", many)
