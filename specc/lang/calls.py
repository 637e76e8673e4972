"""Types of calls: operators and builtins."""

from __future__ import annotations

import ast
from collections.abc import Callable
from fractions import Fraction

from specc.diagnostics.nearest import nearest
from specc.lang.alike import built, infer_alike, needs_context, take, unlike
from specc.lang.context import Context, served
from specc.lang.errors import FOR_WANT_OF_CONTEXT, ExprError, ExprErrors, Origin, one_of
from specc.lang.logic import extreme, quantifier
from specc.lang.mismatch import (
    Bindings,
    fits,
    frames_of,
    has_variables,
    scalar_unit,
    substitute,
    unify,
    way_out,
)
from specc.lang.names import input_element
from specc.lang.parse import span
from specc.model.expr import Call, Expr, Fresh, Present, Unknown
from specc.model.system import Operator
from specc.model.types import Bool, Int, ListOf, Pose, Real, Spatial, Type, Vector
from specc.model.units import DIMENSIONLESS, METRE, RADIAN

# Typing rules of the functions that build poses and take them apart.


_TOLERANCES = "near(X, Y, position_tolerance, rotation_tolerance)"


def near_poses(ctx: Context, node: ast.Call, a: Expr, b: Expr) -> Expr:
    """`near` of two poses in the same frames: a distance and an angle as tolerances."""
    if a.type != b.type:
        raise unlike(ctx, (node.args[0], a), (node.args[1], b), "cannot be near")
    take(ctx, node, _TOLERANCES, 4)
    position, rotation = ctx.each(
        lambda: ctx.expect(node.args[2], Real(METRE)),
        lambda: ctx.expect(node.args[3], Real(RADIAN)),
    )
    return built(node, Bool(), a, b, position, rotation)


def _inverse(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "inverse(X)", 1)
    inner = Pose(hint.child, hint.parent) if isinstance(hint, Pose) else None
    value = ctx.infer(node.args[0], inner)
    if isinstance(value.type, Pose):
        return built(node, Pose(value.type.child, value.type.parent), value)
    raise _no_pose(ctx, node, value)


def _position(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "position(X)", 1)
    value = ctx.infer(node.args[0])
    if isinstance(value.type, Pose):
        return built(node, Vector(3, Real(METRE)), value)
    raise _no_pose(ctx, node, value)


def _no_pose(ctx: Context, node: ast.Call, value: Expr) -> ExprError:
    message = (
        f"`{ctx.quote(node.args[0])}` is `{value.type}`; `{ctx.quote(node.func)}` takes a pose"
    )
    return ctx.error(node.args[0], message, code="E0315").because(ctx.origins(value))


def _identity(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "identity()", 0)
    return built(node, _frames(ctx, node, hint))


def _translation(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "translation(x, y, z)", 3)
    x, y, z = node.args
    parts = ctx.each(
        lambda: ctx.expect(x, Real(METRE)),
        lambda: ctx.expect(y, Real(METRE)),
        lambda: ctx.expect(z, Real(METRE)),
    )
    return built(node, _frames(ctx, node, hint), *parts)


