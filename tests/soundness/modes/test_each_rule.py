"""Each rule of modes decides one of the cases: an interpreter without it fails there."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import pytest

from tests.soundness.modes.hierarchical import Machine, Row, Written
from tests.soundness.modes.scenarios import CASES
from tests.soundness.modes.test_meaning import wrong
from tests.soundness.modes.text_values import Now


class NoSkips(Machine):
    def _pass(self, periods: int) -> None:
        super()._pass(1)


class ClockOfModeStands(Machine):
    def _pass(self, periods: int) -> None:
        lasted = dict(self.lasted)
        super()._pass(periods)
        self.lasted = lasted


class ClockGoesOnOutside(Machine):
    def _pass(self, periods: int) -> None:
        super()._pass(periods)
        for mode in set(self.lasted) - set(self.stack):
            self.lasted[mode] += periods


class NothingIsEnteredAnew(Machine):
    def enter(self, modes: Sequence[str]) -> None:
        self.entered = set()


class ClockGoesOnAtEntry(Machine):
    def enter(self, modes: Sequence[str]) -> None:
        self.entered = set(modes)


class EveryRowEnters(Machine):
    def take(self, row: Row) -> None:
        super().take(row)
        self.enter(self.stack)


class OnlyOutermostIsEntered(Machine):
    def enter(self, modes: Sequence[str]) -> None:
        super().enter(modes[:1])


class NamingInsideIsNoEntry(Machine):
    def take(self, row: Row) -> None:
        before, entered = set(self.stack), self.enter
        self.enter = lambda modes: entered([m for m in modes if m not in before])  # type: ignore[method-assign]  # a mutant
        super().take(row)
        del self.enter


class ResumeEnters(Machine):
    def take(self, row: Row) -> None:
        before = self.stack
        super().take(row)
        if row.resumes:
            self.enter([mode for mode in self.stack if mode not in before])


class ResumeEntersNothing(Machine):
    def take(self, row: Row) -> None:
        entered = self.enter
        self.enter = lambda modes: entered(() if row.resumes else modes)  # type: ignore[method-assign]  # a mutant
        super().take(row)
        del self.enter


class ResumeIsShallow(Machine):
    def destination(self, row: Row) -> str:
        found = super().destination(row)
        members = self.written.modes[row.target].members if row.resumes else ()
        inner = [mode for mode in self.written.modes_of(found) if mode in members]
        return self.written.first_state(inner[0]) if inner else found


class ResumeIsInitial(Machine):
    def destination(self, row: Row) -> str:
        return self.written.first_state(row.target)


class ResumeKeepsTheClockOfTheState(Machine):
    def take(self, row: Row) -> None:
        periods = self.periods
        super().take(row)
        self.periods = periods if row.resumes else 0


class HistoryOfTheFirstTime(Machine):
    def take(self, row: Row) -> None:
        left = dict(self.left)
        super().take(row)
        self.left |= left


class HistoryOfEveryMode(Machine):
    def take(self, row: Row) -> None:
        here = self.state
        super().take(row)
        self.left = dict.fromkeys(self.written.modes, here)


class HistoryOfTheOutermostOnly(Machine):
    def take(self, row: Row) -> None:
        left, outer = dict(self.left), self.stack[:1]
        super().take(row)
        self.left = left | {m: s for m, s in self.left.items() if m in outer}


class InnerErrorsFirst(Machine):
    def endings(self) -> Iterator[tuple[str, ast.expr]]:
        found = list(super().endings())
        yield from (*found[-2::-1], found[-1])


class OwnErrorsFirst(Machine):
    def endings(self) -> Iterator[tuple[str, ast.expr]]:
        found = list(super().endings())
        own = self.written.states[self.state].errors
        yield from own
        yield from (each for each in found if each not in own)


class TerminalFirst(Machine):
    def endings(self) -> Iterator[tuple[str, ast.expr]]:
        found = list(super().endings())
        yield found[-1]
        yield from found[:-1]


class ErrorCoversAll(Machine):
    def rows_of(self, cause: str) -> list[Row]:
        here = {self.state, *self.stack}
        own = [row for row in self.written.rows if here.intersection(row.sources)]
        return [r for r in own if r.cause == cause or (cause != "terminal" and r.cause == "error")]


class RowsOfTheStateOverride(Machine):
    def rows_of(self, cause: str) -> list[Row]:
        found = super().rows_of(cause)
        return [row for row in found if self.state in row.sources] or found


class RowsReadNewClocks(Machine):
    def the_row(self, cause: str, now: Now) -> Row:
        return super().the_row(cause, replace(now, elapsed_of=dict.fromkeys(now.elapsed_of, 0.0)))


class ConditionsAtEntry(Machine):
    def execute(self, now: Now) -> tuple[tuple[str, Any], ...]:
        if now.entered and (cause := self.cause(now)):
            self.take(self.the_row(cause, now))
        return super().execute(now)


WRONG = [kind for kind in Machine.__subclasses__() if kind.__module__ == __name__]


@pytest.mark.parametrize("kind", WRONG, ids=lambda kind: kind.__name__)
def test_each_rule_decides_a_case(kind: type[Machine]) -> None:
    assert any(wrong(case, kind(Written(case.control))) for case in CASES)
