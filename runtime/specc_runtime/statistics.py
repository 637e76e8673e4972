"""Counts over the records of a run: steps, states, transitions and what they execute."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from specc_runtime.records import StepRecord
from specc_runtime.subsystem import Subsystem
from specc_runtime.system import System

Path = tuple[str, int, str]
"""State before (empty in the first period), transition taken or -1, state whose behaviour ran."""


@dataclass(slots=True)
class Tally:
    """What one subsystem did. `state` is where it is now."""

    subsystem: Subsystem
    state: str = ""
    paths: Counter[Path] = field(default_factory=Counter)

    @property
    def steps(self) -> int:
        """Committed steps."""
        return sum(self.paths.values())

    @property
    def states_visited(self) -> dict[str, int]:
        """Steps in each state, in order of the states' names."""
        counts: Counter[str] = Counter()
        for (_, _, state), steps in self.paths.items():
            counts[state] += steps
        return dict(sorted(counts.items()))

    @property
    def transitions_taken(self) -> dict[str, int]:
        """How often each row of the table was taken, in order of the table."""
        counts: Counter[int] = Counter()
        for (_, transition, _), steps in self.paths.items():
            counts[transition] += steps
        rows = enumerate(self.subsystem.transitions)
        return {str(row): counts[index] for index, row in rows if counts[index]}

    def equations(self) -> set[int]:
        """Numbers of the equations that were executed.

        A step checks the error condition of the state before, then the terminal one, then the rows
        of that state and cause up to the one taken, and executes the new state's behaviour.
        """
        done: set[int] = set()
        tables = self.subsystem.equations
        for before, transition, state in self.paths:
            done.update(tables.behaviours.get(state, ()))
            if not before:
                continue
            rows = self.subsystem.transitions[: transition + 1]
            cause = rows[-1].cause if rows else "terminal"
            checks = tables.checks.get(before, {})
            done.update(checks.get("error", ()))
            if cause == "terminal":
                done.update(checks.get("terminal", ()))
            for row, numbers in zip(rows, tables.rows, strict=False):
                if (row.source, row.cause) == (before, cause):
                    done.update(numbers)
        return done


class Statistics:
    """Tallies of all subsystems by name; call it with each record."""

    def __init__(self, system: System) -> None:
        self.tallies = {s.subsystem.name: Tally(s.subsystem) for s in system.subsystems}

    def __call__(self, record: StepRecord) -> None:
        """Count a step."""
        tally = self.tallies[record.subsystem]
        tally.paths[tally.state, record.transition, record.state] += 1
        tally.state = record.state

    @property
    def states(self) -> dict[str, str]:
        """Where each subsystem is now."""
        return {name: tally.state for name, tally in self.tallies.items()}

    def equations(self) -> list[int]:
        """Numbers of all equations that were executed, in order."""
        done: set[int] = set()
        return sorted(done.union(*(tally.equations() for tally in self.tallies.values())))
