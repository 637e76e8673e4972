"""What findings say never happens, or always holds, asked in runs of the interpreter."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from specc.diagnostics import Diagnostic
from tests.soundness.evaluator import Absent
from tests.soundness.modes.hierarchical import TERMINAL, Failure, Machine, Step, Written
from tests.soundness.modes.scripted import Period, initial_inputs
from tests.soundness.modes.text_values import Now, parsed, worth

STATE = r"`(S\d+)`"
NAME = r"`(\w+)`"


@dataclass(slots=True)
class Claims:
    """What is said of one machine."""

    unreachable: set[str] = field(default_factory=set)
    endless: set[tuple[str, str]] = field(default_factory=set)
    """States with a cause for which they never end; `error` for any error."""
    not_taken: set[tuple[str, str, str]] = field(default_factory=set)
    """States, causes or "" for any, and initial conditions of rows that are never taken there."""
    constant: dict[str, tuple[ast.expr, bool]] = field(default_factory=dict)
    """Text -> what always or never holds where conditions are evaluated."""

    @property
    def count(self) -> int:
        several = self.unreachable, self.endless, self.not_taken, self.constant
        return sum(map(len, several))


def claims_of(findings: Sequence[Diagnostic], written: Written) -> Claims:
    """The claims in the messages of findings."""
    found = Claims()
    for finding in findings:
        told = finding.message
        if match := re.match(rf"state {STATE} cannot be reached", told):
            found.unreachable.add(match[1])
        elif match := re.match(rf"state {STATE} never ends by its (\w+) condition {NAME}", told):
            cause = match[2] if match[2] == TERMINAL else match[3]
            found.endless.add((match[1], cause if cause in _names(written, match[1]) else match[2]))
        elif match := re.match(
            rf"{NAME} never holds when state {STATE} ends by its terminal", told
        ):
            found.not_taken.add((match[2], TERMINAL, match[1]))
        elif match := re.search(rf"state {STATE}.* before {NAME} can hold", told):
            if "initial" in written.kinds_of(match[2]):
                found.not_taken.add((match[1], "", match[2]))
        elif match := re.match(r"`([^`]*)` (always|never) holds", told):
            if "condition" in finding.label and "state(" not in match[1]:
                found.constant[match[1]] = parsed(match[1]), match[2] == "always"
        elif match := re.match(rf"(\w+) condition {NAME} (always|never) holds", told):
            when = written.conditions.get((match[1], match[2]))
            if when is not None:
                found.constant[match[2]] = when, match[3] == "always"
    return found


def _names(written: Written, state: str) -> set[str]:
    return {name for name, _ in Machine(written, state).endings()}


class Watched(Machine):
    """A machine of which conditions are asked that are said to be constant."""

    claims: Claims
    refuted: list[str]

    def cause(self, now: Now) -> str:
        for text, (expression, always) in self.claims.constant.items():
            try:
                if worth(expression, now) is not always:
                    self.refuted.append(f"`{text}` in {self.state}")
            except (Absent, ValueError):
                continue
        return super().cause(now)


def refuted(written: Written, claims: Claims, periods: Sequence[Period]) -> Iterator[str]:
    """The claims that a run refutes."""
    machine = Watched(written)
    machine.claims, machine.refuted = claims, []
    inputs, before = dict(initial_inputs()), ""
    for period in periods:
        inputs |= period.arrives
        step = machine.step(inputs, period.arrives)
        if isinstance(step, Failure):
            break
        yield from _of_step(step, before, claims)
        before = step.state
    yield from dict.fromkeys(machine.refuted)


def _of_step(step: Step, before: str, claims: Claims) -> Iterator[str]:
    if step.state in claims.unreachable:
        yield f"{step.state} is reached"
    if not step.cause:
        return
    kinds = {step.cause, TERMINAL if step.cause == TERMINAL else "error"}
    yield from (f"{before} ends by {c}" for s, c in claims.endless if s == before and c in kinds)
    for state, cause, condition in claims.not_taken:
        row = f" {condition} -> "
        if state == before and cause in ("", *kinds) and row in step.row:
            yield f"{step.row} is taken in {before}"
