"""From what is refuted to a script that makes the generated code fail.

Inputs alone drive it there if some are found; else a state, memory or time is put in place.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

from specc.analysis import Facts
from specc.model.fsm import Transition
from specc.proof import freshness
from specc.reachable import grouped
from specc.search import Goal, Situation, showing
from specc.tools.witness.code import (
    AbsentError,
    Placed,
    Script,
    StrayError,
    SubsystemCode,
    fault,
    led,
)
from specc.tools.witness.drive import Driven, Driver, step_between
from specc.tools.witness.subject import Refutation

# Ways through the transition table of a machine.


MOST_PATHS = 6
"""Ways to a state that are tried, and ways through every other one."""

TransitionPath = tuple[Transition, ...]


def paths(rows: Iterable[Transition], start: str, end: str) -> Iterator[TransitionPath]:
    """Ways from a state to another one, the shortest first, no state twice."""
    leaving = grouped((row.source, row) for row in rows)
    open_: deque[TransitionPath] = deque([()])
    visits: Counter[str] = Counter()
    while open_:
        path = open_.popleft()
        here = path[-1].target if path else start
        visits[here] += 1
        if visits[here] > MOST_PATHS:
            continue
        if here == end:
            yield path
            continue
        been = {start, *(row.target for row in path)}
        open_ += [(*path, row) for row in leaving.get(here, ()) if row.target not in been]


# Attempts at a script, those that put the least in place first.


Attempt = Callable[[], Script]


def planned(code: SubsystemCode, facts: Facts, refutation: Refutation) -> Script | None:
    """The script of a refutation; None if none was found. `facts` are of the whole system."""
    for attempt in Planner(code, facts, refutation).attempts():
        try:
            return attempt()
        except StrayError:
            continue
    return None


class Planner:
    """Finds the script of one refutation."""

    def __init__(self, code: SubsystemCode, facts: Facts, refutation: Refutation) -> None:
        whole = next(s for s in facts.system.subsystems if s.qualified_name == refutation.subsystem)
        never = () if refutation.absent is None else (refutation.absent,)
        self._driver = Driver(code, facts, whole, frozenset(never))
        self._code = code
        self._subsystem = code.subsystem
        self._refutation = refutation
        possible = {step.row.place for step in facts.of(whole).edges}
        rows = [row for row in self._subsystem.transitions if row.place in possible]
        self._paths = list(paths(rows, self._subsystem.initial_state, refutation.state))

    def attempts(self) -> Iterator[Attempt]:
        """What may give a script, or raise StrayError."""
        if self._refutation.absent is None:
            for goals in self._goals():
                yield from self._of_rows(goals)
        else:
            for wanted in (self._everything_else(), None):
                yield from self._of_absence(wanted)

    def _goals(self) -> Iterator[tuple[Goal, ...]]:
        """What shows the rows of the refutation."""
        about = self._refutation
        assert about.cause is not None  # this is about rows
        places = {row.place for row in about.rows}
        rows = self._subsystem.rows(about.state, about.cause)
        holding = [index for index, (_, row) in enumerate(rows) if row.place in places]
        return showing(self._subsystem, about.state, about.cause, holding, about.goals)

    def _of_rows(self, goals: Sequence[Goal]) -> Iterator[Attempt]:
        """By inputs; by such as have from the start the values needed in the end; set directly."""
        for driven in self._runs(None, self._paths):
            yield partial(self._reached, driven, goals)
        runs: list[Driven] = []
        if wanted := self._somewhere(goals):
            for driven in self._runs(wanted, self._paths):
                runs.append(driven)
                yield partial(self._reached, driven, goals)
        for driven in runs:  # with memory, time and old inputs set directly
            yield partial(self._set, driven, driven.at, goals, None)
        yield partial(self._put, goals)

    def _of_absence(self, wanted: Situation | None) -> Iterator[Attempt]:
        """The input is read in the first period, in an assumption, a condition, or on entry."""
        code, state = self._refutation.code, self._refutation.state
        if code == "E0703" or (code == "E0701" and state == self._subsystem.initial_state):
            yield partial(self._driver.patiently, partial(self._at_first, wanted))
        elif code == "E0704":
            yield from self._reading(wanted, (), [[]])
        for path in self._paths:
            if code == "E0702":
                yield from self._reading(wanted, path, self._endings(state))
            elif code == "E0701" and path:
                yield from self._reading(wanted, path[:-1], [self._driver.taking(path[-1])])

    def _reading(
        self, wanted: Situation | None, path: TransitionPath, ends: Sequence[list[Goal]]
    ) -> Iterator[Attempt]:
        """Last steps in which different inputs come."""
        others = sorted(self._driver.inputs.names - {self._refutation.absent})
        every = [(freshness(name), True) for name in others]
        for driven in self._runs(wanted, [path]):
            for goals in ends:
                for coming in ([], every, *([one] for one in every)):
                    yield partial(self._reached, driven, [*goals, *coming])

    def _endings(self, state: str) -> list[list[Goal]]:
        """Goals with which all conditions are asked: without them, an early one may end it."""
        behaviour = self._subsystem.state(state).behaviour
        going = (behaviour.error.when, False)
        ends: list[list[Goal]] = [[], [going], [going, (behaviour.terminal.when, True)]]
        return [[*self._driver.inputs.axioms, *goals] for goals in ends]

    def _runs(self, wanted: Situation | None, ways: Iterable[TransitionPath]) -> Iterator[Driven]:
        for path in ways:
            try:
                yield self._driver.along(path, wanted)
            except StrayError:
                continue

    def _everything_else(self) -> Situation | None:
        """All inputs but the one that is absent."""
        try:
            nothing = self._driver.start(None)
        except StrayError:
            return None
        absent = {self._refutation.absent}
        return replace(nothing, present=frozenset(self._driver.inputs.names - absent))

    def _somewhere(self, goals: Sequence[Goal]) -> Situation | None:
        """A situation that meets the goals, whatever leads to it."""
        try:
            return self._driver.anywhere(self._driver.first().at, goals, self._refutation.state)
        except StrayError:
            return None

    # Ends of scripts; each is played before it is taken.

    def _at_first(self, wanted: Situation | None, more: list[Goal]) -> Script:
        at = self._driver.start(wanted, more)
        return self._checked(Script((), None, self._driver.first_step(at), at.answers))

    def _reached(self, driven: Driven, goals: Sequence[Goal]) -> Script:
        """By inputs alone."""

        def last(more: list[Goal]) -> Script:
            reached, seen = self._driver.reach(driven, [*goals, *more])
            step = step_between(reached.seen, seen)
            return self._checked(Script(reached.steps, None, step, seen.answers))

        return self._driver.patiently(last)

    def _put(self, goals: Sequence[Goal]) -> Script:
        """With the state itself set directly after the first period."""
        driven = self._driver.first()
        return self._set(driven, replace(driven.at, periods=1), goals, self._refutation.state)

    def _set(
        self, driven: Driven, at: Situation, goals: Sequence[Goal], state: str | None
    ) -> Script:
        def last(more: list[Goal]) -> Script:
            seen = self._driver.anywhere(at, [*goals, *more], self._refutation.state)
            before = led(self._code, driven.steps, seen.answers).run.memory
            memory = {n: v for n, v in seen.memory.items() if repr(v) != repr(before.get(n))}
            periods = None if state is None and seen.periods == at.periods else seen.periods
            step = step_between(driven.seen, seen)
            placed = Placed(state, memory, periods)
            return self._checked(Script(driven.steps, placed, step, seen.answers))

        return self._driver.patiently(last)

    def _checked(self, script: Script) -> Script:
        """The script, which fails as the refutation says.

        Raises:
            AbsentError: an input has no value that the refutation is not about.
            StrayError: it does not.
        """
        about = self._refutation
        try:
            shown = fault(self._code, script)
        except AbsentError as error:
            if error.name != about.absent:
                raise
            return script
        wanted = {row.label for row in about.rows}
        if (
            (shown.state, shown.cause) != (about.state, about.cause)
            or not wanted <= set(shown.rows)
            or bool(wanted) != bool(shown.rows)
        ):
            raise StrayError("it fails in another way")
        return replace(script, rows=shown.rows)
