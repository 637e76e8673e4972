"""Symbols: how people write them, and what follows from a name."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.lang.notation import MathSymbol, NotationError, notation_of, symbol_of
from tests.commands import specc

T, D = MathSymbol("T"), MathSymbol("d")


@pytest.mark.parametrize(
    ("text", "symbol"),
    [
        ("T", T),
        ("T_d", MathSymbol("T", sub=(D,))),
        ("T_{d,1}^x", MathSymbol("T", sub=(D, MathSymbol("1")), sup=(MathSymbol("x"),))),
        ("dot(r)_p", MathSymbol("r", "dot", (MathSymbol("p"),))),
        (
            "^B_{E_g} T_d",
            MathSymbol(
                "T",
                sub=(D,),
                before_sub=(MathSymbol("E", sub=(MathSymbol("g"),)),),
                before_sup=(MathSymbol("B"),),
            ),
        ),
    ],
)
def test_what_people_write(text: str, symbol: MathSymbol) -> None:
    assert notation_of(text) == symbol


@pytest.mark.parametrize(
    "text",
    [
        *(
            "",
            " ",
            "_d",
            "T_",
            "T_d_e",
            "dot(r",
            "sin(x)",
            "T d",
            "$T$",
            "T#",
            "T_{d",
            '"',
            "{" * 9,
        ),
        *("T_{a_{b_{c_{d_{e}}}}}", "x" * 61),
    ],
)
def test_what_is_no_symbol(text: str) -> None:
    with pytest.raises(NotationError):
        notation_of(text)


@pytest.mark.parametrize(
    ("name", "base", "sub"),
    [
        ("T_d", "T", ["d"]),
        ("p_S_com", "p", ["S", "com"]),
        ("q1", "q", ["1"]),
        ("alpha_0", "alpha", ["0"]),
        ("arm", "arm", []),
        ("tool_weight", "tool_weight", []),
        ("X_", "X", []),
    ],
)
def test_what_follows_from_a_name(name: str, base: str, sub: list[str]) -> None:
    symbol = symbol_of(name)
    assert (symbol.base, [each.base for each in symbol.sub]) == (base, sub)


def test_a_symbol_that_is_wrong_is_found_where_it_is_written(tmp_path: Path) -> None:
    path = tmp_path / "s.yaml"
    path.write_text('specc: 1.3\nsystem: s\nconstants:\n  a: {is: "1[m]", symbol: "T_"}\n', "utf-8")
    done = specc("validate", path)
    assert done.returncode == 1
    assert "s.yaml:4:27" in done.stderr
    assert "`^B_{E_g} T_d`" in done.stderr
