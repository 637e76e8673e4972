"""Typing rules of names and literals."""

from __future__ import annotations

import ast
import math
from functools import partial
from typing import Literal, cast

from specc.diagnostics.nearest import nearest, sole_correction
from specc.lang.context import Context, needs_context, unwrap_list
from specc.lang.errors import (
    CLOCK_NAMES,
    ExprError,
    Scope,
    alternatives,
    collect,
    did_you_mean,
    quoted,
)
from specc.lang.parse import span
from specc.limits import MAX_DEPTH
from specc.model.expr import (
    REST,
    BoundVariable,
    Builtin,
    Clock,
    Component,
    ConstantRef,
    Expr,
    FieldOf,
    FileRef,
    Input,
    Items,
    LetRef,
    Member,
    MemoryRef,
    Nothing,
    Number,
    ParameterRef,
    TextLiteral,
    Truth,
    Unused,
    is_live,
)
from specc.model.types import (
    Bool,
    Enum,
    File,
    Int,
    ListOf,
    Opaque,
    OptionalOf,
    PartialOf,
    Pose,
    Real,
    Record,
    Spatial,
    Text,
    Type,
    Vector,
    complete_type,
)
from specc.model.units import RADIAN, SECOND, UNITS, UnitError, unit_of

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
    unit = _WRITTEN_OUT.get(word) or _WRITTEN_OUT.get(word.removesuffix("s"))
    close = [unit] if unit else nearest(error.name, UNITS) if error.name else []
    help = did_you_mean(close) or f"for example {example}"
    end = end if error.end is None else error.end
    found = ExprError(error.message, error.start, end, help, "E0304")
    found.wrong, found.repair = error.name, _sole_unit_correction(error.name)
    return found


def _sole_unit_correction(name: str) -> str:
    """The only unit of which a name can be a misspelling.

    Empty if none, several, or if only the prefix may be wrong.
    """
    same = [unit for unit in UNITS if unit.casefold() == name.casefold()]
    if same:
        # `MN` is a million newtons, not a thousandth of one.
        mega = name.startswith("M") and same[0].startswith("m") and len(name) > 1
        return same[0] if len(same) == 1 and not mega else ""
    return sole_correction(name, [u for u in UNITS if u[:1] == name[:1]], _LONG_ENOUGH)


# Typing rules of literals: numbers with and without units, truth values, texts, vectors, lists.


def constant(ctx: Context, node: ast.Constant, hint: Type | None) -> Expr:
    """Type a constant: a bare number has the hinted unit if it is 0, else it is dimensionless."""
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
    """Type `None`, of the hinted optional type or of the optional of the hinted type."""
    if hint is None:
        help = "give it a place whose type is declared: memory, or an argument of an operator"
        raise ctx.error(node, "the type of `None` is not known here", help, "E0317")
    type = hint if isinstance(hint, OptionalOf) else OptionalOf(hint)
    return Nothing(type=type, span=span(node))


def quantity(ctx: Context, node: ast.Subscript) -> Expr:
    """Type a number with its unit, `0.02[m/s]`, converted to SI."""
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
    """Type `[a, b, c]` as a vector, spatial vector or list, whichever the hint says."""
    kind = hint if hint is None else complete_type(hint)
    match kind:
        case Vector() | Spatial():
            types = kind.components
        case ListOf():
            types = (kind.element,) * len(node.elts)
            kind = ListOf(kind.element, nonempty=bool(node.elts))
        case _:
            return _infer_items(ctx, node)
    wanted = kind.size if isinstance(kind, Vector) else len(types)  # which may be open
    if len(node.elts) != wanted:
        message = f"{len(node.elts)} items; `{kind}` has {wanted}"
        raise ctx.error(node, message, "write exactly as many", "E0316")
    pairs = zip(node.elts, types, strict=True)
    found = collect(*(partial(_item, ctx, item, wanted, hint) for item, wanted in pairs))
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


def _infer_items(ctx: Context, node: ast.List) -> Items:
    """A vector or list whose items say what they are: the first that has a type of its own."""
    used = [item for item in node.elts if not _is_dash(item)]
    if not used:
        help = "give it a place whose type is declared: memory, or an argument of an operator"
        message = f"the type of `{ctx.quote(node)}` is not known here"
        raise ctx.error(node, message, help, "E0317")
    decisive = next((e for e in used if not needs_context(e, ctx.scope)), used[0])
    first = ctx.infer(decisive, Real())
    element = first.type
    found = collect(
        *(
            partial(_item, ctx, item, element, None) if item is not decisive else lambda: first
            for item in node.elts
        )
    )
    if element.extent[1] >= MAX_DEPTH:
        message = f"lists are more than {MAX_DEPTH} levels deep"
        raise ctx.error(node, message, "make it a record of lists", "E0017")
    type: Type = ListOf(element, nonempty=True)
    if isinstance(element, (Real, Int, Bool, Enum)):
        type = Vector(len(found), element)
    return Items(tuple(found), type=type, span=span(node))


