"""Scenarios for refuted rows and for inputs that are absent."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from specc.analysis import Facts
from specc.example.search import Goal, came
from specc.example.situation import Meaning, Situation, Value
from specc.model.fsm import Cause, Transition
from specc.model.system import System
from specc.proof import InputName
from specc.scenario.drive import Driver
from specc.scenario.machine import AbsentError, Run, StrayError, begun, ending, executed, watched
from specc.scenario.script import Placed, Script, step_between
from specc.scenario.subject import Refutation, alone

# Scripts that lead to where an input is read that has not come.


Reading = Callable[[Situation], object]
"""What reads inputs in a situation, and raises AbsentError at one that is not there."""


class AbsencePlanner:
    """Finds the script of one refutation about an input that may have no value."""

    def __init__(self, system: System, facts: Facts, refutation: Refutation) -> None:
        """`system` is the whole one, `facts` are of it."""
        whole = next(s for s in system.subsystems if s.qualified_name == refutation.subsystem)
        self.system = alone(system, refutation.subsystem)
        (self.subsystem,) = self.system.subsystems
        assert refutation.absent is not None  # this is about an input
        self._name: InputName = refutation.absent
        self.meaning = Meaning(self.system, self.subsystem)
        self._driver = Driver(self.meaning, facts, whole, frozenset((self._name,)))
        self._refutation = refutation
        self._others = sorted(self._driver.inputs.names - {self._name})

    def script(self) -> Script | None:
        """A script that reads the input, if possible with everything else there; else None."""
        for wanted in (self._everything_else(), None):
            for attempt in self._attempts(wanted):
                try:
                    return attempt()
                except StrayError:
                    continue
        return None

    def _everything_else(self) -> Situation:
        nothing = self._driver.start(None)
        return replace(nothing, present=frozenset(self._others))

    def _attempts(self, wanted: Situation | None) -> Iterator[Callable[[], Script]]:
        state, code = self._refutation.state, self._refutation.code
        if code == "E0703":
            yield lambda: self._at_first(wanted, lambda at: begun(self.meaning, at))
        elif code == "E0704":
            yield lambda: self._last(
                self._driver.first(wanted), [], lambda at: watched(self.meaning, at)
            )
        elif code == "E0701" and state == self.subsystem.initial_state:
            yield lambda: self._at_first(
                wanted, lambda at: executed(self.meaning, state, begun(self.meaning, at))
            )
        for path in self._driver.paths(state):
            if code == "E0702":
                yield lambda path=path: self._in_conditions(self._along(path, wanted))  # type: ignore[misc]  # a default binds it
            elif code == "E0701" and path:
                yield lambda path=path: self._entering(self._along(path[:-1], wanted), path[-1])  # type: ignore[misc]  # as above

    def _along(self, path: Sequence[Transition], wanted: Situation | None) -> Run:
        run = self._driver.first(wanted)
        for row in path:
            run = self._driver.along(run, row)
        return run

    def _at_first(self, wanted: Situation | None, reading: Reading) -> Script:
        """The first period is the last step."""

        def begin(more: list[Goal]) -> Script:
            at = self._driver.start(wanted, more)
            self._read(reading, at)
            return Script((), None, self._driver.first_step(at), at.answers, ())

        return self._driver.patiently(begin)

    def _entering(self, run: Run, row: Transition) -> Script:
        """The last step takes a row, and the functions of its target read."""
        goals = self._driver.context(row.source, row.cause, [row])
        target = row.target
        return self._last(
            run, goals, lambda at: executed(self.meaning, target, replace(at, periods=0))
        )

    def _in_conditions(self, run: Run) -> Script:
        """In the last step the conditions of the state read, or those of its rows."""
        state, axioms = run.state, [(a.that, True) for a in self.subsystem.axioms]
        behaviour = self.subsystem.state(state).behaviour
        going: Goal = (behaviour.error.when, False)
        for goals in ([], [going], [going, (behaviour.terminal.when, True)]):
            try:
                asked = [*axioms, *goals]
                return self._last(run, asked, lambda at: ending(self.meaning, state, at))
            except StrayError:
                continue
        raise StrayError("it is not read")

    def _last(self, run: Run, goals: list[Goal], reading: Reading) -> Script:
        """The last step, with different inputs coming in it until what is absent is read."""

        every = [came(name) for name in self._others]
        for coming in ([], every, *([one] for one in every)):
            try:
                return self._reached(run, [*goals, *coming], reading)
            except StrayError:
                continue
        raise StrayError("it is not read")

    def _reached(self, run: Run, goals: list[Goal], reading: Reading) -> Script:
        def reach(more: list[Goal]) -> Script:
            reached, seen = self._driver.reach(run, [*goals, *more])
            self._read(reading, seen)
            step = step_between(reached.seen, seen)
            return Script(reached.steps, None, step, seen.answers, ())

        return self._driver.patiently(reach)

    def _read(self, reading: Reading, at: Situation) -> None:
        """Make sure that the input is read without a value.

        Raises:
            AbsentError: another one is.
            StrayError: it is not read.
        """
        try:
            reading(at)
        except AbsentError as error:
            if error.name == self._name:
                return
            raise
        raise StrayError("it is not read")


# From a refutation to a script: driven by inputs where a run leads there, else set directly.


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
        """The script that sets the least directly; None if no values were found."""
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
        """The last step with memory, time and old inputs set directly."""
        seen, rows = self._settled(run.at, goals)
        self._driver.replay(run, replace(run.at, answers=seen.answers))
        periods = None if seen.periods == run.at.periods else seen.periods
        placed = Placed(None, _changed(run.at, seen), periods)
        return Script(run.steps, placed, step_between(run.seen, seen), seen.answers, rows)

    def _put(self, goals: list[Goal]) -> Script | None:
        """The state itself set directly after the first period."""
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
