"""Lines about a step and its past: where a machine is, by which row, and why it does not go on.

Each line has a role, a truth where it is about a condition, and its place in the specification.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

from specc.diagnostics.phrases import truncate
from specc.lang.values import Value
from specc.model.fsm import Behaviour, Cause, Condition, State, cause_words
from specc.model.requirement import Requirement
from specc.model.system import Subsystem, System
from specc.source import Place, Sources
from specc.tools.why.moment import Moment, NotKnown, value_of
from specc.tools.why.reasons import Reasons, Steps, value_text, violation_reasons

LONGEST_NAME, LONGEST_MESSAGE = 80, 300

LineRole = Literal["state", "row", "condition", "reason", "read", "sent", "past", "fault"]


@dataclass(frozen=True, slots=True)
class WhyLine:
    """A line; `depth` says how far it is indented, `place` is `file:line` or empty.

    `name` is the condition or the row that it is about, as breakpoints name it.
    """

    text: str
    depth: int
    role: LineRole
    truth: bool | None = None
    place: str = ""
    name: str = ""

    def __str__(self) -> str:
        at = f"  ({self.place})" if self.place else ""
        return f"{'  ' * self.depth}{self.text}{at}"


class SeenStep(Protocol):
    """The last step of a subsystem until a moment, and what came before it.

    `step` is the content of its message, `memory` that before the step, None if it is lost. The
    step began in a state entered at `entered_s`; that of now was entered at `since_s` by `row`.
    `recent` are the last transitions: first and last time, repetitions, text. No step is missing
    from the stamp `known_from` on.
    """

    @property
    def name(self) -> str: ...
    @property
    def step(self) -> Mapping[str, Any]: ...
    @property
    def memory(self) -> Mapping[str, Any] | None: ...
    @property
    def entered_s(self) -> float | None: ...
    @property
    def since_s(self) -> float | None: ...
    @property
    def row(self) -> str: ...
    @property
    def recent(self) -> Iterable[tuple[float, float, int, str]]: ...
    @property
    def known_from(self) -> int: ...


class Explainer:
    """Says of steps of a system where its machines are, and why."""

    def __init__(
        self,
        spec: str,
        system: System,
        sources: Sources,
        *,
        is_exact: bool,
        array: Callable[[Value], Any] | None,
    ) -> None:
        """`spec` is the path of the specification; about `is_exact` and `array` see `Moment`."""
        self._spec = spec
        self._system, self._sources = system, sources
        self._is_exact, self._array = is_exact, array
        self._subsystems = {s.qualified_name: s for s in system.subsystems}

    def state(self, subsystem: str, name: str) -> str:
        """A state of a subsystem with the modes around it."""
        known = self._subsystems.get(subsystem)
        states = known.states if known else ()
        return next((state.with_modes for state in states if state.name == name), name)

    def at(self, place: Place) -> str:
        """`file:line` of a place."""
        span = self._sources.span(place)
        return f"{span.file}:{span.line}"

    def violation(
        self, that: str, since_s: float, requirement: Requirement | None, steps: Steps
    ) -> Iterator[WhyLine]:
        """A requirement that was violated: what it asked for, and what came of it."""
        place = "" if requirement is None else self.at(requirement.place)
        is_contract = requirement is not None and requirement.device
        what = "the contract is broken" if is_contract else "violated"
        text = f"{what} at {seconds(since_s)}: {one_line(that)}"
        yield WhyLine(text, 0, "fault", False, place)
        if requirement is None:
            yield WhyLine(f"{self._spec} has no such requirement", 1, "reason")
            return
        if requirement.because:
            yield WhyLine(f"because: {one_line(requirement.because)}", 1, "reason")
        for line in violation_reasons(requirement, since_s, steps, seconds):
            yield WhyLine(line, 1, "reason")

    def lines(self, one: SeenStep) -> Iterator[WhyLine]:
        """All that is known of one subsystem, which the system has."""
        step, subsystem = one.step, self._subsystems[one.name]
        state, before = self.state(one.name, str(step["state"])), str(step.get("before"))
        state = truncate(state, LONGEST_NAME)
        since = ", since when is not in the file"
        if one.since_s is not None:
            lasted_s = step["time"] - one.since_s
            duration = f"for {seconds(lasted_s)}" if lasted_s > 1e-6 else "entered in this step"
            since = f" since {seconds(one.since_s)}, {duration}"
        at = f"{one.name} at {seconds(step['time'])} (stamp {step['stamp']})"
        yield WhyLine(f"{at}: in {state}{since}", 0, "state")
        if one.row:
            rows = (row.place for row in subsystem.transitions if row.label == one.row)
            yield WhyLine(f"by {one.row}", 1, "row", place=next(map(self.at, rows), ""))
        if fault := step.get("fault"):
            yield WhyLine(f"fault in this step: {one_line(fault)}", 1, "fault")
        if not before:
            yield WhyLine("its first period, in which no condition is asked", 1, "condition")
        elif before not in {s.name for s in subsystem.states}:
            text = f"{self._spec} has no state {truncate(before, LONGEST_NAME)}"
            yield WhyLine(text, 1, "condition")
        else:
            yield from self._conditions(one, subsystem, before)
        yield from _sent(step, subsystem)
        if one.known_from > 0:
            text = f"the steps before stamp {one.known_from} are not in the file"
            yield WhyLine(text, 1, "past")
        for number, (begin_s, end_s, times, row) in enumerate(one.recent):
            if number == 0:
                yield WhyLine("last transitions:", 1, "past")
            more = f", {times} times until {seconds(end_s)}" if times > 1 else ""
            yield WhyLine(f"{seconds(begin_s):>9}  {row}{more}", 2, "past")

    def _conditions(self, one: SeenStep, subsystem: Subsystem, before: str) -> Iterator[WhyLine]:
        step, state = one.step, subsystem.state(before)
        behaviour = state.behaviour
        moment = Moment(
            self._system,
            subsystem,
            step,
            one.memory,
            _elapsed_s(one, float(subsystem.rate_hz)),
            is_exact=self._is_exact,
            array=self._array,
            folder=os.path.dirname(self._spec),
        )
        has_failed = bool(step.get("fault"))  # conditions before it failed are not recorded
        cause = _cause(behaviour, moment) if has_failed else str(step.get("cause", ""))
        now = ", from the values that the step read" if has_failed else ""
        yield WhyLine(f"conditions of {state.with_modes}{now}:", 1, "condition")
        causes = [kind for kind, _ in behaviour.endings]
        after = causes[causes.index(cause) + 1 :] if cause in causes else []
        names = _names_of_endings(subsystem, state)
        for (kind, condition), words in zip(behaviour.endings, names.values(), strict=True):
            if kind in after:
                text = f"{words}: not asked, for {names[str(cause)]} occurred"
                yield WhyLine(text, 2, "condition", name=condition.name)
            else:
                recorded = None if has_failed else cause == kind
                yield from self._condition(words, condition, moment, recorded)
        transition = None if has_failed else str(step["transition"])
        for kind, _ in behaviour.endings:
            yield from self._rows(subsystem, (before, kind, cause), transition, moment)
        if step["state"] != before and not has_failed:
            text = f"conditions of {step['state']}: asked first in the next step"
            yield WhyLine(text, 1, "condition")

    def _rows(
        self,
        subsystem: Subsystem,
        source: tuple[str, Cause, str | None],
        transition: str | None,
        moment: Moment,
    ) -> Iterator[WhyLine]:
        """The rows of a state and kind, if that was the cause for which they were tested."""
        state, kind, cause = source
        rows = [row for _, row in subsystem.rows(state, kind)]
        if cause != kind:
            targets = (f"resume({row.resumes})" if row.resumes else row.target for row in rows)
            ways = (f"{r.condition.name} -> {to}" for r, to in zip(rows, targets, strict=True))
            names = ", ".join(dict.fromkeys(ways))
            words = cause_words(kind)
            reason = "not known" if cause is None else f"not asked, for {words} did not occur"
            if rows:
                text = f"rows of {words}: {reason}: {truncate(names, LONGEST_MESSAGE)}"
                yield WhyLine(text, 2, "row")
            return
        places = {row.place for row in rows if row.label == transition}
        for row in rows:
            if row.resumes and row.place in places and row.label != transition:
                continue  # the same row of the file, for another state that may have been left
            holds = None if transition is None else row.label == transition
            if row.is_otherwise:
                others = "no other row applies" if holds else "another row applies"
                truth = "else" if holds is None else f"{holds}, for {others}"
                yield WhyLine(f"row {row.label}: {truth}", 2, "row", holds, name=row.label)
            else:
                words = f"row {row.label}"
                yield from self._condition(words, row.condition, moment, holds, row.label)

    def _condition(
        self,
        words: str,
        condition: Condition,
        moment: Moment,
        recorded: bool | None,
        row: str = "",
    ) -> Iterator[WhyLine]:
        """A condition with its truth, which is the recorded one if there is one, and why.

        It is the initial condition of a `row`, or ends a state.
        """
        computed = moment.truth(condition.when)
        truth = computed if recorded is None else recorded
        place = "" if condition.name in ("always", "never") else self.at(condition.place)
        text = f"{words}: {'not known' if truth is None else truth}"
        role: LineRole = "row" if row else "condition"
        yield WhyLine(text, 2, role, truth, place, row or condition.name)
        if recorded is not None and computed is (not recorded):
            text = f"{self._spec} says {computed} of what was recorded: it, or an operator, is"
            yield WhyLine(text, 3, "reason")
            yield WhyLine("not as it was then", 3, "reason")
            return
        reasons, read = Reasons(moment).of(condition.when)
        yield from _indented(reasons, "reason")
        yield from _indented(read, "read")


def _indented(lines: Sequence[str], role: LineRole) -> Iterator[WhyLine]:
    """Reasons below a condition; they are indented themselves, by two characters a level."""
    for line in lines:
        levels = (len(line) - len(line.lstrip(" "))) // 2
        yield WhyLine(line[2 * levels :], 3 + levels, role)


def _sent(step: Mapping[str, Any], subsystem: Subsystem) -> Iterator[WhyLine]:
    values = step.get("y", {})
    for (peer, name), element in subsystem.outputs.items():
        inside = values.get(peer) if isinstance(values, dict) else None
        if isinstance(inside, dict) and name in inside:
            try:
                text = value_text(element.type, value_of(element.type, inside[name]))
            except NotKnown as reason:
                text = str(reason)
            yield WhyLine(f"sent y.{peer}.{name} = {text}", 1, "sent")


def _names_of_endings(subsystem: Subsystem, state: State) -> dict[Cause, str]:
    """The conditions that can end a state, by their causes, with the modes that they are of."""
    modes = {cause: mode for mode in state.modes for cause, _ in subsystem.mode(mode).errors}
    found = {}
    for cause, condition in state.behaviour.endings:
        is_named = cause not in ("terminal", "error")
        words = cause_words(cause) if is_named else f"{condition.kind} {condition.name}"
        found[cause] = f"{words} of mode {modes[cause]}" if cause in modes else words
    return found


def _cause(behaviour: Behaviour, moment: Moment) -> str | None:
    """What ended it as far as the values tell; None where they do not."""
    for kind, condition in behaviour.endings:
        if (truth := moment.truth(condition.when)) is not False:
            return kind if truth else None
    return ""


def seconds(time_s: float) -> str:
    """A time with its unit."""
    return f"{round(time_s, 9):g} s" if abs(time_s) < 1000 else f"{round(time_s, 6)} s"


def one_line(text: object) -> str:
    """A text of a file on one line that is not too long."""
    return truncate(" ".join(str(text).split()), LONGEST_MESSAGE)


def _elapsed_s(one: SeenStep, rate_hz: float) -> float | None:
    """How long it is in its state, in whole periods; a step in real time may begin within one."""
    if one.entered_s is None:
        return None
    now, entered = (
        math.floor(time_s * rate_hz + 1e-6) for time_s in (one.step["time"], one.entered_s)
    )
    return float((now - entered) / rate_hz)
