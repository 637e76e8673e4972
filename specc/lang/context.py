"""The context of typing one expression: scope, expected types, and the errors of a mismatch."""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from specc.lang.errors import ExprError, ExprErrors, Origin, Scope, alternatives, collect, origins
from specc.lang.parse import span
from specc.model.expr import (
    FRAMELESS,
    INVERSE,
    Builtin,
    Expr,
    Items,
    Nothing,
    Number,
    TextLiteral,
    Unknown,
    Unwrap,
    source_name,
)
from specc.model.types import (
    Bool,
    Enum,
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
    """A help text for a bare number where a unit is expected; "" for anything else."""
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
    """A help text that inverts the pose or composes it with a named pose.

    Empty if neither helps.
    """
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


# What may not be there, optional values and items of lists, where there has to be one.


def is_none(node: ast.expr) -> bool:
    """Whether a node is the constant `None`."""
    return isinstance(node, ast.Constant) and node.value is None


def unwrap_list(expr: Expr) -> Expr:
    """Mark a possibly empty list as one that must have an item; anything else is unchanged."""
    if isinstance(expr.type, ListOf) and not expr.type.nonempty and not isinstance(expr, Items):
        return Unwrap(expr, type=ListOf(expr.type.element, nonempty=True), span=expr.span)
    return expr


def with_item_if_needed(expr: Expr, expected: Type) -> Expr:
    """The expression, marked by `unwrap_list` if `expected` is a list with an item."""
    return unwrap_list(expr) if isinstance(expected, ListOf) and expected.nonempty else expr


# What the typing rules share: the scope, the text, and how they fail and go on.


SyntaxRule = Callable[["Context", ast.expr, "Type | None"], Expr]
"""Types one kind of syntax. The type is a hint for literals; whether it fits is checked outside."""

T = TypeVar("T")

_MAX_QUOTED = 40


@dataclass(frozen=True, slots=True)
class Context:
    """One expression being typed. `rules` has a rule for every kind of syntax in the language."""

    scope: Scope
    text: str
    rules: Mapping[type[ast.expr], SyntaxRule]
    reserved: Collection[str]
    """Names of the language."""
    errors: list[ExprError]
    """What was found wrong where the typing could go on."""

    def infer(self, node: ast.expr, hint: Type | None = None) -> Expr:
        """Infer the typed expression; literals take the hinted type if they can.

        Where nothing else is hinted, all of its value has to be there.
        """
        return self.require_complete(node, self.infer_any(node, hint), hint)

    def infer_any(self, node: ast.expr, hint: Type | None = None) -> Expr:
        """Infer the typed expression, also of None or of one with missing components."""
        if isinstance(hint, OptionalOf) and not isinstance(node, ast.IfExp) and not is_none(node):
            hint = hint.value
        if isinstance(hint, PartialOf) and not isinstance(node, (ast.IfExp, ast.List)):
            hint = hint.value
        return self.rules[type(node)](self, node, hint)

    def require_complete(self, node: ast.expr, expr: Expr, wanted: Type | None) -> Expr:
        """An expression that is there, with all components, unless less is wanted."""
        can_unwrap = not isinstance(wanted, OptionalOf) and not isinstance(expr, Nothing)
        if can_unwrap and isinstance(expr.type, OptionalOf):
            expr = Unwrap(expr, type=expr.type.value, span=expr.span)
        if isinstance(expr.type, PartialOf) and not isinstance(wanted, (OptionalOf, PartialOf)):
            message = f"`{self.quote(node)}` is `{expr.type}`, which may lack components"
            raise self.error(node, message, code="E0321").with_origins(self.origins(expr))
        return expr

    def expect(self, node: ast.expr, expected: Type | None) -> Expr:
        """Infer the typed expression and require the expected type, if there is one."""
        if expected is None:
            return self.infer_any(node)
        expr = with_item_if_needed(self.infer(node, expected), expected)
        if fits(expr.type, expected):
            return expr
        message = f"`{self.quote(node)}` is `{expr.type}`; expected `{expected}`"
        help = mismatch_help(expr, expected, self.quote(node), self.scope)
        if is_none(node):
            message, help = (
                f"`None` is not a `{expected}`",
                f"what may be `None` is `optional[{expected}]`",
            )
        raise self.error(node, message, help).with_origins(self.origins(expr), expected)

    def truth(self, node: ast.expr) -> Expr:
        """Infer the typed condition; one with an error in it becomes an unknown truth value."""
        try:
            return self.expect(node, Bool())
        except ExprErrors as failure:
            return self.unknown(node, Bool(), failure)

    def unknown(self, node: ast.expr, type: Type, failure: ExprErrors) -> Expr:
        """A value of a type that is certain although something inside has an error."""
        self.errors.extend(failure.errors)
        start, end = span(node)
        return Unknown(self.text[start:end], type=type, span=(start, end))

    def with_scope(self, scope: Scope) -> Context:
        """A copy of the context with another scope."""
        return replace(self, scope=scope)

    def quote(self, node: ast.expr) -> str:
        """The text of a node as it was written, on one line and shortened."""
        start, end = span(node)
        words = " ".join(self.text[start:end].split())
        return words if len(words) <= _MAX_QUOTED else words[: _MAX_QUOTED - 3] + "..."

    def origins(self, *exprs: Expr) -> list[Origin]:
        """The declarations that gave expressions their types."""
        return [origin for expr in exprs for origin in origins(expr, self.scope)]

    def error(
        self, node: ast.expr | ast.keyword, message: str, help: str = "", code: str = "E0310"
    ) -> ExprError:
        """Make an `ExprError` about a node, which the caller raises."""
        return ExprError(message, *span(node), help, code)


# Expressions that share a type: a literal takes it from a side that has one of its own.


Side = tuple[ast.expr, Expr]
"""An expression as it is written and as it is typed."""


def infer_same_type(
    ctx: Context, nodes: Sequence[ast.expr], hint: Type | None = None, *, optional: bool = False
) -> list[Expr]:
    """Infer expressions of one type; those without a type take that of the nearest other.

    They have to have a value unless they may be `optional`.
    """
    infer = ctx.infer_any if optional else ctx.infer
    typed = [i for i, node in enumerate(nodes) if not needs_context(node, ctx.scope)]
    if not typed:
        return collect(*(partial(infer, node, hint) for node in nodes))
    own = collect(*(partial(infer, nodes[i], hint) for i in typed))
    found = dict(zip(typed, own, strict=True))
    _prefer_members(ctx, nodes, found)

    allowed = hint.value if isinstance(hint, OptionalOf) else hint

    def nearest_type(index: int) -> Type:
        if isinstance(allowed, PartialOf):
            return allowed
        return found[min(typed, key=lambda i: abs(i - index))].type

    rest = [i for i in range(len(nodes)) if i not in found]
    jobs = [partial(ctx.infer, nodes[i], nearest_type(i)) for i in rest]
    found |= zip(rest, collect(*jobs), strict=True)
    return [found[i] for i in range(len(nodes))]


def _prefer_members(ctx: Context, nodes: Sequence[ast.expr], found: dict[int, Expr]) -> None:
    """Retype a name of both a value and a member as the member beside a value of that enum."""
    for index in found:
        node = nodes[index]
        if not isinstance(node, ast.Name) or node.id not in ctx.scope.enums:
            continue
        beside = [expr.type for other, expr in found.items() if other != index]
        enums = [t for t in beside if isinstance(t, Enum) and node.id in t.members]
        if enums:
            found[index] = ctx.infer(node, enums[0])


UNNAMED = "_"
"""The frame between two poses neither of which gives it a name."""


def needs_context(node: ast.expr, scope: Scope) -> bool:
    """Whether the type of an expression depends on where it stands."""
    match node:
        case ast.Constant(value=value):
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
            return value is None or is_number
        case ast.Name(id=name):
            # What is no value may be a member of an enum, also of one that has no name.
            return name == "_" or not scope.has(name)
        case ast.List():
            return True
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return needs_context(operand, scope)
        case ast.IfExp(body=body, orelse=orelse):
            return needs_context(body, scope) and needs_context(orelse, scope)
        case ast.BinOp(op=ast.Add() | ast.Sub() | ast.MatMult(), left=left, right=right):
            return needs_context(left, scope) and needs_context(right, scope)
        case ast.Call(func=ast.Name(id=name), args=[argument]) if name == INVERSE:
            return needs_context(argument, scope)
        case ast.Call(func=ast.Name(id=name)):
            return name in FRAMELESS and name not in scope.operators
    return False


def mismatch(ctx: Context, left: Side, right: Side, verdict: str) -> ExprError:
    """Make the error of two expressions whose types do not match."""
    sides = [f"`{ctx.quote(node)}` is `{expr.type}`" for node, expr in (left, right)]
    a, b = left[1].type, right[1].type
    help, code = "", "E0313"
    if scalar_unit(a) is not None and scalar_unit(b) is not None:
        code = "E0311"
        help = missing_unit(left[1], b, ctx.quote(left[0]))
        help = help or missing_unit(right[1], a, ctx.quote(right[0]))
    elif isinstance(a, (Spatial, Pose)) and type(a) is type(b):
        code, help = "E0312", "express both in the same frames first"
        help = "poses are composed with `@`" if isinstance(a, Pose) and a == b else help
    elif isinstance(a, Vector) and isinstance(b, Vector) and (a.frame or b.frame):
        code, help = _point_mismatch(a, b)
    else:
        help = _member_help(left[1], b) or _member_help(right[1], a)
    start, end = span(left[0])[0], span(right[0])[1]
    error = ExprError(f"{sides[0]} and {sides[1]}: they {verdict}", start, end, help, code)
    return error.with_origins(ctx.origins(left[1], right[1]))


def _point_mismatch(a: Vector, b: Vector) -> tuple[str, str]:
    """The code and the help of a mismatch of two vectors, at least one of them a point."""
    if a.frame == b.frame:
        return "E0313", "the point between them is `p + (q - p) / 2`"
    if a.frame and b.frame:
        return "E0312", f"`X @ p` is a `{a}` if `X` is a `{Pose(a.frame, b.frame)}`"
    return (
        "E0313",
        f"a `{replace(a, frame='')}` has no frame; declare it as a `{a if a.frame else b}`",
    )


def _member_help(side: Expr, other: Type) -> str:
    if isinstance(side, TextLiteral) and isinstance(other, Enum):
        return f"members are written without quotes: {alternatives(other.members)}"
    return ""
