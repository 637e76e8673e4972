"""`specc why`: what a recording says of a moment, and why each machine is where it is."""

from __future__ import annotations

import math
import os
from argparse import Namespace
from collections.abc import Iterator
from functools import partial
from typing import Any

from specc.cli import streams
from specc.cli.recordings import (
    DIFFERS,
    call_runtime,
    missing_spec,
    print_losses,
    recorded_constants,
    recorded_texts,
)
from specc.diagnostics.phrases import truncate
from specc.model.fsm import Behaviour, Cause, Condition, State, cause_words
from specc.model.system import Subsystem, System
from specc.refusal import Refused
from specc.source import Place, Sources
from specc.tools.why import Moment, NotKnown, Reasons, value_of, value_text, violation_reasons

_LONGEST_NAME, _LONGEST_MESSAGE = 80, 300
_MOST_VIOLATIONS = 3


def why(options: Namespace) -> int:
    """Say where the machines of a recorded run were at a moment, and why."""
    from specc import pipeline

    file, time_s = options.moment
    about, texts = call_runtime("recording.messages", "recorded", file)
    if not options.spec:
        words = ["specc", "why", f"{file}@{time_s:.12g}", *filter(None, [options.subsystem])]
        raise missing_spec(str(file), about, words)
    result = pipeline.compile_spec(options.spec, recorded_constants(about))
    if not result.ok or result.system is None:
        return streams.print_findings(result, options.spec) or DIFFERS
    is_exact = about.get("exact") == "true"
    moment_report = _MomentReport(options, result.system, result.sources, is_exact)
    return moment_report.print_out([*texts.values()] != [*recorded_texts(result.sources).values()])


