"""Gaps as findings at their lines: W1101 for a row that exploring reaches, W1102 for all others."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from specc.diagnostics import Diagnostic
from specc.policy import Settings, judge
from specc.source import Sources
from specc.tools.coverage.counting import Coverage
from specc.tools.coverage.items import CoverageItem

if TYPE_CHECKING:
    from specc.tools.explore.explorer import Exploration

REACHED, GAP = "W1101", "W1102"


@dataclass(frozen=True, slots=True)
class Reach:
    """What exploring says of rows, each by machine and index in its table."""

    reached: frozenset[tuple[str, int]]
    explored: frozenset[str]
    """Machines of which all ways are known."""

    def of(self, rows: Collection[tuple[str, int]]) -> bool | None:
        """Whether one of the rows can be taken; None where that is not known."""
        if self.reached.intersection(rows):
            return True
        return False if all(name in self.explored for name, _ in rows) else None


UNKNOWN = Reach(frozenset(), frozenset())


def reach_of(found: Exploration) -> Reach:
    """What an exploration says of rows."""
    complete = (s for s in found.slices if s.complete)
    names = (name for each in complete for name in (*each.names, *each.equal_machines))
    return Reach(frozenset(found.reached_rows), frozenset(names))


def gap_findings(coverage: Coverage, reach: Reach) -> dict[CoverageItem, Diagnostic]:
    """The finding about each gap."""
    gaps = coverage.gaps
    missing = set(gaps)
    return {item: _finding(item, missing, coverage, reach) for item in gaps}


def ignored_gaps(findings: dict[CoverageItem, Diagnostic], sources: Sources) -> set[CoverageItem]:
    """The gaps that comments beside them take as they are."""
    left = set(judge(findings.values(), sources, Settings(), is_complete=False).diagnostics)
    return {item for item, finding in findings.items() if finding not in left}


def _finding(
    item: CoverageItem, missing: Collection[CoverageItem], coverage: Coverage, reach: Reach
) -> Diagnostic:
    code, message = GAP, _words(item, missing)
    if item.kind == "row":
        match reach.of(coverage.rows_of(item)):
            case True:
                code = REACHED
                message += ", although `specc explore` finds a way to it"
            case False:
                message += ", and there is no way to it, as `specc explore` shows"
    if item.kind == "requirement" and not coverage.has_reports:
        message += " as far as recordings say, some of which were cut"
    return Diagnostic(code, message, item.place)


def _words(item: CoverageItem, missing: Collection[CoverageItem]) -> str:
    name, of = f"`{item.name}`", f"of `{item.subsystem}`"
    if item.kind == "condition":
        if replace(item, truth=not item.truth) in missing:
            return f"no run asks condition {name} {of}"
        return f"condition {name} {of} is {'true' if item.truth else 'false'} in no run"
    words = {
        "state": f"enters state {name} {of}",
        "row": f"takes row {name} {of}",
        "function": f"executes function {name} {of}",
        "equation": f"executes equation {item.name}",
        "requirement": f"asks requirement {name}",
    }
    return f"no run {words[item.kind]}"
