"""What findings claim of expressions and conditions, held against runs of the interpreter.

A claim is that a part of an expression has one truth value (W0617), that a condition comes too late
for its state (W0618), that two things are the same (W0333), or that a limited number is always one
limit (W0332).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

from specc import analysis
from specc.analysis import Facts
from specc.checks.conditions import ConstantConditions
from specc.model.expr import Expr
from specc.model.system import System
from tests.soundness import interpreter
from tests.soundness.evaluator import Absent, Situation, Value, value
from tests.soundness.interpreter import Interpreter, Machine
from tests.soundness.law import marks_of
from tests.soundness.operators import PLAIN
from tests.soundness.running import Script, compiled
from tests.soundness.specifications import specification
from tests.soundness.values import NASTY

Asked = Callable[[Situation], bool]
"""Whether a claim holds in a situation."""


@dataclass(slots=True)
class Claims:
    """Of one subsystem: what holds where conditions are asked, and at any time."""

    in_conditions: dict[str, Asked] = field(default_factory=dict)
    anywhere: dict[str, Asked] = field(default_factory=dict)
    never_ends: set[tuple[str, str]] = field(default_factory=set)
    """State and cause."""
    never_taken: set[int] = field(default_factory=set)
    """Rows by their index."""

    @property
    def count(self) -> int:
        several = self.in_conditions, self.anywhere, self.never_ends, self.never_taken
        return sum(map(len, several))


def claims_of(system: System) -> dict[str, Claims]:
    """The claims about each subsystem of an accepted system."""
    facts = Facts(system)
    return {m.subsystem.qualified_name: _claims(m) for m in facts.complete_machines}


def _claims(machine: analysis.Machine) -> Claims:
    found, constancy, subsystem = Claims(), ConstantConditions(machine), machine.subsystem
    for condition in subsystem.conditions:
        parts = [] if machine.constant_value(condition) is not None else constancy.parts(condition)
        for part in parts:
            about = found.in_conditions if part.text.expr is condition.when else found.anywhere
            about[f"{part.proposition}"] = _always(part.proposition)
    for part in constancy.parts_elsewhere():
        found.anywhere[f"{part.proposition}"] = _always(part.proposition)
    for misfit in machine.suspicious.all:
        one, other = misfit.causes[0], misfit.causes[-1]
        if misfit.kind == "itself":
            found.anywhere[f"same {misfit.expr}"] = _same(one, other)
        elif misfit.kind == "bounds":
            found.anywhere[f"limited {misfit.expr}"] = _same(misfit.expr, one)
    for state in subsystem.states:
        for late in machine.dwell_times.overdue_exits(state):
            if late.row is None:
                endings = state.behaviour.endings
                cause = next(cause for cause, end in endings if end is late.condition)
                found.never_ends.add((state.name, cause))
            else:
                found.never_taken.add(subsystem.transitions.index(late.row))
    return found


def _always(claim: Expr) -> Asked:
    return lambda at: value(claim, at) is True


def _same(one: Expr, other: Expr) -> Asked:
    return lambda at: bool(value(one, at) == value(other, at))


class Watched(Machine):
    """A machine that holds claims about it against what it does."""

    claims: Mapping[str, Claims]
    refuted: list[str]

    def decide(self, now: Situation) -> int:
        claims = self.claims.get(self.subsystem.qualified_name, Claims())
        self._ask(claims.in_conditions | claims.anywhere, now)
        row = super().decide(now)
        if row >= 0:
            cause = self.subsystem.transitions[row].cause
            if (self.state, cause) in claims.never_ends or row in claims.never_taken:
                self.refuted.append(f"{self.state} ended by {cause}, row {row}")
        return row

    def execute(self, *seen: object) -> tuple[tuple[str, Value], ...]:
        claims = self.claims.get(self.subsystem.qualified_name, Claims())
        self._ask(claims.anywhere, self.situation(*seen))  # type: ignore[arg-type]  # passed on
        return super().execute(*seen)  # type: ignore[arg-type]  # passed on

    def _ask(self, claims: Mapping[str, Asked], now: Situation) -> None:
        for text, holds in claims.items():
            try:
                if not holds(now):
                    self.refuted.append(text)
            except (Absent, ArithmeticError, ValueError, KeyError):
                continue  # an input that is absent, or the variable of a quantifier


@dataclass(slots=True)
class Tally:
    """How many systems were accepted, how many claims were made, and those that were refuted."""

    accepted: int = 0
    with_claims: int = 0
    claims: int = 0
    refuted: list[str] = field(default_factory=list)


def held_against_runs(accepted: int, seed: str, folder: Path, ticks: int) -> Tally:
    """Random specifications until so many were accepted, each run once."""
    tally = Tally()
    for number in _counted():
        if tally.accepted == accepted:
            return tally
        result = compiled(specification(Random(f"{seed}.{number}")), folder)
        if not result.ok or result.system is None:
            continue
        tally.accepted += 1
        claims = claims_of(result.system)
        count = sum(found.count for found in claims.values())
        tally.claims += count
        tally.with_claims += bool(count)
        for text in _run(result.system, claims, f"{seed}.{number}", ticks):
            tally.refuted.append(f"specification {seed}.{number}: {text}")
    return tally


def _counted() -> Iterator[int]:
    number = 0
    while True:
        yield number
        number += 1


def _run(system: System, claims: Mapping[str, Claims], seed: str, ticks: int) -> list[str]:
    refuted: list[str] = []
    watched = type("Watched", (Watched,), {"claims": claims, "refuted": refuted})
    script = Script(system, seed, marks_of(system), NASTY)
    plain = interpreter.Machine
    interpreter.Machine = watched  # type: ignore[misc]  # put back below
    try:
        Interpreter(system, PLAIN, script.measure).run(ticks)
    finally:
        interpreter.Machine = plain  # type: ignore[misc]  # as above
    return list(dict.fromkeys(refuted))
