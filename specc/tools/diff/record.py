"""What a comparison says: differences of meaning, and changes that leave the meaning as it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields
from fractions import Fraction
from typing import Any, Generic, Literal, TypeVar

from specc.diagnostics.phrases import in_ms
from specc.model.trace import Trace
from specc.proof.verdict import FactTexts

Guarantee = Literal["", "weaker", "stronger"]
"""Whether less or more is guaranteed, or checked in runs, where agents do the same as before."""

Thing = TypeVar("Thing")


@dataclass(frozen=True, slots=True)
class Verdict:
    """How two conditions relate: facts under which only one holds, or why that is not known."""

    same: bool
    only_old: FactTexts = ()
    only_new: FactTexts = ()
    unknown: str = ""


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
class Book:
    """Takes down the changes of one agent, subsystem or device, or of the system."""

    where: str = ""
    changes: list[Difference] = field(default_factory=list)

    def alone(
        self,
        change: Literal["added", "removed"],
        part: str,
        name: str,
        text: str,
        *,
        semantic: bool = True,
        guarantee: Guarantee = "",
        note: str = "",
    ) -> None:
        """Something that only the new, or only the old system has."""
        texts = ("", text) if change == "added" else (text, "")
        self.changes.append(
            Difference(
                self.where, part, name, change, "", *texts, note, semantic=semantic,
                guarantee=guarantee,
            )
        )  # fmt: skip

    def matched(
        self,
        part: str,
        old: Iterable[Thing],
        new: Iterable[Thing],
        name: Callable[[Thing], str],
        text: Callable[[Thing], str],
        *,
        semantic: bool = True,
    ) -> list[tuple[Compared, Thing, Thing]]:
        """Things of one kind by their names: those of one system alone are taken down.

        Returns those that both have, which are to be compared; `semantic` is about the others.
        """
        pairs = paired(old, new, name)
        for key, thing in pairs.removed.items():
            self.alone("removed", part, key, text(thing), semantic=semantic)
        for key, thing in pairs.added.items():
            self.alone("added", part, key, text(thing), semantic=semantic)
        return [(self.both(part, key), *both) for key, both in pairs.both.items()]

    def both(self, part: str, name: str) -> Compared:
        """Something that both systems have."""
        return Compared(self, part, name)


@dataclass(frozen=True, slots=True)
class Compared:
    """A thing that both systems have: takes down what is different about it."""

    book: Book
    part: str
    name: str

    def changed(
        self,
        aspect: str,
        old: object,
        new: object,
        *,
        semantic: bool = True,
        guarantee: Guarantee = "",
    ) -> None:
        """An aspect of it; nothing is taken down where it is the same."""
        if old != new:
            change = Difference(
                self.book.where, self.part, self.name, "changed", aspect, str(old), str(new),
                semantic=semantic, guarantee=guarantee,
            )  # fmt: skip
            self.book.changes.append(change)

    def guarded(self, aspect: str, texts: tuple[str, str], less: bool, more: bool) -> None:
        """An aspect that guarantees less or more than before."""
        guarantee: Guarantee = "weaker" if less else "stronger" if more else ""
        self.changed(aspect, *texts, guarantee=guarantee)

    def remark(self, aspect: str, old: object, new: object) -> None:
        """An aspect that has no influence on what an agent does."""
        self.changed(aspect, old, new, semantic=False)

    def rest(self, old: Any, new: Any, *told: str) -> None:
        """All its fields that are plain values, but those that are `told` otherwise.

        Words have no influence on what an agent does.
        """
        for item in fields(old):
            both = [getattr(thing, item.name) for thing in (old, new)]
            if item.name not in told and all(map(_is_plain, both)):
                stem, _, unit = item.name.rpartition("_")
                aspect = stem if unit in ("hz", "s") else _SPELT.get(item.name, item.name)
                if item.name in _WORDS:
                    self.remark(aspect, *both)
                else:
                    self.changed(aspect, *(shown(v, unit) for v in both))

    def equality(self, aspect: str, texts: tuple[str, str], same: bool) -> None:
        """Two expressions that have, or have not, the same value."""
        self.verdict(Verdict(same), texts, aspect, "the same value")

    def verdict(
        self, verdict: Verdict, texts: tuple[str, str], aspect: str, equal: str = "proved equal"
    ) -> None:
        """How two conditions relate; nothing if neither their texts nor their meanings differ."""
        same_text = texts[0] == texts[1]
        if verdict.same and same_text:
            return
        note = f"not proved equal: {verdict.unknown}" if verdict.unknown else ""
        if verdict.same:
            note = equal
        elif same_text and not note:
            note = "the text is the same; what it refers to has changed"
        if verdict.same and aspect == "meaning":
            aspect = "text"
        change = Difference(
            self.book.where, self.part, self.name, "changed", aspect, *texts, note,
            verdict.only_old, verdict.only_new, not verdict.same,
        )  # fmt: skip
        self.book.changes.append(change)


_WORDS = ("title", "trace")
_SPELT = {"message": "type"}


def _is_plain(value: object) -> bool:
    if isinstance(value, tuple):
        return all(map(_is_plain, value))
    return value is None or isinstance(value, (str, int, float, Fraction, Trace))


def shown(value: object, unit: str = "") -> str:
    """A plain value; a number of `s` in ms, one of `hz` in Hz."""
    if isinstance(value, Fraction):
        return in_ms(value) if unit == "s" else f"{float(value):g} Hz"
    if isinstance(value, tuple):
        parts = (": ".join(map(str, v)) if isinstance(v, tuple) else str(v) for v in value)
        return ", ".join(parts) or "none"
    return "none" if value is None or value == "" else str(value)


@dataclass(frozen=True, slots=True)
class Pairs(Generic[Thing]):
    """Things of two systems by their names, in alphabetical order."""

    removed: dict[str, Thing]
    both: dict[str, tuple[Thing, Thing]]
    added: dict[str, Thing]


def paired(
    old: Iterable[Thing], new: Iterable[Thing], name: Callable[[Thing], str]
) -> Pairs[Thing]:
    """The things of two systems, matched by name."""
    before = {name(thing): thing for thing in old}
    after = {name(thing): thing for thing in new}
    return Pairs(
        {key: before[key] for key in sorted(before.keys() - after.keys())},
        {key: (before[key], after[key]) for key in sorted(before.keys() & after.keys())},
        {key: after[key] for key in sorted(after.keys() - before.keys())},
    )
