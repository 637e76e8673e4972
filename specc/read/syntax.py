"""Parse events, and the places where YAML goes wrong."""

from __future__ import annotations

import re
from collections.abc import Iterator

from _ruamel_yaml import CParser  # type: ignore[import-not-found]  # compiled, without stubs
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.events import (
    AliasEvent,
    DocumentStartEvent,
    Event,
    MappingEndEvent,
    MappingStartEvent,
    ScalarEvent,
    SequenceEndEvent,
    SequenceStartEvent,
)

from specc.diagnostics import Diagnostic, Related
from specc.source import Place

# The parse events of a YAML text, from the C parser that ruamel.yaml ships as an extra.
#
# Events rather than nodes: one pass over them gives data and places together, 20 times as fast as
# the Python parser of ruamel.yaml.


__all__ = [
    "AliasEvent",
    "DocumentStartEvent",
    "Event",
    "MappingEndEvent",
    "MappingStartEvent",
    "ScalarEvent",
    "SequenceEndEvent",
    "SequenceStartEvent",
    "YamlSyntaxError",
    "events",
]


class YamlSyntaxError(Exception):
    """Where and why a text is not YAML; positions are offsets into the text."""

    def __init__(self, problem: str, at: int, context: str = "", context_at: int | None = None):
        super().__init__(problem)
        self.problem = problem
        self.at = at
        self.context = context
        self.context_at = context_at


def events(text: str) -> Iterator[Event]:
    """Yield the events of a text that holds no forbidden character.

    Raises:
        YamlSyntaxError: the text is not YAML.
    """
    parser = CParser(text)
    try:
        while (event := parser.get_event()) is not None:
            yield event
    except MarkedYAMLError as error:
        mark, context_mark = error.problem_mark, error.context_mark
        raise YamlSyntaxError(
            error.problem or "this is not YAML",
            mark.index if mark is not None else 0,
            error.context or "",
            context_mark.index if context_mark is not None else None,
        ) from None
    except YAMLError as error:
        raise YamlSyntaxError(str(error), 0) from None


# Words for texts that are not YAML: what the parser stumbled over and what usually mends it.


_QUOTE = "put the value in double quotes"
_INDENT = "line the keys of a mapping up, and use the same indentation for all items of a list"
_UNCLOSED = "a quote, a bracket or a brace that was opened here or above is not closed"
_TEXT_IN_FLOW = (
    "close what was opened; inside { } and [ ], text that contains any of [ ] { } , "
    "must stand in double quotes"
)

# The parser's words, more readable words, and the way out.
_PROBLEMS = (
    (
        "mapping values are not allowed",
        "a `: ` is not expected here",
        f"{_QUOTE} if the colon belongs to it; otherwise check the indentation",
    ),
    (
        "cannot start any token",
        "text cannot start with this character",
        f"{_QUOTE} if the character belongs to it",
    ),
    ("did not find expected ',' or '}'", "expected `,` or `}`", _TEXT_IN_FLOW),
    ("did not find expected ',' or ']'", "expected `,` or `]`", _TEXT_IN_FLOW),
    ("did not find expected key", "expected a key of the mapping", _INDENT),
    ("did not find expected '-' indicator", "expected a `- ` item of the list", _INDENT),
    ("could not find expected ':'", "expected `:` after a key", _INDENT),
    ("unexpected end of stream", "the file ends inside quotes", _UNCLOSED),
    ("did not find expected node content", "expected a value", _UNCLOSED),
    ("unknown escape character", "unknown escape sequence", "write a backslash as \\\\"),
    ("hexdecimal number", "an escape sequence lacks digits", "write e.g. \\x07 or \\u00e9"),
    ("Unicode character escape", "no character has this number", "write the character itself"),
    (
        "found unexpected ':'",
        "a `:` is not expected inside { } and [ ]",
        "put the text in double quotes; a colon that ends a key has a space after it",
    ),
    ("block sequence entries", "a `- ` item is not expected here", _INDENT),
    ("mapping keys are not allowed", "a key is not expected here", _INDENT),
    ("violates indentation", "a tab indents this line", "indent with spaces"),
    ("document indicator", "`---` or `...` stands inside quotes", _UNCLOSED),
    ("document start", "text follows the end of the document", "delete the `...`"),
    (
        "alphabetic or numeric",
        "`&` and `*` are followed by a name",
        f"{_QUOTE} if the character belongs to it",
    ),
    ("comment or line break", "text follows `|` or `>` on the same line", _QUOTE),
    ("directive", "a line that begins with % is not expected", _QUOTE),
    ("incompatible YAML document", "unsupported version of YAML", "specc reads YAML 1.2"),
)
_CONTEXTS = (
    ("flow mapping", "the `{` is here"),
    ("flow sequence", "the `[` is here"),
    ("flow node", "the `[` or `{` is here"),
    ("quoted scalar", "the quotes open here"),
    ("simple key", "the key starts here"),
    ("block mapping", "the mapping starts here"),
    ("block collection", "the list starts here"),
    ("plain scalar", "the text starts here"),
    ("block scalar", "the block starts here"),
    ("anchor", "the anchor is here"),
    ("alias", "the alias is here"),
)
_UNFINISHED = "the unfinished part starts here"
_TAB_INDENT = re.compile(r"^ *\t[ \t]*", re.MULTILINE)


def syntax_error(path: str, text: str, fault: YamlSyntaxError) -> Diagnostic:
    """Make the finding for a text that the parser refused."""
    # A tab in the indentation of the line at fault; the parser may blame what follows it.
    line_start = max(text.rfind("\n", 0, fault.at), text.rfind("\r", 0, fault.at)) + 1
    tab = _TAB_INDENT.match(text, line_start)
    if tab is not None and fault.at <= tab.end():
        place = Place(path, (), "text", text.index("\t", tab.start()), tab.end())
        hint = "indent with spaces: YAML does not allow tabs there"
        return Diagnostic("E0009", "a tab indents this line", place, help=hint)
    message, hint = fault.problem, "check quotes, brackets and indentation near this place"
    for words, ours, way_out in _PROBLEMS:
        if words in fault.problem:
            message, hint = ours, way_out
            break
    related: tuple[Related, ...] = ()
    if fault.context_at is not None and fault.context_at != fault.at:
        # Where the construct starts that the parser could not finish.
        ours = next((ours for words, ours in _CONTEXTS if words in fault.context), _UNFINISHED)
        begin = Place(path, (), "text", fault.context_at, fault.context_at)
        related = (Related(begin, ours),)
    place = Place(path, (), "text", fault.at, fault.at)
    message = f"this is not YAML: {message}"
    return Diagnostic("E0009", message, place, related=related, help=hint)
