"""Inputs that lead a subsystem from its first period into a state."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import TypeVar

from specc.analysis import Facts
from specc.example.assign import Freedom
from specc.example.search import Goal, find, present
from specc.example.situation import Meaning, Situation, alike
from specc.model.expr import Expr, LetRef, MemoryRef, walk
from specc.model.fsm import Cause, Transition
from specc.model.system import Subsystem
from specc.proof import InputName
from specc.scenario.machine import (
    AbsentError,
    Ending,
    Inputs,
    Run,
    Seen,
    StrayError,
    axioms_hold,
    begun,
    ending,
    executed,
)
from specc.scenario.script import Step, row_words, step_between

# Ways through the transition table of a machine.


MOST_PATHS = 6
"""Ways to a state that are tried, and ways through every other one."""

Path = tuple[Transition, ...]


def paths(rows: Iterable[Transition], start: str, end: str) -> Iterator[Path]:
    """Ways from a state to another one, the shortest first, no state twice."""
    leaving: dict[str, list[Transition]] = {}
    for row in rows:
        leaving.setdefault(row.source, []).append(row)
    open_: deque[Path] = deque([()])
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


# Driving a subsystem from its first period into a state, on the rows of its table.


MOST_ABSENT = 8
"""Inputs that are asked for one after another."""
MOST_COUNTED = 12
"""Periods in which memory is waited for."""
LONGEST_WAIT = 5000
"""Periods that a run waits at most; beyond that the time is put in place."""


Found = TypeVar("Found")


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
        self.meaning = meaning
        self.inputs = Inputs(meaning, facts, original, never)
        self._never = never
        self._subsystem = meaning.subsystem
        self._presence = facts.presence(original)
        self._possible = {step.row.place for step in facts.steps(original)}
        self._changing = frozenset(
            a.name for b in self._subsystem.behaviours for a in b.assignments if not a.peer
        )
        self._changing_lets: set[str] = set()
        for let in self._subsystem.lets:  # in order of dependence
            if self._depends(let.value):
                self._changing_lets.add(let.name)

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

    def first(self, wanted: Situation | None = None) -> Run:
        """The first period; inputs that a later situation needs arrive already then if they can.

        Raises:
            StrayError: it fails.
        """
        state = self._subsystem.initial_state

        def begin(more: list[Goal]) -> Run:
            seen = begun(self.meaning, self.start(wanted, more, number))
            step = self.first_step(seen)
            return Run(seen, (), (step,), state, self._next(state, seen))

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
        at = self.inputs.nothing(number)
        at = at if wanted is None else self.inputs.with_values(at, wanted)
        return self.found(at, [*axioms, *goals], "")

    def first_step(self, seen: Situation) -> Step:
        """The step of the first period."""
        shown = self.inputs.without_own(seen)
        return step_between(None, shown, self._subsystem.initial_state, "the first period")

    def along(self, run: Run, row: Transition) -> Run:
        """The run with one more row taken.

        Raises:
            StrayError: nothing was found that takes it.
        """
        goals = self.context(row.source, row.cause, [row])
        index = next(i for i, other in enumerate(self._subsystem.transitions) if other is row)

        def take(more: list[Goal]) -> Run:
            here, seen = self.reach(run, [*goals, *more])
            if ending(self.meaning, row.source, seen) != Ending(row.cause, (index,)):
                raise StrayError("another row is taken")
            step = step_between(here.seen, seen, row.target, row_words(row))
            at = self._next(row.target, replace(seen, periods=0))
            return here.having(Seen(row.source, seen, index), step, row.target, at)

        return self.patiently(take)

    def patiently(self, attempt: Callable[[list[Goal]], Found]) -> Found:
        """The result of an attempt once the inputs that it lacks are among its goals.

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

    def reach(self, run: Run, goals: Sequence[Goal]) -> tuple[Run, Situation]:
        """What is seen in the state that the run is in so that the goals are met; it may wait.

        Raises:
            StrayError: nothing was found that meets them.
        """
        try:
            found = self.found(run.at, goals, run.state, time=True)
        except StrayError:
            return self._counted(run, goals)
        missing = found.periods - run.at.periods
        if missing == 0:
            return run, found
        if not 0 < missing <= LONGEST_WAIT:
            raise StrayError("it takes too long")
        waited = self._wait(run, missing)
        return waited, self.found(waited.at, goals, run.state)

    def _counted(self, run: Run, goals: Sequence[Goal]) -> tuple[Run, Situation]:
        """The same where changing memory has to reach some value first."""
        if not any(self._depends(condition) for condition, _ in goals):
            raise StrayError(f"no inputs were found that end {run.state} as required")
        for _ in range(MOST_COUNTED):
            run = self._wait(run, 1)
            try:
                return run, self.found(run.at, goals, run.state)
            except StrayError:
                continue
        raise StrayError("memory does not reach the required values")

    def _depends(self, expr: Expr) -> bool:
        """Whether an expression depends on memory that changes."""
        return any(
            (isinstance(node, MemoryRef) and node.name in self._changing)
            or (isinstance(node, LetRef) and node.name in self._changing_lets)
            for node in walk(expr)
        )

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
        inputs = self.inputs
        sure = self.sure(state) | inputs.always if state else inputs.always
        freedom = Freedom(memory, time, placed, inputs.devices, sure, self._never)
        found = find(self.meaning, at, goals, freedom)
        if found is None:
            raise StrayError(f"no inputs were found that end {state} as required")
        while time and found.periods > at.periods:
            sooner = replace(found, periods=found.periods - 1)
            if not self.meaning.meets(goals, sooner):
                break
            found = sooner
        return self.inputs.with_company(found, goals)

    def replay(self, run: Run, last: Situation) -> None:
        """Run it again with operators returning from the beginning what they return in the end.

        Raises:
            StrayError: the run then differs, or memory has other values than in `last`.
        """
        answers, at = last.answers, self.after_first(run, last)
        for seen in run.periods:
            now = replace(seen.at, answers=answers, memory=at.memory)
            ended = ending(self.meaning, seen.state, now)
            rows = self._subsystem.transitions
            wanted = None if seen.row is None else Ending(rows[seen.row].cause, (seen.row,))
            if ended != wanted or not axioms_hold(self.meaning, now):
                raise StrayError(
                    "an operator would have to return two values for the same arguments"
                )
            target = seen.state if seen.row is None else rows[seen.row].target
            now = now if seen.row is None else replace(now, periods=0)
            at = executed(self.meaning, target, now)
        if any(not alike(last.memory[name], value) for name, value in at.memory.items()):
            raise StrayError("memory would have other values")

    def after_first(self, run: Run, last: Situation) -> Situation:
        """What the first period leaves if operators give what they give in the end.

        Raises:
            StrayError: it fails.
        """
        at = begun(self.meaning, replace(run.first, answers=last.answers))
        return executed(self.meaning, self._subsystem.initial_state, at)

    def paths(self, state: str) -> Iterator[Path]:
        """Ways to a state over rows that can be taken."""
        rows = (row for row in self._subsystem.transitions if row.place in self._possible)
        return paths(rows, self._subsystem.initial_state, state)

    def _wait(self, run: Run, periods: int) -> Run:
        """The run with some more periods in its state."""
        for _ in range(periods):
            at = self._going_on(run.state, run.at)
            step = step_between(run.seen, at, run.state, "it goes on")
            later = self._next(run.state, at)
            run = run.having(Seen(run.state, at), step, run.state, later)
        return run

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
        return self.inputs.later(executed(self.meaning, state, at))
