"""Scripts that lead to where an input is read that has not come."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

from specc.example.search import Goal, came
from specc.example.situation import Meaning, Situation
from specc.facts import Facts
from specc.model.fsm import Transition
from specc.model.system import System
from specc.proof import InputName
from specc.scenario.drive import Driver
from specc.scenario.machine import AbsentError, StrayError, begun, ending, executed, watched
from specc.scenario.refutations import Refutation
from specc.scenario.run import Run
from specc.scenario.script import Script, step_between
from specc.scenario.subject import alone

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
        """Make sure that the input is read in vain.

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
