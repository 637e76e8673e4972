"""Expressions that are in order, and the types that they have."""

from dataclasses import replace

from specc.lang import expression, parse_type, show
from specc.model import expr as m
from specc.model.types import Enum, Int, ListOf, Pose, Real, Vector
from tests.strategies import MODE, NAMES, SCOPE

TYPES = [
    ("1", "int"),
    ("1.5", "real"),
    ("1 / 2", "real"),
    ("count + 1", "int"),
    ("count ** 2 - count * 3", "int"),
    ("count ** -1", "real"),
    ("ratio + 1", "real"),
    ("ratio * count", "real"),
    ("0.02[m/s] * elapsed", "real[m]"),
    ("tolerance ** 2 / tolerance", "real[m]"),
    ("sqrt(tolerance) ** 2", "real[m]"),
    ("1[N] * 1[m]", "real[N*m]"),
    ("turn_limit / 1[rad]", "real"),
    ("30[deg]", "real[rad]"),
    ("pi / 2", "real[rad]"),
    ("sin(turn_limit) + cos(30[deg])", "real"),
    ("atan2(x.c.d_d, tolerance)", "real[rad]"),
    ("clamp(x.c.d_d, -0.1[m], tolerance)", "real[m]"),
    ("clamp(3, 0, 1.5)", "real"),
    ("clamp(3, 0, 2)", "int"),
    ("hypot(x.c.d_d, tolerance)", "real[m]"),
    ("hypot(3, 4)", "real"),
    ("sign(x.c.d_d)", "int"),
    ("floor(x.c.d_d / 1[mm]) + round(0.5)", "int"),
    ("wrap_angle(2 * turn_limit)", "real[rad]"),
    ("2 * p / elapsed", "vector[3, m/s]"),
    ("F_c * period", "spatial[E, kg*m/s, kg*m**2/s]"),
    ("F_c.z", "real[N]"),
    ("F_c[5]", "real[N*m]"),
    ("x.c.b[1]", "Mode"),
    ("x.c.b.az", "Mode"),
    ("x.c.T_d @ X_EO", "pose[B, O]"),
    ("X_KB @ T_c @ X_EO", "pose[K, O]"),
    ("X_KB @ rotation([0, 1, 0], 0) @ X_EO", "pose[K, O]"),
    ("inverse(X_KB @ T_c)", "pose[E, K]"),
    ("position(T_c) + p", "point[B]"),
    ("position(T_c) - [0, 0, 1[mm]]", "point[B]"),
    ("position(T_c) - position(x.c.T_d)", "vector[3, m]"),
    ("X_KB @ position(T_c)", "point[K]"),
    ("X_EO @ [0, 0, 1[m]]", "point[E]"),
    ("2 * position(T_c)", "vector[3, m]"),
    ("distances[0]", "real[m]"),
    ("distances[1:]", "list[real[m]]"),
    ("distances + [tolerance]", "nonempty[real[m]]"),
    ("[] + distances[2:] + distances", "list[real[m]]"),
    ("norm(position(T_c))", "real[m]"),
    ("position(T_c) if entered else p", "vector[3, m]"),
    ("near(position(T_c), [0, 0, 1[m]], tolerance)", "bool"),
    ("chain(X_KB, T_c)", "pose[K, E]"),
    ("chain(T_c, chain(X_EO, inverse(X_EO)))", "pose[B, E]"),
    ("best.mode", "Mode"),
    ("[0, 1[rad], 0]", "vector[3, rad]"),
    ("[u, x.c.mode]", "vector[2, Mode]"),
    ("[0, 1.5, 2]", "vector[3]"),
    ("[entered, True]", "vector[2, bool]"),
    ("[best, best]", "nonempty[Reading]"),
    ("x.c.b == [u, u, g, u, u, u]", "bool"),
    ("0 < x.c.d_d <= 1[m]", "bool"),
    ("x.c.n == 3 or 0 == x.c.n", "bool"),
    ("'a' != 'b'", "bool"),
    ("entered == x.c.go", "bool"),
    ("near(0, x.c.d_d, tolerance)", "bool"),
    ("near(p, [0, 0, 1[m]], tolerance)", "bool"),
    ("near(T_c, inverse(X_KB) @ X_KB @ T_c, 1[mm], 1[deg])", "bool"),
    ("all(all(v == w for w in x.c.b) for v in x.c.b)", "bool"),
    ("min(0, x.c.d_d, tolerance)", "real[m]"),
    ("abs(-x.c.n)", "int"),
    ("0 if entered else x.c.d_d", "real[m]"),
    ("x.c.n if entered else 1.5", "real"),
]


def test_types() -> None:
    for text, type in TYPES:
        assert expression(text, SCOPE).type == parse_type(type, NAMES), text


