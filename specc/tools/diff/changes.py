"""What a comparison says: differences of meaning, and changes that leave the meaning as it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal, TypeVar

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

    def expressions(
        self,
        aspect: str,
        old: Expr | None,
        new: Expr | None,
        compare: Callable[[Expr, Expr], Verdict],
        absent: str = "none",
        guarantee: Guarantee = "",
    ) -> None:
        """Two expressions, each of which may be `absent`."""
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
