"""Which side is misspelt where a name and its only near definition differ by a slip.

A finding about an unknown name carries the repair of the use. If the definition is what is
misspelt, that would spread the slip, so the repair is turned around, or taken away where nothing
tells the two apart. The side with a use that agrees with it is right; without one the side that
several uses have; then the side whose words the file has elsewhere, titles and comments included.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import field, replace
from typing import NamedTuple

from specc.diagnostics.diagnostic import Diagnostic, Edit, Fix
from specc.frozen import frozen
from specc.source import Node, Place, Route, SourceFile, Sources

_SECTIONS: dict[str, tuple[str, ...]] = {
    "E0201": ("memory", "let", "constants", "parameters", "files"),
    "E0202": ("operators",),
    "E0203": ("x",),
    "E0209": ("frames",),
    "E0212": ("initial", "terminal", "error"),
    "E0214": ("memory", "y"),
    "E0215": ("functions",),
    "E0216": ("behaviours",),
    "E0217": ("states",),
    "E0233": ("types",),
    "E0234": ("fields",),
    "E0236": ("interfaces",),
}
"""Where names are defined: the key above the definition, or above the peer of an element."""

_PROSE = ("title", "because")
_WORD = re.compile(r"[^\W\d_]+")


class _Slip(NamedTuple):
    """`wrong` stands where a definition is called `right`."""

    wrong: str
    right: str


@frozen
class _Definition:
    """A key that defines a name; `scope` is the route above which nothing refers to it.

    An element of a buffer has another end, in another subsystem.
    """

    source: SourceFile = field(hash=False)
    route: Route
    scope: Route
    is_element: bool = False

    def serves(self, use: Place) -> bool:
        """Whether what stands at a place can refer to the definition."""
        if use.file != self.source.path:
            return not self.scope
        return use.route[: len(self.scope)] == self.scope


def settled(diagnostics: Iterable[Diagnostic], sources: Sources) -> list[Diagnostic]:
    """The diagnostics, with repairs of the side that is misspelt."""
    found = list(diagnostics)
    slips: dict[_Slip, list[Diagnostic]] = defaultdict(list)
    for diagnostic in found:
        if slip := _slip(diagnostic, sources):
            slips[slip].append(diagnostic)
    turned = {
        id(diagnostic): fix
        for slip, uses in slips.items()
        for diagnostic, fix in _settle(slip, uses, sources)
    }
    return [replace(d, fix=turned[id(d)]) if id(d) in turned else d for d in found]


def _slip(diagnostic: Diagnostic, sources: Sources) -> _Slip | None:
    source = sources.get(diagnostic.primary.file)
    if diagnostic.fix is None or diagnostic.code not in _SECTIONS or source is None:
        return None
    (edit,) = diagnostic.fix.edits
    start, end = source.offsets(edit.place)
    wrong = source.text[start:end].strip("'\"").rpartition(".")
    right = edit.text.rpartition(".")
    return _Slip(wrong[2], right[2]) if wrong[0] == right[0] else None


def _settle(
    slip: _Slip, uses: list[Diagnostic], sources: Sources
) -> Iterator[tuple[Diagnostic, Fix | None]]:
    """Uses whose repair changes, each with its other repair or none."""
    by_definition: dict[_Definition, list[Diagnostic]] = defaultdict(list)
    for use in uses:
        known = _definitions(slip.right, _SECTIONS[use.code], sources)
        if served := [d for d in known if d.serves(use.primary)]:
            own = [d for d in served if d.source.path == use.primary.file]
            by_definition[max(own or served, key=lambda d: len(d.scope))].append(use)
    for definition, here in by_definition.items():
        if _is_misspelt(slip, definition, len(here), sources):
            fix = _other_fix(slip, definition, here)
            yield from ((use, fix) for use in here)


def _other_fix(slip: _Slip, definition: _Definition, uses: list[Diagnostic]) -> Fix | None:
    """The repair of a definition, unless others that are not known here may rely on it."""
    source = definition.source
    alone = definition.scope or (source.spans is not None and "system" in source.spans.values)
    if not alone or any(use.primary.file != source.path for use in uses):
        return None
    place = Place(source.path, definition.route, "key")
    return Fix(f"rename the definition to `{slip.wrong}`", (Edit(place, slip.wrong),))


def _is_misspelt(slip: _Slip, definition: _Definition, uses: int, sources: Sources) -> bool:
    scope = () if definition.is_element else definition.scope
    readers = [definition.source] if scope else list(sources)
    if sum(_count(slip.right, reader, scope) for reader in readers) > 1:
        return False
    if definition.is_element:
        # The other end of the connection has the element too, under its right name.
        return sum(_count(slip.wrong, reader, scope) for reader in readers) > uses
    return uses > 1 or _speaks_for(slip, definition.source.text)


def _speaks_for(slip: _Slip, text: str) -> bool:
    """Whether a file has the words of `wrong` beside its one use, and not those of `right`."""
    ours, theirs = _words(slip.wrong), _words(slip.right)
    elsewhere = _words(text) - ours - theirs
    own, other = ours - theirs, theirs - ours
    return bool(own) and elsewhere >= own and not elsewhere & other


def _words(text: str) -> Counter[str]:
    return Counter(word.casefold() for word in _WORD.findall(text))


def _definitions(name: str, sections: tuple[str, ...], sources: Sources) -> Iterator[_Definition]:
    for source in sources:
        for route, _ in _routes(source.spans, ()):
            if route[-1] != name:
                continue
            section, above = ("", "", *route)[-2], ("", "", "", *route)[-3]
            if above in ("x", "y", "conditions"):
                if (section if above == "conditions" else above) in sections:
                    yield _Definition(source, route, route[:-3], above != "conditions")
            elif section in sections:
                yield _Definition(source, route, () if section == "fields" else route[:-2])


def _count(name: str, source: SourceFile, scope: Route) -> int:
    """How often a name stands in keys and values below `scope`, but in prose."""
    word = re.compile(rf"\b{re.escape(name)}\b")
    return sum(
        len(word.findall(text))
        for route, value in _routes(source.spans, ())
        if route[: len(scope)] == scope and route and route[-1] not in _PROSE
        for text in (str(route[-1]) if isinstance(route[-1], str) else "", value)
    )


def _routes(node: Node | None, route: Route) -> Iterator[tuple[Route, str]]:
    """Every route below a node with the scalar that stands there, if one does."""
    if node is None:
        return
    if route:
        yield route, node.scalar or ""
    for step, below in node.values.items():
        yield from _routes(below, (*route, step))
