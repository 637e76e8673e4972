"""Types of literals: numbers with units, lists, vectors and poses."""

from __future__ import annotations

import ast
import math
from functools import partial

from specc.diagnostics.nearest import nearest, sole_correction
from specc.lang.context import Context, needs_context
from specc.lang.errors import ExprError, did_you_mean, each
from specc.lang.parse import span
from specc.limits import MAX_DEPTH
from specc.model.expr import Expr, Items, Nothing, Number, TextLiteral, Truth, Unused
from specc.model.types import (
    Bool,
    Enum,
    Int,
    ListOf,
    OptionalOf,
    PartialOf,
    Real,
    Spatial,
    Text,
    Type,
    Vector,
    whole,
)
from specc.model.units import UNITS, UnitError, unit_of

# What is said about a text that is not a unit, and which unit was surely meant.


_LONG_ENOUGH = 3
_WRITTEN_OUT = {
    "sec": "s",
    "second": "s",
    "meter": "m",
    "metre": "m",
    "degree": "deg",
    "radian": "rad",
    "newton": "N",
    "hertz": "Hz",
    "rpm": "turn/min",
}


def unit_error(error: UnitError, end: int, example: str) -> ExprError:
    """The finding about a unit, whose last character stands before `end` if it does not say."""
    word = error.name.casefold()
    meant = _WRITTEN_OUT.get(word) or _WRITTEN_OUT.get(word.removesuffix("s"))
    close = [meant] if meant else nearest(error.name, UNITS) if error.name else []
    help = did_you_mean(close) or f"for example {example}"
    end = end if error.end is None else error.end
    found = ExprError(error.message, error.start, end, help, "E0304")
    found.wrong, found.repair = error.name, _surely_meant(error.name)
    return found


def _surely_meant(name: str) -> str:
    """The only unit that a name can be a slip of; another prefix, `mm` for `m`, is not a slip."""
    same = [unit for unit in UNITS if unit.casefold() == name.casefold()]
    if same:
        # `MN` is a million newtons, not a thousandth of one.
        mega = name.startswith("M") and same[0].startswith("m") and len(name) > 1
        return same[0] if len(same) == 1 and not mega else ""
    return sole_correction(name, [u for u in UNITS if u[:1] == name[:1]], _LONG_ENOUGH)


# Typing rules of literals: numbers with and without units, truth values, texts, vectors, lists.


def constant(ctx: Context, node: ast.Constant, hint: Type | None) -> Expr:
    """`True`, `"text"` or a bare number: of the hinted unit if it is 0, else dimensionless."""
    value, at = node.value, span(node)
    if value is None:
        return _nothing(ctx, node, hint)
    if isinstance(value, bool):
        return Truth(value, type=Bool(), span=at)
    if isinstance(value, str):
        return TextLiteral(value, type=Text(), span=at)
    assert isinstance(value, (int, float))  # the parser lets nothing else through
    if isinstance(hint, Real) and (value == 0 or (isinstance(value, int) and hint == Real())):
        return Number(float(value), type=hint, span=at)
    return Number(value, type=Int() if isinstance(value, int) else Real(), span=at)


def _nothing(ctx: Context, node: ast.Constant, hint: Type | None) -> Expr:
    """`None`, of the optional type that is hinted or whose values are."""
    if hint is None:
        help = "give it a place whose type is declared: memory, or an argument of an operator"
        raise ctx.error(node, "the type of `None` is not known here", help, "E0317")
    type = hint if isinstance(hint, OptionalOf) else OptionalOf(hint)
    return Nothing(type=type, span=span(node))


def quantity(ctx: Context, node: ast.Subscript) -> Expr:
    """A number with its unit, `0.02[m/s]`, in SI."""
    assert isinstance(node.value, ast.Constant)  # the caller looked
    try:
        unit = unit_of(node.slice)
    except UnitError as error:
        example = "`0.02[m/s]`, `30[deg]` or `2[kg*m**2]`"
        raise unit_error(error, node.slice.end_col_offset or 0, example) from None
    value = unit.to_si(float(node.value.value))  # type: ignore[arg-type]  # a number, see above
    if math.isinf(value):
        raise ctx.error(node, "the number is too large", "choose a larger unit", "E0304")
    return Number(value, type=Real(unit.coherent()), span=span(node))


def items(ctx: Context, node: ast.List, hint: Type | None) -> Expr:
    """`[a, b, c]`: a vector, spatial vector or list, as the hint says."""
    kind = hint if hint is None else whole(hint)
    match kind:
        case Vector() | Spatial():
            types = kind.components
        case ListOf():
            types = (kind.element,) * len(node.elts)
            kind = ListOf(kind.element, nonempty=bool(node.elts))
        case _:
            return _inferred(ctx, node)
    wanted = kind.size if isinstance(kind, Vector) else len(types)  # which may be open
    if len(node.elts) != wanted:
        message = f"{len(node.elts)} items; `{kind}` has {wanted}"
        raise ctx.error(node, message, "write exactly as many", "E0316")
    pairs = zip(node.elts, types, strict=True)
    found = each(*(partial(_item, ctx, item, wanted, hint) for item, wanted in pairs))
    if isinstance(hint, PartialOf) and any(isinstance(item, Unused) for item in found):
        kind = hint
    return Items(tuple(found), type=kind, span=span(node))


def _item(ctx: Context, node: ast.expr, wanted: Type, of: Type | None) -> Expr:
    """An item where `wanted` is expected, of a vector or list of the type `of`, if known."""
    if not _is_dash(node):
        return ctx.expect(node, wanted)
    if isinstance(of, PartialOf):
        return Unused(type=wanted, span=span(node))
    help = "write a value"
    if isinstance(wanted, Real) and not isinstance(of, ListOf):
        help = f"declare the place as `partial[{of or '...'}]`, or write a number"
    raise ctx.error(node, "`_` is not a value, and every item here needs one", help, "E0318")


def _is_dash(node: ast.expr) -> bool:
    return isinstance(node, ast.Name) and node.id == "_"


def _inferred(ctx: Context, node: ast.List) -> Items:
    """A vector or list whose items say what they are: the first that has a type of its own."""
    used = [item for item in node.elts if not _is_dash(item)]
    if not used:
        help = "give it a place whose type is declared: memory, or an argument of an operator"
        message = f"the type of `{ctx.quote(node)}` is not known here"
        raise ctx.error(node, message, help, "E0317")
    decisive = next((e for e in used if not needs_context(e, ctx.scope)), used[0])
    first = ctx.infer(decisive, Real())
    element = first.type
    found = each(
        *(
            partial(_item, ctx, item, element, None) if item is not decisive else lambda: first
            for item in node.elts
        )
    )
    if element.extent[1] >= MAX_DEPTH:
        message = f"lists are more than {MAX_DEPTH} levels deep"
        raise ctx.error(node, message, "make it a record of lists", "E0016")
    type: Type = ListOf(element, nonempty=True)
    if isinstance(element, (Real, Int, Bool, Enum)):
        type = Vector(len(found), element)
    return Items(tuple(found), type=type, span=span(node))
