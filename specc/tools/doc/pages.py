"""The text of a document in Typst as it grows: headings, equations, tables, pictures, references.

Numbers of equations, tables and figures are known when all is there: a number that several
equations have gets letters, and whatever else names one leads to it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

from specc.model.fsm import Trace
from specc.reachable import grouped
from specc.source import Place, Sources
from specc.tools.doc.markup import Math, array, call, string, unlinked, verbatim
from specc.tools.graph.diagram import Diagram

NumberKind = Literal["eq", "table", "fig"]
_NO_TRACE = Trace()
_WIDTH = 62
"""Of a formula that fits into a page of HTML."""
_NARROW = 40
"""Of a formula that fits into a page of paper for certain, so that nothing has to be measured."""
_WORDS = {"eq": "eq.", "table": "Table", "fig": "Fig."}
_PLURALS = {"eq": "eqs", "table": "Tables", "fig": "Figs"}


@dataclass(eq=False, slots=True)
class NumberMark:
    """A number of the specification where the document shows it.

    Equations are the first choice for the place that has it, then captions, then mentions.
    """

    kind: NumberKind
    value: int
    role: Literal["equation", "caption", "mention"]


Part = str | NumberMark


@dataclass(slots=True)
class IndexEntry:
    """What the index says of a number: where it is, and in which line of which file."""

    label: str
    words: str
    place: Place | None


@dataclass(slots=True)
class Pages:
    """Parts of the text, and what stands in them."""

    sources: Sources
    main: str
    """The file of the system."""
    parts: list[Part] = field(default_factory=list)
    defined: dict[str, None] = field(default_factory=dict)
    """The names of places that something can lead to."""
    lines: dict[str, set[int]] = field(default_factory=dict)
    """File -> lines that something leads to."""
    pictures: list[Diagram] = field(default_factory=list)
    """In their order."""
    contents: list[tuple[int, str, str, str]] = field(default_factory=list)
    """Level, number, name of the place and words of each heading."""
    index: dict[tuple[NumberKind, int], list[IndexEntry]] = field(default_factory=dict)
    marks: dict[int, str] = field(default_factory=dict)
    """Numbers of equations with departures -> where the document tells of them."""

    def add(self, *parts: Part) -> None:
        """Add text."""
        self.parts += parts

    def heading(self, level: int, text: str, id: str = "", symbol: Math | None = None) -> None:
        """A heading, with a symbol behind it."""
        levels = [number for at, number, _, _ in self.contents if at == level]
        above = next((n for at, n, _, _ in reversed(self.contents) if at == level - 1), "")
        inside = [n for n in levels if n.startswith(f"{above}.")] if above else levels
        number = f"{above}.{len(inside) + 1}" if above else str(len(inside) + 1)
        id = id or f"section-{number}"
        self.defined[id] = None
        self.contents.append((level, number, id, text))
        after = f" {symbol.inline}" if symbol else ""
        self.add(f"#title_({level}, {string(number)}, {string(id)}, [#{string(text)}{after}])\n")

    def text(self, text: str) -> None:
        """A paragraph."""
        self.add(f"#par_[#{string(text)}]\n")

    def content(self, content: str) -> None:
        """A paragraph of text of Typst."""
        self.add(f"#par_[{content}]\n")

    # References.

    def source(self, place: Place | None) -> str:
        """Code of a reference to a line of a file; `none` where there is none."""
        if place is None or not place.file:
            return "none"
        span = self.sources.span(place)
        if not span.line:
            return "none"
        self.lines.setdefault(place.file, set()).add(span.line)
        name = f"{self.shown(place.file)}:{span.line}"
        return call("src", string(name), string(self.line_id(place.file, span.line)))

    def shown(self, file: str) -> str:
        """A file as the document calls it: relative to the one of the system."""
        if file.startswith("specc:"):
            return file
        return os.path.relpath(file, os.path.dirname(self.main) or ".")

    def line_id(self, file: str, line: int) -> str:
        """The name of a line in the appendix."""
        return f"line-{list(self.lines).index(file) + 1}-{line}"

    def anchor(self, id: str) -> str:
        """Code of a place that others lead to."""
        self.defined[id] = None
        return call("anchor", string(id))

    def mentions(self, trace: Trace, words: str = "", place: Place | None = None) -> list[Part]:
        """The numbers of a part, which is in a table or a text."""
        found: list[Part] = []
        for kind, values in _kinds(trace):
            for number, value in enumerate(values):
                self._note(kind, value, words, place)
                one = _WORDS[kind] if len(values) == 1 else _PLURALS[kind]
                found += [f"#{string(one)}~" if number == 0 else ", "]
                found += [NumberMark(kind, value, "mention")]
            found.append('#"; "')
        return found[:-1]

    def caption(self, trace: Trace, words: str, place: Place | None = None) -> list[Part]:
        """The tables and figures of what a caption stands under; the caption has their numbers."""
        found: list[Part] = []
        for kind, values in _kinds(trace):
            for number, value in enumerate(values):
                self._note(kind, value, words, place)
                one = _WORDS[kind] if len(values) == 1 else _PLURALS[kind]
                found += [f"#{string(one)}~" if number == 0 else ", "]
                found += [NumberMark(kind, value, "caption")]
            found.append(". ")
        return found

    def _note(self, kind: NumberKind, value: int, words: str, place: Place | None) -> None:
        self.index.setdefault((kind, value), []).append(IndexEntry("", words, place))

    # Blocks.

    def equation(
        self,
        id: str,
        forms: Sequence[Math],
        trace: Trace = _NO_TRACE,
        *,
        title: str = "",
        name: str = "",
        about: str = "",
        place: Place | None = None,
    ) -> None:
        """An equation in several forms, of which the first that fits is shown.

        The index calls it by its title, by its name, or by what it is `about`.
        """
        words = title or name or about
        ids = array(string(each) for each in (id,) if each)
        if id:
            self.defined[id] = None
        numbers: list[Part] = []
        for number, value in enumerate(trace.eq):
            self._note("eq", value, words, place)
            numbers += ["#sym.comma~"] * bool(number) + [NumberMark("eq", value, "equation")]
        marked = [self.marks[value] for value in trace.eq if value in self.marks]
        rest = Trace(table=trace.table, fig=trace.fig)
        self.add(f"#equation({ids}, [")
        self.add(*numbers)
        forms = [unlinked(form, id) for form in forms]
        fits = [number for number, form in enumerate(forms) if form.width <= _WIDTH]
        wide = fits[0] if fits else len(forms) - 1
        narrow = "true" if forms[0].width <= _NARROW else "false"
        has_number = "true" if numbers else "false"
        shown = f"[#{string(title)}]" if title else "[]"
        self.add(f"], {has_number}, {array(form.inline for form in forms)}, ")
        self.add(f"{narrow}, {wide}, {shown}, ")
        self.add(f"{string(name)}, [")
        self.add(*self.mentions(rest, words, place))
        self.add(f"], {self.source(place)}, {array(map(string, dict.fromkeys(marked)))})\n")

    def table(
        self,
        columns: Sequence[str],
        rows: Iterable[Sequence[str | list[Part]]],
        caption: list[Part] | None = None,
        widths: str = "",
    ) -> None:
        """A table; cells are content of Typst. Without rows nothing is shown."""
        found = list(rows)
        if not found:
            return
        heads = array(f"[#{string(column)}]" for column in columns)
        self.add(f"#table_({widths or len(columns)}, {heads}, [")
        self.add(*(caption or []), "], (")
        for row in found:
            for cell in row:
                self.add("[", *([cell] if isinstance(cell, str) else cell), "], ")
            self.add("\n")
        self.add("))\n")

    def picture(self, diagram: Diagram, caption: list[Part], words: str) -> None:
        """A picture."""
        self.add(f"#picture({len(self.pictures)}, {string(words)}, [", *caption, "])\n")
        self.pictures.append(diagram)

    # The whole.

    def finished(self) -> str:
        """The text, with all numbers."""
        numbers = [part for part in self.parts if isinstance(part, NumberMark)]
        shown: dict[int, str] = {}
        for (kind, value), uses in grouped(((n.kind, n.value), n) for n in numbers).items():
            shown |= _numbered(kind, value, uses)
        return "".join(shown[id(p)] if isinstance(p, NumberMark) else p for p in self.parts)

    @property
    def places(self) -> dict[str, None]:
        """All names that something can lead to, with those of lines and numbers."""
        found = dict(self.defined)
        found |= {f"{kind}-{value}": None for kind, value in self.index}
        for file, lines in self.lines.items():
            found |= {self.line_id(file, line): None for line in sorted(lines)}
        return found


def _kinds(trace: Trace) -> list[tuple[NumberKind, tuple[int, ...]]]:
    found: list[tuple[NumberKind, tuple[int, ...]]] = [
        ("eq", trace.eq), ("table", trace.table), ("fig", trace.fig),
    ]  # fmt: skip
    return [(kind, values) for kind, values in found if values]


def _numbered(kind: NumberKind, value: int, uses: list[NumberMark]) -> dict[int, str]:
    """The code of each place that shows a number."""
    place = f"{kind}-{value}"
    owners = [use for use in uses if use.role == "equation"]
    owners = owners or [use for use in uses if use.role == "caption"][:1] or uses[:1]
    shown = {id(use): f"#ref_({string(place)})[#{string(str(value))}]" for use in uses}
    for number, use in enumerate(owners):
        letter = _letters(number) if len(owners) > 1 else ""
        name = string(place if number == 0 else f"{place}{letter}")
        text = f"({value}{letter})" if use.role == "equation" else f"{value}{letter}"
        shown[id(use)] = f"#number_({name}, {string(kind)})[#{string(text)}]"
    return shown


def _letters(number: int) -> str:
    """a, b, …, z, aa, ab, …"""
    more, last = divmod(number, 26)
    return (_letters(more - 1) if more else "") + chr(ord("a") + last)


def mono(text: str) -> str:
    """Content of Typst: a name or text of the language as it is written."""
    return f"#mono({verbatim(text)})"


def plain(text: str) -> str:
    """Content of Typst: words."""
    return f"#{string(text)}" if text else ""
