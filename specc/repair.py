"""Repairs as edits of the text: what is not edited stays as it is, to the last blank."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

from specc.diagnostics import Diagnostic, Edit
from specc.diagnostics.report import Change, Repair
from specc.model.expr import Node
from specc.model.fsm import Behaviour, State, Transition
from specc.model.system import System
from specc.source import Place, Route


@dataclass(frozen=True, slots=True)
class RepairResult:
    """A text after repairs, those that were made, and those that could not be."""

    text: str
    applied: tuple[Repair, ...]
    refused: tuple[Repair, ...]


Accepts = Callable[[str, tuple[Repair, ...]], bool]
"""Whether a text may take the place of another one, after repairs."""


def apply_compatible(text: str, repairs: Iterable[Repair], accepts: Accepts) -> RepairResult:
    """Make the repairs that do not touch each other and after which `accepts` takes the text.

    Of two that touch each other the first is made; the other may fit once the file is read again.
    All are tried together first, then one after the other.
    """
    ordered = sorted(repairs, key=_first)
    apart: list[Repair] = []
    others: list[Repair] = []
    for repair in ordered:
        (others if _touches(repair, apart) else apart).append(repair)
    if len(apart) > 1 and accepts(_edited(text, apart), tuple(apart)):
        return RepairResult(_edited(text, apart), tuple(apart), tuple(others))
    made: list[Repair] = []
    left: list[Repair] = []
    for repair in ordered:
        if not _touches(repair, made) and accepts(_edited(text, [*made, repair]), (*made, repair)):
            made.append(repair)
        else:
            left.append(repair)
    return RepairResult(_edited(text, made), tuple(made), tuple(left))


def _first(repair: Repair) -> tuple[int, int, str]:
    return min((change.start, change.end, change.text) for change in repair.changes)


def _touches(repair: Repair, made: Iterable[Repair]) -> bool:
    return any(
        change.start <= other.end and other.start <= change.end
        for change in repair.changes
        for earlier in made
        for other in earlier.changes
    )


def _edited(text: str, repairs: Iterable[Repair]) -> str:
    changes = [change for repair in repairs for change in repair.changes]
    for change in sorted(changes, key=_start, reverse=True):
        text = text[: change.start] + change.text + text[change.end :]
    return text


def _start(change: Change) -> int:
    return change.start


# What stands there after a repair is not wrong in the same way.


_EditedText = tuple[str, Route, str]


def is_wrong_again(repaired: Iterable[Diagnostic], after: Iterable[Diagnostic]) -> bool:
    """Whether a finding says of a text that was written by repairs what they were to repair.

    A text inside `for` is that of many copies, and may be right in some of them.
    """
    texts: dict[_EditedText, list[tuple[str, Edit]]] = defaultdict(list)
    for found in repaired:
        for edit in found.fix.edits if found.fix else ():
            place = edit.place
            texts[place.file, place.route, place.part].append((found.code, edit))
    written = set()
    for (file, route, _), edits in texts.items():
        moved = 0
        for code, edit in sorted(edits, key=lambda one: one[1].place.start or 0):
            written.add((code, file, route, (edit.place.start or 0) + moved))
            moved += len(edit.text) - len(edit.old)
    places = ((found.code, found.primary) for found in after)
    return any((code, at.file, at.route, at.start or 0) in written for code, at in places)


# What a repair does to the meaning: it makes known what was not, where it is made and elsewhere.


_NOT_SAID = (
    "place", "title", "trace", "type", "span", "rate_hz", "has_rate", "has_initial_state",
    "is_complete",
)  # fmt: skip
"""What says nothing of the meaning, or follows from what is not known yet."""
_REFERRED = ("behaviour", "functions", "terminal", "error", "condition")
"""Parts of states, behaviours and rows that are those of the subsystem, by their names."""
_REFERRING = (State, Behaviour, Transition)
_PartKey = tuple[object, ...]


def changes_elsewhere(old: System, new: System, at: Collection[Place]) -> bool:
    """Whether what was known of a part is different after edits that do not stand in that part."""
    before = dict(_parts(old, ()))
    places = Counter(part.place for part in before.values())
    many = {place for place, times in places.items() if times > 1}
    for key, part in _parts(new, ()):
        earlier = before.get(key)
        known = earlier is not None and getattr(earlier, "is_complete", True)
        if not known:
            continue
        before_said, is_edited = dict(_own_fields(earlier)), any(part.place.contains(e) for e in at)
        for name, value in _own_fields(part):
            was, now = _meaning(before_said.get(name)), _meaning(value)
            # An edit inside `for` is one of all copies, of which some may have been right before.
            if was and _is_known(was) and was != now and not (is_edited and part.place not in many):
                return True
    return False


def _parts(value: Any, key: _PartKey) -> Iterator[tuple[_PartKey, Any]]:
    """The parts of a model that have places, by the names on the way to them."""
    if isinstance(value, tuple):
        count: Counter[object] = Counter()
        for one in value:
            name = getattr(one, "target", getattr(one, "name", ""))
            count[name] += 1
            yield from _parts(one, (*key, name, count[name]))
    elif is_dataclass(value) and not isinstance(value, (Node, Place)):
        if hasattr(value, "place"):
            yield key, value
        for item in fields(value):
            if not (isinstance(value, _REFERRING) and item.name in _REFERRED):
                yield from _parts(getattr(value, item.name), (*key, item.name))


def _own_fields(part: Any) -> Iterator[tuple[str, Any]]:
    """What a part says by itself, not in parts of its own."""
    for item in fields(part):
        value = getattr(part, item.name)
        if isinstance(part, _REFERRING) and item.name in _REFERRED:
            value = tuple(one.name for one in (value if isinstance(value, tuple) else (value,)))
        first = value[0] if isinstance(value, tuple) and value else value
        if item.name not in _NOT_SAID and not hasattr(first, "place"):
            yield item.name, value


def _meaning(value: Any) -> Any:
    """A value without places and types, which may become known elsewhere."""
    if isinstance(value, tuple):
        return tuple(map(_meaning, value))
    if not is_dataclass(value):
        return value
    said = ((f.name, getattr(value, f.name)) for f in fields(value) if f.name not in _NOT_SAID)
    return type(value).__name__, tuple((name, _meaning(one)) for name, one in said)


def _is_known(meaning: Any) -> bool:
    if isinstance(meaning, tuple):
        return meaning[:1] != ("Unknown",) and all(map(_is_known, meaning))
    return True
