"""`specc validate --fix`: makes the repairs that findings carry, file by file.

What is not edited stays as it is, to the last blank.
"""

from __future__ import annotations

import os
import shlex
import tomllib
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

from specc.cli import streams
from specc.cli.files import rewrite_file
from specc.cli.inspect import inspect_all, is_argument
from specc.diagnostics import Diagnostic, Edit
from specc.diagnostics.report import Finding, Repair, Report, report, resolve
from specc.model.expr import Node
from specc.model.fsm import Behaviour, State, Transition
from specc.model.system import System
from specc.policy import Overrides, clear_cache
from specc.read import read_text
from specc.refusal import reason_of
from specc.source import Place, Route, Sources, real_path

ROUNDS = 10
"""A repair can uncover what another one hid; more rounds than this would be a cycle."""
_MARK = "\ufeff"


def inspect_and_fix(arguments: Sequence[str], overrides: Overrides) -> Report:
    """Repair the files that the arguments name, in rounds until nothing is left to repair.

    Returns the last report.
    """
    found = inspect_all(arguments, overrides)
    earlier_texts = set[str]()
    for _ in range(ROUNDS):
        try:
            if not apply_repairs(found.findings, arguments, earlier_texts):
                break
        except OSError as error:
            findings = [*found.findings, *resolve([unwritable(error)], Sources())]
            return replace(report(findings, ()), checked=found.checked, ignored=found.ignored)
        clear_cache()
        found = inspect_all(arguments, overrides)
    print_unapplied(found.findings, arguments)
    return found


def unwritable(error: OSError) -> Diagnostic:
    """The finding about a file that could not be rewritten."""
    message = f"the file cannot be written: {reason_of(error)}"
    hint = "it is unchanged; check its permissions, those of its directory and the space there"
    return Diagnostic("E0090", message, Place(str(error.filename)), help=hint)


def apply_repairs(
    findings: Iterable[Finding], arguments: Sequence[str], earlier_texts: set[str]
) -> bool:
    """Make the repairs of findings in files that arguments name, and say which; whether any was.

    No repair leads back to one of `earlier_texts`; the texts that are repaired now join them.

    Raises:
        OSError: a file cannot be written; those before it are repaired.
    """
    has_changed = False
    for path, wanted in repairs_by_file(findings).items():
        if is_argument(path, arguments):
            has_changed |= _repair_file(path, wanted, earlier_texts)
    return has_changed


def print_unapplied(findings: Iterable[Finding], arguments: Sequence[str]) -> None:
    """Say which files could be repaired but were not named, and how to have them repaired."""
    for path, wanted in repairs_by_file(findings).items():
        if is_argument(path, arguments):
            continue
        repairs = "1 repair" if len(wanted) == 1 else f"{len(wanted)} repairs"
        name = (os.path.dirname(path) or ".") if path.endswith(".toml") else path
        command = shlex.join(["specc", "validate", "--fix", *arguments, name])
        streams.print_message(
            f"not repaired, since it was not named: {path} ({repairs}); `{command}`"
        )


def repairs_by_file(findings: Iterable[Finding]) -> dict[str, dict[Repair, Finding]]:
    """Repairs that findings carry, each once, by the file that they change."""
    found: dict[str, dict[Repair, Finding]] = {}
    seen: dict[object, str] = {}
    for finding in findings:
        if (repair := finding.repair) is None:
            continue
        # A file that was read under two names is still one file.
        real = os.path.realpath(repair.file)
        path = seen.setdefault(real, repair.file)
        edits = real, tuple((change.start, change.end, change.text) for change in repair.changes)
        if edits not in seen:
            seen[edits] = path
            found.setdefault(path, {})[repair] = finding
    return found


def _repair_file(path: str, wanted: dict[Repair, Finding], earlier_texts: set[str]) -> bool:
    with open(path, encoding="utf-8", newline="") as file:
        text = file.read()
    mark = _MARK if text.startswith(_MARK) else ""
    text = text.removeprefix(_MARK)
    earlier_texts.add(text)
    new_text, applied = apply_compatible(text, wanted, _acceptance(path, wanted, earlier_texts))
    if applied:
        rewrite_file(path, (mark + new_text).encode())
    for repair in applied:
        line = repair.changes[0].span.line
        code = wanted[repair].diagnostic.code
        streams.print_message(f"repaired {path}:{line}: {code}: {repair.title}")
    return bool(applied)


