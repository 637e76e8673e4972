"""Scalars and collections of YAML, composed from parse events."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

from specc.diagnostics import Diagnostic, Faults, Related, TooManyFaultsError
from specc.limits import MAX_DEPTH, MAX_KEYS, MAX_VALUES
from specc.read.syntax import (
    AliasEvent,
    DocumentStartEvent,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
    YamlSyntaxError,
    events,
    syntax_error,
)
from specc.source import Place, TextNode

# What a plain scalar means: the core schema of YAML 1.2 (10.3.2).
#
# `on`, `off`, `yes` and `no` are text, as are sexagesimal numbers and dates.


_NULLS = frozenset(("", "~", "null", "Null", "NULL"))
_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(_NULLS, None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_NUMBER_STARTS = frozenset("+-.0123456789")
_FORMS: tuple[tuple[re.Pattern[str], Callable[[str], int | float]], ...] = (
    (re.compile(r"[-+]?[0-9]+"), int),
    (re.compile(r"0o[0-7]+"), lambda text: int(text[2:], 8)),
    (re.compile(r"0x[0-9a-fA-F]+"), lambda text: int(text[2:], 16)),
    (re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?"), float),
)
_INFINITY = re.compile(r"[-+]?\.(?:inf|Inf|INF)")
_NOT_A_NUMBER = frozenset((".nan", ".NaN", ".NAN"))

# Longer ones are out of range or a mistake, and int() of a very long text is slow.
_MOST_DIGITS = 400
_LARGEST_INT = 2**63 - 1


class NumberRangeError(ValueError):
    """A number that neither a double nor an integer of 64 bits can hold."""


def plain_value(text: str) -> str | int | float | bool | None:
    """Value of an unquoted scalar.

    Raises:
        NumberRangeError: the text is a number beyond 64 bits, a double or 400 digits.
    """
    if text in _WORDS:
        return _WORDS[text]
    return _number(text) if text[0] in _NUMBER_STARTS else text


def is_null(text: str) -> bool:
    """Whether an unquoted scalar stands for no value."""
    return text in _NULLS


def _number(text: str) -> str | int | float:
    for pattern, convert in _FORMS:
        if pattern.fullmatch(text):
            number = convert(text) if len(text) <= _MOST_DIGITS else math.inf
            if abs(number) > _LARGEST_INT if isinstance(number, int) else math.isinf(number):
                raise NumberRangeError(text)
            return number
    if _INFINITY.fullmatch(text):
        return -math.inf if text.startswith("-") else math.inf
    return math.nan if text in _NOT_A_NUMBER else text


# From parse events to plain data and a tree of places, in one pass, within limits.


_ANCHOR = re.compile(r"&[^\s,\[\]{}]+(?:\s+(?:#[^\r\n]*)?)*")
"""An anchor with the white space and comments behind it."""
_NO_PARTS: dict[str | int, TextNode] = {}
"""Of all scalars; nothing is put into it."""
_VALUES = frozenset((ScalarEvent, AliasEvent, MappingStartEvent, SequenceStartEvent))


@dataclass(frozen=True, slots=True)
class ComposedValue:
    """A value and its place; `size` counts the keys and values in it, aliases expanded."""

    data: Any
    node: TextNode
    size: int


def compose(path: str, text: str) -> tuple[ComposedValue | None, tuple[Diagnostic, ...]]:
    """Data with places, and findings, of a YAML text that holds no forbidden character.

    There is no data when the text is not YAML or goes beyond the limits of depth and size.
    """
    composer = _Composer(path, text)
    try:
        root = composer.document()
    except YamlSyntaxError as fault:
        return None, (*composer.findings, syntax_error(path, text, fault))
    except (_GiveUpError, TooManyFaultsError):
        return None, tuple(composer.findings)
    if root is None or (root.node.scalar == "" and not root.node.style):
        composer.report("E0022", "the file is empty", 0, 0, "start with `specc: 1`")
        return None, tuple(composer.findings)
    return root, tuple(composer.findings)


class _GiveUpError(Exception):
    """The last finding makes the rest of the file meaningless or too expensive."""


class _Composer:
    """Gives every event its meaning; what a specification may not have becomes a finding."""

    def __init__(self, path: str, text: str) -> None:
        self.findings = Faults()
        self._path = path
        self._text = text
        self._events = events(text)
        self._anchors: dict[str, ComposedValue | None] = {}
        self._nodes = 0

    def document(self) -> ComposedValue | None:
        """The value of the one document; None if there is none."""
        root, documents = None, 0
        for event in self._events:
            if type(event) is DocumentStartEvent:
                documents += 1
                if documents > 1:
                    hint = "delete the `---`, or move what follows it to a file of its own"
                    self._abort("E0013", "a second document starts here", event, hint)
            elif type(event) in _VALUES:
                root = self._value(event, 0, None)
        return ComposedValue(*root, self._nodes) if root else None

    def report(
        self, code: str, message: str, start: int, end: int, hint: str, *related: Related
    ) -> None:
        """Add a finding about a stretch of the text."""
        self.findings.add(Diagnostic(code, message, self._text_at(start, end), "", related, hint))

    def _text_at(self, start: int, end: int) -> Place:
        return Place(self._path, (), "text", start, end)

    def _value(self, event: Any, depth: int, key: TextNode | None) -> tuple[Any, TextNode]:
        """The value that begins with an event, below `depth` collections and perhaps a key."""
        if type(event) is AliasEvent:
            return self._alias(event, depth)
        if event.ctag is not None:
            self._refuse_tag(event)
        before = self._nodes
        if type(event) is ScalarEvent:
            value = self._scalar(event, key)
        else:
            value = self._collection(event, depth)
        if event.anchor is not None:
            self._anchors[event.anchor] = ComposedValue(*value, self._nodes - before)
        return value

    def _scalar(self, event: Any, key: TextNode | None) -> tuple[Any, TextNode]:
        node = self._node(event)
        if node.start == node.end and key is not None:
            self._refuse_cut_text(event, key)
        data = event.value
        if not node.style:
            try:
                data = plain_value(data)
            except NumberRangeError:
                hint = "numbers have at most 64 bits; quote it if it is meant as text"
                self.report("E0018", "this number is out of range", node.start, node.end, hint)
        return data, node

    def _node(self, event: Any) -> TextNode:
        start, end = self._start_of(event), event.end_mark.index
        return TextNode(start, end, event.value, event.style or "", _NO_PARTS, _NO_PARTS)

    def _collection(self, event: Any, depth: int) -> tuple[Any, TextNode]:
        if depth >= MAX_DEPTH:
            self._too_deep(event)
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        start = self._start_of(event)
        node = TextNode(start, start)
        if type(event) is MappingStartEvent:
            data, last = self._mapping(node, depth + 1)
        else:
            data = []
            while type(last := next(self._events)) is not SequenceEndEvent:
                self._count(1, last)
                item, node.values[len(data)] = self._value(last, depth + 1, None)
                data.append(item)
        # A block collection "ends" where the next token starts, often lines below.
        if last.start_mark.index < last.end_mark.index:
            node.end = last.end_mark.index
        elif node.values:
            node.end = max(part.end for part in node.values.values())
        return data, node

    def _mapping(self, mapping: TextNode, depth: int) -> tuple[Any, Any]:
        data: dict[str, Any] = {}
        while type(event := next(self._events)) is not MappingEndEvent:
            self._count(2, event)
            if type(event) is not ScalarEvent:
                hint = "a key is a name or a text in quotes"
                self._abort("E0013", "this cannot be a key", event, hint)
            if event.ctag is not None:
                self._refuse_tag(event)
            key = self._node(event)
            name = key.scalar or ""
            is_accepted = self._accepts_key(key, name, mapping)
            value, node = self._value(next(self._events), depth, key)
            if is_accepted:
                data[name], mapping.keys[name], mapping.values[name] = value, key, node
        return data, event

    def _accepts_key(self, key: TextNode, name: str, mapping: TextNode) -> bool:
        """Whether a mapping may have the key; reports it if not."""
        first = mapping.keys.get(name)
        related: tuple[Related, ...] = ()
        if not key.style and name in _NULLS:
            code, message = "E0013", "a key is missing here"
            hint = "write the key before the colon, in quotes if it is meant as text"
        elif not key.style and name == "<<":
            code, message = "E0013", "merge keys are not supported"
            hint = "write the keys out, or use a description from another file with parameters"
        elif first is not None:
            code, message = "E0011", f"the key `{name}` is given twice"
            related = (Related(self._text_at(first.start, first.end), "first given here"),)
            hint = "give it once: rename or delete one of the two"
        elif len(mapping.keys) >= MAX_KEYS:
            code, message = "E0017", "the mapping has too many keys"
            hint = f"a mapping may have {MAX_KEYS} keys"
        else:
            return True
        self.report(code, message, key.start, key.end, hint, *related)
        if code == "E0017":
            raise _GiveUpError
        return False

    def _alias(self, event: Any, depth: int) -> tuple[Any, TextNode]:
        if event.anchor not in self._anchors:
            hint = f"write `&{event.anchor}` before the value that is meant"
            self._abort("E0009", f"no anchor is called `{event.anchor}`", event, hint)
        target = self._anchors[event.anchor]
        if target is None:
            hint = "an alias may only name a value that is complete before it"
            self._abort("E0009", f"`*{event.anchor}` stands inside its own value", event, hint)
        self._count(target.size, event)
        if depth + _height(target.node) > MAX_DEPTH:
            self._too_deep(event)
        return target.data, target.node

    def _count(self, nodes: int, event: Any) -> None:
        self._nodes += nodes
        if self._nodes > MAX_VALUES:
            hint = f"with its aliases written out, a file may hold {MAX_VALUES} values"
            self._abort("E0017", "the file holds too many values", event, hint)

    def _too_deep(self, event: Any) -> NoReturn:
        hint = f"values may be nested {MAX_DEPTH} levels deep"
        self._abort("E0017", "this is nested too deep", event, hint)

    def _refuse_tag(self, event: Any) -> None:
        hint = "delete it; a value in quotes is text, any other is what it looks like"
        start = event.start_mark.index
        self.report("E0013", "tags are not supported", start, event.end_mark.index, hint)

    def _refuse_cut_text(self, event: Any, key: TextNode) -> None:
        """Refuse `b)`, which the braces of `{is: min(a, b)}` make a key without a value."""
        if key.style or not key.scalar or not key.scalar.endswith(")"):
            return
        if ":" not in self._text[key.end : event.start_mark.index]:
            self.report(
                "E0013",
                f"a comma ends a text inside {{ }}: `{key.scalar}` is read as a key",
                key.start,
                key.end,
                "put the whole text, from before the comma on, in double quotes",
            )
            raise _GiveUpError

    def _start_of(self, event: Any) -> int:
        """The offset at which a value begins, after its anchor."""
        start: int = event.start_mark.index
        if event.anchor is None:
            return start
        anchor = _ANCHOR.match(self._text, start)
        # An empty value ends with its anchor.
        return min(anchor.end(), max(start, event.end_mark.index)) if anchor else start

    def _abort(self, code: str, message: str, event: Any, hint: str) -> NoReturn:
        self.report(code, message, event.start_mark.index, event.end_mark.index, hint)
        raise _GiveUpError


def _height(node: TextNode) -> int:
    """The number of levels of collections below a value, within its size, which is counted."""
    return 1 + max(map(_height, node.values.values())) if node.values else 0