# Typing rules of plain names: values, files, members of enums, the clock.


_NODES: dict[str, type[BoundVariable | ParameterRef | MemoryRef | LetRef]] = {
    "bound": BoundVariable,
    "parameters": ParameterRef,
    "memory": MemoryRef,
    "lets": LetRef,
}
_CLOCK: dict[str, Type] = {"elapsed": Real(SECOND), "entered": Bool(), "period": Real(SECOND)}
_FOREIGN_NAMES = {"true": "True", "false": "False", "null": "", "None": "", "nan": "_", "NIL": "[]"}


def name(ctx: Context, node: ast.Name, hint: Type | None) -> Expr:
    """Type a plain name; the hint tells a member or a file from a value of the same name."""
    value = ctx.scope.value(node.id)
    if isinstance(hint, Enum) and node.id in hint.members:
        if value and value[1] == hint:
            message = f"`{node.id}` is both a value and a member of `{hint}`"
            raise ctx.error(node, message, "give the value another name", "E0221")
        return Member(node.id, type=hint, span=span(node))
    if node.id in ctx.scope.files and (value is None or isinstance(hint, File)):
        return FileRef(ctx.scope.files[node.id], type=File(), span=span(node))
    if value:
        kind, type = value
        if kind == "constants":
            known = ctx.scope.constants[node.id].value
            changes = known is not None and is_live(known)
            return ConstantRef(node.id, changes, type=type, span=span(node))
        return _NODES[kind](node.id, type=type, span=span(node))
    if node.id in ctx.scope.enums:
        return _member(ctx, node)
    if node.id in CLOCK_NAMES and ctx.scope.allow_clock:
        which = cast(Literal["elapsed", "entered", "period"], node.id)
        return Clock(which, type=_CLOCK[which], span=span(node))
    if node.id == "pi":
        return Number(math.pi, type=Real(RADIAN), span=span(node))
    raise _unknown_error(ctx, node, hint)


def _member(ctx: Context, node: ast.Name) -> Expr:
    enums = ctx.scope.enums[node.id]
    if len(enums) > 1:
        message = f"`{node.id}` is a member of {alternatives(enums).replace(' or ', ' and ')}"
        help = "the expected type decides which is meant; where no type is expected, rename one"
        raise ctx.error(node, message, help, "E0221")
    return Member(node.id, type=enums[0], span=span(node))


def _unknown_error(ctx: Context, node: ast.Name, hint: Type | None) -> ExprError:
    name, scope = node.id, ctx.scope
    if name == "_":
        help = "`_` is an item where `partial[...]` is expected: `[_, _, 0, _, _, _]`"
        return ctx.error(node, "`_` is used outside a vector", help, "E0318")
    if name == "x":
        return ctx.error(
            node, "`x` is all input buffers", "name one element, `x.peer.element`", "E0201"
        )
    if name == "y":
        return output_error(ctx, node)
    if name in CLOCK_NAMES:
        message = f"`{name}` has no value here: no state has been entered"
        return ctx.error(node, message, "refer to constants and operators only", "E0230")
    if name in scope.modes:
        help = f"write `elapsed({name})` or `entered({name})`"
        return ctx.error(node, f"`{name}` is a mode, which has no value", help, "E0201")
    if name in scope.operators:
        parameters = ", ".join(p for p, _ in scope.operators[name].parameters)
        return ctx.error(
            node, f"`{name}` is an operator", f"call it: `{name}({parameters})`", "E0201"
        )
    if name in scope.uninitialized:
        message = (
            f"`{name}` has no value here: memory gets its initial values after this is evaluated"
        )
        known = (
            "inputs, constants and operators" if scope.inputs else "constants and operators only"
        )
        return ctx.error(node, message, f"refer to {known}", "E0230")
    if name in scope.later_constants:
        message = f"`{name}` has no value here: a constant is computed from those above it"
        return ctx.error(node, message, "name constants above it, and operators", "E0230")
    help = _unknown_help(ctx, name)
    near = _similar_names(scope, name) if help.startswith("did you mean") else ()
    error = ctx.error(node, f"unknown name `{name}`", help, "E0201").set_repair(name, near)
    if help == f"write `{_FOREIGN_NAMES.get(name)}`" and name in ("true", "false"):
        error.repair = _FOREIGN_NAMES[name]
    if help and not near:
        return error
    way = _declaration_help(scope, hint)
    if (scope.known_peers or scope.allow_clock) and not isinstance(hint, File):
        peer = next(iter(scope.known_peers), "peer")
        way += (
            f"; a signal from elsewhere is an element of a buffer, e.g. `x.{peer}.{name}`: declare "
            "it under `x:` here and under `y:` of what sends it"
        )
    return error.or_open_point(f"`{name}` is not there yet", way, name, near)


