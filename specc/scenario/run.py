"""A run as far as it has been driven."""

from __future__ import annotations

from dataclasses import dataclass, replace

from specc.example.situation import Situation
from specc.scenario.script import Step


@dataclass(frozen=True, slots=True)
class Seen:
    """A period after the first: the state, what was seen in it, and the row taken, if any."""

    state: str
    at: Situation
    row: int | None = None


@dataclass(frozen=True, slots=True)
class Run:
    """What has been seen so far.

    Attributes:
        first: what was seen in the first period.
        periods: the others.
        steps: the same as steps of a script.
        state: the state that it is in.
        at: what is seen there next if nothing comes.
    """

    first: Situation
    periods: tuple[Seen, ...]
    steps: tuple[Step, ...]
    state: str
    at: Situation

    @property
    def seen(self) -> Situation:
        """What was seen last."""
        return self.periods[-1].at if self.periods else self.first

    def having(self, seen: Seen, step: Step, state: str, at: Situation) -> Run:
        """The run with one more period; a step that only goes on is made longer instead."""
        steps = (*self.steps, step)
        last = self.steps[-1]
        if seen.row is None and last.way == step.way and not (step.arrives or step.there):
            steps = (*self.steps[:-1], replace(last, periods=last.periods + 1))
        return Run(self.first, (*self.periods, seen), steps, state, at)
