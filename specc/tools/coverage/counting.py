"""Counts of what recorded runs tried, over all runs of one specification."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import chain
from typing import Any, NamedTuple

from specc.model.system import System
from specc.reachable import grouped
from specc.tools.coverage.items import (
    CoverageItem,
    ItemKind,
    MachineItems,
    Passage,
    equation_places,
    requirement_item,
)


class Share(NamedTuple):
    """How many items were tried, of how many."""

    covered: int
    of: int

    @property
    def percent(self) -> float:
        """Down to a tenth, so that only all of them are 100."""
        return 1000 * self.covered // self.of / 10 if self.of else 100.0

    def __str__(self) -> str:
        return f"{self.covered}/{self.of}" if self.of else "-"


def total(shares: Iterable[Share]) -> Share:
    """The share of all of them together."""
    every = [*shares]
    return Share(sum(each.covered for each in every), sum(each.of for each in every))


class ForeignRunError(Exception):
    """A run made a passage that the specification does not have; the message says which."""


class Coverage:
    """How many steps tried each item; of a requirement, how many runs asked it."""

    def __init__(self, system: System) -> None:
        self._machines = {s.qualified_name: MachineItems(system, s) for s in system.subsystems}
        places = equation_places(system)
        executable = frozenset[int]().union(*(m.equations() for m in self._machines.values()))
        self._equations = {
            number: CoverageItem("equation", "", str(number), places[number])
            for number in sorted(executable)
        }
        self._requirements = grouped((r.that, requirement_item(r)) for r in system.requirements)
        items = chain.from_iterable(machine.items() for machine in self._machines.values())
        requirements = chain.from_iterable(self._requirements.values())
        every = (*items, *self._equations.values(), *requirements)
        self.counts: dict[CoverageItem, int] = dict.fromkeys(every, 0)
        self.has_reports = True
        """Whether every run has one: a recording that was cut does not say what was asked."""

    def add(self, passages: Mapping[str, Mapping[Passage, int]], report: Mapping[str, Any]) -> None:
        """Add a run: how often each machine made each passage, and its report, which may be empty.

        Raises ForeignRunError.
        """
        for name, counts in passages.items():
            machine = self._machines.get(name)
            for passage, steps in counts.items():
                if machine is None or not machine.is_possible(passage):
                    raise ForeignRunError(_passage_words(name, passage))
                items, numbers = machine.covered(passage)
                for item in (*items, *(self._equations[number] for number in numbers)):
                    self.counts[item] += steps
        self.has_reports &= bool(report)
        for item in self._requirement_items(report.get("requirements")):
            self.counts[item] += 1

    def _requirement_items(self, entries: object) -> Iterator[CoverageItem]:
        """The requirements that a run asked, which its report says."""
        for entry in entries if isinstance(entries, list) else ():
            that = entry.get("that") if isinstance(entry, dict) else None
            if isinstance(that, str) and entry.get("asked", False) in (True, None):
                yield from self._requirements.get(that, ())  # None: at every tick

    def rows_of(self, item: CoverageItem) -> Sequence[tuple[str, int]]:
        """The rows of the table that a row of the file stands for, by machine and index."""
        return self._machines[item.subsystem].rows[item]

    @property
    def gaps(self) -> list[CoverageItem]:
        """What no run tried."""
        return [item for item, count in self.counts.items() if not count]

    def shares(self, but: Collection[CoverageItem]) -> dict[tuple[ItemKind, str], Share]:
        """How much was tried of each kind and subsystem, but for some items."""
        counts = grouped(
            ((item.kind, item.subsystem), count > 0)
            for item, count in self.counts.items()
            if item not in but
        )
        return {of: Share(sum(each), len(each)) for of, each in counts.items()}

    @property
    def machines(self) -> list[str]:
        """The subsystems, in the order of the file."""
        return list(self._machines)


def _passage_words(name: str, passage: Passage) -> str:
    before, label, state = passage
    by = f" by {label}" if label else ""
    start = f" from {before}" if before else ""
    return f"{name} went{start} to {state}{by}"
