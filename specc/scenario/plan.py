"""From a refutation to a script: driven by inputs where a run leads there, else put in place."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from specc.example.search import Goal
from specc.example.situation import Meaning, Situation
from specc.example.values import Value
from specc.facts import Facts
from specc.model.fsm import Cause, Transition
from specc.model.system import System
from specc.scenario.drive import Driver
from specc.scenario.machine import StrayError, ending
from specc.scenario.refutations import Refutation
from specc.scenario.run import Run
from specc.scenario.script import Placed, Script, step_between
from specc.scenario.subject import alone


class Planner:
    """Finds the script of one refutation."""

    def __init__(self, system: System, facts: Facts, refutation: Refutation) -> None:
        """`system` is the whole one, `facts` are of it."""
        whole = next(s for s in system.subsystems if s.qualified_name == refutation.subsystem)
        self.system = alone(system, refutation.subsystem)
        (self.subsystem,) = self.system.subsystems
        self.meaning = Meaning(self.system, self.subsystem)
        self._driver = Driver(self.meaning, facts, whole)
        self._refutation = refutation
        assert refutation.cause is not None  # this is about rows
        self._cause: Cause = refutation.cause
        self._rows = tuple(self._own(row) for row in refutation.rows)

    def script(self) -> Script | None:
        """The script that needs the least put in place; None if no values were found."""
        for goals in self._goals():
            for attempt in (self._driven, self._driven_towards, self._put):
                script = attempt(goals)
                if script is not None:
                    return script
        return None

    def _own(self, row: Transition) -> Transition:
        return next(other for other in self.subsystem.transitions if other.place == row.place)

    def _goals(self) -> Iterator[list[Goal]]:
        """The goals of the last step: first without, then with further rows that apply."""
        state, cause = self._refutation.state, self._cause
        exact = [*self._driver.context(state, cause, self._rows), *self._refutation.goals]
        yield exact
        others = {id(r.condition.when) for _, r in self.subsystem.rows(state, cause)}
        others -= {id(row.condition.when) for row in self._rows}
        if self._rows and others:
            yield [goal for goal in exact if id(goal[0]) not in others]

    def _driven(self, goals: list[Goal]) -> Script | None:
        """Only by inputs, from the first period on."""
        return self._along(None, goals, self._reached)

    def _driven_towards(self, goals: list[Goal]) -> Script | None:
        """By inputs that have from the start the values that the last step needs."""
        wanted = self._anywhere(goals)
        if wanted is None:
            return None
        script = self._along(wanted, goals, self._reached)
        return script or self._along(wanted, goals, self._remembered)

    def _along(
        self,
        wanted: Situation | None,
        goals: list[Goal],
        last: Callable[[Run, list[Goal]], Script],
    ) -> Script | None:
        for path in self._driver.paths(self._refutation.state):
            try:
                run = self._driver.first(wanted)
                for row in path:
                    run = self._driver.along(run, row)
                return last(run, goals)
            except StrayError:
                continue
        return None

    def _reached(self, run: Run, goals: list[Goal]) -> Script:
        """The last step of a run that is driven by inputs alone."""

        def reach(more: list[Goal]) -> Script:
            reached, seen = self._driver.reach(run, [*goals, *more])
            rows = self._rows_at(seen)
            self._driver.replay(reached, seen)
            step = step_between(reached.seen, seen)
            return Script(reached.steps, None, step, seen.answers, rows)

        return self._driver.patiently(reach)

    def _remembered(self, run: Run, goals: list[Goal]) -> Script:
        """The last step with memory, time and old inputs put in place."""
        seen, rows = self._settled(run.at, goals)
        self._driver.replay(run, replace(run.at, answers=seen.answers))
        periods = None if seen.periods == run.at.periods else seen.periods
        placed = Placed(None, _changed(run.at, seen), periods)
        return Script(run.steps, placed, step_between(run.seen, seen), seen.answers, rows)

    def _put(self, goals: list[Goal]) -> Script | None:
        """The state itself put in place after the first period."""
        try:
            run = self._driver.first()
            at = replace(run.at, periods=1)
            seen, rows = self._settled(at, goals)
        except StrayError:
            return None
        left = self._driver.after_first(run, seen)
        placed = Placed(self._refutation.state, _changed(left, seen), seen.periods)
        return Script(run.steps, placed, step_between(run.seen, seen), seen.answers, rows)

    def _anywhere(self, goals: list[Goal]) -> Situation | None:
        try:
            return self._settled(self._driver.first().at, goals)[0]
        except StrayError:
            return None

    def _settled(self, at: Situation, goals: Sequence[Goal]) -> tuple[Situation, tuple[int, ...]]:
        """A situation that meets the goals whatever led to it, and the rows that apply.

        Raises:
            StrayError: nothing was found.
        """
        state = self._refutation.state
        at = replace(at, present=at.present | self._driver.sure(state))

        def settle(more: list[Goal]) -> tuple[Situation, tuple[int, ...]]:
            seen = self._driver.found(at, [*goals, *more], state, time=True, placed=True)
            return seen, self._rows_at(seen)

        return self._driver.patiently(settle)

    def _rows_at(self, seen: Situation) -> tuple[int, ...]:
        """The rows that apply in the last step, which are those of the refutation at least.

        Raises:
            StrayError: it ends otherwise.
        """
        ended = ending(self.meaning, self._refutation.state, seen)
        wanted = {i for i, row in enumerate(self.subsystem.transitions) if row in self._rows}
        if (
            ended is None
            or ended.cause != self._refutation.cause
            or not wanted <= set(ended.rows)
            or len(ended.rows) == 1
            or bool(ended.rows) != bool(wanted)
        ):
            raise StrayError("the situation does not show it")
        return ended.rows


def _changed(before: Situation, at: Situation) -> dict[str, Value]:
    """Memory that has other values than before."""
    known = before.memory
    return {n: value for n, value in at.memory.items() if repr(value) != repr(known[n])}
