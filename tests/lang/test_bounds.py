"""What is computed from numbers lies within the bounds that are computed from theirs."""

from __future__ import annotations

import math

import pytest
from hypothesis import strategies as st

from specc.lang import Environment, evaluate, expression
from specc.lang.evaluate import range_of
from specc.lang.ranges import Range
from specc.model import expr as m
from specc.model.types import Bool, Int, Real
from specc.model.units import METRE
from tests.seeds import drawn
from tests.strategies import SCOPE, conditions, environments, expressions

FEW, MANY = 10, 40
BIG, HUGE = 2**53, f"({10**300} * {10**300})"
"""Beyond these floats are no whole numbers, or none."""
UNKNOWN = (m.Input, m.MemoryRef, m.ConstantRef, m.LetRef, m.Call, m.Quantifier)


@drawn(
    st.one_of(expressions(Real(METRE), 3), expressions(Int(), 3), conditions(3)),
    environments(),
    st.sampled_from((0.0, 0.5, 3.0, math.inf)),
    few=FEW,
    many=MANY,
)
def test_values_lie_within(tree: m.Expr, env: Environment, around: float) -> None:
    def known(leaf: m.Expr) -> Range | None:
        if not isinstance(leaf, UNKNOWN) or not isinstance(leaf.type, (Bool, Int, Real)):
            return None
        value = evaluate(leaf, env)
        return (value - around, value + around) if not isinstance(leaf.type, Bool) else (0, 1)

    try:
        value = evaluate(tree, env)
        low, high = range_of(tree, known)
    except (ZeroDivisionError, OverflowError, ValueError):
        return
    assert math.isnan(value) or low <= value <= high


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("abs(count)", (0, math.inf)),
        ("clamp(tolerance, 1[m], 2[m]) + 1[m]", (2.0, 3.0)),
        ("-hypot(tolerance, 3[m])", (-math.inf, -3.0)),
        ("norm(p) >= 0[m]", (True, True)),
        ("norm(p) < 0[m] and x.c.go", (False, False)),
        ("count if abs(tolerance) < 0[m] else 1", (1, 1)),
        ("x.c.go", (False, True)),
        ("not x.c.go", (False, True)),
        ("not (x.c.go and abs(count) < 0)", (True, True)),
        ("2 if not fresh(x.c.go) else 1", (1, 2)),
        (f"late(x.c.n) + {BIG + 3}", (BIG + 3, math.inf)),
        (f"len(seen) + {BIG + 3}", (BIG + 3, math.inf)),
        (f"{BIG + 1} * 1.0", (float(BIG), float(BIG))),
        (f"{BIG + 1} / 3", ((BIG + 1) / 3, (BIG + 1) / 3)),
        (f"max({BIG + 1}, ratio)", (float(BIG), math.inf)),
        (f"{HUGE} + count if count > {HUGE} else 1", (-math.inf, math.inf)),
        (f"min(count, {HUGE})", (-math.inf, math.inf)),
    ],
)
def test_what_is_known_of_operations_is_put_together(text: str, expected: Range) -> None:
    tree = expression(text, SCOPE)
    assert range_of(tree, lambda leaf: None) == expected
