"""A finding as a value: what is wrong, where, and a way out; no lines, columns or colours."""

import re
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

from specc.diagnostics.phrases import join_some
from specc.limits import MAX_FAULTS
from specc.source import Place

Severity = Literal["error", "warning", "open"]
CommandName = Literal["build", "run"]

_BLOCKING_RUNS_ONLY = frozenset(("O0501", "O0502"))
_NEVER_BLOCKING = frozenset(("O0404", "O0503"))


@dataclass(frozen=True, slots=True)
class Related:
    """A second place that a finding speaks of, with a few words on its part in it."""

    place: Place
    message: str


@dataclass(frozen=True, slots=True)
class Edit:
    """New text for what stands at a place; `old` is what was read there, where it is a name."""

    place: Place
    text: str
    old: str = ""


@dataclass(frozen=True, slots=True)
class Fix:
    """The one safe repair of a finding: `title` says what it does, in the imperative."""

    title: str
    edits: tuple[Edit, ...]


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """A finding; `code` is an entry of the registry and `label` stands at the caret.

    `promoted` makes a warning or an open point count as an error, as `--strict` asks for. `lacks`
    are the places of parts that are not there but should be, if that is what the finding says.
    `example` has values that show what is refuted, in words.
    """

    code: str
    message: str
    primary: Place
    label: str = ""
    related: tuple[Related, ...] = ()
    help: str = ""
    fix: Fix | None = None
    promoted: bool = False
    lacks: tuple[Place, ...] = ()
    example: str = ""

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is said below the message: an example and a way out, where there are any."""
        example = f"for example: {self.example}" if self.example else ""
        return tuple(filter(None, (example, self.help)))

    @property
    def severity(self) -> Severity:
        """Whether the specification is refused because of this."""
        return "error" if self.promoted else severity_of(self.code)


def without_follow_ups(
    uses: Iterable[Diagnostic], found: Iterable[Diagnostic]
) -> Iterator[Diagnostic]:
    """Drop findings about `uses` of parts that are `found` missing already."""
    lacking = {place for finding in found for place in finding.lacks}
    for use in uses:
        if not any(
            replace(place, route=place.route[:depth]) in lacking
            for place in use.lacks
            for depth in range(len(place.route) + 1)
        ):
            yield use


_MOST_NAMED = 3


def merge_duplicates(found: Iterable[Diagnostic], agents: Collection[str]) -> list[Diagnostic]:
    """Merge findings that differ only in the names of agents into one that lists these agents.

    Findings with one code and place whose words differ only by the names of agents are one.
    """
    names = re.compile(rf"\b(?:{'|'.join(sorted(map(re.escape, agents), key=len))})\b")
    if not agents:
        return list(dict.fromkeys(found))
    groups: dict[object, list[Diagnostic]] = {}
    for finding in found:
        words = names.sub("", finding.message), names.sub("", finding.help)
        groups.setdefault((finding.code, finding.primary, finding.label, words), []).append(finding)
    merged = []
    for first, *rest in groups.values():
        own = names.findall(first.message)
        others = dict.fromkeys(name for d in rest for name in names.findall(d.message))
        listed = [f"`{name}`" for name in others if name not in own]
        if listed:
            message = f"{first.message}; so with {join_some(listed, _MOST_NAMED)}"
            first = replace(first, message=message)
        merged.append(first)
    return merged


def first_at_each_place(found: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """Keep only the first finding at each place."""
    places = set[Place]()
    for finding in found:
        if finding.primary not in places:
            places.add(finding.primary)
            yield finding


def severity_of(code: str) -> Severity:
    """Severity that the first letter of a code stands for: error, warning, open point."""
    match code[:1]:
        case "W":
            return "warning"
        case "O":
            return "open"
    return "error"


def blocks(code: str, command: CommandName) -> bool:
    """Whether a finding with this code prevents the command."""
    if severity_of(code) != "open":
        return severity_of(code) == "error"
    return code not in _NEVER_BLOCKING and (command == "run" or code not in _BLOCKING_RUNS_ONLY)


class TooManyFaultsError(Exception):
    """A file has more than `MAX_FAULTS`; the last finding says so."""


class Faults(list[Diagnostic]):
    """The findings about a file, of which `add` accepts at most `MAX_FAULTS`."""

    def add(self, fault: Diagnostic) -> None:
        """Add a finding.

        Raises:
            TooManyFaultsError: the file has `MAX_FAULTS` findings now.
        """
        self.append(fault)
        if len(self) == MAX_FAULTS:
            hint = f"correct these {MAX_FAULTS} first; what follows them was not looked at"
            self.append(Diagnostic("E0017", "too many mistakes", fault.primary, help=hint))
            raise TooManyFaultsError
