"""Whether types fit: unification, and how a mismatch is told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from specc.lang.errors import Scope
from specc.model.expr import Builtin, Expr, Number, source_name
from specc.model.types import (
    Bool,
    Frame,
    Int,
    ListOf,
    OptionalOf,
    PartialOf,
    Pose,
    Real,
    Spatial,
    Type,
    Vector,
)
from specc.model.units import DIMENSIONLESS, RADIAN, Unit

# Frame variables in the types of an operator's signature: binding them and filling them in.


Bindings = dict[Frame, Frame]
"""Frame variable, with its question mark -> actual frame."""


def unify(pattern: Type, actual: Type, bindings: Bindings) -> bool:
    """Whether `actual` is `pattern` for some frames; binds them. On False, nothing is bound."""
    if pattern == actual and not has_variables(pattern):
        return True
    if isinstance(pattern, Vector) and isinstance(actual, Vector) and not pattern.frame:
        return pattern == replace(actual, frame="")
    if isinstance(pattern, (OptionalOf, PartialOf)):
        value = actual.value if type(actual) is type(pattern) else actual
        return unify(pattern.value, value, bindings)
    trial = dict(bindings)
    if not _same_shape(pattern, actual):
        return False
    pairs = zip(pattern.frames, actual.frames, strict=True)
    for wanted, frame in pairs:
        if wanted.startswith("?"):
            wanted = trial.setdefault(wanted, frame)
        if wanted != frame:
            return False
    bindings |= trial
    return True


def substitute(type: Type, bindings: Mapping[Frame, Frame]) -> Type:
    """The type with frames replaced wherever `bindings` has them."""
    return type.framed(lambda frame: bindings.get(frame, frame))


def has_variables(type: Type) -> bool:
    """Whether a type still names a frame variable."""
    return any(frame.startswith("?") for frame in type.frames)


def _same_shape(pattern: Type, actual: Type) -> bool:
    """Whether two types differ in their frames at most, or in that a list is never empty."""
    if isinstance(pattern, ListOf) and isinstance(actual, ListOf):
        enough = actual.nonempty or not pattern.nonempty
        return enough and _same_shape(pattern.element, actual.element)
    if isinstance(pattern, OptionalOf) and isinstance(actual, OptionalOf):
        return _same_shape(pattern.value, actual.value)
    return pattern.framed(_any_frame) == actual.framed(_any_frame)


def _any_frame(frame: Frame) -> Frame:
    return frame and "?"


# When a type serves where another is expected, and what helps when it does not.


def fits(actual: Type, expected: Type) -> bool:
    """Whether a value of type `actual` may stand where `expected` is expected."""
    if isinstance(expected, (OptionalOf, PartialOf)) and type(actual) is not type(expected):
        return fits(actual, expected.value)
    if isinstance(expected, ListOf) and actual == ListOf(expected.element, nonempty=True):
        return True
    if isinstance(actual, Vector) and isinstance(expected, Vector) and not expected.frame:
        return replace(actual, frame="") == expected
    return actual == expected or (isinstance(actual, Int) and expected == Real())


def scalar_unit(type: Type) -> Unit | None:
    """The unit of a number, also of an integer; None for anything that is not one number."""
    if isinstance(type, Real):
        return type.unit
    return DIMENSIONLESS if isinstance(type, Int) else None


def mismatch_help(expr: Expr, expected: Type, text: str, scope: Scope) -> str:
    """A help line for an expression that is not of the expected type; "" if none is obvious."""
    return (
        _unit_help(expr, expected, text)
        or _pose_help(expr, expected, text, scope)
        or _shape_help(expr, expected)
        or _operator_help(expr.type, expected, text, scope)
    )


def missing_unit(expr: Expr, expected: Type, text: str) -> str:
    """What helps a bare number where a number with a unit is expected; "" for anything else."""
    wanted = scalar_unit(expected)
    is_bare = isinstance(expr, Number) and scalar_unit(expr.type) == DIMENSIONLESS
    is_missing = is_bare and wanted not in (None, DIMENSIONLESS)
    return f"a number carries its unit: `{text}[{wanted}]`" if is_missing else ""


def _unit_help(expr: Expr, expected: Type, text: str) -> str:
    actual, wanted = scalar_unit(expr.type), scalar_unit(expected)
    if actual is None or wanted is None:
        return ""
    if missing := missing_unit(expr, expected, text):
        return missing
    for by, verb in ((RADIAN, "divide"), (RADIAN**-1, "multiply")):
        if actual == wanted * by:
            return f"an angle is not a plain number; {verb} it by `1[rad]` if it is meant as one"
    if isinstance(expected, Int):
        return "an `int` comes from whole numbers, `len(...)`, `floor(...)` and `round(...)`"
    return ""


def _pose_help(expr: Expr, expected: Type, text: str, scope: Scope) -> str:
    """Turn a pose round, or go on from it with a named pose."""
    actual = expr.type
    if not isinstance(actual, Pose) or not isinstance(expected, Pose):
        return ""
    if expected == Pose(actual.child, actual.parent):
        inside = text.removeprefix("inverse(").removesuffix(")")
        is_inverse = isinstance(expr, Builtin) and text.startswith("inverse(")
        turned = inside if is_inverse else f"inverse({text})"
        return f"`{turned}` is `{expected}`"
    if expected.parent != actual.parent:
        return ""
    for name, type in scope.values():
        if type == Pose(actual.child, expected.child):
            return f"`{text} @ {name}` is `{expected}`"
        if type == Pose(expected.child, actual.child):
            return f"`{text} @ inverse({name})` is `{expected}`"
    return ""


def _shape_help(expr: Expr, expected: Type) -> str:
    if isinstance(expected, Bool):
        return "a condition is a comparison, `fresh(...)`, `present(...)` or a `bool`"
    if isinstance(expected, ListOf) and expected.element == expr.type:
        return "a list of one item is written `[item]`"
    if isinstance(expr, Number) and isinstance(expected, (Vector, Spatial)):
        return "a vector is written with all its components, e.g. `[0, 0, 0]`"
    return ""


def _operator_help(actual: Type, expected: Type, text: str, scope: Scope) -> str:
    """An operator that takes the one type to the other, if there is just one."""
    found = []
    for operator in scope.operators.values():
        if len(operator.parameters) != 1:
            continue
        bindings: dict[str, str] = {}
        is_taken = unify(operator.parameters[0][1], actual, bindings)
        if is_taken and substitute(operator.result, bindings) == expected:
            found.append(source_name(operator.name))
    return f"`{found[0]}({text})` is `{expected}`" if len(found) == 1 and actual != expected else ""
