"""The elements of a buffer, of a device or of an interface; safe values of those of devices."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Literal

from specc.diagnostics import Related
from specc.lang import FOLLOW_UP, TYPE_WORDS, Declaration, ExprError, parse_interface
from specc.lang.types import SAME, MakeType
from specc.model.expr import Call, Expr, FileRef, MemoryRef, constant_names, is_live, walk
from specc.model.fsm import Trace
from specc.model.system import Element, InterfaceRef, SafeOutput
from specc.model.types import Frame, Type
from specc.reachable import reachable
from specc.resolve.context import Findings, TypeText, YamlNode, duration_in, trace_of
from specc.resolve.definitions import Definitions, Interface
from specc.resolve.expressions import FIXED_INSTEAD, Expressions
from specc.resolve.library import constant_scope
from specc.schema.files import DeviceDef
from specc.schema.subsystem import BufferDef, ElementDef, InputBufferDef, InputDef, ReceivedDef


def resolve_elements(
    elements: Mapping[str, ElementDef], where: YamlNode, expressions: Expressions
) -> tuple[Element, ...]:
    """The elements of one buffer; one whose type is wrong is left out and marked as broken."""
    found = []
    for name, definition in elements.items():
        type_ = expressions.type(where[name]["type"], definition.type)
        if type_ is None:
            expressions.broken.add(name)
        else:
            found.append(_element(name, type_, definition, where[name], expressions))
    return tuple(found)


def _element(
    name: str, type_: Type, definition: ElementDef, at: YamlNode, expressions: Expressions
) -> Element:
    init = None
    if definition.init is not None:
        scope = replace(
            constant_scope(expressions.definitions), uninitialized=expressions.uninitialized_names
        )
        init = expressions.value(at["init"], definition.init, scope, type_, at.key)
        _refuse_live(init, at["init"], "is there before a run begins", expressions)
    trace = trace_of(definition)
    is_received = isinstance(definition, ReceivedDef)
    age = duration_in(definition, at, "max_age", expressions.findings) if is_received else None
    event = isinstance(definition, InputDef) and definition.event
    symbol = definition.symbol or ""
    parts = name, type_, init, definition.title, trace, at.key, age
    return Element(*parts, event=event, symbol=symbol)


# What a device gets when a run ends: an expression over what the device reported last.


def with_safe(
    accepted: tuple[Element, ...],
    definition: DeviceDef,
    where: YamlNode,
    reported: tuple[Element, ...],
    expressions: Expressions,
) -> tuple[Element, ...]:
    """Add the safe values declared in `where`, its `x`, to the elements that a device accepts."""
    found, findings = [], expressions.findings
    constants = constant_scope(expressions.definitions)
    scope = replace(constants, memory={e.name: Declaration(e.type, e.place) for e in reported})
    for element in accepted:
        own = definition.x.elements.get(element.name)
        safe = own.safe if own else None
        if safe is None:
            found.append(element)
            continue
        at = where[element.name]["safe"]
        here, wanted, otherwise = at["is"], (element.type, element.place), None
        value = expressions.value(here, safe.value, scope, *wanted)
        _refuse_live(value, here, "is sent when nothing runs any more", expressions)
        if safe.otherwise is not None:
            there = at["otherwise"]
            otherwise = expressions.value(there, safe.otherwise, constants, *wanted)
            _refuse_live(otherwise, there, "is sent when nothing runs any more", expressions)
            if otherwise is not None and _may_fail(otherwise, expressions):
                message = "this is sent if `safe` fails, so it must not be able to fail itself"
                help_text = "write numbers, or constants that no operator computes"
                findings.report("E0412", message, there.place, help=help_text)
        elif value is not None and _may_fail(value, expressions):
            message = f"`safe` of `{element.name}` may fail, and nothing says what is sent then"
            help_text = "add `otherwise:` with a constant: `safe: {is: ..., otherwise: ...}`"
            findings.report("E0412", message, here.place, help=help_text)
        output = SafeOutput(value, otherwise, at.key) if value is not None else None
        found.append(replace(element, safe=output))
    return tuple(found)


def _refuse_live(value: Expr | None, at: YamlNode, why: str, expressions: Expressions) -> None:
    """Report a value that depends on a constant that may change, where none can."""
    if value is not None and is_live(value):
        message = f"`{at.raw}` may change while something runs, and this value {why}"
        expressions.findings.report("E0344", message, at.place, help=FIXED_INSTEAD)


def _may_fail(value: Expr, expressions: Expressions) -> bool:
    """Whether a value calls an operator, reads a file, or uses what may be missing."""
    constants = expressions.definitions.constants
    names = reachable(
        (name for name in constant_names(value) if name in constants),
        lambda name: [n for n in constant_names(constants[name].value) if n in constants],
    )
    parts = (value, *(constants[name].value for name in names))
    return any(isinstance(node, Call | FileRef | MemoryRef) for p in parts for node in walk(p))


def check_interfaces(known: Iterable[Definitions], findings: Findings) -> None:
    """Report what is wrong with interfaces whoever uses them, each once.

    What names a type parameter is checked where the interface is used.
    """
    all_of_them = {i.where.key: i for d in known for i in d.interfaces.values()}
    for interface in all_of_them.values():
        definition = interface.definition
        for key, words, kind in (("frames", (), "frame"), ("types", TYPE_WORDS, "type")):
            for index, name in enumerate(getattr(definition, key)):
                if name in words or name in getattr(definition, key)[:index]:
                    message = f"`{name}` cannot be the name of a {kind} parameter here"
                    place = interface.where[key][index].place
                    help_text = "it stands for something else already: choose another name"
                    findings.report("E0221", message, place, help=help_text)
        own = _check(interface)
        findings.diagnostics += own.diagnostics
        findings.meanings += own.meanings
        findings.types += own.types
        findings.uses += own.uses


def all_elements(
    buffer: BufferDef, at: YamlNode, direction: Literal["x", "y"], expressions: Expressions
) -> tuple[tuple[Element, ...], InterfaceRef | None]:
    """The elements of a buffer: those of its interface, if it is known, and its own."""
    typed = buffer.own
    found = resolve_elements(typed, at, expressions)
    untyped = [name for name in buffer.elements if name not in typed]
    used = None
    if buffer.interface is not None:
        used = _elements_of(buffer.interface, at["is"], expressions)
    else:
        for name in untyped:
            message = f"missing key `type` in `{'.'.join(map(str, at[name].route))}`"
            expressions.findings.report("E0102", message, at[name].key, help="add `type: ...`")
    if buffer.interface is None or used is None:
        expressions.broken.update(untyped)
        return found, None
    interface, shared = used
    ref = InterfaceRef(buffer.interface, interface.where.key)
    return extended(as_read(shared, direction), found, buffer, at, expressions), ref


def as_read(elements: tuple[Element, ...], direction: Literal["x", "y"]) -> tuple[Element, ...]:
    """Elements of both ends, as they are at the one that reads them or at the other one."""
    if direction == "x":
        return elements
    return tuple(replace(e, init=None, max_age_s=None, event=False) for e in elements)


def extended(
    given: tuple[Element, ...],
    own: tuple[Element, ...],
    buffer: BufferDef,
    at: YamlNode,
    expressions: Expressions,
) -> tuple[Element, ...]:
    """The elements that `is` gives to a buffer, with what it says of some, and its own ones."""
    findings = expressions.findings
    known = {element.name: element for element in given}
    for element in (element for element in own if element.name in known):
        giver = "other end" if buffer.interface == SAME else "interface"
        message = f"the {giver} has an element `{element.name}` already"
        related = (Related(known[element.name].place, "first defined here"),)
        help = "delete or rename one of the two"
        if isinstance(buffer, InputBufferDef):
            help = "delete its `type` to say more of that one, or rename it"
        findings.report("E0205", message, element.place, related=related, help=help)
    typed = buffer.own
    for name, item in buffer.elements.items():
        if name in typed:
            continue
        if name not in known:
            findings.unknown("E0201", "element", name, known, at[name].key)
            expressions.broken.add(name)
            continue
        old = known[name]
        new = _element(name, old.type, item, at[name], expressions)
        known[name] = replace(
            new,
            init=old.init if item.init is None else new.init,
            title=new.title or old.title,
            symbol=new.symbol or old.symbol,
            trace=old.trace if new.trace == Trace() else new.trace,
            max_age_s=old.max_age_s if new.max_age_s is None else new.max_age_s,
            event=new.event if "event" in item.given_keys else old.event,
        )
    return (*known.values(), *own)


def _elements_of(
    text: str, where: YamlNode, expressions: Expressions
) -> tuple[Interface, tuple[Element, ...]] | None:
    """The interface that a buffer names at `where` and its elements, or None after reporting."""
    definitions, findings = expressions.definitions, expressions.findings
    known = definitions.interfaces
    if text == SAME and SAME not in known:
        message = f"`{SAME}` is for the subsystem at the other end: a device has its elements here"
        findings.report("E0104", message, where.place, help="write them: `{name: type}`")
        return None
    names = definitions.names()
    findings.types.append(TypeText(where, "interface", text, names, definitions.places))
    takes = {n: (i.definition.frames, i.definition.types) for n, i in known.items()}
    try:
        used = parse_interface(text, names, takes)
    except ExprError as error:
        findings.expression_error(where, error)
        return None
    interface = known[used.name]
    scratch = Findings()
    found = _elements(interface, used.frames, used.types, scratch, expressions.broken)
    if scratch.diagnostics and not _check(interface).diagnostics:
        first = scratch.diagnostics[0]
        findings.report(
            "E0237",
            f"`{text}` is not possible: {first.message}",
            where.place,
            related=(Related(first.primary, "with these types, this is wrong"),),
            help=first.help,
        )
    elif scratch.diagnostics:
        findings.suppressed += 1
    return interface, found


def _check(interface: Interface) -> Findings:
    """What is found in an interface whatever types it is given."""
    definition, found = interface.definition, Findings()
    frames = tuple(f"?{name}" for name in definition.frames)
    _elements(interface, frames, (None,) * len(definition.types), found, set())
    return found


def _elements(
    interface: Interface,
    frames: tuple[Frame, ...],
    types: tuple[Type | None, ...],
    findings: Findings,
    broken: set[str],
) -> tuple[Element, ...]:
    """Its elements for frames and types; a type that is None is not known."""
    definition, around = interface.definition, interface.definitions
    own = dict(zip(definition.frames, frames, strict=True))
    makers = {n: _maker(n, type_) for n, type_ in zip(definition.types, types, strict=True)}
    local = replace(around, frames=around.frames | own, types=around.types | makers)
    expressions = Expressions(findings, local, broken)
    return resolve_elements(definition.elements, interface.where, expressions)


def _maker(name: str, type_: Type | None) -> MakeType:
    """What makes the type that a parameter stands for."""

    def make(frames: tuple[Frame, ...]) -> Type:
        if frames:
            raise ExprError(f"`{name}` takes no frames", 0, 0, f"write `{name}`", "E0306")
        if type_ is None:
            raise ExprError(f"`{name}` is not known", 0, 0, code=FOLLOW_UP)
        return type_

    return make
