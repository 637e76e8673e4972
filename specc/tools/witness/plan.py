"""From what is refuted to a script that makes the generated code fail.

Inputs are searched for one period after the other, and stepped to see where they lead. If none are
found that lead to the refutation, a state, memory or time is put in place.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TypeVar

from specc.analysis import Facts
from specc.analysis.definite_assignment import always_present
from specc.analysis.graph import TransitionPath, paths
from specc.analysis.reads import Dependences
from specc.model.fsm import Transition, mode_name
from specc.model.system import Subsystem
from specc.proof import InputName, freshness, presence
from specc.search import (
    NO_VALUE,
    FreeVariables,
    Goal,
    Interpreter,
    Situation,
    find,
    refutation_goals,
)
from specc.tools.witness.code import (
    AbsentError,
    NoRunError,
    Periods,
    Placed,
    Script,
    SubsystemCode,
    fault,
    input_text,
    replay,
    run_for,
)
from specc.tools.witness.subject import Refutation

# Situations of a subsystem as steps of a script.


def step_between(before: Situation | None, at: Situation, into: str = "", way: str = "") -> Periods:
    """The step that makes a situation of the one before; None stands for the beginning."""
    known = {} if before is None else {n: before.inputs[n] for n in before.present}
    present = sorted(at.present)
    there = {
        input_text(name): at.inputs[name]
        for name in present
        if name not in at.fresh
        and (name not in known or repr(known[name]) != repr(at.inputs[name]))
    }
    lags = {} if before is None else before.lags
    there |= {
        f"{key[0]}({input_text(key[1:])})": lag
        for key, lag in at.lags.items()
        if lags.get(key) != lag
    }
    live = {} if before is None else before.live
    there |= {name: value for name, value in at.live.items() if live.get(name) != value}
    arrives = {input_text(name): at.inputs[name] for name in present if name in at.fresh}
    absent = map(input_text, sorted(known.keys() - at.present))
    return Periods(arrives, there, tuple(absent), into, way)


# The inputs of a subsystem: what is there at first, what comes later, what comes together.


class Inputs:
    """Situations as far as the inputs of one subsystem go."""

    def __init__(
        self, meaning: Interpreter, facts: Facts, original: Subsystem, never: frozenset[InputName]
    ) -> None:
        """`original` is the subsystem as the facts know it; what `never` names does not come."""
        self._meaning = meaning
        self._never = never
        self._arrivals = facts.of(original).availability
        self._elements = original.inputs
        self.names = frozenset(self._elements)
        self.always = always_present(original, facts.wires)
        self.devices = frozenset(
            (peer, element)
            for peer, element in original.inputs
            if facts.wires.measuring_device(original.qualified_name, peer)
        )
        self.axioms = [(axiom.that, True) for axiom in meaning.subsystem.axioms]

    def initial(self, number: float) -> Situation:
        """The first period when nothing has come, with `number` where numbers do not matter.

        Raises:
            NoRunError: an initial value has no value.
        """
        start = replace(self._meaning.blank(number), present=self.always)
        inputs = dict(start.inputs)
        for name, element in self._elements.items():
            if element.init is not None:
                try:
                    inputs[name] = self._meaning.value(element.init, start, strictly=True)
                except NO_VALUE as error:
                    raise NoRunError(str(error)) from error
        return replace(start, inputs=inputs)

    def with_values(self, at: Situation, wanted: Situation) -> Situation:
        """A first period with the values of another situation, as far as the assumptions allow."""
        for name in sorted(wanted.present):
            known = name in self.always or name in self._arrivals.later
            if known and repr(at.inputs[name]) == repr(wanted.inputs[name]):
                continue
            fresh = at.fresh if name in self.devices else at.fresh | {name}
            inputs = {**at.inputs, name: wanted.inputs[name]}
            more = replace(at, inputs=inputs, present=at.present | {name}, fresh=fresh)
            if self._meaning.satisfies(self.axioms, more):
                at = more
        return replace(at, answers=wanted.answers)

    def without_initial_values(self, at: Situation) -> Situation:
        """The situation without the inputs that have their initial value by themselves."""
        own = {
            name
            for name, element in self._elements.items()
            if element.init is not None and name not in at.fresh
        }
        return replace(at, present=at.present - own)

    def with_simultaneous(self, at: Situation, goals: Sequence[Goal]) -> Situation:
        """The situation with what is sent together with what has come."""
        present = self._arrivals.close(at.present) - self._never
        both = replace(at, present=present, fresh=at.fresh | (present - at.present))
        return both if self._meaning.satisfies(goals, both) else replace(at, present=present)

    def next_period(self, at: Situation) -> Situation:
        """The situation one period later, when what is sent in every period has come."""
        present = self._arrivals.close(at.present | self._arrivals.later) - self._never
        return replace(at, present=present, fresh=frozenset())


# Driving a subsystem: over a row, into a state, or until it is time.


MOST_ABSENT = 8
"""Inputs that are asked for one after another."""
MOST_COUNTED = 12
"""Periods in which memory is waited for."""
LONGEST_WAIT = 5000
"""Periods that a run waits at most; beyond that the time is put in place."""


Found = TypeVar("Found")


@dataclass(frozen=True, slots=True)
class Driven:
    """A run as far as it has been driven.

    Attributes:
        steps: from the first period on.
        seen: what was seen last.
        state: the state that it is in.
        at: what is seen there next if nothing comes.
    """

    steps: tuple[Periods, ...]
    last: Situation
    state: str
    at: Situation


class Driver:
    """Drives one subsystem."""

    def __init__(
        self, code: SubsystemCode, facts: Facts, original: Subsystem, never: frozenset[InputName]
    ) -> None:
        """`original` is the subsystem as the facts know it; what `never` names does not come."""
        self.meaning = Interpreter(code.system, code.subsystem)
        self.inputs = Inputs(self.meaning, facts, original, never)
        self._code = code
        self._never = never
        self._subsystem = code.subsystem
        self._presence = facts.of(original).presence
        self._rests = Dependences({let.name: let.value for let in self._subsystem.lets})

    def row_goals(self, row: Transition) -> list[Goal]:
        """Its state ends by the cause of the row, which is the only one that applies."""
        rows = [other for _, other in self._subsystem.rows(row.source, row.cause)]
        holding = [index for index, other in enumerate(rows) if other is row]
        return list(next(refutation_goals(self._subsystem, row.source, row.cause, holding)))

    def follow(
        self,
        path: Sequence[Transition],
        wanted: Situation | None,
        waits: Mapping[int, int] = MappingProxyType({}),
    ) -> Driven:
        """The run over the rows of a path; inputs have `wanted` values from the start if they can.

        It `waits` so many periods longer before rows with these indices.

        Raises:
            NoRunError: nothing was found that takes them.
        """
        driven = self.first(wanted)
        for index, row in enumerate(path):
            driven = self._wait(driven, waits.get(index, 0))
            driven = self.with_missing_inputs(partial(self._take_row, driven, row))
        return driven

    def longer_runs(
        self, path: Sequence[Transition], state: str, wanted: Situation
    ) -> Iterator[Driven]:
        """Runs over the rows of a path that wait on the way until a mode has lasted as wanted."""
        memory = self.follow(path, None).at.memory
        for timer in sorted(self.timers(state)):
            missing = wanted.memory[timer] - memory[timer]
            for index, row in enumerate(path if 0 < missing <= LONGEST_WAIT else ()):
                if timer in self.timers(row.source):
                    with suppress(NoRunError):
                        yield self.follow(path, None, {index: missing})

    def _take_row(self, driven: Driven, row: Transition, more: list[Goal]) -> Driven:
        here, seen = self.reach(driven, [*self.row_goals(row), *more])
        index = next(i for i, other in enumerate(self._subsystem.transitions) if other is row)
        step = step_between(here.last, seen, row.target, row.label)
        return self._advance((*here.steps, step), seen, index)

    def first(self, wanted: Situation | None = None) -> Driven:
        """The first period; inputs that a later situation needs arrive already then if they can.

        Raises:
            NoRunError: it fails.
        """
        try:
            return self.with_missing_inputs(partial(self._begin, wanted, 0.0))
        except AbsentError:
            raise
        except NoRunError:
            return self.with_missing_inputs(
                partial(self._begin, wanted, 1.0)
            )  # by one, one can divide

    def _begin(self, wanted: Situation | None, number: float, more: list[Goal]) -> Driven:
        seen = self.start(wanted, more, number)
        return self._advance((self.first_step(seen),), seen, -1)

    def start(
        self, wanted: Situation | None, goals: Sequence[Goal] = (), number: float = 0.0
    ) -> Situation:
        """What is seen in the first period, where numbers that do not matter are `number`.

        Raises:
            NoRunError: nothing was found that meets the assumptions and the goals.
        """
        at = self.inputs.initial(number)
        at = at if wanted is None else self.inputs.with_values(at, wanted)
        return self.find_situation(at, [*self.inputs.axioms, *goals], "")

    def first_step(self, seen: Situation) -> Periods:
        """The step of the first period."""
        shown = self.inputs.without_initial_values(seen)
        return step_between(None, shown, self._subsystem.initial_state, "the first period")

    def with_missing_inputs(self, attempt: Callable[[list[Goal]], Found]) -> Found:
        """The result of an attempt once the inputs that it lacks are among its goals.

        Raises:
            NoRunError: it fails otherwise, or needs what never comes.
        """
        more: list[Goal] = []
        for _ in range(MOST_ABSENT):
            try:
                return attempt(more)
            except AbsentError as error:
                if error.name in self._never:
                    raise
                more.append((presence(error.name), True))
        raise NoRunError("inputs are missing")

    def reach(self, driven: Driven, goals: Sequence[Goal]) -> tuple[Driven, Situation]:
        """What is seen in the state that the run is in so that the goals are met; it may wait.

        Raises:
            NoRunError: nothing was found that meets them.
        """
        try:
            found = self.find_situation(driven.at, goals, driven.state, time=True)
        except NoRunError:
            return self._wait_for_memory(driven, goals)
        missing = found.periods - driven.at.periods
        if missing == 0:
            return driven, found
        if not 0 < missing <= LONGEST_WAIT:
            raise NoRunError("it takes too long")
        waited = self._wait(driven, missing)
        return waited, self.find_situation(waited.at, goals, driven.state)

    def _wait_for_memory(self, driven: Driven, goals: Sequence[Goal]) -> tuple[Driven, Situation]:
        """Like `reach`, but waits period by period until memory has reached the required values."""
        if not self._rests.all(c for c, _ in goals).memory & self.meaning.changing:
            raise NoRunError(f"no inputs were found that end {driven.state} as required")
        for _ in range(MOST_COUNTED):
            driven = self._wait(driven, 1)
            try:
                return driven, self.find_situation(driven.at, goals, driven.state)
            except NoRunError:
                continue
        raise NoRunError("memory does not reach the required values")

    def _wait(self, driven: Driven, periods: int) -> Driven:
        """The run with some more periods in its state.

        Raises:
            NoRunError: nothing was found that keeps it there.
        """
        while periods:
            at, state = driven.at, driven.state
            run = replay(self._code, driven.steps, at.answers).run
            gone = run_for(run, step_between(driven.last, at), periods)
            if not gone:
                behaviour = self._subsystem.state(state).behaviour
                goals = [(condition.when, False) for _, condition in behaviour.endings]
                at, gone = self.find_situation(at, [*goals, *self.inputs.axioms], state), 1
            step = step_between(driven.last, at, state, "it goes on")
            *earlier, last = driven.steps
            if last == replace(step, periods=last.periods):  # nothing distinguishes them
                steps = *earlier, replace(last, periods=last.periods + gone)
            else:
                steps = *driven.steps, replace(step, periods=gone)
            driven = self._advance(steps, at, -1)
            periods -= gone
        return driven

    def _advance(self, steps: tuple[Periods, ...], seen: Situation, row: int) -> Driven:
        """The run of some steps, of which the last is what was `seen` and takes a row, or none.

        Raises:
            NoRunError: they lead elsewhere.
        """
        reached = replay(self._code, steps, seen.answers)
        if reached.row != row:
            raise NoRunError("another row is taken")
        later = self.inputs.next_period(seen)
        at = replace(later, memory=reached.run.memory, periods=reached.periods + 1)
        return Driven(steps, seen, reached.run.state, at)

    def find_situation(
        self,
        at: Situation,
        goals: Sequence[Goal],
        state: str,
        *,
        time: bool = False,
        placed: bool = False,
    ) -> Situation:
        """A situation near `at` that meets goals; without a `state`, one of the first period.

        With `time` the state may have lasted any number of periods; with `placed` memory and inputs
        may have any values, since the test puts them there.

        Raises:
            NoRunError: nothing was found.
        """
        memory = self.meaning.changing if placed else frozenset[str]()
        inputs = self.inputs
        sure = self._presence.in_conditions(state) | inputs.always if state else inputs.always
        timers = self.timers(state) if time and not placed else frozenset[str]()
        freedom = FreeVariables(memory, sure, time, placed, inputs.devices, self._never, timers)
        found = find(self.meaning, at, goals, freedom)
        if found is None:
            raise NoRunError(f"no inputs were found that end {state} as required")
        while time and found.periods > at.periods:
            (sooner,) = freedom.wait(found.periods - 1, found)
            if not self.meaning.satisfies(goals, sooner):
                break
            found = sooner
        return self.inputs.with_simultaneous(found, goals)

    def timers(self, state: str) -> frozenset[str]:
        """The memory that counts periods while a state lasts."""
        modes = self._subsystem.state(state).modes if state else ()
        known = {item.name for item in self._subsystem.memory}
        return frozenset(mode_name("periods", mode) for mode in modes) & known

    def find_situation_anywhere(
        self, at: Situation, goals: Sequence[Goal], state: str
    ) -> Situation:
        """A situation of a state that meets the goals, whatever may lead to it.

        Raises:
            NoRunError: nothing was found.
        """
        at = replace(at, present=at.present | self._presence.in_conditions(state))
        found = self.find_situation(at, goals, state, time=True, placed=True)
        for timer in self.timers(state):
            while found.memory[timer] > at.memory[timer]:
                sooner = replace(found, memory={**found.memory, timer: found.memory[timer] - 1})
                if not self.meaning.satisfies(goals, sooner):
                    break
                found = sooner
        return found


# Attempts at a script, those that put the least in place first.


Attempt = Callable[[], Script]


def plan_script(code: SubsystemCode, facts: Facts, refutation: Refutation) -> Script | None:
    """The script of a refutation; None if none was found. `facts` are of the whole system."""
    for attempt in Planner(code, facts, refutation).attempts():
        try:
            return attempt()
        except NoRunError:
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
        possible = {step.row.identity for step in facts.of(whole).edges}
        rows = [row for row in self._subsystem.transitions if row.identity in possible]
        self._paths = list(paths(rows, self._subsystem.initial_state, refutation.state))

    def attempts(self) -> Iterator[Attempt]:
        """Yields attempts; each returns a script or raises NoRunError."""
        if self._refutation.absent is None:
            for goals in self._goals():
                yield from self._row_attempts(goals)
        else:
            for wanted in (self._everything_else(), None):
                yield from self._absence_attempts(wanted)

    def _goals(self) -> Iterator[tuple[Goal, ...]]:
        """What shows the rows of the refutation."""
        about = self._refutation
        assert about.cause is not None  # this is about rows
        shown = {row.identity for row in about.rows}
        rows = self._subsystem.rows(about.state, about.cause)
        holding = [index for index, (_, row) in enumerate(rows) if row.identity in shown]
        return refutation_goals(self._subsystem, about.state, about.cause, holding, about.goals)

    def _row_attempts(self, goals: Sequence[Goal]) -> Iterator[Attempt]:
        """Yields attempts.

        They work with inputs alone, with inputs that have the final values from the start, or with
        state set directly.
        """
        for driven in self._runs(None, self._paths):
            yield partial(self._script_by_inputs, driven, goals)
        runs: list[Driven] = []
        if wanted := self._unreached_situation(goals):
            for path in self._paths:
                with suppress(NoRunError):
                    for driven in self._driver.longer_runs(path, self._refutation.state, wanted):
                        yield partial(self._script_by_inputs, driven, goals)
            for driven in self._runs(wanted, self._paths):
                runs.append(driven)
                yield partial(self._script_by_inputs, driven, goals)
        for driven in runs:  # with memory, time and old inputs set directly
            yield partial(self._script_with_placed_state, driven, driven.at, goals, None)
        yield partial(self._script_from_placed_state, goals)

    def _absence_attempts(self, wanted: Situation | None) -> Iterator[Attempt]:
        """Yields attempts at reading the absent input.

        It is read in the first period (E0703, E0701), in an assumption (E0704), in a condition
        (E0702), or when a state is entered (E0701).
        """
        code, state = self._refutation.code, self._refutation.state
        if code == "E0703" or (code == "E0701" and state == self._subsystem.initial_state):
            yield partial(self._driver.with_missing_inputs, partial(self._at_first, wanted))
        elif code == "E0704":
            yield from self._attempts_to_read(wanted, (), [[]])
        for path in self._paths:
            if code == "E0702":
                yield from self._attempts_to_read(wanted, path, self._end_goals(state))
            elif code == "E0701" and path:
                yield from self._attempts_to_read(
                    wanted, path[:-1], [self._driver.row_goals(path[-1])]
                )

    def _attempts_to_read(
        self, wanted: Situation | None, path: TransitionPath, ends: Sequence[list[Goal]]
    ) -> Iterator[Attempt]:
        """Yields attempts whose last steps differ in the inputs that come."""
        others = sorted(self._driver.inputs.names - {self._refutation.absent})
        every = [(freshness(name), True) for name in others]
        for driven in self._runs(wanted, [path]):
            for goals in ends:
                for coming in ([], every, *([one] for one in every)):
                    yield partial(self._script_by_inputs, driven, [*goals, *coming])

    def _end_goals(self, state: str) -> list[list[Goal]]:
        """Goals under which all conditions are evaluated: an early one may end the state before."""
        behaviour = self._subsystem.state(state).behaviour
        going: list[Goal] = [(error.when, False) for _, error in behaviour.errors]
        ends: list[list[Goal]] = [[], going, [*going, (behaviour.terminal.when, True)]]
        return [[*self._driver.inputs.axioms, *goals] for goals in ends]

    def _runs(self, wanted: Situation | None, ways: Iterable[TransitionPath]) -> Iterator[Driven]:
        for path in ways:
            try:
                yield self._driver.follow(path, wanted)
            except NoRunError:
                continue

    def _everything_else(self) -> Situation | None:
        """All inputs but the one that is absent."""
        try:
            nothing = self._driver.start(None)
        except NoRunError:
            return None
        absent = {self._refutation.absent}
        return replace(nothing, present=frozenset(self._driver.inputs.names - absent))

    def _unreached_situation(self, goals: Sequence[Goal]) -> Situation | None:
        """A situation that meets the goals, whatever leads to it."""
        try:
            return self._driver.find_situation_anywhere(
                self._driver.first().at, goals, self._refutation.state
            )
        except NoRunError:
            return None

    # Ends of scripts; each is played before it is taken.

    def _at_first(self, wanted: Situation | None, more: list[Goal]) -> Script:
        at = self._driver.start(wanted, more)
        return self._checked(Script((), None, self._driver.first_step(at), at.answers))

    def _script_by_inputs(self, driven: Driven, goals: Sequence[Goal]) -> Script:
        """The script in which inputs alone lead to the goals."""

        def script_with(more: list[Goal]) -> Script:
            """The script whose last step also meets the goals `more`."""
            reached, seen = self._driver.reach(driven, [*goals, *more])
            step = step_between(reached.last, seen)
            return self._checked(Script(reached.steps, None, step, seen.answers))

        return self._driver.with_missing_inputs(script_with)

    def _script_from_placed_state(self, goals: Sequence[Goal]) -> Script:
        """The script in which the state itself is set directly after the first period."""
        driven = self._driver.first()
        return self._script_with_placed_state(
            driven, replace(driven.at, periods=1), goals, self._refutation.state
        )

    def _script_with_placed_state(
        self, driven: Driven, at: Situation, goals: Sequence[Goal], state: str | None
    ) -> Script:
        def script_with(more: list[Goal]) -> Script:
            seen = self._driver.find_situation_anywhere(at, [*goals, *more], self._refutation.state)
            before = replay(self._code, driven.steps, seen.answers).run.memory
            memory = {n: v for n, v in seen.memory.items() if repr(v) != repr(before.get(n))}
            periods = None if state is None and seen.periods == at.periods else seen.periods
            step = step_between(driven.last, seen)
            placed = Placed(state, memory, periods)
            return self._checked(Script(driven.steps, placed, step, seen.answers))

        return self._driver.with_missing_inputs(script_with)

    def _checked(self, script: Script) -> Script:
        """The script, which fails as the refutation says.

        Raises:
            AbsentError: an input has no value that the refutation is not about.
            NoRunError: it does not.
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
            raise NoRunError("it fails in another way")
        return replace(script, rows=shown.rows)