def _declaration_help(scope: Scope, hint: Type | None) -> str:
    """Lets depend on memory, so that nothing names one where memory has no value yet."""
    lets = scope.allow_clock or scope.known_peers
    match hint:
        case File():
            return "declare it under `files:`"
        case Enum(members=members):
            way = "declare it, e.g. under `let:`" if lets else "declare it under `constants:`"
            return f"{way}, or write {alternatives(members)}"
    return f"declare it{', e.g. under `let:` or' if lets else ' under'} `constants:`"


def _similar_names(scope: Scope, name: str) -> list[str]:
    """The names that may be meant, and the truth values, unless it is one in another language."""
    return nearest(name, (*scope.names(), *(() if name in _FOREIGN_NAMES else ("True", "False"))))


def _unknown_help(ctx: Context, name: str) -> str:
    scope = ctx.scope
    inputs = [f"x.{peer}.{element}" for peer, element in scope.inputs if element == name]
    if inputs:
        return f"an input is spelt {alternatives(inputs)}"
    if name in scope.known_peers:
        return f"an input is spelt `x.{name}.element`"
    if close := _similar_names(scope, name):
        return did_you_mean(close)
    if name in _FOREIGN_NAMES:
        return f"write `{_FOREIGN_NAMES[name]}`" if _FOREIGN_NAMES[name] else ""
    return f"a unit is written in brackets after its number: `1[{name}]`" if name in UNITS else ""


def output_error(ctx: Context, node: ast.expr) -> ExprError:
    """Make the error of an expression that refers to an output buffer."""
    help = "keep the value in memory, or name it under `let:` and use it in both places"
    return ctx.error(node, f"`{ctx.quote(node)}` is an output: it cannot be read", help, "E0230")


# Typing rules of dots and brackets: input elements, fields of records, components of vectors.


def attribute(ctx: Context, node: ast.Attribute, hint: Type | None) -> Expr:
    """Type `x.peer.element`, `record.field` or `vector.z`."""
    match node.value:
        case ast.Name(id="y") | ast.Attribute(value=ast.Name(id="y")):
            raise output_error(ctx, node)
        case ast.Name(id="x"):
            raise _buffer_error(ctx, node)
        case ast.Attribute(value=ast.Name(id="x")):
            return input_element(ctx, node)
    value = ctx.infer(node.value)
    if isinstance(value.type, Record):
        return _field(ctx, node, value, value.type)
    names = value.type.names
    if node.attr in names:
        return _component(node, value, names.index(node.attr))
    raise _no_part_error(ctx, node, value.type, names).with_origins(ctx.origins(value))


def subscript(ctx: Context, node: ast.Subscript, hint: Type | None) -> Expr:
    """Type `0.02[m/s]` or `v[2]`."""
    if isinstance(node.value, ast.Constant) and type(node.value.value) in (int, float):
        return quantity(ctx, node)
    value = ctx.infer(node.value)
    if isinstance(value.type, ListOf):
        return _list_part(ctx, node, value, value.type)
    size = len(value.type.components)
    if not size:
        message = f"`{ctx.quote(node.value)}` is `{value.type}`, which has no components"
        error = ctx.error(node, message, "`all(...)` and `any(...)` go over a list", "E0234")
        raise error.with_origins(ctx.origins(value))
    match node.slice:
        case ast.Constant(value=int(index)) if not isinstance(index, bool):
            if index < size:
                return _component(node, value, index)
            message = f"`{ctx.quote(node.value)}` has no component {index}"
            help = f"its components are 0 to {size - 1}, counted from 0"
            raise ctx.error(node.slice, message, help, "E0234")
    message = f"`{ctx.quote(node.slice)}` is not an index: an index is a whole number, 0 or more"
    help = "`all(...)` and `any(...)` go over all components"
    raise ctx.error(node.slice, message, help, "E0234")


