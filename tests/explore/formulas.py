"""Formulas of requirements in a few forms, each with a small machine that judges a run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from types import CodeType
from typing import Any

Memory = int | None
"""What a formula remembers of a run."""


STATES: dict[str, Any] = {f"S{i}": f"S{i}" for i in range(4)} | {"__builtins__": {}}
"""A state stands for its name."""


class Form(StrEnum):
    """What is asked of `p` and `q`, each about a single tick."""

    ALWAYS = "always({p})"
    IMPLIED = "always({p} implies {q})"
    ANSWERED = "always({p} implies within({d}[s], {q}))"
    LASTING = "always({p} implies throughout({d}[s], {q}))"
    PRECEDED = "always({p} implies once({d}[s], {q}))"
    LASTED = "always({p} or historically({d}[s], {q}))"
    SINCE = "always({p} or since({q}, {p}))"
    REACHED = "within({d}[s], {q})"


@dataclass(slots=True)
class Formula:
    """A formula; `step` gives what it remembers after a tick, and whether it fails there."""

    form: Form
    p: str
    q: str
    span_s: float
    _p: CodeType = field(init=False)
    _q: CodeType = field(init=False)

    def __post_init__(self) -> None:
        self._p, self._q = (compile(t, t, "eval") for t in (self.p, self.q))

    @property
    def text(self) -> str:
        """As it stands in a specification."""
        return self.form.format(p=f"({self.p})", q=f"({self.q})", d=self.span_s)

    @property
    def asks(self) -> bool:
        """Whether it holds vacuously where `p` never does."""
        return " implies " in self.form

    def truths(self, view: Mapping[str, Any]) -> tuple[bool, bool]:
        """Those of its parts."""
        return bool(eval(self._p, STATES, view)), bool(eval(self._q, STATES, view))

    def judge(self, tick_s: float) -> Callable[[Memory, bool, bool], tuple[Memory, bool]]:
        """The step of its machine, which begins with None."""
        span = int(self.span_s / tick_s + 1e-6)
        return {
            Form.ALWAYS: lambda _, p, q: (None, not p),
            Form.IMPLIED: lambda _, p, q: (None, p and not q),
            Form.ANSWERED: lambda m, p, q: _within(m, p, q, span),
            Form.LASTING: lambda m, p, q: _throughout(m, p, q, span),
            Form.PRECEDED: lambda m, p, q: _once(m, p, q, span),
            Form.LASTED: lambda m, p, q: _historically(m, p, q, span),
            Form.SINCE: _since,
            Form.REACHED: lambda m, p, q: _reached(m, q, span),
        }[self.form]


def _within(waits: Memory, p: bool, q: bool, span: int) -> tuple[Memory, bool]:
    """It remembers the age of the oldest request without an answer."""
    if q:
        return None, False
    if waits is not None:
        waits += 1
    elif p:
        waits = 0
    return waits, waits == span


def _throughout(lasts: Memory, p: bool, q: bool, span: int) -> tuple[Memory, bool]:
    """It remembers for how many more ticks `q` has to hold."""
    left = span + 1 if p else lasts or 0
    return (left - 1 if left > 1 else None), left > 0 and not q


def _once(age: Memory, p: bool, q: bool, span: int) -> tuple[Memory, bool]:
    """It remembers how long ago `q` held, if that is not too long."""
    age = 0 if q else None if age is None or age >= span else age + 1
    return age, p and age is None


def _historically(age: Memory, p: bool, q: bool, span: int) -> tuple[Memory, bool]:
    """It remembers how long ago `q` did not hold."""
    age, _ = _once(age, p, not q, span)
    return age, not p and age is not None


def _since(holds: Memory, p: bool, q: bool) -> tuple[Memory, bool]:
    """It remembers whether `p` held, and `q` since then."""
    holds = 1 if p or (holds and q) else None
    return holds, not holds


def _reached(age: Memory, q: bool, span: int) -> tuple[Memory, bool]:
    """It remembers the ticks until now; beyond the span it is over."""
    now = 0 if age is None else age + 1
    if age == span + 1 or q:
        return span + 1, False
    return now, now == span
