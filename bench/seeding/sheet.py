"""A specification as text with places: what faults are seeded into, one edit at a time."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from specc.read import read_text
from specc.source import Route, TextNode

WORD = re.compile(r"(?<![\w.])[A-Za-z_]\w*")
UNIT = re.compile(r"(?<=[\w.])\[[^\]]*\]")


class Edit(NamedTuple):
    """New text for the characters from `start` up to `end`."""

    start: int
    end: int
    text: str


@dataclass(frozen=True)
class Sheet:
    """The text of a file and its data; places are offsets into the text."""

    path: str
    text: str
    data: Any = field(repr=False)
    root: TextNode = field(repr=False)

    @classmethod
    def read(cls, path: Path) -> Sheet:
        """The sheet of a file that is YAML; raises ValueError for any other."""
        text = path.read_text(encoding="utf-8")
        document = read_text(str(path), text)
        if document.source.spans is None:
            raise ValueError(f"{path} is not YAML")
        return cls(str(path), text, document.data, document.source.spans)

    def at(self, route: Route) -> TextNode:
        """Place of the value at a route."""
        node = self.root
        for step in route:
            node = node.values[step]
        return node

    def key(self, route: Route) -> TextNode:
        """Place of the key that names the value at a route."""
        return self.at(route[:-1]).keys[route[-1]]

    def get(self, route: Route, default: Any = None) -> Any:
        """Data at a route, or the default."""
        data = self.data
        for step in route:
            try:
                data = data[step]
            except (KeyError, IndexError, TypeError):
                return default
        return data

    def has(self, route: Route) -> bool:
        """Whether there is a value at a route."""
        return self.get(route, self) is not self

    def entries(self, route: Route) -> list[Route]:
        """Routes of the parts of the mapping or list at a route, none if there is no such."""
        data = self.get(route)
        steps = data if isinstance(data, dict) else range(len(data) if type(data) is list else 0)
        return [(*route, step) for step in steps]

    def raw(self, node: TextNode) -> str:
        """The characters of a place as they are written."""
        return self.text[node.start : node.end]

    def replaced(self, node: TextNode, text: str) -> Edit:
        """Other text in place of a value or key."""
        # The text of a folded scalar ends with its line break.
        return Edit(node.start, node.start + len(self.raw(node).rstrip()), text)

    def rewritten(self, node: TextNode, text: str) -> Edit:
        """Other text in place of a value or key, in the quotes that it has."""
        quote = self.text[node.start] if self.text[node.start] in "\"'" else ""
        return self.replaced(node, f"{quote}{text}{quote}")

    def inside(self, route: Route, start: int, end: int, text: str) -> Edit:
        """Other text for a part of a scalar, which gets quotes where the new text needs them."""
        node = self.at(route)
        if self.text[node.start] in "\"'>|" or not re.search(r"[,\[\]{}]", text):
            return Edit(start, end, text)
        whole = self.text[node.start : start] + text + self.text[end : node.end]
        return Edit(node.start, node.end, f'"{whole}"')

    def scalar(self, route: Route, key: str) -> Route:
        """Route to the text of a part in its long form, `key: text`, or in its short form."""
        return (*route, key) if isinstance(self.get(route), dict) else route

    def walk(self, route: Route = ()) -> Iterator[Route]:
        """Routes of all values, parents first."""
        yield route
        for entry in self.entries(route):
            yield from self.walk(entry)

    def removed(self, route: Route) -> Edit:
        """The edit that takes a whole entry away, with its comma or its lines."""
        start, end = self._extent(route)
        siblings = self.entries(route[:-1])
        index = siblings.index(route)
        if self._in_flow(route):
            if index + 1 < len(siblings):
                return Edit(start, self._extent(siblings[index + 1])[0], "")
            return Edit(self._extent(siblings[index - 1])[1] if index else start, end, "")
        # The first key of an item of a list shares its line with the dash.
        line_start, line_end = self._line_start(start), self.text.find("\n", end)
        shared = isinstance(route[-1], str) and self.text[line_start:start].strip()
        if shared and index + 1 < len(siblings):
            return Edit(start, self._extent(siblings[index + 1])[0], "")
        return Edit(line_start, len(self.text) if line_end < 0 else line_end + 1, "")

    def beside(self, route: Route, text: str) -> Edit:
        """The edit that puts another entry in front of the one at a route."""
        start, _ = self._extent(route)
        if self._in_flow(route):
            return Edit(start, start, f"{text}, ")
        if isinstance(route[-1], int):
            start, text = self.text.rindex("-", 0, start), f"- {text}"
        margin = " " * (start - self._line_start(start))
        return Edit(start, start, f"{text}\n{margin}")

    def one_line(self, route: Route) -> bool:
        """Whether an entry is written on one line."""
        start, end = self._extent(route)
        return "\n" not in self.text[start:end]

    def entry(self, route: Route) -> str:
        """The characters of a whole entry, key and value."""
        start, end = self._extent(route)
        return self.text[start:end]

    def words(self, route: Route, names: frozenset[str] | set[str]) -> list[TextNode]:
        """Where the text at a route has one of these names, outside of units and of `x.y.z`."""
        node = self.at(route)
        text = self.raw(node)
        units = [match.span() for match in UNIT.finditer(text)]
        return [
            TextNode(node.start + match.start(), node.start + match.end(), match[0])
            for match in WORD.finditer(text)
            if match[0] in names and not any(first < match.start() < last for first, last in units)
        ]

    def _extent(self, route: Route) -> tuple[int, int]:
        value = self.at(route)
        start = value.start if isinstance(route[-1], int) else self.key(route).start
        return start, value.end

    def _in_flow(self, route: Route) -> bool:
        return self.text[self.at(route[:-1]).start] in "{["

    def _line_start(self, offset: int) -> int:
        return self.text.rfind("\n", 0, offset) + 1


def misspelt(name: str) -> str:
    """A name as a hurried hand writes it: the last two different letters changed round."""
    for index in range(len(name) - 1, 0, -1):
        first, second = name[index - 1], name[index]
        if first != second and (index > 1 or second.isalpha()):
            return name[: index - 1] + second + first + name[index + 1 :]
    return name * 2