def _list_part(ctx: Context, node: ast.Subscript, value: Expr, kind: ListOf) -> Expr:
    """Type `v[0]`, an item that must exist, or `v[2:]`, the items from the third on."""
    match node.slice:
        case ast.Constant(value=0) if node.slice.value is not False:
            return Component(unwrap_list(value), 0, type=kind.element, span=span(node))
        case ast.Slice(ast.Constant(value=int(first)), None, None) if not isinstance(first, bool):
            start = Number(first, type=Int(), span=span(node.slice))
            return Builtin(REST, (value, start), type=ListOf(kind.element), span=span(node))
    text = ctx.quote(node.value)
    help = f"the first item is `{text}[0]`, the others are `{text}[1:]`"
    raise ctx.error(node.slice, f"`{ctx.quote(node.slice)}` is no part of a list", help, "E0234")


def input_element(ctx: Context, node: ast.expr) -> Input:
    """Type `x.peer.element`; raises `ExprError` for anything else."""
    match node:
        case ast.Attribute(value=ast.Attribute(value=ast.Name(id="x"), attr=peer), attr=element):
            pass
        case _:
            message = f"`{ctx.quote(node)}` is not an element of an input buffer"
            raise ctx.error(node, message, "it is spelt `x.peer.element`", "E0201")
    scope = ctx.scope
    if not scope.known_peers:
        message = f"`{ctx.quote(node)}` has no value here: there are no inputs"
        raise ctx.error(node, message, "refer to constants and operators only", "E0230")
    declared = scope.inputs.get((peer, element))
    if declared is not None:
        return Input(peer, element, type=declared.type, span=span(node))
    if peer not in scope.known_peers:
        known = scope.known_peers
        error = _unknown_part(node.value, "there is no input buffer of ", peer, known, "E0201")
        way = f"declare it under `x:` here and under `y:` at its other end, `{peer}`"
        raise error.or_open_point(f"`x.{peer}` is not there yet", way, peer, known)
    known = scope.elements(peer)
    error = _unknown_part(node, f"input buffer `x.{peer}` has no ", element, known, "E0201")
    way = f"declare it under `x: {peer}:` here and under `y:` of what sends it, `{peer}`"
    raise error.or_open_point(f"`x.{peer}.{element}` is not there yet", way, element, known)


def _unknown_part(node: ast.expr, what: str, name: str, known: list[str], code: str) -> ExprError:
    end = span(node)[1]
    error = ExprError(f"{what}`{name}`", end - len(name), end, _suggestion(name, known), code)
    return error.set_repair(name, nearest(name, known))


def _suggestion(name: str, known: list[str]) -> str:
    if suggestion := did_you_mean(nearest(name, known)):
        return suggestion
    return f"there {'is' if len(known) == 1 else 'are'} {quoted(known)}" if known else ""


def _buffer_error(ctx: Context, node: ast.Attribute) -> ExprError:
    known = ctx.scope.known_peers
    if node.attr not in known:
        return _unknown_part(node, "there is no input buffer of ", node.attr, known, "E0201")
    listed = alternatives(f"x.{node.attr}.{e}" for e in ctx.scope.elements(node.attr))
    message = f"`{ctx.quote(node)}` is a whole input buffer"
    return ctx.error(node, message, f"name an element: {listed}" if listed else "", "E0201")


def _field(ctx: Context, node: ast.Attribute, value: Expr, record: Record) -> Expr:
    type = record.field(node.attr)
    if type is not None:
        return FieldOf(value, node.attr, type=type, span=span(node))
    known = [name for name, _ in record.fields]
    error = _no_part_error(ctx, node, record, tuple(known)).with_origins(ctx.origins(value))
    message = f"field `{node.attr}` of `{record}` is not there yet"
    raise error.or_open_point(message, "declare it under `fields:`", node.attr, known)


def _component(node: ast.expr, value: Expr, index: int) -> Component:
    type = value.type.components[index]
    return Component(value, index, type=type, span=span(node))


def _no_part_error(
    ctx: Context, node: ast.Attribute, type: Type, known: tuple[str, ...]
) -> ExprError:
    message = f"`{ctx.quote(node.value)}` is `{type}`, which has no `{node.attr}`"
    help = _suggestion(node.attr, list(known))
    peer = ctx.quote(node.value)
    if (peer, node.attr) in ctx.scope.inputs:
        help = f"an input is spelt `x.{peer}.{node.attr}`"
    elif isinstance(type, Pose):
        help = f"`position({ctx.quote(node.value)})` is a vector with `x`, `y` and `z`"
    elif isinstance(type, Opaque):
        help = "only operators look into it"
    end = span(node)[1]
    near = nearest(node.attr, known) if help.startswith("did you mean") else ()
    return ExprError(message, end - len(node.attr), end, help, "E0234").set_repair(node.attr, near)
