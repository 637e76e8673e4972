"""What expressions mean: identities of logic and arithmetic, and values worked out by hand."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import strategies as st
from specc_runtime import builtins

from specc.lang import Environment, evaluate, expression, parse_type
from specc.lang.number_functions import wrap_angle
from specc.lang.values import angle, compose, inverse, pose, rotation, rpy, translation
from specc.model import expr as m
from specc.model.types import Bool, Pose
from tests.seeds import drawn
from tests.strategies import NAMES, SCOPE, Reading, conditions, environments, expressions, values

FEW, MANY = 8, 20
"""Examples of a random test, and of a long one."""
ARITHMETIC_FAULTS = (ZeroDivisionError, OverflowError, ValueError)


def outcome(tree: m.Expr, env: Environment) -> object:
    """The value, or the kind of arithmetic fault."""
    try:
        return evaluate(tree, env)
    except ARITHMETIC_FAULTS as fault:
        return type(fault)


def negated(tree: m.Expr) -> m.Expr:
    return m.Unary("not", tree, type=Bool())


def joined(op: str, *operands: m.Expr) -> m.Expr:
    return m.Logic(op, operands, type=Bool())


@drawn(conditions(2), conditions(2), environments(), few=FEW, many=MANY)
def test_de_morgan(a: m.Expr, b: m.Expr, env: Environment) -> None:
    left = negated(joined("and", a, b))
    right = joined("or", negated(a), negated(b))
    assert outcome(left, env) == outcome(right, env)


@drawn(conditions(2), conditions(2), environments(), few=FEW, many=MANY)
def test_a_choice_is_two_implications(a: m.Expr, b: m.Expr, env: Environment) -> None:
    choice = m.Choice(a, b, negated(b), type=Bool())
    as_logic = joined("or", joined("and", a, b), joined("and", negated(a), negated(b)))
    assert outcome(choice, env) == outcome(as_logic, env)


@drawn(conditions(2), environments(), few=FEW, many=MANY)
def test_all_is_not_any_not(body: m.Expr, env: Environment) -> None:
    over = m.Input("c", "b", type=SCOPE.inputs["c", "b"].type)
    every = m.Quantifier("all", "w", over, body, type=Bool())
    some = m.Quantifier("any", "w", over, negated(body), type=Bool())
    assert outcome(every, env) == outcome(negated(some), env)


@drawn(conditions(3), environments(), few=FEW, many=MANY)
def test_conditions_are_truth_values(tree: m.Expr, env: Environment) -> None:
    assert outcome(tree, env) in (True, False, *ARITHMETIC_FAULTS)


@drawn(expressions(SCOPE.lets["T_c"].type, 2), environments(), few=FEW, many=MANY)
def test_poses_stay_rigid(tree: m.Expr, env: Environment) -> None:
    X = evaluate(tree, env)
    back = compose(X, inverse(X))
    identity = translation(0.0, 0.0, 0.0)
    assert all(math.dist(a, b) < 1e-6 for a, b in zip(back, identity, strict=True))


@drawn(values(Pose("B", "E")), values(Pose("E", "K")), few=FEW, many=MANY)
def test_the_inverse_of_a_product_is_the_product_of_inverses(X: tuple, Y: tuple) -> None:
    one, other = inverse(compose(X, Y)), compose(inverse(Y), inverse(X))
    assert all(math.dist(a, b) < 1e-9 for a, b in zip(one, other, strict=True))


@drawn(st.floats(0.01, 3.1), values(Pose("B", "E")), few=FEW, many=MANY)
def test_near_poses_by_their_angle(turn: float, X: tuple) -> None:
    turned = compose(X, pose((0.0, 0.0, 0.0), (0.0, math.sin(turn / 2), 0.0, math.cos(turn / 2))))
    assert math.isclose(angle(X, turned), turn, rel_tol=1e-6, abs_tol=1e-6)


ENV = Environment(
    inputs={("c", "n"): 3, ("c", "b"): ("u", "g", "u", "u", "u", "u"), ("c", "d_d"): 0.5},
    fresh={("c", "b")},
    memory={"p": (3.0, 4.0, 12.0), "seen": (Reading(0.5, "u"), Reading(2.0, "s"))},
    lets={"ratio": 0.25, "distances": (1.0, 2.0), "F_c": (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)},
    constants={"best": Reading(0.5, "g"), "tolerance": 0.001},
    clock={"elapsed": 2.0, "period": 0.002, "entered": True},
    operators={"widen": lambda d, ratio: d * ratio},
)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("x.c.n / 2", 1.5),
        ("x.c.n ** 2 - x.c.n", 6),
        ("norm(p)", 13.0),
        ("p * 2 - p / ratio", (-6.0, -8.0, -24.0)),
        ("F_c.az + F_c[3]", 10.0),
        ("fresh(x.c.b) and not fresh(x.c.n)", True),
        ("present(x.c.n) and not present(x.c.go)", True),
        ("any(v == g for v in x.c.b)", True),
        ("all(v in {u} for v in x.c.b)", False),
        ("x.c.b[1] not in {u, c}", True),
        ("all(d > 0.5[m] for d in distances)", True),
        ("any(r.d > 1[m] and r.mode == s for r in seen)", True),
        ("len(seen) == 2", True),
        ("widen(best.d, ratio)", 0.125),
        ("near(best.d, 500[mm], tolerance)", True),
        ("near(p, [3[m], 4[m], 12.01[m]], tolerance)", False),
        ("near(x.c.d_d, 0, tolerance)", False),
        ("max(ratio, 0.5, -1) + abs(-ratio)", 0.75),
        ("sqrt(best.d * best.d)", 0.5),
        ("1 if elapsed > 1[s] and entered else 0", 1),
        ("-p", (-3.0, -4.0, -12.0)),
        ("-2 ** 2", -4),
        ("(best.mode == g) == entered", True),
    ],
)
def test_values(text: str, value: object) -> None:
    assert evaluate(expression(text, SCOPE), ENV) == value


def test_a_missing_component_is_nan_in_python() -> None:
    partial = parse_type("partial[vector[3, m]]", NAMES)
    missing, *there = evaluate(expression("[_, 1[m], 0]", SCOPE, partial), ENV)
    assert math.isnan(missing)
    assert there == [1.0, 0.0]


def test_and_or_and_choices_evaluate_no_more_than_they_need() -> None:
    for text in ("False and 1 / 0 > 1", "True or 1 / 0 > 1", "True if True else 1 / 0 > 1"):
        evaluate(expression(text, SCOPE), ENV)
    with pytest.raises(ZeroDivisionError):
        evaluate(expression("1 / 0 > 1", SCOPE), ENV)


def test_a_quaternion_is_normalised() -> None:
    X = pose((1.0, 2.0, 3.0), (0.0, 0.0, 3.0, 3.0))
    assert X[0] == pytest.approx((0.0, -1.0, 0.0, 1.0))
    assert X[1] == pytest.approx((1.0, 0.0, 0.0, 2.0))


angles = st.floats(-7.0, 7.0)
axes = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: math.hypot(*v) > 1e-3)


@drawn(axes, angles, angles, angles, few=FEW, many=MANY)
def test_rotations_are_those_of_generated_code(
    axis: tuple, roll: float, pitch: float, yaw: float
) -> None:
    turned = builtins.rotation(np.array(axis), roll)
    assert np.allclose(rotation(axis, roll), turned, rtol=0, atol=1e-12)
    assert np.allclose(rpy(roll, pitch, yaw), builtins.rpy(roll, pitch, yaw), rtol=0, atol=1e-12)
    assert rotation(axis, 0.0) == translation(0.0, 0.0, 0.0) == rpy(0.0, 0.0, 0.0)


def test_a_rotation_needs_an_axis() -> None:
    with pytest.raises(ValueError, match="no direction"):
        rotation((0.0, 0.0, 0.0), 1.0)


def test_functions_that_version_1_did_not_have_give_way_to_operators() -> None:
    scope = replace(SCOPE, operators={**SCOPE.operators, "sin": SCOPE.operators["chain"]})
    assert isinstance(expression("sin(X_KB, T_c)", scope), m.Call)
    named = replace(SCOPE, constants={**SCOPE.constants, "pi": SCOPE.lets["ratio"]})
    assert isinstance(expression("pi", named), m.ConstantRef)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("sin(pi / 6)", 0.5),
        ("cos(60[deg])", 0.5),
        ("atan2(1[m], -1[m]) / 1[rad]", 0.75 * math.pi),
        ("atan2(0, -1) - pi", 0.0),
    ],
)
def test_angles(text: str, value: float) -> None:
    assert evaluate(expression(text, SCOPE), Environment()) == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("clamp(3, -1, 2)", 2),
        ("clamp(-3[m], -1[m], 2[m])", -1.0),
        ("clamp(0.5, -1, 2)", 0.5),
        ("clamp(0, 2, 1)", 1),
        ("hypot(-3[m], 4[m])", 5.0),
        ("sign(-0.5[m])", -1),
        ("sign(-0.0)", 0),
        ("sign(3)", 1),
        ("floor(-0.5)", -1),
        ("floor(2.0)", 2),
        ("floor(7)", 7),
        ("round(0.5)", 0),
        ("round(1.5)", 2),
        ("round(-2.5)", -2),
        ("round(0.49999999999999994)", 0),
        ("wrap_angle(pi)", -math.pi),
        ("wrap_angle(-pi)", -math.pi),
        ("wrap_angle(3.1[rad])", 3.1),
        ("wrap_angle(2 * pi)", 0.0),
        ("wrap_angle(3 * pi)", -math.pi),
    ],
)
def test_numbers(text: str, value: float) -> None:
    found = evaluate(expression(text, SCOPE), Environment())
    assert found == value
    assert type(found) is type(value)


@drawn(
    st.one_of(st.floats(-1e4, 1e4), st.floats(allow_nan=False, allow_infinity=False)),
    few=FEW,
    many=MANY,
)
def test_an_angle_keeps_its_direction_exactly(angle_rad: float) -> None:
    wrapped = wrap_angle(angle_rad)
    assert -math.pi <= wrapped < math.pi
    assert wrap_angle(wrapped) == wrapped == builtins.wrap_angle(angle_rad)
    assert (Fraction(angle_rad) - Fraction(wrapped)) % Fraction(math.tau) == 0
