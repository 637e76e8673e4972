"""What is shown reads back as the same tree."""

import pytest

from specc.lang import expression, show
from specc.model import expr as m
from specc.model.types import Bool, Int, Real
from tests.seeds import drawn
from tests.strategies import SCOPE, expressions


@drawn(expressions(), few=20, many=100)
def test_shown_expressions_read_back_as_themselves(tree: m.Expr) -> None:
    assert expression(show(tree), SCOPE, tree.type) == tree


@pytest.mark.parametrize(
    ("text", "canonical"),
    [
        ("( ratio+ratio )*ratio", "(ratio + ratio) * ratio"),
        ("ratio - (ratio - ratio)", "ratio - (ratio - ratio)"),
        ("(ratio - ratio) - ratio", "ratio - ratio - ratio"),
        ("2[mm] + 0", "0.002[m] + 0[m]"),
        ("-(2[m])", "-2[m]"),
        ("--2[m]", "2[m]"),
        ("-ratio**2", "-ratio ** 2"),
        ("(-ratio)**2", "(-ratio) ** 2"),
        ("(-3)**2", "(-3) ** 2"),
        ("not (x.c.go and entered)", "not (x.c.go and entered)"),
        ("(x.c.go or entered) and entered", "(x.c.go or entered) and entered"),
        ("(x.c.go and entered) and entered", "(x.c.go and entered) and entered"),
        ("0 < ratio < 1", "0.0 < ratio and ratio < 1.0"),
        ("(x.c.go == entered) == entered", "(x.c.go == entered) == entered"),
        ("not x.c.mode in {g, u}", "x.c.mode not in {u, g}"),
        ("F_c[3]", "F_c.ax"),
        ("p.y", "p[1]"),
        ("(T_c if entered else T_c) @ X_EO", "(T_c if entered else T_c) @ X_EO"),
        ("x.c.go if entered else entered if x.c.go else x.c.go",) * 2,
        ("180[deg] > turn_limit", "3.141592653589793[rad] > turn_limit"),
    ],
)
def test_canonical_texts(text: str, canonical: str) -> None:
    assert show(expression(text, SCOPE)) == canonical


def test_an_integer_and_a_real_literal_stay_apart() -> None:
    assert show(m.Number(3, type=Int())) == "3"
    assert show(m.Number(3.0, type=Real())) == "3.0"


def test_any_of_several_members_keeps_the_order_of_the_enum() -> None:
    tree = expression("all(v in {s, g, c} for v in x.c.b)", SCOPE, Bool())
    assert show(tree) == "all(v in {c, g, s} for v in x.c.b)"