def _acceptance(path: str, wanted: dict[Repair, Finding], earlier_texts: set[str]) -> Accepts:
    from specc.pipeline import read_spec

    is_toml = path.endswith(".toml")
    before = None if is_toml else read_spec(path).system

    def accepts(text: str, repairs: tuple[Repair, ...]) -> bool:
        if is_toml:
            return text not in earlier_texts and _is_toml(text)
        if text in earlier_texts or not read_text("mended", text).ok:
            return False
        after = read_spec(path, {real_path(path): text})
        found = [wanted[repair].diagnostic for repair in repairs]
        if is_wrong_again(found, after.diagnostics):
            return False
        places = [edit.place for one in found if one.fix for edit in one.fix.edits]
        if before is None or after.system is None:
            return True
        return not changes_elsewhere(before, after.system, places)

    return accepts


def _is_toml(text: str) -> bool:
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    return True


# Repairs as edits of the text.


Accepts = Callable[[str, tuple[Repair, ...]], bool]
"""Whether a text may take the place of another one, after repairs."""


def apply_compatible(
    text: str, repairs: Iterable[Repair], accepts: Accepts
) -> tuple[str, tuple[Repair, ...]]:
    """The text after the repairs that do not touch each other and that it accepts; and these.

    Of two that touch each other the first is made; the other may fit once the file is read again.
    All are tried together first, then one after the other.
    """
    ordered = sorted(
        repairs, key=lambda repair: min((c.start, c.end, c.text) for c in repair.changes)
    )
    separate: list[Repair] = []
    for repair in ordered:
        if not _touches(repair, separate):
            separate.append(repair)
    if len(separate) > 1 and accepts(_edited(text, separate), tuple(separate)):
        return _edited(text, separate), tuple(separate)
    applied: list[Repair] = []
    for repair in ordered:
        more = [*applied, repair]
        if not _touches(repair, applied) and accepts(_edited(text, more), tuple(more)):
            applied = more
    return _edited(text, applied), tuple(applied)


def _touches(repair: Repair, made: Iterable[Repair]) -> bool:
    return any(
        change.start <= other.end and other.start <= change.end
        for change in repair.changes
        for earlier in made
        for other in earlier.changes
    )


def _edited(text: str, repairs: Iterable[Repair]) -> str:
    changes = [change for repair in repairs for change in repair.changes]
    for change in sorted(changes, key=lambda change: change.start, reverse=True):
        text = text[: change.start] + change.text + text[change.end :]
    return text


# What stands there after a repair is not wrong in the same way.


def is_wrong_again(repaired: Iterable[Diagnostic], after: Iterable[Diagnostic]) -> bool:
    """Whether a finding says of a text that was written by repairs what they were to repair.

    A text inside `for` is that of many copies, and may be right in some of them.
    """
    texts: dict[tuple[str, Route, str], list[tuple[str, Edit]]] = defaultdict(list)
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


_WITHOUT_MEANING = (
    "place", "title", "trace", "type", "span", "rate_hz", "has_rate", "has_initial_state",
    "is_complete",
)  # fmt: skip
"""Fields that have no meaning, or follow from what is not known yet."""
_REFERRED = ("behaviour", "functions", "terminal", "error", "condition")
"""Parts of states, behaviours and rows that are those of the subsystem, by their names."""
_REFERRING = (State, Behaviour, Transition)
_PartKey = tuple[object, ...]


def changes_elsewhere(old: System, new: System, at: Collection[Place]) -> bool:
    """Whether what was known of a part is different after edits that do not stand in that part."""
    before = dict(_parts(old, ()))
    places = Counter(part.place for part in before.values())
    copied = {place for place, times in places.items() if times > 1}
    for key, part in _parts(new, ()):
        earlier = before.get(key)
        if earlier is None or not getattr(earlier, "is_complete", True):
            continue
        old_fields = dict(_own_fields(earlier))
        is_edited = any(part.place.contains(place) for place in at)
        for name, value in _own_fields(part):
            was, now = _meaning(old_fields.get(name)), _meaning(value)
            # An edit inside `for` is one of all copies, of which some may have been right before.
            if (
                was
                and _is_known(was)
                and was != now
                and not (is_edited and part.place not in copied)
            ):
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
    """The fields of a part that are no parts themselves."""
    for item in fields(part):
        value = getattr(part, item.name)
        if isinstance(part, _REFERRING) and item.name in _REFERRED:
            value = tuple(one.name for one in (value if isinstance(value, tuple) else (value,)))
        first = value[0] if isinstance(value, tuple) and value else value
        if item.name not in _WITHOUT_MEANING and not hasattr(first, "place"):
            yield item.name, value


def _meaning(value: Any) -> Any:
    """A value without places and types, which may become known elsewhere."""
    if isinstance(value, tuple):
        return tuple(map(_meaning, value))
    if not is_dataclass(value):
        return value
    names = (item.name for item in fields(value) if item.name not in _WITHOUT_MEANING)
    return type(value).__name__, tuple((name, _meaning(getattr(value, name))) for name in names)


def _is_known(meaning: Any) -> bool:
    if isinstance(meaning, tuple):
        return meaning[:1] != ("Unknown",) and all(map(_is_known, meaning))
    return True
