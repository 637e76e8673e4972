"""Driving a subsystem from its first period into a state, on the rows of its table."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

from specc.facts import Facts
from specc.facts import Step as Taken
from specc.model.fsm import Cause, Transition
from specc.model.system import Subsystem
from specc.proof import InputName
from specc.scenario.freedom import Freedom
from specc.scenario.machine import (
    AbsentError,
    Ending,
    StrayError,
    axioms_hold,
    begun,
    ending,
    executed,
)
from specc.scenario.script import Step, row_words, step_between
from specc.scenario.search import Goal, find, present
from specc.scenario.situation import Meaning, Situation
from specc.scenario.values import Value, alike, first_value

MOST_PATHS = 6
MOST_ABSENT = 8
"""Inputs that are asked for one after another."""
LONGEST_WAIT = 5000
"""Periods that a run waits at most; beyond that the time is put in place."""


Found = TypeVar("Found")


@dataclass(frozen=True, slots=True)
class Seen:
    """A period after the first: the state, what was seen in it, and the row taken, if any."""

    state: str
    at: Situation
    row: int | None = None


@dataclass(frozen=True, slots=True)
class Drive:
    """A run so far.

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

    def having(self, seen: Seen, step: Step, state: str, at: Situation) -> Drive:
        """The run with one more period; a step that only goes on is made longer instead."""
        steps = (*self.steps, step)
        last = self.steps[-1]
        if seen.row is None and last.way == step.way and not (step.arrives or step.there):
            steps = (*self.steps[:-1], replace(last, periods=last.periods + 1))
        return Drive(self.first, (*self.periods, seen), steps, state, at)


