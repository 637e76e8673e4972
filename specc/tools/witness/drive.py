"""Driving generated code from its first period into a state, on the rows of its table.

Inputs are searched for one period after the other, and stepped to see where they lead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

from specc.analysis import Facts
from specc.analysis.definite_assignment import always_present
from specc.analysis.reads import Dependences
from specc.model.fsm import Transition
from specc.model.system import Subsystem
from specc.proof import InputName, presence
from specc.search import (
    NO_VALUE,
    FreeVariables,
    Goal,
    Interpreter,
    Situation,
    find,
    showing,
)
from specc.tools.witness.code import (
    AbsentError,
    Periods,
    StrayError,
    SubsystemCode,
    input_text,
    lag_text,
    led,
    run_for,
)

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
    there |= {lag_text(key): lag for key, lag in at.lags.items() if lags.get(key) != lag}
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

    def nothing(self, number: float) -> Situation:
        """The first period when nothing has come, with `number` where numbers do not matter.

        Raises:
            StrayError: an initial value has no value.
        """
        start = replace(self._meaning.blank(number), present=self.always)
        inputs = dict(start.inputs)
        for name, element in self._elements.items():
            if element.init is not None:
                try:
                    inputs[name] = self._meaning.value(element.init, start, strictly=True)
                except NO_VALUE as error:
                    raise StrayError(str(error)) from error
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
            if self._meaning.meets(self.axioms, more):
                at = more
        return replace(at, answers=wanted.answers)

    def without_own(self, at: Situation) -> Situation:
        """The situation without the inputs that have their initial value by themselves."""
        own = {
            name
            for name, element in self._elements.items()
            if element.init is not None and name not in at.fresh
        }
        return replace(at, present=at.present - own)

    def with_company(self, at: Situation, goals: Sequence[Goal]) -> Situation:
        """The situation with what is sent together with what has come."""
        present = self._arrivals.close(at.present) - self._never
        both = replace(at, present=present, fresh=at.fresh | (present - at.present))
        return both if self._meaning.meets(goals, both) else replace(at, present=present)

    def later(self, at: Situation) -> Situation:
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
    seen: Situation
    state: str
    at: Situation


class Driver:
    """Drives one subsystem."""

    def __init__(
        self, code: SubsystemCode, facts: Facts, original: Subsystem, never: frozenset[InputName]
    ) -> None:
        """`original` is the subsystem as the facts know it; what `never` names does not come."""
        self.meaning = Interpreter(code.alone, code.subsystem)
        self.inputs = Inputs(self.meaning, facts, original, never)
        self._code = code
        self._never = never
        self._subsystem = code.subsystem
        self._presence = facts.of(original).presence
        self._rests = Dependences({let.name: let.value for let in self._subsystem.lets})

    def taking(self, row: Transition) -> list[Goal]:
        """Its state ends by the cause of the row, which is the only one that applies."""
        rows = [other for _, other in self._subsystem.rows(row.source, row.cause)]
        holding = [index for index, other in enumerate(rows) if other is row]
        return list(next(showing(self._subsystem, row.source, row.cause, holding)))

    def along(self, path: Sequence[Transition], wanted: Situation | None) -> Driven:
        """The run over the rows of a path; inputs have `wanted` values from the start if they can.

        Raises:
            StrayError: nothing was found that takes them.
        """
        driven = self.first(wanted)
        for row in path:
            driven = self.patiently(partial(self._over, driven, row))
        return driven

    def _over(self, driven: Driven, row: Transition, more: list[Goal]) -> Driven:
        here, seen = self.reach(driven, [*self.taking(row), *more])
        index = next(i for i, other in enumerate(self._subsystem.transitions) if other is row)
        step = step_between(here.seen, seen, row.target, row.label)
        return self._went((*here.steps, step), seen, index)

    def first(self, wanted: Situation | None = None) -> Driven:
        """The first period; inputs that a later situation needs arrive already then if they can.

        Raises:
            StrayError: it fails.
        """
        try:
            return self.patiently(partial(self._begun, wanted, 0.0))
        except AbsentError:
            raise
        except StrayError:
            return self.patiently(partial(self._begun, wanted, 1.0))  # by one, one can divide

    def _begun(self, wanted: Situation | None, number: float, more: list[Goal]) -> Driven:
        seen = self.start(wanted, more, number)
        return self._went((self.first_step(seen),), seen, -1)

    def start(
        self, wanted: Situation | None, goals: Sequence[Goal] = (), number: float = 0.0
    ) -> Situation:
        """What is seen in the first period, where numbers that do not matter are `number`.

        Raises:
            StrayError: nothing was found that meets the assumptions and the goals.
        """
        at = self.inputs.nothing(number)
        at = at if wanted is None else self.inputs.with_values(at, wanted)
        return self.found(at, [*self.inputs.axioms, *goals], "")

    def first_step(self, seen: Situation) -> Periods:
        """The step of the first period."""
        shown = self.inputs.without_own(seen)
        return step_between(None, shown, self._subsystem.initial_state, "the first period")

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
                more.append((presence(error.name), True))
        raise StrayError("inputs are missing")

    def reach(self, driven: Driven, goals: Sequence[Goal]) -> tuple[Driven, Situation]:
        """What is seen in the state that the run is in so that the goals are met; it may wait.

        Raises:
            StrayError: nothing was found that meets them.
        """
        try:
            found = self.found(driven.at, goals, driven.state, time=True)
        except StrayError:
            return self._counted(driven, goals)
        missing = found.periods - driven.at.periods
        if missing == 0:
            return driven, found
        if not 0 < missing <= LONGEST_WAIT:
            raise StrayError("it takes too long")
        waited = self._waited(driven, missing)
        return waited, self.found(waited.at, goals, driven.state)

    def _counted(self, driven: Driven, goals: Sequence[Goal]) -> tuple[Driven, Situation]:
        """The same where changing memory has to reach some value first."""
        if not self._rests.all(c for c, _ in goals).memory & self.meaning.changing:
            raise StrayError(f"no inputs were found that end {driven.state} as required")
        for _ in range(MOST_COUNTED):
            driven = self._waited(driven, 1)
            try:
                return driven, self.found(driven.at, goals, driven.state)
            except StrayError:
                continue
        raise StrayError("memory does not reach the required values")

    def _waited(self, driven: Driven, periods: int) -> Driven:
        """The run with some more periods in its state.

        Raises:
            StrayError: nothing was found that keeps it there.
        """
        while periods:
            at, state = driven.at, driven.state
            run = led(self._code, driven.steps, at.answers).run
            gone = run_for(run, step_between(driven.seen, at), periods)
            if not gone:
                at, gone = self._going_on(at, state), 1
            step = step_between(driven.seen, at, state, "it goes on")
            steps = _with_wait(driven.steps, replace(step, periods=gone))
            driven = self._went(steps, at, -1)
            periods -= gone
        return driven

    def _going_on(self, at: Situation, state: str) -> Situation:
        """A situation in which a state does not end."""
        behaviour = self._subsystem.state(state).behaviour
        goals = [(behaviour.error.when, False), (behaviour.terminal.when, False)]
        return self.found(at, [*goals, *self.inputs.axioms], state)

    def _went(self, steps: tuple[Periods, ...], seen: Situation, row: int) -> Driven:
        """The run of some steps, of which the last is what was `seen` and takes a row, or none.

        Raises:
            StrayError: they lead elsewhere.
        """
        reached = led(self._code, steps, seen.answers)
        if reached.row != row:
            raise StrayError("another row is taken")
        later = self.inputs.later(seen)
        at = replace(later, memory=reached.run.memory, periods=reached.periods + 1)
        return Driven(steps, seen, reached.run.state, at)

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
        memory = self.meaning.changing if placed else frozenset[str]()
        inputs = self.inputs
        sure = self._sure(state) | inputs.always if state else inputs.always
        freedom = FreeVariables(memory, sure, time, placed, inputs.devices, self._never)
        found = find(self.meaning, at, goals, freedom)
        if found is None:
            raise StrayError(f"no inputs were found that end {state} as required")
        while time and found.periods > at.periods:
            sooner = replace(found, periods=found.periods - 1)
            if not self.meaning.meets(goals, sooner):
                break
            found = sooner
        return self.inputs.with_company(found, goals)

    def anywhere(self, at: Situation, goals: Sequence[Goal], state: str) -> Situation:
        """A situation of a state that meets the goals, whatever may lead to it.

        Raises:
            StrayError: nothing was found.
        """
        at = replace(at, present=at.present | self._sure(state))
        return self.found(at, goals, state, time=True, placed=True)

    def _sure(self, state: str) -> frozenset[InputName]:
        """Inputs that are there whenever the conditions of a state are asked."""
        return self._presence.in_conditions(state)


def _with_wait(steps: tuple[Periods, ...], wait: Periods) -> tuple[Periods, ...]:
    """The steps with one more, which makes the last one longer if nothing distinguishes them."""
    last = steps[-1]
    if last == replace(wait, periods=last.periods):
        return (*steps[:-1], replace(last, periods=last.periods + wait.periods))
    return (*steps, wait)
