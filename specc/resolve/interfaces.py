"""Interfaces: named sets of elements, with the frames and types that a buffer gives them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from typing import Literal

from specc.diagnostics import Related
from specc.lang import FOLLOW_UP, TYPE_WORDS, ExprError, parse_interface
from specc.lang.types import MakeType
from specc.model.system import Element, InterfaceRef
from specc.model.types import Frame, Type
from specc.resolve.context import Findings, TypeText, Where
from specc.resolve.definitions import Definitions, Interface
from specc.resolve.elements import resolve_elements
from specc.resolve.expressions import Expressions
from specc.schema.subsystem import BufferDef


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
        alone = _alone(interface)
        findings.diagnostics += alone.diagnostics
        findings.note(alone.notes())


def all_elements(
    buffer: BufferDef, at: Where, direction: Literal["x", "y"], expressions: Expressions
) -> tuple[tuple[Element, ...], InterfaceRef | None]:
    """The elements of a buffer: those of its interface, if that is known, and its own."""
    found = resolve_elements(buffer.elements, at, expressions)
    if buffer.interface is None:
        return found, None
    used = _elements_of(buffer.interface, at.scalar("is"), expressions)
    if used is None:
        return found, None
    interface, shared = used
    if direction == "y":
        shared = tuple(replace(element, init=None, max_age_s=None) for element in shared)
    _report_twice(found, shared, expressions)
    return (*shared, *found), InterfaceRef(buffer.interface, interface.where.key)


def _report_twice(
    own: tuple[Element, ...], shared: tuple[Element, ...], expressions: Expressions
) -> None:
    """Elements of a buffer that its interface has already."""
    first = {element.name: element.place for element in shared}
    for element in own:
        if element.name in first:
            message = f"the interface has an element `{element.name}` already"
            related = (Related(first[element.name], "first defined here"),)
            help_text = "delete or rename one of the two"
            expressions.findings.report(
                "E0205", message, element.place, related=related, help=help_text
            )


def _elements_of(
    text: str, where: Where, expressions: Expressions
) -> tuple[Interface, tuple[Element, ...]] | None:
    """The interface that a buffer names at `where` and its elements, or None after reporting."""
    definitions, findings = expressions.definitions, expressions.findings
    known = definitions.interfaces
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
    if scratch.diagnostics and not _alone(interface).diagnostics:
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


def _alone(interface: Interface) -> Findings:
    """What is found in an interface whatever types it is given."""
    definition, alone = interface.definition, Findings()
    frames = tuple(f"?{name}" for name in definition.frames)
    _elements(interface, frames, (None,) * len(definition.types), alone, set())
    return alone


def _elements(
    interface: Interface,
    frames: tuple[Frame, ...],
    types: tuple[Type | None, ...],
    findings: Findings,
    broken: set[str],
) -> tuple[Element, ...]:
    """Its elements for frames and types; a type that is None is not known."""
    definition, around = interface.definition, interface.definitions
    local = replace(
        around,
        frames=around.frames | dict(zip(definition.frames, frames, strict=True)),
        types=around.types
        | {name: _given(name, type_) for name, type_ in zip(definition.types, types, strict=True)},
    )
    expressions = Expressions(findings, local, broken)
    return resolve_elements(definition.elements, interface.where, expressions)


def _given(name: str, type_: Type | None) -> MakeType:
    """What makes the type that a parameter stands for."""

    def made(frames: tuple[Frame, ...]) -> Type:
        if frames:
            raise ExprError(f"`{name}` takes no frames", 0, 0, f"write `{name}`", "E0306")
        if type_ is None:
            raise ExprError(f"`{name}` is not known", 0, 0, code=FOLLOW_UP)
        return type_

    return made
