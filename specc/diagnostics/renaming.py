"""Repairs that write another name, as the file writes it, and on the side that is misspelt.

A finding is about what a text became where `for` was expanded, such as `raill_3`; the file has
`raill_{i}` there, once for all copies. So the letters change by which the right name differs, and
nothing else; where the difference is in an index there is no repair.

A finding about an unknown name carries the repair of the use. If the definition is misspelt, that
would spread the typo, so the repair is turned around, or taken away where nothing tells the two
apart. The side with a use that agrees with it is right; without one the side that several uses
have; then the side whose words the file has elsewhere, titles and comments included. A name that
nobody else sees may be written either way.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

from specc.diagnostics.diagnostic import Diagnostic, Edit, Fix
from specc.reachable import grouped
from specc.source import Place, Route, SourceFile, Sources

_INDEX = re.compile(r"(-?\d+|\{[^{}]*\})")
_LONGEST = 200


def rename_fix(place: Place, wrong: str, right: str) -> Fix | None:
    """The repair that writes `right` where `wrong` was read; None without a replacement."""
    return Fix(f"write `{right}`", (Edit(place, right, wrong),)) if right else None


def as_written(fix: Fix | None, sources: Sources) -> Fix | None:
    """A repair in terms of the text of the file; None if it would change more than letters."""
    if fix is None or not any(edit.old for edit in fix.edits):
        return fix
    (edit,) = fix.edits
    source = sources.get(edit.place.file)
    raw = source.scalar(edit.place) if source is not None else None
    if edit.place.part == "text" or source is None:
        return fix
    if raw is None:
        return None
    start = edit.place.start or 0
    found = renamed_as_written(raw[start:], edit.old, edit.text)
    if found is None or (edit.place.start is None and len(found[0]) != len(raw)):
        return None
    old, new = found
    place = replace(edit.place, start=start, end=start + len(old))
    return Fix(f"write `{new}`", (Edit(place, new, old),))


def renamed_as_written(raw: str, old: str, new: str) -> tuple[str, str] | None:
    """The text at the start of `raw` that was read as `old`, and its replacement.

    The replacement spells `new` and keeps the braces of indices; None if the indices differ.
    """
    parts = _INDEX.split(new)
    found = re.match(_pattern(old), raw[:_LONGEST])
    if found is None or _INDEX.split(old)[1::2] != parts[1::2]:
        return None
    parts[1::2] = found.groups()
    return found[0], "".join(parts)


def _pattern(name: str) -> str:
    """A pattern of what files may have for a name: any number in it may be an index in braces."""
    parts = enumerate(_INDEX.split(name))
    texts = (rf"({re.escape(t)}|\{{[^{{}}]*\}})" if n % 2 else re.escape(t) for n, t in parts)
    return rf"{''.join(texts)}(?![\w{{])"


_SECTIONS = (
    "memory", "let", "constants", "parameters", "files", "operators", "x", "y", "interfaces",
    "frames", "initial", "terminal", "error", "functions", "behaviours", "states", "agents",
    "real_effectors", "real_receptors", "virtual_effectors", "virtual_receptors", "fields",
)  # fmt: skip
_UNKNOWN_TYPE = "E0233"
"""Where names are defined: the key above the definition, or above the peer of an element."""

_UNSEEN = ("let", "constants", "initial", "terminal", "error", "functions", "behaviours")
"""Where names are defined that are only for readers."""
_NOT_DEFINED = ("E0101", "E0304", "E0502", "E0905")
"""What is a slip of a word that specifications do not define."""

_PROSE = ("title", "because")
_WORD = re.compile(r"[^\W\d_]+")


class _Slip(NamedTuple):
    """`wrong` stands where a definition is called `right`, which may be that of a peer."""

    wrong: str
    right: str
    is_peer: bool
    is_group: bool = False
    """Whether the names are those of all that one `for` stands for, without an index."""


@dataclass(frozen=True, slots=True)
class _Definition:
    """A key that defines a name; `scope` is the route above which nothing refers to it.

    An element of a buffer has another end, in another subsystem.
    """

    source: SourceFile = field(hash=False)
    route: Route
    scope: Route
    is_element: bool = False

    @property
    def is_in_system(self) -> bool:
        """Whether its file is that of a system."""
        return self.source.node(("system",)) is not None

    @property
    def is_alone(self) -> bool:
        """Whether only this file can refer to it."""
        return bool(self.scope) or self.is_in_system

    @property
    def is_unseen(self) -> bool:
        """Whether its name is only for readers."""
        return self.is_alone and ("", *self.route)[-2] in _UNSEEN

    def is_there(self, wrong: Collection[Place]) -> bool:
        """Whether the peer that it names is in the system, since nothing is said of it."""
        return self.is_in_system and Place(self.source.path, self.route, "key") not in wrong

    def serves(self, use: Place) -> bool:
        """Whether what stands at a place can refer to the definition."""
        if use.file != self.source.path:
            return not self.scope
        return use.route[: len(self.scope)] == self.scope


def with_repairs_of_typos(diagnostics: Iterable[Diagnostic], sources: Sources) -> list[Diagnostic]:
    """The diagnostics, with repairs as files write them, of the side that is misspelt."""
    found = [replace(d, fix=as_written(d.fix, sources)) if d.fix else d for d in diagnostics]
    slips = grouped(
        (slip, diagnostic) for diagnostic in found if (slip := _slip(diagnostic, sources))
    )
    turned = {
        id(diagnostic): fix
        for slip, uses in slips.items()
        for diagnostic, fix in _settle(slip, uses, sources, {d.primary for d in found})
    }
    return [replace(d, fix=turned[id(d)]) if id(d) in turned else d for d in found]


def _slip(diagnostic: Diagnostic, sources: Sources) -> _Slip | None:
    if diagnostic.fix is None or diagnostic.code in _NOT_DEFINED:
        return None
    edit = diagnostic.fix.edits[0]
    wrong, right = edit.old.split("."), edit.text.split(".")
    apart = [n for n, pair in enumerate(zip(wrong, right, strict=False)) if pair[0] != pair[1]]
    if len(wrong) != len(right) or len(apart) != 1:
        return None
    is_peer = _reads_peer(diagnostic, sources) or (len(right) == _TARGET and apart == [1])
    return _Slip(wrong[apart[0]], right[apart[0]], is_peer)


def _reads_peer(diagnostic: Diagnostic, sources: Sources) -> bool:
    """Whether the unknown name is that of a peer in an expression, behind `x.`."""
    place = diagnostic.primary
    source = sources.get(place.file)
    text = source.scalar(place) if source is not None and place.start is not None else None
    return text is not None and re.search(r"\bx\s*\.\s*$", text[: place.start]) is not None


_TARGET = 3
"""Parts of `y.peer.element`."""


def _settle(
    slip: _Slip, uses: list[Diagnostic], sources: Sources, wrong: Collection[Place]
) -> Iterator[tuple[Diagnostic, Fix | None]]:
    """Uses whose repair changes, each with its other repair or none; what is `wrong` is told."""
    by_definition: dict[tuple[_Slip, _Definition], list[Diagnostic]] = defaultdict(list)
    for use in uses:
        sections = ("types",) if use.code == _UNKNOWN_TYPE else _SECTIONS
        for candidate in dict.fromkeys((slip, _without_index(slip))):
            known = _definitions(candidate, sections, sources)
            if served := [d for d in known if d.serves(use.primary)]:
                own = [d for d in served if d.source.path == use.primary.file]
                chosen = max(own or served, key=lambda d: len(d.scope))
                by_definition[candidate, chosen].append(use)
                break
        else:
            if _is_member_once(slip.right, sources):
                yield use, None
    for (slip, definition), here in by_definition.items():
        scope = () if definition.is_element else definition.scope
        readers = [definition.source] if scope else list(sources)
        places = len({use.primary for use in here})  # copies of one text are one use
        count = partial(
            _count, scope=scope, is_element=definition.is_element, is_group=slip.is_group
        )
        if sum(count(slip.right, reader) for reader in readers) > 1:
            # Several have the same slip, which is rare: another name may be right.
            if places > 1 or (not definition.is_element and _is_also_a_type(slip.right, readers)):
                yield from ((use, None) for use in here)
            continue
        elsewhere = sum(count(slip.wrong, reader) for reader in readers) > places
        if _is_misspelt(slip, definition, places, elsewhere):
            fix = _other_fix(slip, definition, here)
            yield from ((use, fix) for use in here)
        elif not definition.is_unseen and not (slip.is_peer and definition.is_there(wrong)):
            yield from ((use, None) for use in here)


def _is_also_a_type(name: str, sources: Iterable[SourceFile]) -> bool:
    """Whether a type and something else have a name: its uses do not tell which is right."""
    routes = (route for source in sources for route, *_ in source.nodes)
    sections = {("", *route)[-2] for route in routes if route[-1] == name}
    return "types" in sections and len(sections) > 1


def _without_index(slip: _Slip) -> _Slip:
    """Of the names of all that one `for` stands for, which it may define without the index."""
    wrong, right = (_INDEX_SUFFIX.sub("", name) for name in (slip.wrong, slip.right))
    same = slip.wrong[len(wrong) :] == slip.right[len(right) :]
    if not same or wrong == right:
        return slip
    return slip._replace(wrong=wrong, right=right, is_group=True)


_INDEX_SUFFIX = re.compile(r"(?:_(?:\{[^{}]*\}|\d+))+$")


def _other_fix(slip: _Slip, definition: _Definition, uses: list[Diagnostic]) -> Fix | None:
    """The repair of a definition, unless others that are not known here may rely on it."""
    source, key = definition.source, str(definition.route[-1])
    if not definition.is_alone or any(use.primary.file != source.path for use in uses):
        return None
    found = renamed_as_written(key, slip.right, slip.wrong)
    if found is None or found[0] != key:
        return None
    edit = Edit(Place(source.path, definition.route, "key"), found[1], key)
    return Fix(f"rename the definition to `{found[1]}`", (edit,))


def _is_misspelt(slip: _Slip, definition: _Definition, uses: int, elsewhere: bool) -> bool:
    """Whether a definition is, of which no use is right; `elsewhere` stands its other name."""
    if definition.is_element and elsewhere:
        # The other end of the connection has the element too, under its right name.
        return True
    return uses > 1 or (not definition.is_element and _speaks_for(slip, definition.source.text))


def _speaks_for(slip: _Slip, text: str) -> bool:
    """Whether a file has the words of `wrong` beside its one use, and not those of `right`."""
    ours, theirs = _words(slip.wrong), _words(slip.right)
    elsewhere = _words(text) - ours - theirs
    own, other = ours - theirs, theirs - ours
    return bool(own) and elsewhere >= own and not elsewhere & other


def _words(text: str) -> Counter[str]:
    return Counter(word.casefold() for word in _WORD.findall(text))


def _definitions(slip: _Slip, sections: tuple[str, ...], sources: Sources) -> Iterator[_Definition]:
    for source in sources:
        for route, *_ in source.nodes:
            if not _is_called(route[-1], slip.right):
                continue
            section, above = ("", "", *route)[-2], ("", "", "", *route)[-3]
            if slip.is_peer:
                if section in ("x", "y"):
                    yield _Definition(source, route, route[:-2], True)
            elif above in ("x", "y", "interfaces", "conditions"):
                scope = () if above == "interfaces" else route[:-3]
                if (section if above == "conditions" else above) in sections:
                    yield _Definition(source, route, scope, above != "conditions")
            elif section in sections:
                yield _Definition(source, route, () if section == "fields" else route[:-2])


def _is_called(key: str | int, name: str) -> bool:
    """Whether a key, which may have indices, is the name of something."""
    if key == name or not isinstance(key, str) or "{" not in key:
        return key == name
    found = renamed_as_written(key, name, name)
    return found is not None and found[0] == key


def _is_member_once(name: str, sources: Sources) -> bool:
    """Whether a name stands nowhere but among the members of an enum."""
    if sum(_count(name, source) for source in sources) != 1:
        return False
    texts = (node.scalar or "" for source in sources for *_, node in source.nodes)
    return any(name in _NAME.findall(text) and "enum[" in text for text in texts)


_NAME = re.compile(r"\w+(?:\{[^{}]*\}\w*)*")
_BRACES = re.compile(r"\{[^{}]*\}")


def _count(
    name: str,
    source: SourceFile,
    scope: Route = (),
    *,
    is_element: bool = False,
    is_group: bool = False,
) -> int:
    """How often a name stands in keys and values below `scope`, but in prose; by any index.

    That of an element or a peer is a whole key, or stands behind a point; that of a group counts
    with an index too.
    """
    name = _BRACES.sub("{}", name)
    return sum(
        name in (_BRACES.sub("{}", one[0]), _INDEX_SUFFIX.sub("", one[0]) if is_group else "")
        for route, _, node in source.nodes
        if route[: len(scope)] == scope and route[-1] not in _PROSE
        for text, is_key in ((route[-1], True), (node.scalar, False))
        for one in (_NAME.finditer(text) if isinstance(text, str) else ())
        if not is_element
        or one.string[: one.start()].endswith(".")
        or (is_key and one[0] == text and _is_in_buffer(route))
    )


def _is_in_buffer(route: Route) -> bool:
    """Whether a key is that of a peer, or of an element of a buffer or an interface."""
    section, above = ("", "", *route)[-2], ("", "", "", *route)[-3]
    return section in ("x", "y") or above in ("x", "y", "interfaces")