def _pose(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """Position and unit quaternion (x, y, z, w); the evaluation normalises it."""
    take(ctx, node, "pose(position, quaternion_xyzw)", 2)
    parts = ctx.each(
        lambda: ctx.expect(node.args[0], Vector(3, Real(METRE))),
        lambda: ctx.expect(node.args[1], Vector(4, Real())),
    )
    return built(node, _frames(ctx, node, hint), *parts)


def _frames(ctx: Context, node: ast.Call, hint: Type | None) -> Pose:
    if isinstance(hint, Pose):
        return hint
    if hint is not None:
        message = f"`{ctx.quote(node)}` is a pose; expected `{hint}`"
        raise ExprError(message, *span(node))
    help = "declare it as a memory element of a pose type, which gives its frames"
    message = f"the frames of `{ctx.quote(node)}` are not known here"
    raise ctx.error(node, message, help, "E0317")


POSE_BUILTINS = {
    "inverse": _inverse,
    "position": _position,
    "identity": _identity,
    "translation": _translation,
    "pose": _pose,
}


# The functions of the language itself: how each is typed. Numbers, vectors and buffers here.


BuiltinRule = Callable[[Context, ast.Call, "Type | None"], Expr]


def _fresh(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "fresh(x.peer.element)", 1)
    return Fresh(input_element(ctx, node.args[0]), type=Bool(), span=span(node))


def _present(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "present(x.peer.element)", 1)
    return Present(input_element(ctx, node.args[0]), type=Bool(), span=span(node))


def _near(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """Numbers and vectors with one tolerance in their unit, poses with two."""
    take(ctx, node, "near(a, b, tolerance)", 3, 4)
    a, b = infer_alike(ctx, node.args[:2])
    if isinstance(a.type, Pose) or isinstance(b.type, Pose):
        return near_poses(ctx, node, a, b)
    unit = _common_unit(a.type, b.type)
    if isinstance(a.type, Spatial) and a.type == b.type:
        message = f"`{ctx.quote(node.args[0])}` is `{a.type}`, whose components differ in unit"
        raise ctx.error(
            node, message, "compare them one by one: `near(a.z, b.z, tolerance)`", "E0315"
        )
    if unit is None and a.type == b.type:
        message = f"`{ctx.quote(node.args[0])}` is `{a.type}`"
        reads = "`near` compares numbers, vectors of `real` and poses"
        raise ctx.error(node, f"{message}; {reads}", "compare with `==`", "E0315")
    if unit is None:
        raise unlike(ctx, (node.args[0], a), (node.args[1], b), "cannot be near")
    take(ctx, node, "near(a, b, tolerance)", 3)
    return built(node, Bool(), a, b, ctx.expect(node.args[2], unit))


def _common_unit(a: Type, b: Type) -> Real | None:
    """The type of the tolerance when two numbers or two vectors are compared."""
    if isinstance(a, Vector) and a == b:
        return a.element if isinstance(a.element, Real) else None
    unit = scalar_unit(a)
    return Real(unit) if unit is not None and unit == scalar_unit(b) else None


def _len(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "len(list)", 1)
    value = ctx.infer(node.args[0])
    if isinstance(value.type, ListOf):
        return built(node, Int(), value)
    help = f"its length is always {value.type.size}" if isinstance(value.type, Vector) else ""
    message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `len` counts the items of a list"
    raise ctx.error(node.args[0], message, help, "E0315").because(ctx.origins(value))


def _norm(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "norm(vector)", 1)
    value = ctx.infer(node.args[0])
    if isinstance(value.type, Vector) and isinstance(value.type.element, Real):
        return built(node, value.type.element, value)
    message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `norm` takes a vector of reals"
    raise ctx.error(node.args[0], message, code="E0315").because(ctx.origins(value))


def _abs(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "abs(a)", 1)
    value = ctx.infer(node.args[0])
    if scalar_unit(value.type) is not None:
        return built(node, value.type, value)
    message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `abs` takes a number"
    error = ctx.error(node.args[0], message, "the length of a vector is `norm(v)`", "E0315")
    raise error.because(ctx.origins(value))


def _sqrt(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    take(ctx, node, "sqrt(a)", 1)
    value = ctx.infer(node.args[0], Real())
    unit = scalar_unit(value.type)
    if unit is not None:
        return built(node, Real(unit ** Fraction(1, 2)), value)
    message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `sqrt` takes a number"
    raise ctx.error(node.args[0], message, code="E0315").because(ctx.origins(value))


def _extreme(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """`min` and `max` of two or more numbers of one unit."""
    take(ctx, node, f"{ctx.quote(node.func)}(a, b)", 2, None)
    values = infer_alike(ctx, node.args, hint)
    unit = scalar_unit(values[0].type)
    for arg, value in zip(node.args, values, strict=True):
        if unit is None or scalar_unit(value.type) != unit:
            raise unlike(ctx, (node.args[0], values[0]), (arg, value), "have no order")
    whole = all(isinstance(value.type, Int) for value in values)
    return built(node, Int() if whole else Real(unit or DIMENSIONLESS), *values)


BUILTINS: dict[str, BuiltinRule] = {
    "all": quantifier,
    "any": quantifier,
    "argmax": extreme,
    "argmin": extreme,
    "fresh": _fresh,
    "present": _present,
    "near": _near,
    "len": _len,
    "norm": _norm,
    "abs": _abs,
    "sqrt": _sqrt,
    "min": _extreme,
    "max": _extreme,
    **POSE_BUILTINS,
}
"""Name -> typing rule."""


# Typing rules of calls: operators, whose frame variables are bound by their arguments.


def call(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """An operator or a function of the language, applied to arguments by position."""
    if not isinstance(node.func, ast.Name):
        message = f"`{ctx.quote(node.func)}` cannot be called"
        raise ctx.error(node.func, message, "operators have plain names", "E0302")
    if node.keywords:
        message = "arguments are given by position"
        raise ctx.error(node.keywords[0], message, "leave the name out", "E0302")
    name = node.func.id
    if name in BUILTINS:
        return BUILTINS[name](ctx, node, hint)
    operator = ctx.scope.operators.get(name)
    if operator is None:
        raise _unknown(ctx, node.func)
    return _Application(ctx, node, operator, hint).typed()


def _unknown(ctx: Context, func: ast.Name) -> ExprError:
    if ctx.scope.value(func.id):
        message = f"`{func.id}` is not an operator"
        return ctx.error(func, message, "a value is not called; leave the brackets out", "E0202")
    close = nearest(func.id, [*ctx.scope.operators, *BUILTINS])
    help = f"did you mean {one_of(close)}?" if close else "declare it under `operators:`"
    error = ctx.error(func, f"unknown operator `{func.id}`", help, "E0202").meant(func.id, close)
    message = f"operator `{func.id}` is not there yet"
    return error.not_there(message, "declare it under `operators:`", func.id, close)


class _Application:
    """One call of an operator. Arguments with a type of their own come first: they bind frames."""

    def __init__(self, ctx: Context, node: ast.Call, operator: Operator, hint: Type | None) -> None:
        self.ctx = ctx
        self.node = node
        self.operator = operator
        self.hint = hint
        self.bindings: Bindings = {}
        self.misfits = False

    def typed(self) -> Expr:
        parameters, args = self.operator.parameters, self.node.args
        if len(args) != len(parameters):
            raise ExprErrors([self._wrong_number(), *self._inner_errors()])
        order = sorted(range(len(args)), key=lambda i: needs_context(args[i], self.ctx.scope))
        found: dict[int, Expr] = {}
        errors: list[ExprError] = []
        for index in order:
            if errors and self._waits(args[index], parameters[index][1]):
                continue
            try:
                found[index] = self._argument(args[index], *parameters[index])
            except ExprErrors as failure:
                errors += failure.errors
        if errors:
            return self._failed(found, ExprErrors(errors))
        ordered = tuple(found[i] for i in range(len(args)))
        result = substitute(self.operator.result, self.bindings)
        return Call(self.operator.name, ordered, type=result, span=span(self.node))

    def _failed(self, found: dict[int, Expr], failure: ExprErrors) -> Expr:
        """A call of this operator was meant if each argument is wrong in itself, if at all."""
        result = substitute(self.operator.result, self.bindings)
        if self.misfits or has_variables(result):
            raise failure
        self.ctx.errors.extend(failure.errors)
        wanted = [substitute(pattern, self.bindings) for _, pattern in self.operator.parameters]
        unknown = (
            Unknown(self.ctx.quote(n), type=t, span=span(n))
            for n, t in zip(self.node.args, wanted, strict=True)
        )
        ordered = tuple(found.get(i, other) for i, other in enumerate(unknown))
        return Call(self.operator.name, ordered, type=result, span=span(self.node))

    def _inner_errors(self) -> list[ExprError]:
        """What is wrong with arguments wherever they belong."""
        found: list[ExprError] = []
        for node in self.node.args:
            try:
                self.ctx.infer_any(node)
            except ExprErrors as failure:
                found += (e for e in failure.errors if e.code not in FOR_WANT_OF_CONTEXT)
        return found

    def _waits(self, node: ast.expr, pattern: Type) -> bool:
        """Whether an argument has its frames from others; if those failed, it would fail too."""
        open_frames = has_variables(substitute(pattern, self.bindings))
        return open_frames and needs_context(node, self.ctx.scope)

    def _argument(self, node: ast.expr, name: str, pattern: Type) -> Expr:
        wanted = substitute(pattern, self.bindings)
        if self.hint is not None and self._waits(node, pattern):
            unify(self.operator.result, self.hint, self.bindings)
            wanted = substitute(pattern, self.bindings)
        expr = served(self._inferred(node, wanted), wanted)
        if fits(expr.type, wanted) or unify(wanted, expr.type, self.bindings):
            return expr
        self.misfits = True
        quoted = self.ctx.quote(node)
        message = f"`{quoted}` is `{expr.type}`; `{self.operator.name}` takes `{name}: {wanted}`"
        help = way_out(expr, wanted, quoted, self.ctx.scope) or self._bound_frames(pattern)
        taken = Origin(self.operator.place, f"`{self.operator.name}` takes `{name}: {pattern}`")
        error = self.ctx.error(node, message, help, "E0315")
        raise error.because([*self.ctx.origins(expr), taken])

    def _inferred(self, node: ast.expr, wanted: Type) -> Expr:
        hint = None if has_variables(wanted) else wanted
        return self.ctx.whole(node, self.ctx.infer_any(node, hint), wanted)

    def _bound_frames(self, pattern: Type) -> str:
        bound = [f for f in dict.fromkeys(frames_of(pattern)) if f in self.bindings]
        given = " and ".join(f"`{f[1:]}` is `{self.bindings[f]}`" for f in bound)
        return f"by the other arguments {given}" if given else ""

    def _wrong_number(self) -> ExprError:
        name, parameters = self.operator.name, self.operator.parameters
        usage = f"{name}({', '.join(f'{p}: {t}' for p, t in parameters)})"
        message = f"`{name}` takes {_count(len(parameters))}, not {len(self.node.args)}"
        error = self.ctx.error(self.node, message, f"it is called as `{usage}`", "E0314")
        return error.because([Origin(self.operator.place, f"`{name}` is declared here")])


def _count(number: int) -> str:
    return {0: "no arguments", 1: "1 argument"}.get(number, f"{number} arguments")
