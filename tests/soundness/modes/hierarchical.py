"""Runs machines with modes as they are written: a tree of modes, a stack of those that are active.

Nothing is flattened and nothing of the compiler is used; what is read is the data of the YAML. Each
rule of the section on modes in docs/language.md is one function here, or a line with the rule
beside it.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Literal

from tests.soundness.evaluator import Absent, Key, Value
from tests.soundness.modes.text_values import Now, parsed, worth

Tree = Mapping[str, Any]
TERMINAL, ERROR, OTHERWISE = "terminal", "error", "otherwise"
RESUME = "resume"


# What is written -----------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Mode:
    """A group of states and of other modes."""

    name: str
    members: tuple[str, ...]
    initial: str
    errors: tuple[tuple[str, ast.expr], ...]


@dataclass(frozen=True, slots=True)
class Behaviour:
    functions: tuple[Tree, ...]
    errors: tuple[tuple[str, ast.expr], ...]
    terminal: ast.expr


@dataclass(frozen=True, slots=True)
class Row:
    """`sources` are states and modes; `target` is a state or mode, or the mode to resume."""

    sources: tuple[str, ...]
    cause: str
    when: ast.expr | Literal["otherwise"]
    target: str
    resumes: bool
    text: str


class Written:
    """The machine of one subsystem as it is written."""

    def __init__(self, subsystem: Tree) -> None:
        self.rate_hz = rate_of(subsystem.get("rate", "1 Hz"))
        self.conditions = {
            (kind, name): _expression(value)
            for kind, group in subsystem.get("conditions", {}).items()
            for name, value in group.items()
        }
        self.functions: Tree = subsystem.get("functions", {})
        self.lets = {n: _expression(v) for n, v in subsystem.get("let", {}).items()}
        self.memory = {n: parsed(v["init"]) for n, v in subsystem.get("memory", {}).items()}
        self.behaviours = {
            name: self._behaviour(name, part)
            for name, part in subsystem.get("behaviours", {}).items()
        }
        self.states = {n: self._of_state(n, part) for n, part in subsystem["states"].items()}
        self.modes = {n: self._mode(n, part) for n, part in subsystem.get("modes", {}).items()}
        self.initial_state: str = subsystem["initial_state"]
        self.rows = tuple(self._row(row) for row in subsystem.get("transitions", ()))

    def _behaviour(self, name: str, part: Tree) -> Behaviour:
        used = [self.functions[f] if isinstance(f, str) else f for f in part.get("functions", ())]
        ending = part.get("terminal", "never")
        terminal = self._condition("terminal", ending) if ending else parsed("False")
        return Behaviour(tuple(used), tuple(self._errors(name, part.get("error"))), terminal)

    def _of_state(self, name: str, part: Any) -> Behaviour:
        """A state names a behaviour, or a behaviour stands in its state."""
        if isinstance(part, str):
            return self.behaviours[part]
        if "behaviour" in part:
            return self.behaviours[part["behaviour"]]
        return self._behaviour(name, part)

    def _mode(self, name: str, part: Tree) -> Mode:
        errors = tuple(self._errors(name, part.get("error")))
        return Mode(name, tuple(part["states"]), part.get("initial", ""), errors)

    def _errors(self, owner: str, part: Any) -> Iterator[tuple[str, ast.expr]]:
        """Error conditions: the name of a declared one, several in place, or one without a name."""
        if part is None or part == "never":
            return
        if isinstance(part, str):
            yield part, self._condition("error", part)
        elif "when" in part:
            yield f"{owner}.error", _expression(part)
        else:
            yield from ((name, _expression(value)) for name, value in part.items())

    def _condition(self, kind: str, part: Any) -> ast.expr:
        if part in ("always", "never"):
            return parsed(part == "always")
        if isinstance(part, str) and (kind, part) in self.conditions:
            return self.conditions[kind, part]
        return _expression(part)

    def _row(self, row: Any) -> Row:
        if isinstance(row, Mapping):
            row = (row["from"], row["cause"], row["when"], row["to"])
        sources, cause, when, to = row
        resumes = to.startswith(f"{RESUME}(")
        target = to[len(RESUME) + 1 : -1].strip() if resumes else to
        return Row(
            (sources,) if isinstance(sources, str) else tuple(sources),
            cause,
            OTHERWISE if when == OTHERWISE else self._condition("initial", when),
            target,
            resumes,
            f"{sources} {cause} {when} -> {to}",
        )

    def kinds_of(self, name: str) -> tuple[str, ...]:
        """The kinds of the conditions that are declared by a name."""
        return tuple(kind for kind, other in self.conditions if other == name)

    # The tree --------------------------------------------------------------------------

    def modes_of(self, name: str) -> tuple[str, ...]:
        """The modes that a state or mode is in, the outermost first, without itself."""
        outer = next((m.name for m in self.modes.values() if name in m.members), None)
        return () if outer is None else (*self.modes_of(outer), outer)

    def path(self, state: str) -> tuple[str, ...]:
        """The stack of a state: its modes, the outermost first, and the state."""
        return (*self.modes_of(state), state)

    def first_state(self, name: str) -> str:
        """A mode as next state means its `initial`; raises `NoWay` where it has none."""
        while name in self.modes:
            name = self.modes[name].initial
            if not name:
                raise NoWay
        return name


def rate_of(text: str) -> Fraction:
    """A rate, or a period, in Hz."""
    number, unit = text.split()
    return {
        "Hz": Fraction(number),
        "s": 1 / Fraction(number),
        "ms": 1000 / Fraction(number),
    }[unit]


class NoWay(Exception):
    """A mode is to be entered that has no `initial`."""


def _expression(part: Any) -> ast.expr:
    """An expression in place, or with its title and traces around it."""
    if isinstance(part, Mapping):
        part = part["when"] if "when" in part else part["is"]
    return parsed(part)


# What happens --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Step:
    """What a subsystem did at its time stamp `stamp`."""

    stamp: int
    state: str
    cause: str
    """The name of the condition that ended the behaviour, empty for none."""
    row: str
    sent: tuple[tuple[str, Value], ...]
    memory: tuple[tuple[str, Value], ...]
    active: tuple[str, ...]
    """The modes of the state, outermost first."""
    lasted: tuple[tuple[str, int], ...]
    """The periods of each mode."""
    left: tuple[tuple[str, str], ...]
    """The state in which each mode was left, of those that were."""
    entered: tuple[str, ...]
    """The modes that were entered in this period."""


@dataclass(frozen=True, slots=True)
class Failure:
    """A step that came to nothing: `rows` are those that held where one had to."""

    stamp: int
    state: str
    kind: Literal["undecided", "absent", "nothing", "arithmetic"]
    cause: str = ""
    rows: tuple[str, ...] = ()


class Undecided(Exception):
    """Not exactly one row holds; `args` are the cause and those that do."""


@dataclass
class Machine:
    """A machine with modes between two periods."""

    written: Written
    state: str = ""
    periods: int = 0
    memory: dict[str, Value] = field(default_factory=dict)
    lasted: dict[str, int] = field(default_factory=dict)
    """Mode -> the periods that passed while it was active since it was entered."""
    left: dict[str, str] = field(default_factory=dict)
    """Mode -> the innermost state in which it was left last."""
    entered: set[str] = field(default_factory=set)
    """The modes in the first period after an entry that was no `resume`."""
    stamp: int = -1

    @property
    def stack(self) -> tuple[str, ...]:
        """The active modes, the outermost first."""
        return self.written.modes_of(self.state)

    def step(self, inputs: Mapping[Key, Value], fresh: Iterable[Key], skipped: int = 0) -> Any:
        """One period of the work cycle, after some that were skipped: a `Step` or a `Failure`."""
        self.stamp += 1
        fresh, cause = frozenset(fresh), ""
        try:
            taken = None
            if not self.state:
                self._start(inputs, fresh)
            else:
                self._pass(1 + skipped)
                cause = self.cause(self.now(inputs, fresh))
                if cause:
                    taken = self.the_row(cause, self.now(inputs, fresh))
                    self.take(taken)
            sent = self.execute(self.now(inputs, fresh))
        except Undecided as error:
            return Failure(self.stamp, self.state, "undecided", cause, error.args[1])
        except Absent as error:
            return Failure(self.stamp, self.state, "absent", cause, (str(error),))
        except ValueError:
            return Failure(self.stamp, self.state, "nothing", cause)
        except ArithmeticError:
            return Failure(self.stamp, self.state, "arithmetic", cause)
        return Step(
            self.stamp,
            self.state,
            cause,
            taken.text if taken else "",
            sent,
            tuple(self.memory.items()),
            self.stack,
            tuple((m, self.lasted.get(m, 0)) for m in self.written.modes),
            tuple((m, self.left[m]) for m in self.written.modes if m in self.left),
            tuple(m for m in self.written.modes if m in self.entered),
        )

    def now(self, inputs: Mapping[Key, Value], fresh: Iterable[Key]) -> Now:
        """What expressions see."""
        return Now(
            inputs,
            frozenset(fresh),
            self.memory,
            self.written.lets,
            float(self.periods / self.written.rate_hz),
            self.periods == 0,
            {m: float(self.lasted.get(m, 0) / self.written.rate_hz) for m in self.written.modes},
            self.entered,
            float(1 / self.written.rate_hz),
        )

    def _start(self, inputs: Mapping[Key, Value], fresh: Iterable[Key]) -> None:
        """In the first period the initial state is entered, and no condition is evaluated."""
        now = self.now(inputs, fresh)
        self.memory = {name: worth(init, now) for name, init in self.written.memory.items()}
        self.state = self.written.first_state(self.written.initial_state)
        self.enter(self.stack)

    def _pass(self, periods: int) -> None:
        """Periods pass, skipped ones included: for the state and for all modes that are active.

        Conditions are evaluated after that, so first one period after entry, `resume` included; the
        first period after an entry is over by then.
        """
        self.periods += periods
        for mode in self.stack:
            self.lasted[mode] = self.lasted.get(mode, 0) + periods
        self.entered = set()

    def endings(self) -> Iterator[tuple[str, ast.expr]]:
        """The causes for which the state can end, in their order.

        A mode's error conditions are evaluated in each of its states, before the state's own, those
        of the outermost mode first; then in the order in which they are written.
        """
        behaviour = self.written.states[self.state]
        for mode in self.stack:
            yield from self.written.modes[mode].errors
        yield from behaviour.errors
        yield TERMINAL, behaviour.terminal

    def cause(self, now: Now) -> str:
        """Where several conditions hold at once, the first one is the cause; empty for none."""
        return next((name for name, when in self.endings() if worth(when, now)), "")

    def rows_of(self, cause: str) -> list[Row]:
        """The rows of a mode and of its states form one table; nothing overrides.

        `error` covers the causes that no row of this state names.
        """
        here = {self.state, *self.stack}
        own = [row for row in self.written.rows if here.intersection(row.sources)]
        named = [row for row in own if row.cause == cause]
        return named or [row for row in own if cause != TERMINAL and row.cause == ERROR]

    def the_row(self, cause: str, now: Now) -> Row:
        """Exactly one row applies; `otherwise` negates all others of the state and cause.

        A row to a mode without a way in is no way.
        """
        rows = self.rows_of(cause)
        enabled = [r for r in rows if isinstance(r.when, ast.expr) and worth(r.when, now)]
        enabled = enabled or [r for r in rows if r.when == OTHERWISE]
        if len(enabled) != 1:
            raise Undecided(cause, tuple(row.text for row in enabled))
        try:
            self.destination(enabled[0])
        except NoWay:
            raise Undecided(cause, ()) from None
        return enabled[0]

    def destination(self, row: Row) -> str:
        """The state that a row leads to.

        `resume` goes back to the innermost state that was left, or to `initial` the first time.
        """
        if row.resumes:
            assert row.target not in self.stack, "`resume(m)` inside m is an error"
            return self.left.get(row.target) or self.written.first_state(row.target)
        return self.written.first_state(row.target)

    def take(self, row: Row) -> None:
        """Leave modes, enter others, be in the next state."""
        before, destination = self.stack, self.destination(row)
        after = self.written.modes_of(destination)
        # Only a row that leaves a mode writes its history.
        for mode in before:
            if mode not in after:
                self.left[mode] = self.state
        if row.resumes:
            # `resume(outer)` resumes every mode inside; those around it are entered.
            resumed = set(after[after.index(row.target) :])
            anew = [mode for mode in after if mode not in before and mode not in resumed]
        elif row.target in self.written.modes:
            # Naming a mode as next state inside of it enters it anew, and what is inside of it.
            inside = set(after[after.index(row.target) :])
            anew = [mode for mode in after if mode not in before or mode in inside]
        else:
            anew = [mode for mode in after if mode not in before]
        self.state = destination
        self.periods = 0  # `elapsed` of the state begins anew, after `resume` too
        self.enter(anew)

    def enter(self, modes: Sequence[str]) -> None:
        """Every entry except by `resume` sets the clock of a mode to zero."""
        self.lasted.update(dict.fromkeys(modes, 0))
        self.entered = set(modes)

    def execute(self, now: Now) -> tuple[tuple[str, Value], ...]:
        """All functions of the state's behaviour once; results take effect at the next stamp."""
        sent, after = {}, dict(self.memory)
        for function in self.written.states[self.state].functions:
            for target, value in function.items():
                if target.startswith("y."):
                    _, peer, name = target.split(".")
                    sent[f"{peer}_{name}"] = worth(_expression(value), now)
                elif target in self.memory:
                    after[target] = worth(_expression(value), now)
        self.memory = after
        return tuple(sorted(sent.items()))
