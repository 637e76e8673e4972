"""Functions of the language: how calls are typed, and the columns of their table."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import partial
from typing import Any, Literal, NoReturn, Protocol

from specc.diagnostics.nearest import nearest
from specc.lang.context import (
    UNNAMED,
    Context,
    infer_same_type,
    mismatch,
    scalar_unit,
    unwrap_list,
)
from specc.lang.errors import ExprError, collect
from specc.lang.names import input_element
from specc.lang.parse import span
from specc.lang.ranges import ANY, Operation, Range
from specc.lang.values import Value
from specc.model.expr import (
    Builtin,
    Expr,
    Fresh,
    Lag,
    LagName,
    LetRef,
    MemoryRef,
    Present,
    Quantifier,
)
from specc.model.fsm import mode_name
from specc.model.types import Bool, Int, ListOf, Pose, Real, Spatial, Type, Vector, point
from specc.model.units import DIMENSIONLESS, METRE, RADIAN, SECOND


def inverted_pose(type: Type | None) -> Type | None:
    """The type of `inverse(X)`."""
    return Pose(type.child, type.parent) if isinstance(type, Pose) else None


def real_element(type: Type) -> Real | None:
    """The type of `norm(v)`."""
    return type.element if isinstance(type, Vector) and isinstance(type.element, Real) else None


def list_length(type: Type) -> Type | None:
    """The type of `len(list)`."""
    return Int() if isinstance(type, ListOf) else None


def fixed_length(type: Type) -> str:
    """A help text for the length of a vector."""
    return f"its length is always {type.size}" if isinstance(type, Vector) else ""


def integer_type(type: Type) -> Type | None:
    """The type of `floor(a)` and `round(a)`."""
    return Int() if scalar_unit(type) == DIMENSIONLESS else None


def unit_help(type: Type) -> str:
    """A help text for a number with a unit."""
    unit = scalar_unit(type)
    return "" if unit is None else f"a whole number has no unit; divide by one: `a / 1[{unit}]`"


def angle_help(type: Type) -> str:
    """A help text for an argument that is not an angle."""
    plain = scalar_unit(type) == DIMENSIONLESS
    return "an angle has a unit: `30[deg]`; multiply a plain number by `1[rad]`" if plain else ""


# Typing rules, most of them made from how a function is called and what it takes.


Rule = Callable[[Context, ast.Call, Type | None], Expr]


def _check_arity(
    ctx: Context, node: ast.Call, usage: str, least: int, most: int | None = -1
) -> None:
    """Refuse a call with a wrong number of arguments; with `most` None there may be any more."""
    count = len(node.args)
    upper = least if most == -1 else most
    if count >= least and (upper is None or count <= upper):
        return
    name = usage.partition("(")[0]
    wanted = f"{least} or more" if upper is None else f"{least} or {upper}"
    wanted = str(least) if upper == least else wanted
    noun = "argument" if wanted == "1" else "arguments"
    message = f"{name} takes {wanted} {noun}, not {count}"
    raise ctx.error(node, message, f"it is called as {usage}", "E0315")


def _builtin(node: ast.Call, type: Type, *args: Expr) -> Builtin:
    assert isinstance(node.func, ast.Name)  # it was looked up by its name
    return Builtin(node.func.id, args, type=type, span=span(node))


def unary_rule(
    usage: str,
    takes: str,
    result: Callable[[Type], Type | None],
    help: Callable[[Type], str] = lambda type: "",
    wanted: Callable[[Type | None], Type | None] = lambda hint: None,
) -> Rule:
    """The typing rule of a function of one argument.

    `result` gives its type by that of the argument, None if none fits.

    `wanted` is the type that a literal takes where the call is expected to be of a type.
    """

    def rule(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
        _check_arity(ctx, node, usage, 1)
        value = ctx.infer(node.args[0], wanted(hint))
        type = result(value.type)
        if type is not None:
            return _builtin(node, type, value)
        message = f"`{ctx.quote(node.args[0])}` is `{value.type}`; `{ctx.quote(node.func)}` {takes}"
        error = ctx.error(node.args[0], message, help(value.type), "E0315")
        raise error.with_origins(ctx.origins(value))

    return rule


def numbers_rule(
    parameters: str,
    least: int,
    most: int | None,
    *,
    is_real: bool = False,
    result: Type | None = None,
) -> Rule:
    """The typing rule of a function of numbers of one unit, which its result has.

    `is_real` even for integers.

    With a `result` that is its type.
    """

    def rule(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
        _check_arity(ctx, node, f"{ctx.quote(node.func)}({parameters})", least, most)
        numbers = infer_same_type(ctx, node.args, hint)
        unit = scalar_unit(numbers[0].type)
        verdict = "have no order" if result is None else "make no angle"
        for arg, number in zip(node.args, numbers, strict=True):
            if unit is None or scalar_unit(number.type) != unit:
                raise mismatch(ctx, (node.args[0], numbers[0]), (arg, number), verdict)
        if result is not None:
            return _builtin(node, result, *numbers)
        whole = not is_real and all(isinstance(number.type, Int) for number in numbers)
        return _builtin(node, Int() if whole else Real(unit or DIMENSIONLESS), *numbers)

    return rule


def pose_rule(usage: str, *parts: Type) -> Rule:
    """The typing rule of a function that gives a pose in the frames required at its place."""

    def rule(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
        _check_arity(ctx, node, usage, len(parts))
        pairs = zip(node.args, parts, strict=True)
        args = collect(*(partial(ctx.expect, arg, type) for arg, type in pairs))
        type = _pose_type(ctx, node, hint)
        for arg, value in zip(node.args, args, strict=True):
            if isinstance(value.type, Vector) and value.type.frame not in ("", type.parent):
                message = f"`{ctx.quote(arg)}` is `{value.type}`; expected `{point(type.parent)}`"
                help = "" if type.parent != UNNAMED else "the frame between these poses has no name"
                error = ctx.error(arg, message, help, "E0312")
                raise error.with_origins(ctx.origins(value), type)
        return _builtin(node, type, *args)

    return rule


def _pose_type(ctx: Context, node: ast.Call, hint: Type | None) -> Pose:
    if isinstance(hint, Pose) and hint.parent and hint.child:
        return hint
    if hint is not None and not isinstance(hint, Pose):
        raise ctx.error(node, f"`{ctx.quote(node)}` is a pose; expected `{hint}`")
    help = 'say its type, which has the frames, e.g. `{type: "pose[A, B]", is: ...}`'
    message = f"the frames of `{ctx.quote(node)}` are not known here"
    raise ctx.error(node, message, help, "E0317")


def position(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """Type `position(X)`: a point in the frame of the pose, in version 1 a vector."""
    found = _pose_origin(ctx, node, hint)
    return found if ctx.scope.has_points else replace(found, type=point(""))


_pose_origin = unary_rule(
    "position(X)",
    "takes a pose",
    lambda type: point(type.parent) if isinstance(type, Pose) else None,
)


def input_rule(usage: str, kind: type[Fresh | Present]) -> Rule:
    """The typing rule of a question about an element of an input buffer."""

    def rule(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
        _check_arity(ctx, node, usage, 1)
        return kind(input_element(ctx, node.args[0]), type=Bool(), span=span(node))

    return rule


def mode_rule(name: Literal["elapsed", "entered"]) -> Rule:
    """The typing rule of a question about a mode."""

    def rule(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
        _check_arity(ctx, node, f"{name}(mode)", 1)
        argument, scope = node.args[0], ctx.scope
        if not scope.allow_clock:
            message = f"`{name}` has no value here: no mode has been entered"
            raise ctx.error(node, message, "refer to constants and operators only", "E0230")
        mode = argument.id if isinstance(argument, ast.Name) else ""
        if mode not in scope.modes:
            known = ", ".join(f"`{m}`" for m in scope.modes)
            alone = "the time in" if name == "elapsed" else "the first period of"
            help = f"{known} can stand here" if known else "declare modes under `modes:`"
            help += f"; `{name}` alone is {alone} the present state"
            near = nearest(mode, scope.modes)
            if near:
                help = f"did you mean {' or '.join(f'`{one}`' for one in near)}?"
            error = ctx.error(argument, f"`{ctx.quote(argument)}` is no mode", help, "E0201")
            raise error.set_repair(mode, near)
        if name == "elapsed":
            return LetRef(mode_name("elapsed", mode), type=Real(SECOND), span=span(node))
        return MemoryRef(mode_name("entered", mode), type=Bool(), span=span(node))

    return rule


def lag_rule(name: LagName, type: Type) -> Rule:
    """The typing rule of `age` and `late`: how far an element of an input buffer is behind."""

    def rule(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
        _check_arity(ctx, node, f"{name}(x.peer.element)", 1)
        argument = node.args[0]
        match argument:
            case ast.Name(id=value) if ctx.scope.value(value):
                message = f"`{value}` is not an element of an input buffer, for which `{name}` asks"
                help = f"ask when it is read, and keep the answer: `{name}(x.peer.element)`"
                raise ctx.error(argument, message, help, "E0201")
        return Lag(name, input_element(ctx, argument), type=type, span=span(node))

    return rule


_NEAR = "near(a, b, tolerance)"


def near(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
    """Type `near(...)`: numbers and vectors have one tolerance in their unit, poses have two."""
    _check_arity(ctx, node, _NEAR, 3, 4)
    a, b = infer_same_type(ctx, node.args[:2])
    if isinstance(a.type, Pose) or isinstance(b.type, Pose):
        return _near_poses(ctx, node, a, b)
    unit = _common_unit(a.type, b.type)
    if unit is None:
        raise _never_near(ctx, node, a, b)
    _check_arity(ctx, node, _NEAR, 3)
    return _builtin(node, Bool(), a, b, ctx.expect(node.args[2], unit))


def _near_poses(ctx: Context, node: ast.Call, a: Expr, b: Expr) -> Expr:
    if a.type != b.type:
        raise mismatch(ctx, (node.args[0], a), (node.args[1], b), "cannot be near")
    _check_arity(ctx, node, "near(X, Y, position_tolerance, rotation_tolerance)", 4)
    position, rotation = collect(
        lambda: ctx.expect(node.args[2], Real(METRE)),
        lambda: ctx.expect(node.args[3], Real(RADIAN)),
    )
    return _builtin(node, Bool(), a, b, position, rotation)


def _common_unit(a: Type, b: Type) -> Real | None:
    """The type of the tolerance when two numbers or two vectors are compared."""
    if isinstance(a, Vector) and a == b:
        return a.element if isinstance(a.element, Real) else None
    unit = scalar_unit(a)
    return Real(unit) if unit is not None and unit == scalar_unit(b) else None


def _never_near(ctx: Context, node: ast.Call, a: Expr, b: Expr) -> ExprError:
    """The error of two values that no tolerance can compare."""
    if a.type != b.type:
        return mismatch(ctx, (node.args[0], a), (node.args[1], b), "cannot be near")
    what, help = f"`{ctx.quote(node.args[0])}` is `{a.type}`", "compare with `==`"
    if isinstance(a.type, Spatial):
        help = "compare them one by one: `near(a.z, b.z, tolerance)`"
        return ctx.error(node, f"{what}, whose components differ in unit", help, "E0315")
    reads = "`near` compares numbers, vectors of `real` and poses"
    return ctx.error(node, f"{what}; {reads}", help, "E0315")


# Typing rules of `all(... for v in ...)`, `any(...)`, `argmax(...)` and `argmin(...)`.


_USAGE = "all(v in {u, c} for v in x.c.b)"


def quantifier_rule(kind: Literal["all", "any"]) -> Rule:
    """The typing rule of a condition on every item, or on some item, of a vector or a list."""

    def rule(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
        body, variable, over, element = _over_items(ctx, node)
        test = ctx.with_scope(ctx.scope.binding(variable, element)).truth(body)
        return Quantifier(kind, variable, over, test, type=Bool(), span=span(node))

    return rule


def extreme_rule(kind: Literal["argmax", "argmin"]) -> Rule:
    """The typing rule of `argmin` and `argmax`: the item for which a number is extreme.

    The list must have an item.
    """

    def rule(ctx: Context, node: ast.Call, hint: Type | None) -> Expr:
        body, variable, over, element = _over_items(ctx, node)
        number = ctx.with_scope(ctx.scope.binding(variable, element)).infer(body)
        if scalar_unit(number.type) is None:
            message = f"`{ctx.quote(body)}` is `{number.type}`; items are compared by a number"
            raise ctx.error(body, message, code="E0315").with_origins(ctx.origins(number))
        return Quantifier(kind, variable, unwrap_list(over), number, type=element, span=span(node))

    return rule


def _over_items(ctx: Context, node: ast.Call) -> tuple[ast.expr, str, Expr, Type]:
    """Type the parts of a quantifier: body, variable, items and the type of an item."""
    body, comprehension = _comprehension(ctx, node)
    variable = _variable(ctx, comprehension)
    over = ctx.infer(comprehension.iter)
    if isinstance(over.type, (Vector, ListOf)):
        return body, variable, over, over.type.element
    text = ctx.quote(comprehension.iter)
    message = f"`{text}` is `{over.type}`; a quantifier goes over a vector or a list"
    raise ctx.error(comprehension.iter, message, code="E0313").with_origins(ctx.origins(over))


def stray_generator(ctx: Context, node: ast.GeneratorExp, hint: Type | None) -> NoReturn:
    """Refuse a generator outside of quantifiers."""
    message = "`for` can stand only in `all(...)`, `any(...)`, `argmax(...)` and `argmin(...)`"
    raise ctx.error(node, message, f"for example `{_USAGE}`", "E0302")


def _comprehension(ctx: Context, node: ast.Call) -> tuple[ast.expr, ast.comprehension]:
    """The body of a quantifier and its `for`; raises if it is anything else."""
    match node.args:
        case [ast.GeneratorExp(elt, [ast.comprehension(ifs=[], is_async=0) as only])]:
            return elt, only
        case [ast.GeneratorExp(generators=[ast.comprehension(ifs=[filter, *_]), *_])]:
            help = "write it into the condition: `all(not a or b for ...)`, `any(a and b for ...)`"
            raise ctx.error(filter, "a quantifier has no filter", help, "E0302")
        case [ast.GeneratorExp()]:
            help = "put one quantifier into the other"
            raise ctx.error(node, "a quantifier goes over one vector or list", help, "E0302")
    name = ctx.quote(node.func)
    usage = _USAGE if name in ("all", "any") else f"{name}(abs(v) for v in [1, -2])"
    raise ctx.error(node, f"`{name}` goes over a vector or list", f"for example `{usage}`", "E0315")


def _variable(ctx: Context, comprehension: ast.comprehension) -> str:
    target = comprehension.target
    if not isinstance(target, ast.Name):
        raise ctx.error(target, "a quantifier has one variable", f"for example `{_USAGE}`", "E0302")
    scope = ctx.scope
    known = target.id in ctx.reserved or target.id in scope.files or target.id in scope.enums
    if known or scope.value(target.id):
        message = f"the variable `{target.id}` hides a name that is already in use"
        raise ctx.error(target, message, "choose another name for the variable", "E0221")
    return target.id


RUNTIME = "specc_runtime.builtins"


class SolverTerms(Protocol):
    """What terms of the solver can be made of, besides their own `+`, `-` and comparisons."""

    def constant(self, value: float | Fraction) -> Any:
        """The term of a number."""

    def whole(self, value: int) -> Any:
        """The term of a whole number."""

    def choice(self, test: Any, then: Any, otherwise: Any) -> Any:
        """`then if test else otherwise`."""

    def floor(self, number: Any) -> Any:
        """The greatest whole number that is not greater."""

    def representable(self, number: Any) -> Any:
        """The term of a number that is known to be exactly a float."""


ArgumentChoices = Iterator[tuple[int, Value]]
"""Indices of arguments, each with a value that it could have."""
Encoding = Callable[..., Any]
"""From a `SolverTerms` and terms of arguments, also of the result where that is unknown."""


@dataclass(frozen=True, slots=True)
class Form:
    """How a call is written without its name: a place for each argument, with how tightly what
    stands there has to bind, and how tightly the whole binds.
    """

    text: str
    binding: str


@dataclass(frozen=True, slots=True)
class BuiltinFunction:
    """A function of the language. What is said of a result holds of each of its components.

    The defaults are what is safe to believe of a function that nobody has thought about.
    """

    signature: str
    """Parameters, result and what it is, for editors: `X -> pose: pose[B, A] of a pose[A, B]`."""
    rule: Rule | None
    """Types a call; None for a function that only the compiler calls."""
    is_overridable: bool = False
    """Whether an operator of that name takes its place; version 1 did not have it."""

    # What it computes, and how.

    value: Callable[..., Any] = NotImplemented
    """What it computes on plain Python values, with integers as floats if the result is a real."""
    python: str = RUNTIME
    """The module that has it for generated code; "" for a function of Python's own."""
    form: Callable[[Type], Form | str] = lambda type: ""
    """How generated code writes it, by the type of the first argument: in a form, by another name
    of its module, or as a call if that is "". `show` writes what has no rule in this form, too."""
    notation: Literal["", "bars", "double bars", "root", "power -1"] = ""
    """How documents write it, unless by its name."""
    rounds: bool = True
    """Whether its result may differ from that of exact numbers."""
    may_fail: bool = True
    """Whether it raises for some arguments, so that it is called only where it is needed."""
    constants_checked: bool = False
    """Whether checks find the constant arguments for which it raises."""
    overflows: bool = True
    """Whether finite arguments may give a result that is not finite."""
    propagates: bool = False
    """Whether an argument that is not finite gives a result that is not finite, or an error."""
    is_costly: bool = False
    """Whether calling it again costs more than keeping its result; arrays always do."""

    # What proofs know of it.

    is_foldable: bool = False
    """Whether `value` is what every machine computes, so that it is known of known arguments."""
    bounds: Range = ANY
    """The least and greatest value that the result ever has."""
    range: Operation | None = None
    """The least and greatest value of the result by those of the arguments."""
    chooses: bool = False
    """Whether its result is one of its arguments."""
    picks: int = 0
    """-1 if the result is the least of its arguments, 1 if it is the greatest."""
    limits: tuple[int, int] | None = None
    """The arguments between which the result lies: the lower and the upper limit."""
    is_size: bool = False
    """Whether it is its argument without the sign."""
    turns_at: tuple[float, ...] = ()
    """The numbers around which its result jumps."""
    compares: bool = False
    """Whether it says how its first two arguments, which may change places, compare within what
    the others allow, as `near` does."""
    term: Encoding | None = None
    """What the solver has for a number: a term, made by `SolverTerms` of those of arguments, which
    is the result itself. What rounds has `laws`."""
    stays_float: bool = False
    """Whether the result, a whole number, is one that a float has if the argument is a float."""
    laws: Callable[..., Iterable[Any]] | None = None
    """Where it has no such term: facts, made by a `SolverTerms` of the term of the result, which is
    otherwise not known, and those of the arguments."""
    inverse: Callable[[Sequence[Type], Sequence[Value], Value], ArgumentChoices] | None = None
    """What arguments may be so that the result is a wanted one: from their types, their present
    values and the result that is wanted."""

    # Which calls cannot be meant.

    same_arguments: str = ""
    """What is wrong with two arguments that have one value, with braces for it; "" if nothing."""
    direction: int | None = None
    """The argument that says a direction: a quaternion of length 1, an axis of any but zero."""
    neutral: tuple[int, float, str] | None = None
    """An argument, its value with which the call gives the first one as it is, and a way out."""

    @property
    def is_modelled(self) -> bool:
        """Whether proofs have its result by the values of its arguments."""
        return self.term is not None or self.compares


exact = partial(BuiltinFunction, rounds=False, may_fail=False, overflows=False)
"""A row of a function that neither rounds nor fails, and is finite for what is finite."""
