"""What importers write: names, rates and YAML, which `specc.tools.fmt` lays out."""

from __future__ import annotations

import keyword
import re
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from specc.emit import fill
from specc.lang import RESERVED
from specc.tools.fmt import format_text
from specc.tools.fmt.layout import WIDTH
from specc.tools.fmt.tree import Collection, Scalar, key_text, quoted, value_text

_LONGEST = 60
PEERS = frozenset(("c", "E", "R"))
"""Names that no agent can have: these stand for parts of the agent itself (docs/language.md 6)."""


class SpecNames:
    """Legal and unique names for foreign ones."""

    def __init__(self, used: Iterable[str] = ()) -> None:
        self._known: dict[str, str] = {}
        self._used = {*RESERVED, *used}
        self._counts: dict[str, int] = {}

    def of(self, foreign: str) -> str:
        """The name for a foreign one, the same in every call."""
        if foreign not in self._known:
            self._known[foreign] = self.new(foreign)
        return self._known[foreign]

    def new(self, wish: str) -> str:
        """A new legal name, as close to `wish` as possible."""
        base = re.sub(r"\W+", "_", wish, flags=re.ASCII).strip("_")[:_LONGEST] or "unnamed"
        if base[0].isdigit() or keyword.iskeyword(base):
            base = f"n_{base}"
        name, count = base, self._counts.get(base, 2)
        while name in self._used:
            name, count = f"{base}_{count}", count + 1
        self._used.add(name)
        self._counts[base] = count
        return name

    @property
    def renamed(self) -> dict[str, str]:
        """Foreign names that are not legal or not unique -> their new names."""
        return {old: new for old, new in self._known.items() if old != new}


def printable(text: str) -> str:
    """A text without characters that cannot be shown."""
    return "".join(c if c.isprintable() else "?" for c in text)


def comment_lines(text: str, width: int) -> list[str]:
    """A text as lines of a comment; items of lists are indented."""
    inner = "  " if text.startswith("- ") else ""
    return textwrap.wrap(
        printable(text),
        width,
        subsequent_indent=inner,
        break_long_words=False,
        break_on_hyphens=False,
    )


def rate(period: Fraction) -> str:
    """A period as the language writes it: whole hertz where it is a whole number of them."""
    frequency = 1 / period
    if frequency.denominator == 1:
        return f"{frequency.numerator} Hz"
    return f"{float(period * 1000):.12g} ms"


@dataclass(frozen=True, slots=True)
class Commented:
    """A value of a mapping with lines of comments above its key."""

    value: Data
    lines: Sequence[str]


Data = str | bool | Commented | Sequence["Data"] | Mapping[str, "Data"]
_NUMBER = re.compile(r"[0-9]+(?:\.[0-9]+)?")


def fill_yaml(
    template: str, parts: Mapping[str, Any], change: Callable[[Collection], None] | None = None
) -> str:
    """The text of a template of YAML, in the canonical layout.

    The template prints values by `yaml`, and those of sections by `section`.
    """
    return format_text(fill(template, {"yaml": to_yaml, "section": _section, **parts}), change)


def _section(data: Mapping[str, Data]) -> str:
    return textwrap.indent("\n".join(_entries(data)), "  ")


def to_yaml(value: Data) -> str:
    """A value as YAML in braces, a line for each entry: what does not fit becomes a block."""
    if isinstance(value, Commented):
        return to_yaml(value.value)
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return value if _NUMBER.fullmatch(value) else quoted(value)
    if isinstance(value, Mapping):
        return "{\n" + ",\n".join(_entries(value)) + "}" if value else "{}"
    return "[\n" + ",\n".join(map(to_yaml, value)) + "]" if value else "[]"


def _entries(data: Mapping[str, Data]) -> Iterator[str]:
    for key, value in data.items():
        lines = value.lines if isinstance(value, Commented) else ()
        yield "".join(f"# {line}\n" for line in lines) + f"{quoted(key)}: {to_yaml(value)}"


def fold(tree: Collection, indent: int = 0) -> None:
    """Break texts that are too long for a line, such as expressions, over several."""
    for entry in tree.entries:
        value = entry.value
        if isinstance(value, Collection):
            fold(value, indent + 2)
        elif isinstance(value, Scalar) and entry.key and " " in value.text:
            line = f"{key_text(entry.key, flow=False)}: {value_text(value, flow=False)}"
            if indent + len(line) > WIDTH:
                lines = textwrap.wrap(
                    value.text, WIDTH - indent - 2, break_long_words=False, break_on_hyphens=False
                )
                value.style, value.raw = ">", "\n".join((">-", *lines))