EXPECTED = [
    ("0", "real[m]"),
    ("-0", "real[N]"),
    ("3", "real"),
    ("len(seen)", "real"),
    ("[]", "list[Reading]"),
    ("[_, 0, 1]", "partial[vector[3]]"),
    ("[0, 0, 1[N], 0, 0, _]", "partial[wrench[E]]"),
    ("[_, 0, 1[N]] if entered else push", "partial[vector[3, N]]"),
    ("[1[N], 0, 0] if entered else [_, 0, 1[N]]", "partial[vector[3, N]]"),
    ("F_c if entered else [_, _, _, _, _, _]", "partial[wrench[E]]"),
    ("[len(seen), 0]", "vector[2]"),
    ("identity()", "pose[B, K]"),
    ("inverse(identity())", "pose[B, K]"),
    ("T_c @ translation(0, 0, 0.1[m])", "pose[B, E]"),
    ("T_c @ translation(0, 0, 0.1[m])", "pose[B, O]"),
    ("translation(0, 0, 0.1[m]) @ T_c", "pose[K, E]"),
    ("rotation([0, 0, 1], 90[deg])", "pose[B, K]"),
    ("rotation(p / norm(p), elapsed / 1[s] * 1[rad])", "pose[B, K]"),
    ("rpy(0, pi / 2, 0)", "pose[B, K]"),
    ("translation(0, 0, 0.1[m]) @ rotation([0, 0, 1], 90[deg])", "pose[B, E]"),
    ("translation(0, 0, 0.1[m]) @ rpy(0, 0, pi) @ translation(1[m], 0, 0)", "pose[B, E]"),
    ("translation(0, 0, 0.1[m]) @ inverse(rpy(0, 0, pi))", "pose[B, E]"),
    ("inverse(translation(0, 0, 0.1[m]) @ rpy(0, 0, pi))", "pose[B, E]"),
    ("X_KB @ translation(0, 0, 0.1[m]) @ rpy(0, 0, pi)", "pose[K, E]"),
    ("X_KB @ translation(0, 0, 0.1[m]) @ rpy(0, 0, pi) @ X_EO", "pose[K, O]"),
    ("translation(0, 0, 0.1[m]) @ X_KB @ rpy(0, 0, pi)", "pose[E, O]"),
    ("translation(0, 0, 0.1[m]) @ (X_KB @ rpy(0, 0, pi))", "pose[E, O]"),
    ("rpy(0, 0, pi) @ (identity() if entered else T_c)", "pose[K, E]"),
    ("translation(0, 0, 0.1[m]) @ rpy(0, 0, pi) @ position(X_EO)", "point[B]"),
    ("near(T_c, translation(0, 0, 0.1[m]) @ rpy(0, 0, pi), 1[mm], 1[deg])", "bool"),
    ("chain(T_c, translation(0, 0, 0.1[m]) @ rpy(0, 0, pi))", "pose[B, K]"),
    ("pose([0, 0, 1[m]], [0, 0, 0, 1]) if entered else x.c.T_d", "pose[B, E]"),
    ("T_c @ identity() if entered else T_c @ X_EO", "pose[B, O]"),
    ("chain(T_c, identity())", "pose[B, K]"),
    ("open", "enum[open, closed]"),
    ("[1[m] + 0, 0 - 0, -(0 + 0)]", "vector[3, m]"),
]


def test_the_expected_type_is_pushed_inwards() -> None:
    for text, type in EXPECTED:
        expected = parse_type(type, NAMES)
        found = expression(text, SCOPE, expected).type
        assert found == expected or (isinstance(found, Int) and expected == Real()), text


def test_numbers_are_in_si() -> None:
    assert expression("1.1[mm]", SCOPE) == m.Number(0.0011, type=parse_type("real[m]", NAMES))
    assert expression("-2", SCOPE) == m.Number(-2, type=Int())
    assert expression("0", SCOPE, Real()) == m.Number(0.0, type=Real())


def test_a_chain_is_its_comparisons_and_no_member_of_is_a_negation() -> None:
    chain = expression("0 < count < 3", SCOPE)
    assert isinstance(chain, m.Logic)
    assert [show(link) for link in chain.operands] == ["0 < count", "count < 3"]
    negated = expression("x.c.mode not in {u}", SCOPE)
    assert isinstance(negated, m.Unary)
    assert isinstance(negated.operand, m.IsOneOf)


def test_equality_of_trees_ignores_where_they_stand() -> None:
    assert expression("ratio+ratio", SCOPE) == expression("  ratio  +  ratio", SCOPE)


def test_a_member_of_several_enums_is_that_of_the_expected_one() -> None:
    gear = Enum("Gear", ("u", "high"))
    scope = replace(SCOPE, enums={**SCOPE.enums, "u": (MODE, gear)})
    assert expression("u", scope, gear).type == gear
    assert expression("x.c.mode == u", scope) == expression("x.c.mode == u", SCOPE)
    assert expression("[u, x.c.mode]", scope).type == Vector(2, MODE)


def test_a_file_and_a_value_of_one_name_are_told_apart_by_the_expected_type() -> None:
    scope = replace(SCOPE, files={"ratio": "ratio"})
    assert isinstance(expression("ratio", scope, parse_type("file", NAMES)), m.FileRef)
    assert isinstance(expression("ratio", scope, Real()), m.LetRef)
    assert isinstance(expression("arm", replace(SCOPE, files={"arm": "arm"})), m.FileRef)


def test_a_literal_takes_its_frames_from_the_other_arguments_of_a_call() -> None:
    tree = expression("chain(translation(1[m], 0, 0), T_c)", SCOPE, Pose("K", "E"))
    assert isinstance(tree, m.Call)
    assert tree.args[0].type == Pose("K", "B")


def test_walk_goes_through_every_part_parents_first() -> None:
    tree = expression("all(v == u for v in x.c.b) and widen(best.d, -ratio) < 1[m]", SCOPE)
    names = [type(node).__name__ for node in m.walk(tree)]
    assert names == [
        "Logic", "Quantifier", "Input", "Compare", "BoundVariable", "Member",
        "Compare", "Call", "FieldOf", "ConstantRef", "Unary", "LetRef", "Number",
    ]  # fmt: skip


def test_lists_keep_their_element_type() -> None:
    assert expression("[best]", SCOPE).type == ListOf(SCOPE.constants["best"].type, nonempty=True)
