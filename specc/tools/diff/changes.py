"""What a comparison says, and how: as text for a terminal, as Markdown for a review, as JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from itertools import groupby
from types import MappingProxyType
from typing import Any, Literal, TypeVar

from specc.diagnostics.phrases import counted, join_some, truncate
from specc.diagnostics.visible import visible
from specc.lang import show
from specc.model.expr import Expr
from specc.proof.verdict import FactTexts

Guarantee = Literal["", "weaker", "stronger"]
"""Whether less or more is guaranteed, or checked in runs, where agents do the same as before."""

Thing = TypeVar("Thing")


@dataclass(frozen=True, slots=True)
class Verdict:
    """How two expressions relate: facts under which only one holds, or why that is not known."""

    same: bool
    only_old: FactTexts = ()
    only_new: FactTexts = ()
    unknown: str = ""
    is_proved: bool = False
    """Whether a proof compared two conditions, rather than the normal forms of two values."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One change.

    `where` is the qualified name of an agent, subsystem or device, "" for the system; `part` says
    what kind of thing changed, `name` which one, `aspect` what about it. `old` and `new` are texts.
    """

    where: str
    part: str
    name: str
    change: Literal["added", "removed", "changed"]
    aspect: str = ""
    old: str = ""
    new: str = ""
    note: str = ""
    only_old: FactTexts = ()
    """For conditions: facts under which only the old one holds."""
    only_new: FactTexts = ()
    """For conditions: facts under which only the new one holds."""
    semantic: bool = True
    """Whether agents, or what is known of them, behave differently."""
    guarantee: Guarantee = ""


@dataclass(frozen=True, slots=True)
class Comparison:
    """All changes between two systems, in an order that does not depend on their files."""

    changes: tuple[Difference, ...]

    @property
    def differences(self) -> tuple[Difference, ...]:
        """The changes of meaning."""
        return tuple(change for change in self.changes if change.semantic)

    @property
    def weaker(self) -> tuple[Difference, ...]:
        """The changes by which less is guaranteed."""
        return tuple(change for change in self.differences if change.guarantee == "weaker")

    @property
    def verdict(self) -> Literal["equal", "weaker", "stronger", "different"]:
        """What the new system is against the old one."""
        found = {change.guarantee for change in self.differences}
        if found == {"weaker"}:
            return "weaker"
        if found == {"stronger"}:
            return "stronger"
        return "different" if found else "equal"

    @property
    def remarks(self) -> tuple[Difference, ...]:
        """The changes that leave the meaning as it is."""
        return tuple(change for change in self.changes if not change.semantic)


@dataclass(eq=False, slots=True)
class ChangeLog:
    """The changes of one agent, subsystem or device, or of the system."""

    where: str = ""
    changes: list[Difference] = field(default_factory=list)
    """Those of everything that is compared, in order."""

    def at(self, where: str) -> ChangeLog:
        """The log of another place."""
        return ChangeLog(where, self.changes)

    def pair(
        self,
        part: str,
        versions: Iterable[Mapping[str, Thing]],
        text: Callable[[Thing], str],
        *,
        semantic: bool = True,
        removed: Mapping[str, Any] = MappingProxyType({}),
        added: Mapping[str, Any] = MappingProxyType({}),
    ) -> list[tuple[PartLog, Thing, Thing]]:
        """The things of one kind that both systems have, by name.

        The others are `removed` or `added`: with these fields of a difference.
        """
        old, new = versions
        for name in sorted(old.keys() - new.keys()):
            self.part(part, name).removed(text(old[name]), semantic=semantic, **removed)
        for name in sorted(new.keys() - old.keys()):
            self.part(part, name).added(text(new[name]), semantic=semantic, **added)
        both = sorted(old.keys() & new.keys())
        return [(self.part(part, name), old[name], new[name]) for name in both]

    def part(self, part: str, name: str = "") -> PartLog:
        return PartLog(self, part, name)


@dataclass(frozen=True, slots=True)
class PartLog:
    """Collects the changes of one thing."""

    log: ChangeLog
    part: str
    name: str

    def added(self, text: str, **more: Any) -> None:
        self._add("added", new=text, **more)

    def removed(self, text: str, **more: Any) -> None:
        self._add("removed", old=text, **more)

    def changed(self, aspect: str, old: object, new: object, **more: Any) -> None:
        """An aspect, if it differs."""
        if old != new:
            self._add("changed", aspect=aspect, old=str(old), new=str(new), **more)

    def _add(self, change: Literal["added", "removed", "changed"], **more: Any) -> None:
        self.log.changes.append(Difference(self.log.where, self.part, self.name, change, **more))

    def remark(self, aspect: str, old: object, new: object) -> None:
        """An aspect that has no influence on what an agent does."""
        self.changed(aspect, old, new, semantic=False)

    def compare_expressions(
        self,
        aspect: str,
        old: Expr | None,
        new: Expr | None,
        compare: Callable[[Expr, Expr], Verdict],
        absent: str = "none",
        guarantee: Guarantee = "",
    ) -> None:
        """Compare two expressions and log the difference; None is shown as `absent`."""
        texts = [absent if expr is None else show(expr) for expr in (old, new)]
        verdict = compare(old, new) if old is not None and new is not None else Verdict(old is new)
        self.verdict(verdict, (texts[0], texts[1]), aspect, guarantee=guarantee)

    def verdict(self, verdict: Verdict, texts: tuple[str, str], aspect: str, **more: Any) -> None:
        """How two expressions relate; nothing if neither their texts nor their meanings differ."""
        if verdict.same and texts[0] == texts[1]:
            return
        if verdict.same:
            note = "proved equal" if verdict.is_proved else "the same value"
            aspect = "text" if aspect == "meaning" else aspect
        elif verdict.unknown:
            note = f"not proved equal: {verdict.unknown}"
        else:
            is_same_text = texts[0] == texts[1]
            note = "the text is the same; what it refers to has changed" if is_same_text else ""
        self._add(
            "changed",
            aspect=aspect,
            old=texts[0],
            new=texts[1],
            note=note,
            only_old=verdict.only_old,
            only_new=verdict.only_new,
            semantic=not verdict.same,
            **more,
        )


# What the readable formats share: a change in a few words, in order.


LONGEST = 400
MOST_PLACES = 8


def _headline(change: Difference) -> str:
    """What changed: `state S1 added`, `row S0 --terminal--> S1: condition changed`."""
    name = "" if change.name == change.where else change.name
    what = visible(f"{change.part} {name}".strip())
    if change.change != "changed":
        return f"{what} {change.change}"
    return f"{what}: {visible(change.aspect)} changed" if change.aspect else f"{what} changed"


def _witnesses(change: Difference) -> Iterator[str]:
    """Under which facts only one of two conditions holds."""
    for which, facts in (("old", change.only_old), ("new", change.only_new)):
        if facts:
            when = visible(", ".join(f"{fact} is {answer}" for fact, answer in facts))
            yield f"only the {which} one holds when {when}"


_GUARANTEES = {"weaker": "less is guaranteed", "stronger": "more is guaranteed", "": ""}


def _by_place(changes: Iterable[Difference]) -> Iterator[tuple[str, list[Difference]]]:
    """Changes by agent, subsystem or device; places with the same changes are listed together."""
    together: dict[tuple[Difference, ...], list[tuple[str, list[Difference]]]] = {}
    for where, group in groupby(changes, key=lambda change: change.where):
        own = list(group)
        same = (replace(one, where="", name="" if one.name == where else one.name) for one in own)
        together.setdefault(tuple(same), []).append((visible(where) or "system", own))
    for alike in together.values():
        yield join_some([where for where, _ in alike], MOST_PLACES), alike[0][1]


# For a terminal.


_SIGNS = {"added": "+", "removed": "-", "changed": "~"}


def as_text(comparison: Comparison, old: str, new: str) -> str:
    """Differences by place, then changes without a change of meaning, then how many there are."""
    lines = [*_list(comparison.differences)]
    if comparison.remarks:
        lines += ["without a change of meaning:", "", *_list(comparison.remarks)]
    remarks = counted(len(comparison.remarks), "remark")
    lines.append(f"{visible(old)} -> {visible(new)}: {_counted(comparison)}, {remarks}")
    return "\n".join(lines) + "\n"


def _counted(comparison: Comparison) -> str:
    """How many differences there are, and by how many of them less is guaranteed."""
    weaker = sum(change.guarantee == "weaker" for change in comparison.differences)
    words = f", {weaker} of which weaken{'s' * (weaker == 1)} what is guaranteed" if weaker else ""
    return f"{counted(len(comparison.differences), 'difference')}{words}"


def _list(changes: Iterable[Difference]) -> Iterator[str]:
    for where, group in _by_place(changes):
        yield where
        for change in group:
            yield f"  {_SIGNS[change.change]} {_headline(change)}"
            old, new = (visible(truncate(text, LONGEST)) for text in (change.old, change.new))
            if change.change == "changed":
                yield f"      old: {old}"
                yield f"      new: {new}"
            elif old or new:
                yield f"      {old or new}"
            yield from (f"      {visible(line)}" for line in _witnesses(change))
            remarks = filter(None, (_GUARANTEES[change.guarantee], change.note))
            yield from (f"      ({visible(words)})" for words in remarks)
        yield ""


# For a review: a table for each part of the system.


def as_markdown(comparison: Comparison, old: str, new: str) -> str:
    """Differences as tables, with changes without a change of meaning folded away."""
    lines = [f"## {_plain(old)} → {_plain(new)}", ""]
    lines += [f"{_counted(comparison)}.", ""]
    lines += _tables(comparison.differences)
    if comparison.remarks:
        count = counted(len(comparison.remarks), "change")
        lines += ["<details>", f"<summary>{count} without a change of meaning</summary>", ""]
        lines += [*_tables(comparison.remarks), "</details>", ""]
    return "\n".join(lines)


def _tables(changes: Iterable[Difference]) -> Iterator[str]:
    for where, group in _by_place(changes):
        head = "| change | old | new | |", "| --- | --- | --- | --- |"
        yield from (f"### {_plain(where)}", "", *head)
        for change in group:
            words = *_witnesses(change), _GUARANTEES[change.guarantee], change.note
            why = "<br>".join(map(_plain, filter(None, words)))
            cells = _plain(_headline(change)), _code(change.old), _code(change.new), why
            yield f"| {' | '.join(cells)} |"
        yield ""


def _code(text: str) -> str:
    """A text as code; a vertical bar would end the cell, a backtick the code."""
    if not text:
        return ""
    clean = " ".join(visible(truncate(text, LONGEST)).split()).replace("|", "\\|")
    return f"`` {clean} ``" if "`" in clean else f"`{clean}`"


def _plain(text: str) -> str:
    clean = " ".join(text.split())
    for letter in "\\|<>*_`[]#":
        clean = clean.replace(letter, f"\\{letter}")
    return clean


# For programs. The keys stay; new ones may come.


def as_json(comparison: Comparison, old: str, new: str) -> str:
    """One object: both files, `equal`, and all changes; see docs/diff.md."""
    document = {
        "version": 1,
        "old": old,
        "new": new,
        "equal": not comparison.differences,
        "verdict": comparison.verdict,
        "differences": [_difference_as_json(change) for change in comparison.differences],
        "remarks": [_difference_as_json(change) for change in comparison.remarks],
    }
    return json.dumps(document, indent=2) + "\n"


def _difference_as_json(change: Difference) -> dict[str, Any]:
    found = {key: value for key, value in asdict(change).items() if key != "semantic"}
    for key in ("only_old", "only_new"):
        found[key] = [{"fact": fact, "value": answer} for fact, answer in found[key]]
    return found
