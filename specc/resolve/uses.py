"""Which definition each name in an expression names: what resolving knew when it read the text.

Nothing else looks names up. A definition is known by the place of its name; a variable of a
quantifier by its place in the text, a member of an enum by a step below its type, the peer in
`x.peer.element` by the key of the buffer.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from specc.lang import RESERVED
from specc.lang.types import NameKind, NameMention, names_of
from specc.model import expr as m
from specc.model.system import Definition, Element, Memory
from specc.model.types import Enum, Record, Type
from specc.resolve.context import Findings, Meaning, TypeText, Use, YamlNode
from specc.schema import SpecFile
from specc.schema.places import split_at_part
from specc.source import Place

# Names in the machine of a subsystem, noted where they are looked up.


def note_target(
    findings: Findings, target: str, at: YamlNode, home: YamlNode, found: Element | Memory | None
) -> None:
    """Note a memory element, or peer and element of `y.peer.element`; the peer may be many.

    A target that `through` writes is no key of the file.
    """
    match target.split("."):
        case ["y", _, _] if at.raw is not None:
            written = str(at.route[-1])
        case [_]:
            findings.use(declared_at(home, "memory", target), at, part="key")
            return
        case _:
            return
    begin, middle = 2, written.rindex(".")
    buffer = _buffer_of(home, "y", written[begin:middle])
    findings.use(buffer, at, part="key", start=begin, end=middle)
    element = found.place if found else declared_at(home, "y", *written[begin:].split("."))
    findings.use(element, at, part="key", start=middle + 1, end=len(written))


def note_element(
    findings: Findings, name: str, at: YamlNode, home: YamlNode, element: Place
) -> None:
    """Note peer and element of `x.peer.element` or `y.peer.element`, declared at `element`."""
    begin, middle = 2, name.rindex(".")
    findings.use(_buffer_of(home, name[0], name[begin:middle]), at, start=begin, end=middle)
    findings.use(element, at, start=middle + 1, end=len(name))


def declared_at(home: YamlNode | None, *steps: str) -> Place | None:
    """Where a subsystem declares what may have an error, or comes later."""
    at = home
    for step in steps:
        at = at[step] if at and isinstance(at.raw, dict) and step in at.raw else None
    return at.key if at else None


def _buffer_of(home: YamlNode, direction: str, peer: str) -> Place:
    return Place(home.file, (*home.route, direction, peer), "key")


# Names in expressions, as their scopes have them.


NAME = re.compile(r"[^\W\d]\w*")
_INPUT = re.compile(r"\bx\s*\.\s*(\w+)")
_ELEMENT = re.compile(r"\bx\s*\.\s*(\w+)\s*\.\s*(\w+)")
_OF_MODE = re.compile(r"\b(?:elapsed|entered)\s*\(\s*(\w+)\s*\)")
"""What is asked of a mode."""
_LITERAL = re.compile(r"\d\s*\[[^\]]*\]|\"[^\"]*\"|'[^']*'")
_VARIABLE = re.compile(r"\bfor\s+(\w+)\s+in\b")


def uses_in(meaning: Meaning) -> Iterator[Use]:
    """Yield the names in an expression; with errors, only those whose spelling is enough."""
    text = _Text(meaning)
    return text.guessed() if meaning.expr is None else text.named(meaning.expr, {})


@dataclass(frozen=True, slots=True)
class _Text:
    """The text of an expression, with the names that are in force there."""

    meaning: Meaning

    def named(self, expr: m.Expr, variables: Mapping[str, Place]) -> Iterator[Use]:
        """The names in a part that is typed, each known for what it is."""
        text, (start, end) = self.meaning.text, expr.span
        match expr:
            case m.MemoryRef() | m.LetRef() | m.ConstantRef() | m.FileRef() | m.Call():
                own = expr.operator if isinstance(expr, m.Call) else expr.name
                kind, name = _KINDS[type(expr)], m.source_name(own)
                if found := _OF_MODE.match(text, start, end):
                    yield from self._mode(found)
                elif self._stands(name, start):
                    type_ = None if kind == "operator" else expr.type
                    yield from self._use(start, start + len(name), self._defined(kind, name), type_)
            case m.ParameterRef(name=name) if name in self.meaning.scope.parameters:
                parameter = self.meaning.scope.parameters[name]
                yield from self._use(start, end, parameter.place, expr.type)
            case m.BoundVariable():
                yield from self._use(start, end, variables.get(expr.name), expr.type)
            case m.Member(type=Enum() as enum) if self._stands(expr.name, start):
                yield from self._use(start, end, self._part(enum, expr.name), enum)
            case m.Input():
                yield from self._input(expr)
            case m.FieldOf(value=m.Node(type=Record() as record) as of) if of.span[1] < end:
                part = self._part(record, "fields", expr.name)
                yield from self._use(end - len(expr.name), end, part, expr.type)
            case m.IsOneOf(item=m.Node(type=Enum() as enum)):
                opening = text.find("{", expr.item.span[1], end)
                for found in NAME.finditer(text, opening, end) if opening >= 0 else ():
                    yield from self._use(*found.span(), self._part(enum, found.group()), enum)
            case m.Quantifier():
                spans = _VARIABLE.finditer(text, expr.body.span[1], expr.over.span[0])
                declared = next((f.span(1) for f in spans if f[1] == expr.variable), None)
                if declared:
                    at = self.meaning.where.place.within(*declared)
                    variables = {**variables, expr.variable: at}
                    yield from self._use(*declared, at)
        for child in m.children(expr):
            yield from self.named(child, variables)

    def _stands(self, name: str, start: int) -> bool:
        """Whether the text has the name there: a `let` of formulas stands for what it says."""
        found = NAME.match(self.meaning.text, start)
        return found is not None and found[0] == name

    def guessed(self) -> Iterator[Use]:
        """The names in a text that could not be typed, by how they are spelt alone."""
        text = self.meaning.text
        hidden = [found.span() for found in _LITERAL.finditer(text)]
        variables = {found.group(1) for found in _VARIABLE.finditer(text)}
        for found in _ELEMENT.finditer(text):
            peer, element = found.groups()
            yield from self._use(*found.span(1), self._buffer(peer))
            yield from self._use(*found.span(2), self._element(peer, element))
        for found in _OF_MODE.finditer(text):
            yield from self._mode(found)
        for found in NAME.finditer(text):
            start, end, name = *found.span(), found.group()
            behind_dot = text[:start].rstrip().endswith(".")
            in_literal = any(first <= start < last for first, last in hidden)
            if not (name in RESERVED or name in variables or behind_dot or in_literal):
                called = text[end:].lstrip().startswith("(")
                kinds = ("operator",) if called else _OF_VALUES
                known = (self._defined(kind, name) for kind in kinds)
                yield from self._use(start, end, next(filter(None, known), None))

    def _mode(self, found: re.Match[str]) -> Iterator[Use]:
        return self._use(*found.span(1), declared_at(self.meaning.home, "modes", found[1]))

    def _use(
        self, start: int, end: int, of: Place | None, type_: Type | None = None
    ) -> Iterator[Use]:
        if of is not None:
            yield Use(self.meaning.where.place.within(start, end), of, type_)

    def _defined(self, kind: str, name: str) -> Place | None:
        """Where what has a name of its own is defined."""
        scope, where = self.meaning.scope, self.meaning.where
        if kind == "parameter":
            parameter = scope.parameters.get(name)
            return parameter.place if parameter else None
        if kind in ("memory", "let"):
            declared = (scope.memory if kind == "memory" else scope.lets).get(name)
            return declared.place if declared else declared_at(self.meaning.home, kind, name)
        place = self.meaning.places.get(f"{kind} {name}")
        if place is None and kind == "constant" and name in scope.constants:
            return Place(where.file, ("parameters", name), "key")
        return place

    def _part(self, type_: Enum | Record, *steps: str) -> Place | None:
        place = self.meaning.places.get(f"type {type_.name}")
        return place.below(*steps) if place else None

    def _input(self, expr: m.Input) -> Iterator[Use]:
        """The peer, if it stands there, and the element; of many peers it may stand behind one."""
        text, (start, end) = self.meaning.text, expr.span
        if found := _INPUT.match(text, start):
            yield from self._use(*found.span(1), self._buffer(found.group(1)))
        begin = end - len(expr.element)
        if text[begin:end] == expr.element:
            yield from self._use(begin, end, self._element(expr.peer, expr.element), expr.type)

    def _element(self, peer: str, element: str) -> Place | None:
        declared = self.meaning.scope.inputs.get((peer, element))
        home = self.meaning.home
        return declared.place if declared else declared_at(home, "x", peer, element)

    def _buffer(self, peer: str) -> Place:
        where = self.meaning.where
        return Place(where.file, (*split_at_part(where.route)[0], "x", peer), "key")


_OF_VALUES = "parameter", "memory", "let", "constant", "file"
_KINDS = {
    m.MemoryRef: "memory",
    m.LetRef: "let",
    m.ConstantRef: "constant",
    m.FileRef: "file",
    m.Call: "operator",
}


# Names in the texts of types.


_CALLED: dict[NameKind, tuple[str, ...]] = {
    "type": ("type",),
    "interface": ("interface",),
    "frame": ("frame", "parameter"),
    "argument": ("frame", "parameter", "type"),
    "size": ("parameter",),
}


def names_in(text: TypeText) -> Iterator[NameMention]:
    """The names in the text of a type, whatever they name."""
    return names_of(text.form, text.text, text.names.types)


def uses_in_type(text: TypeText) -> Iterator[Use]:
    """The types, frames, sizes and interfaces that the text of a type names."""
    frames = text.names.frames
    for named in names_in(text):
        labels = (f"{kind} {named.name}" for kind in _CALLED[named.kind])
        of = next((text.places[label] for label in labels if label in text.places), None)
        # A frame that a record or an interface takes stands for others.
        if of is not None and not str(frames.get(named.name, "")).startswith("?"):
            yield Use(text.where.place.within(named.start, named.end), of)


# Which types, interfaces and constants of a file its other parts name.
#
# Frames are left out: section 3 of the paper has them described before anything is given in them.


_SECTIONS = ("types", "interfaces", "files", "constants", "operators")
MentionedTypes = Mapping[tuple[str | int, ...], set[str]]
"""Section and name of a definition -> the types and interfaces that its texts name: `type Mode`."""


def types_named(findings: Findings, path: str) -> MentionedTypes:
    """What the texts of types, and of constants, in the file at a path name there."""
    found: dict[tuple[str | int, ...], set[str]] = {}
    texts = [text for text in findings.types if text.where.file == path]
    # Most texts stand many times in a part, and name the same there.
    for text in {(text.where.route[:2], text.form, text.text): text for text in texts}.values():
        labels = found.setdefault(text.where.route[:2], set())
        for of in (use.of for use in uses_in_type(text) if use.of.file == path):
            labels.add(f"{str(of.route[0]).removesuffix('s')} {of.route[1]}")
    # The value and the range of a constant that may change are not in its expression.
    for meaning in findings.meanings:
        route = meaning.where.route
        if meaning.where.file == path and route[:1] == ("constants",) and meaning.expr:
            labels = found.setdefault(route[:2], set())
            labels |= {f"constant {name}" for name in m.constant_names(meaning.expr)}
    return found


def definitions_of(spec: SpecFile, top: YamlNode, named: MentionedTypes) -> tuple[Definition, ...]:
    """The definitions in a file, in its order, with the types that each one names."""
    return tuple(
        Definition(
            section[:-1],
            name,
            top[section][name].key,
            frozenset(named.get((section, name), ())),
        )
        for section in _SECTIONS
        for name in getattr(spec, section)
    )


def named_in_agents(named: MentionedTypes, findings: Findings, path: str) -> frozenset[str]:
    """The types and interfaces that agents and the plant name, e.g. `type Mode`.

    And the constants of arguments: descriptions get their values, without their names.
    """
    parts = [labels for route, labels in named.items() if route[0] not in _SECTIONS]
    constants = {
        f"constant {name}"
        for meaning in findings.meanings
        if "with" in meaning.where.route[2:-1] and meaning.where.file == path
        for name in (m.constant_names(meaning.expr) if meaning.expr else ())
    }
    return frozenset(constants.union(*parts))