class Driver:
    """Drives one subsystem."""

    def __init__(
        self,
        meaning: Meaning,
        facts: Facts,
        original: Subsystem,
        never: frozenset[InputName] = frozenset(),
    ) -> None:
        """`original` is the subsystem as the facts know it; what `never` names does not come."""
        self._never = never
        self.meaning = meaning
        self._subsystem = meaning.subsystem
        self._presence = facts.presence(original)
        self._arrivals = self._presence.arrivals
        self._steps = facts.steps(original)
        ports = [port for port in original.ports if port.direction == "x"]
        self.devices = frozenset(
            (port.peer, element.name)
            for port in ports
            if port.other_end in facts.connections.devices
            for element in port.elements
        )
        self.always = facts.connections.always_present(original)
        self._changing = frozenset(
            a.name for b in self._subsystem.behaviours for a in b.assignments if not a.peer
        )
        self._elements = {(p.peer, e.name): e for p in ports for e in p.elements}

    @property
    def elements(self) -> frozenset[InputName]:
        """All inputs."""
        return frozenset(self._elements)

    def sure(self, state: str) -> frozenset[InputName]:
        """Inputs that are there whenever the conditions of a state are asked."""
        return self._presence.in_conditions(state)

    def context(self, state: str, cause: Cause, rows: Sequence[Transition]) -> list[Goal]:
        """The state ends by the cause, the assumptions hold, and of its rows `rows` apply."""
        behaviour = self._subsystem.state(state).behaviour
        goals: list[Goal] = [(behaviour.error.when, cause == "error")]
        if cause == "terminal":
            goals.append((behaviour.terminal.when, True))
        goals += [(axiom.that, True) for axiom in self._subsystem.axioms]
        return goals + [
            (row.condition.when, any(row is other for other in rows))
            for _, row in self._subsystem.rows(state, cause)
        ]

    def first(self, wanted: Situation | None = None) -> Drive:
        """The first period; what a later situation needs comes then already if it can.

        Raises:
            StrayError: it fails.
        """
        state = self._subsystem.initial_state

        def begin(more: list[Goal]) -> Drive:
            seen = begun(self.meaning, self.start(wanted, more, number))
            step = self.first_step(seen)
            return Drive(seen, (), (step,), state, self._next(state, seen))

        number = 0.0
        try:
            return self.patiently(begin)
        except AbsentError:
            raise
        except StrayError:
            number = 1.0  # by which one can divide
            return self.patiently(begin)

    def start(
        self, wanted: Situation | None, goals: Sequence[Goal] = (), number: float = 0.0
    ) -> Situation:
        """What is seen in the first period, where numbers that do not matter are `number`.

        Raises:
            StrayError: nothing was found that meets the assumptions and the goals.
        """
        axioms = [(axiom.that, True) for axiom in self._subsystem.axioms]
        at = self._with_values(self._nothing(number), wanted)
        return self.found(at, [*axioms, *goals], "")

    def first_step(self, seen: Situation) -> Step:
        """The step of the first period."""
        shown = self._without_own(seen)
        return step_between(None, shown, self._subsystem.initial_state, "the first period")

    def along(self, drive: Drive, row: Transition) -> Drive:
        """The run with one more row taken.

        Raises:
            StrayError: nothing was found that takes it.
        """
        goals = self.context(row.source, row.cause, [row])
        index = next(i for i, other in enumerate(self._subsystem.transitions) if other is row)

        def take(more: list[Goal]) -> Drive:
            here, seen = self.reach(drive, [*goals, *more])
            if ending(self.meaning, row.source, seen) != Ending(row.cause, (index,)):
                raise StrayError("another row is taken")
            step = step_between(here.seen, seen, row.target, row_words(row))
            at = self._next(row.target, replace(seen, periods=0))
            return here.having(Seen(row.source, seen, index), step, row.target, at)

        return self.patiently(take)

    def patiently(self, attempt: Callable[[list[Goal]], Found]) -> Found:
        """What an attempt gives once the inputs that it reads in vain are among its goals.

        Raises:
            StrayError: it fails otherwise, or needs what never comes.
        """
        more: list[Goal] = []
        for _ in range(MOST_ABSENT):
            try:
                return attempt(more)
            except AbsentError as error:
                if error.name in self._never:
                    raise
                more.append(present(error.name))
        raise StrayError("inputs are missing")

    def reach(self, drive: Drive, goals: Sequence[Goal]) -> tuple[Drive, Situation]:
        """What is seen in the state that the run is in so that the goals are met; it may wait.

        Raises:
            StrayError: nothing was found that meets them.
        """
        found = self.found(drive.at, goals, drive.state, time=True)
        missing = found.periods - drive.at.periods
        if missing == 0:
            return drive, found
        if not 0 < missing <= LONGEST_WAIT:
            raise StrayError("it takes too long")
        waited = self._wait(drive, missing)
        return waited, self.found(waited.at, goals, drive.state)

    def found(
        self,
        at: Situation,
        goals: Sequence[Goal],
        state: str,
        *,
        time: bool = False,
        placed: bool = False,
    ) -> Situation:
        """A situation near `at` that meets goals; without a `state`, one of the first period.

        Other periods are tried with `time`, and with `placed` what no run changes by itself.

        Raises:
            StrayError: nothing was found.
        """
        memory = self._changing if placed else frozenset[str]()
        sure = self.sure(state) | self.always if state else self.always
        found = find(
            self.meaning, at, goals, Freedom(memory, time, placed, self.devices, sure, self._never)
        )
        if found is None:
            raise StrayError(f"nothing was found that ends {state} as wanted")
        return self._with_company(found, goals)

    def _with_company(self, at: Situation, goals: Sequence[Goal]) -> Situation:
        """The situation with what is sent together with what has come."""
        present = self._arrivals.close(at.present) - self._never
        came = replace(at, present=present, fresh=at.fresh | (present - at.present))
        if all(self.meaning.holds(condition, came) is wanted for condition, wanted in goals):
            return came
        return replace(at, present=present)

    def replay(self, drive: Drive, last: Situation) -> None:
        """Run it again with what operators give in the end, which they give from the beginning.

        Raises:
            StrayError: then it goes otherwise, or memory has other values than `last`.
        """
        answers, at = last.answers, self.after_first(drive, last)
        for seen in drive.periods:
            now = replace(seen.at, answers=answers, memory=at.memory)
            ended = ending(self.meaning, seen.state, now)
            rows = self._subsystem.transitions
            wanted = None if seen.row is None else Ending(rows[seen.row].cause, (seen.row,))
            if ended != wanted or not axioms_hold(self.meaning, now):
                raise StrayError("an operator would have to give two values for one argument")
            target = seen.state if seen.row is None else rows[seen.row].target
            now = now if seen.row is None else replace(now, periods=0)
            at = executed(self.meaning, target, now)
        if any(not alike(last.memory[name], value) for name, value in at.memory.items()):
            raise StrayError("memory would have other values")

    def after_first(self, drive: Drive, last: Situation) -> Situation:
        """What the first period leaves if operators give what they give in the end.

        Raises:
            StrayError: it fails.
        """
        at = begun(self.meaning, replace(drive.first, answers=last.answers))
        return executed(self.meaning, self._subsystem.initial_state, at)

    def paths(self, state: str) -> Iterator[tuple[Transition, ...]]:
        """Ways to a state over rows that can be taken, the shortest first, no state twice."""
        rows = [row for taken in self._steps if (row := self._own(taken)) is not None]
        open_: deque[tuple[Transition, ...]] = deque([()])
        count = 0
        while open_ and count < MOST_PATHS:
            path = open_.popleft()
            here = path[-1].target if path else self._subsystem.initial_state
            if here == state:
                count += 1
                yield path
                continue
            been = {self._subsystem.initial_state, *(row.target for row in path)}
            open_ += [(*path, row) for row in rows if row.source == here and row.target not in been]

    def _own(self, taken: Taken) -> Transition | None:
        """The row of the subsystem at hand that stands where a row of the facts does."""
        rows = self._subsystem.transitions
        return next((row for row in rows if row.place == taken.row.place), None)

    def _wait(self, drive: Drive, periods: int) -> Drive:
        """The run with some more periods in its state."""
        for _ in range(periods):
            at = self._going_on(drive.state, drive.at)
            step = step_between(drive.seen, at, drive.state, "it goes on")
            later = self._next(drive.state, at)
            drive = drive.having(Seen(drive.state, at), step, drive.state, later)
        return drive

    def _going_on(self, state: str, at: Situation) -> Situation:
        """A situation in which a state does not end, the given one if it can be.

        Raises:
            StrayError: nothing was found that keeps it.
        """
        if ending(self.meaning, state, at) is None and axioms_hold(self.meaning, at):
            return at
        behaviour = self._subsystem.state(state).behaviour
        goals: list[Goal] = [(behaviour.error.when, False), (behaviour.terminal.when, False)]
        goals += [(axiom.that, True) for axiom in self._subsystem.axioms]
        return self.found(at, goals, state)

    def _next(self, state: str, at: Situation) -> Situation:
        later = executed(self.meaning, state, at)
        present = self._arrivals.close(later.present | self._arrivals.later) - self._never
        return replace(later, present=present)

    def _nothing(self, number: float) -> Situation:
        inputs: dict[InputName, Value] = {
            name: first_value(element.type, number) for name, element in self._elements.items()
        }
        start = Situation(inputs, self.always)
        for name, element in self._elements.items():
            if element.init is not None:
                inputs[name] = self.meaning.value(element.init, start)
        return start

    def _with_values(self, at: Situation, wanted: Situation | None) -> Situation:
        """The situation with the values of another one, as far as the assumptions allow."""
        for name in sorted(wanted.present) if wanted else ():
            assert wanted is not None
            known = name in self.always or name in self._arrivals.later
            if known and repr(at.inputs[name]) == repr(wanted.inputs[name]):
                continue
            came = at.fresh if name in self.devices else at.fresh | {name}
            inputs = {**at.inputs, name: wanted.inputs[name]}
            more = replace(at, inputs=inputs, present=at.present | {name}, fresh=came)
            if axioms_hold(self.meaning, more):
                at = more
        return at if wanted is None else replace(at, answers=wanted.answers)

    def _without_own(self, at: Situation) -> Situation:
        """The situation without the inputs that have their initial value by themselves."""
        own = {
            name
            for name, element in self._elements.items()
            if element.init is not None and name not in at.fresh
        }
        return replace(at, present=at.present - own)
