"""A subsystem that is stepped with given inputs."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from specc.analysis import Facts
from specc.example.search import Goal
from specc.example.situation import NO_VALUE, Meaning, Situation, Value, first_value
from specc.frozen import frozen
from specc.model.expr import Expr
from specc.model.fsm import Cause
from specc.model.system import Subsystem
from specc.proof import InputName
from specc.scenario.script import Step

# The work cycle by the book: what a subsystem does in one period (section 2.3).


@frozen
class Ending:
    """How a state ends: the cause, and the rows that apply, by their index in the table."""

    cause: Cause
    rows: tuple[int, ...]


class StrayError(Exception):
    """A period does not go as wanted; the message says why."""


class AbsentError(StrayError):
    """An input is read that has no value."""

    def __init__(self, name: InputName) -> None:
        super().__init__(f"x.{'.'.join(name)} has no value")
        self.name = name


def ending(meaning: Meaning, state: str, at: Situation) -> Ending | None:
    """How a state ends in a situation; None if it goes on.

    Raises:
        StrayError: a condition has no value.
    """
    subsystem = meaning.subsystem
    behaviour = subsystem.state(state).behaviour
    asked: tuple[tuple[Cause, Expr], ...] = (
        ("error", behaviour.error.when),
        ("terminal", behaviour.terminal.when),
    )
    for cause, condition in asked:
        if _surely(meaning, condition, at):
            rows = subsystem.rows(state, cause)
            held = (i for i, row in rows if _surely(meaning, row.condition.when, at))
            return Ending(cause, tuple(held))
    return None


def executed(meaning: Meaning, state: str, at: Situation) -> Situation:
    """The situation after the functions of a state, one period later, when nothing has come.

    Raises:
        StrayError: a function has no value.
    """
    changed = {}
    for assignment in meaning.subsystem.state(state).behaviour.assignments:
        value = value_of(meaning, assignment.value, at)
        if not assignment.peer:
            changed[assignment.name] = value
    later = {**at.memory, **changed}
    return replace(at, memory=later, fresh=frozenset(), periods=at.periods + 1)


def begun(meaning: Meaning, at: Situation) -> Situation:
    """The situation in the first period with the memory that the subsystem begins with.

    Raises:
        StrayError: an initial value has no value.
    """
    memory = {item.name: value_of(meaning, item.init, at) for item in meaning.subsystem.memory}
    return replace(at, memory=memory, periods=0)


def axioms_hold(meaning: Meaning, at: Situation) -> bool:
    """Whether all assumptions hold."""
    return all(meaning.holds(axiom.that, at) for axiom in meaning.subsystem.axioms)


def watched(meaning: Meaning, at: Situation) -> list[bool]:
    """Which assumptions hold; a run watches all of them.

    Raises:
        StrayError: one has no value.
    """
    return [_surely(meaning, axiom.that, at) for axiom in meaning.subsystem.axioms]


def _surely(meaning: Meaning, condition: Expr, at: Situation) -> bool:
    return bool(value_of(meaning, condition, at))


def value_of(meaning: Meaning, expr: Expr, at: Situation) -> Value:
    """The value of an expression.

    Raises:
        StrayError: it has none.
    """
    try:
        return meaning.value(expr, at, strictly=True)
    except KeyError as error:
        if error.args[0] in at.inputs:
            raise AbsentError(error.args[0]) from error
        raise StrayError(f"{error} has no value") from error
    except NO_VALUE as error:
        raise StrayError(str(error)) from error


# The inputs of a subsystem: what is there at first, what comes later, what comes together.


class Inputs:
    """Situations as far as the inputs of one subsystem go."""

    def __init__(
        self, meaning: Meaning, facts: Facts, original: Subsystem, never: Collection[InputName]
    ) -> None:
        """`original` is the subsystem as the facts know it; what `never` names does not come."""
        self._meaning = meaning
        self._never = frozenset(never)
        self._arrivals = facts.presence(original).arrivals
        ports = [port for port in original.ports if port.direction == "x"]
        self._elements = {(p.peer, e.name): e for p in ports for e in p.elements}
        self.names = frozenset(self._elements)
        self.always = facts.connections.always_present(original)
        self.devices = frozenset(
            (port.peer, element.name)
            for port in ports
            if port.other_end in facts.connections.devices
            for element in port.elements
        )

    def nothing(self, number: float) -> Situation:
        """The first period when nothing has come, with `number` where numbers do not matter.

        Raises:
            StrayError: an initial value has no value.
        """
        inputs: dict[InputName, Value] = {
            name: first_value(element.type, number) for name, element in self._elements.items()
        }
        start = Situation(inputs, self.always)
        for name, element in self._elements.items():
            if element.init is not None:
                inputs[name] = value_of(self._meaning, element.init, start)
        return start

    def with_values(self, at: Situation, wanted: Situation) -> Situation:
        """A first period with the values of another situation, as far as the assumptions allow."""
        for name in sorted(wanted.present):
            known = name in self.always or name in self._arrivals.later
            if known and repr(at.inputs[name]) == repr(wanted.inputs[name]):
                continue
            came = at.fresh if name in self.devices else at.fresh | {name}
            inputs = {**at.inputs, name: wanted.inputs[name]}
            more = replace(at, inputs=inputs, present=at.present | {name}, fresh=came)
            if axioms_hold(self._meaning, more):
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
        came = replace(at, present=present, fresh=at.fresh | (present - at.present))
        return came if self._meaning.meets(goals, came) else replace(at, present=present)

    def later(self, at: Situation) -> Situation:
        """The situation one period later, when what is sent in every period has come."""
        present = self._arrivals.close(at.present | self._arrivals.later) - self._never
        return replace(at, present=present)


# A run as far as it has been driven.


@frozen
class Seen:
    """A period after the first: the state, what was seen in it, and the row taken, if any."""

    state: str
    at: Situation
    row: int | None = None


@frozen
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