class _MomentReport:
    """What a recording says of one moment."""

    def __init__(
        self, options: Namespace, system: System, sources: Sources, is_exact: bool
    ) -> None:
        self._file, self._time_s = options.moment
        self._spec, self._only = options.spec, options.subsystem or ""
        self._system, self._sources, self._is_exact = system, sources, is_exact
        self._subsystems = {s.qualified_name: s for s in system.subsystems}
        self._index: Any = None

    def print_out(self, is_other: bool) -> int:
        """Print it; the exit code. The specification may be another than the recorded one."""
        if self._only and self._only not in self._subsystems:
            names = ", ".join(self._subsystems)
            raise Refused(f"there is no subsystem {self._only}; there are {names}")
        file = self._file
        self._index = index = call_runtime("recording.index", "Index", file)
        moments = call_runtime("recording.moment", "seen_at", index, self._time_s, self._only)
        if not moments:
            until = f" until {self._time_s:.12g} s"
            raise Refused(f"{file} has no step of {self._only or 'any subsystem'}{until}")
        if is_other:
            streams.print_message(f"specc: {self._spec} is not as it was recorded")
        if self._only:
            lines = self._details(moments[0], self._subsystems[self._only])
        else:
            streams.print_output(self._overview(moments))
            lines = self._violations()
        streams.print_output("".join(f"{line}\n" for line in lines))
        return int(print_losses(index.reading))

    def _overview(self, moments: list[Any]) -> str:
        """A line for each subsystem, in the order of the specification."""
        order = {name: place for place, name in enumerate(self._subsystems)}
        rows = []
        for one in sorted(moments, key=lambda s: (order.get(s.name, len(order)), s.name)):
            name, state = one.name, self._state(one.name, str(one.step["state"]))
            name, state = (truncate(text, _LONGEST_NAME) for text in (name, state))
            by = truncate(one.row, _LONGEST_MESSAGE)
            if fault := one.step.get("fault"):
                by = f"fault at {_seconds(one.step['time'])}: {_one_line(fault)}"
            since = f"since {_seconds(one.since_s)}" if one.since_s is not None else ""
            rows.append((name, state, since, by))
        return streams.format_table(rows)

    def _state(self, subsystem: str, name: str) -> str:
        """A state of a subsystem with the modes around it."""
        known = self._subsystems.get(subsystem)
        states = known.states if known else ()
        return next((state.with_modes for state in states if state.name == name), name)

    def _violations(self) -> Iterator[str]:
        """Requirements that were violated by then: what they asked for, and what came of it."""
        found = call_runtime("recording.moment", "violations", self._index, self._time_s)
        required = {each.that: each for each in self._system.requirements}
        for that, since_s in found[:_MOST_VIOLATIONS]:
            requirement = required.get(that)
            at = "" if requirement is None else self._at(requirement.place)
            yield f"violated at {_seconds(since_s)}: {_one_line(that)}{at}"
            if requirement is None:
                yield f"  {self._spec} has no such requirement"
                continue
            yield f"  because: {_one_line(requirement.because)}"
            steps = partial(call_runtime, "recording.moment", "last_steps", self._index)
            reasons = violation_reasons(requirement, since_s, steps, _seconds)
            yield from (f"  {line}" for line in reasons)
        if len(found) > _MOST_VIOLATIONS:
            yield f"and {len(found) - _MOST_VIOLATIONS} more are violated"

    def _details(self, one: Any, subsystem: Subsystem) -> Iterator[str]:
        """All that is known of one subsystem."""
        step = one.step
        state, before = self._state(one.name, str(step["state"])), str(step.get("before"))
        state = truncate(state, _LONGEST_NAME)
        since = ", since when is not in the file"
        if one.since_s is not None:
            lasted_s = step["time"] - one.since_s
            duration = f"for {_seconds(lasted_s)}" if lasted_s > 1e-6 else "entered in this step"
            since = f" since {_seconds(one.since_s)}, {duration}"
        yield f"{one.name} at {_seconds(step['time'])} (stamp {step['stamp']}): in {state}{since}"
        if one.row:
            rows = (row.place for row in subsystem.transitions if row.label == one.row)
            yield f"  by {one.row}{next(map(self._at, rows), '')}"
        if fault := step.get("fault"):
            yield f"  fault in this step: {_one_line(fault)}"
        if not before:
            yield "  its first period, in which no condition is asked"
        elif before not in {s.name for s in subsystem.states}:
            yield f"  {self._spec} has no state {truncate(before, _LONGEST_NAME)}"
        else:
            yield from self._conditions(one, subsystem, before)
        yield from self._sent(step, subsystem)
        if one.known_from > 0:
            yield f"  the steps before stamp {one.known_from} are not in the file"
        if one.recent:
            yield "  last transitions:"
            for begin_s, end_s, times, row in one.recent:
                more = f", {times} times until {_seconds(end_s)}" if times > 1 else ""
                yield f"    {_seconds(begin_s):>9}  {row}{more}"

    def _conditions(self, one: Any, subsystem: Subsystem, before: str) -> Iterator[str]:
        step, behaviour = one.step, subsystem.state(before).behaviour
        moment = Moment(
            self._system,
            subsystem,
            step,
            one.memory,
            _elapsed_s(one, float(subsystem.rate_hz)),
            is_exact=self._is_exact,
            array=lambda value: call_runtime("stepping", "array", value),
            folder=os.path.dirname(self._spec),
        )
        has_failed = bool(step.get("fault"))  # conditions before it failed are not recorded
        cause = _cause(behaviour, moment) if has_failed else str(step.get("cause", ""))
        now = ", from the values that the step read" if has_failed else ""
        yield f"  conditions of {subsystem.state(before).with_modes}{now}:"
        causes = [kind for kind, _ in behaviour.endings]
        after = causes[causes.index(cause) + 1 :] if cause in causes else []
        names = _names_of_endings(subsystem, subsystem.state(before))
        for (kind, condition), words in zip(behaviour.endings, names.values(), strict=True):
            if kind in after:
                yield f"    {words}: not asked, for {names[str(cause)]} occurred"
            else:
                recorded = None if has_failed else cause == kind
                yield from self._condition(words, condition, moment, recorded)
        transition = None if has_failed else str(step["transition"])
        for kind, _ in behaviour.endings:
            yield from self._rows(subsystem, (before, kind, cause), transition, moment)
        if step["state"] != before and not has_failed:
            yield f"  conditions of {step['state']}: asked first in the next step"

    def _rows(
        self,
        subsystem: Subsystem,
        source: tuple[str, Cause, str | None],
        transition: str | None,
        moment: Moment,
    ) -> Iterator[str]:
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
                yield f"    rows of {words}: {reason}: {truncate(names, _LONGEST_MESSAGE)}"
            return
        places = {row.place for row in rows if row.label == transition}
        for row in rows:
            if row.resumes and row.place in places and row.label != transition:
                continue  # the same row of the file, for another state that may have been left
            holds = None if transition is None else row.label == transition
            if row.is_otherwise:
                others = "no other row applies" if holds else "another row applies"
                truth = "else" if holds is None else f"{holds}, for {others}"
                yield f"    row {row.label}: {truth}"
            else:
                yield from self._condition(f"row {row.label}", row.condition, moment, holds)

    def _condition(
        self, words: str, condition: Condition, moment: Moment, recorded: bool | None
    ) -> Iterator[str]:
        """A condition with its truth, which is the recorded one if there is one, and why."""
        computed = moment.truth(condition.when)
        truth = computed if recorded is None else recorded
        at = "" if condition.name in ("always", "never") else self._at(condition.place)
        yield f"    {words}: {'not known' if truth is None else truth}{at}"
        if recorded is not None and computed is (not recorded):
            yield f"      {self._spec} says {computed} of what was recorded: it, or an operator, is"
            yield "      not as it was then"
            return
        yield from (f"      {line}" for line in Reasons(moment).lines(condition.when))

    def _sent(self, step: Any, subsystem: Subsystem) -> Iterator[str]:
        values = step.get("y", {})
        for (peer, name), element in subsystem.outputs.items():
            inside = values.get(peer) if isinstance(values, dict) else None
            if isinstance(inside, dict) and name in inside:
                try:
                    text = value_text(element.type, value_of(element.type, inside[name]))
                except NotKnown as reason:
                    text = str(reason)
                yield f"  sent y.{peer}.{name} = {text}"

    def _at(self, place: Place) -> str:
        span = self._sources.span(place)
        return f"  ({span.file}:{span.line})"


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


def _seconds(time_s: float) -> str:
    return f"{round(time_s, 9):g} s" if abs(time_s) < 1000 else f"{round(time_s, 6)} s"


def _one_line(text: object) -> str:
    return truncate(" ".join(str(text).split()), _LONGEST_MESSAGE)


def _elapsed_s(one: Any, rate_hz: float) -> float | None:
    """How long it is in its state, in whole periods; a step in real time may begin within one."""
    if one.entered_s is None:
        return None
    now, entered = (
        math.floor(time_s * rate_hz + 1e-6) for time_s in (one.step["time"], one.entered_s)
    )
    return float((now - entered) / rate_hz)
