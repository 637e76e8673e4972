"""`specc why`: what a recording says of a moment, and why each machine is where it is."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from functools import partial
from typing import Any

from specc.cli import streams
from specc.cli.recordings import (
    DIFFERS,
    as_recorded,
    call_runtime,
    constants_for,
    missing_spec,
    print_losses,
    recorded_texts,
)
from specc.diagnostics.phrases import truncate
from specc.model.system import System
from specc.refusal import Refused
from specc.source import Sources
from specc.tools.why.lines import (
    LONGEST_MESSAGE,
    LONGEST_NAME,
    Explainer,
    WhyLine,
    one_line,
    seconds,
)

_MOST_VIOLATIONS = 3


def why(options: Namespace) -> int:
    """Say where the machines of a recorded run were at a moment, and why."""
    from specc import pipeline

    file, time_s = options.moment
    about, texts = call_runtime("recording.messages", "recorded", file)
    if not options.spec:
        words = ["specc", "why", f"{file}@{time_s:.12g}", *filter(None, [options.subsystem])]
        raise missing_spec(str(file), about, words)
    result = pipeline.compile_spec(options.spec, constants_for(file, about, options.spec))
    if not result.ok or result.system is None:
        return streams.print_findings(result, options.spec) or DIFFERS
    is_exact, system = about.get("exact") == "true", as_recorded(result, about).system
    assert system is not None
    moment_report = _MomentReport(options, system, result.sources, is_exact)
    return moment_report.print_out([*texts.values()] != [*recorded_texts(result.sources).values()])


class _MomentReport:
    """What a recording says of one moment."""

    def __init__(
        self, options: Namespace, system: System, sources: Sources, is_exact: bool
    ) -> None:
        self._file, self._time_s = options.moment
        self._spec, self._only = options.spec, options.subsystem or ""
        self._system = system
        self._subsystems = [s.qualified_name for s in system.subsystems]
        self._explainer = Explainer(
            options.spec,
            system,
            sources,
            is_exact=is_exact,
            array=lambda value: call_runtime("stepping", "array", value),
        )
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
            lines = self._explainer.lines(moments[0])
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
            name, state = one.name, self._explainer.state(one.name, str(one.step["state"]))
            name, state = (truncate(text, LONGEST_NAME) for text in (name, state))
            by = truncate(one.row, LONGEST_MESSAGE)
            if fault := one.step.get("fault"):
                by = f"fault at {seconds(one.step['time'])}: {one_line(fault)}"
            since = f"since {seconds(one.since_s)}" if one.since_s is not None else ""
            rows.append((name, state, since, by))
        return streams.format_table(rows)

    def _violations(self) -> Iterator[WhyLine]:
        """Requirements that were violated by then: what they asked for, and what came of it."""
        found = call_runtime("recording.moment", "violations", self._index, self._time_s)
        required = {each.that: each for each in self._system.run_requirements}
        steps = partial(call_runtime, "recording.moment", "last_steps", self._index)
        for that, since_s in found[:_MOST_VIOLATIONS]:
            yield from self._explainer.violation(that, since_s, required.get(that), steps)
        if len(found) > _MOST_VIOLATIONS:
            text = f"and {len(found) - _MOST_VIOLATIONS} more are violated"
            yield WhyLine(text, 0, "fault")
