"""The base of every generated subsystem and the tables it carries."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any, ClassVar

from specc_runtime.buffers import slots
from specc_runtime.faults import UndecidedTransition

Cause = str
"""`terminal`, `error`, or the name of one of several error conditions."""


@dataclass(frozen=True, slots=True)
class Transition:
    """A row of the transition table: in `source`, ended by `cause`, if `condition`, to `target`."""

    source: str
    cause: Cause
    condition: str
    target: str
    resumes: str = ""
    """The mode that it resumes."""

    def __str__(self) -> str:
        resumed = f" by resume({self.resumes})" if self.resumes else ""
        named = "" if self.cause in ("terminal", "error") else "error "
        return f"{self.source} {named}{self.cause} {self.condition} -> {self.target}{resumed}"


@dataclass(frozen=True, slots=True)
class Equations:
    """Equation numbers of what a step can execute.

    `behaviours` by state, `checks` by state and cause (error conditions, highest priority first,
    then the terminal one), `rows` by index into the transition table.
    """

    behaviours: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    checks: Mapping[str, Mapping[Cause, tuple[int, ...]]] = field(default_factory=dict)
    rows: tuple[tuple[int, ...], ...] = ()


class Subsystem(ABC):
    """A Moore machine over its buffers (section 2.3). Generated classes fill in the rest.

    `x` holds the input elements with their `fresh_` and `present_` flags, `y` the output elements,
    both by `<peer>_<element>`. The executor writes `x` and reads `y`; nobody else does.
    """

    name: str
    """Qualified name, `irp.m`; a class that several subsystems share is given it."""
    period_s: ClassVar[float]
    initial_state: ClassVar[str]
    transitions: ClassVar[tuple[Transition, ...]]
    sends: ClassVar[Mapping[str, tuple[str, ...]]]
    """State -> the elements of `y` that its behaviour writes."""
    equations: ClassVar[Equations] = Equations()
    axioms: ClassVar[tuple[str, ...]] = ()
    modes: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """State -> the modes around it, the innermost first."""
    timers: ClassVar[Mapping[str, tuple[str, ...]]] = {}
    """State -> the memory elements that count the periods of the modes around it."""

    x: Any
    y: Any
    memory: Any
    state: str = ""
    """The state whose behaviour ran last; empty before the first step."""
    violations: tuple[int, ...] = ()
    """Indices of the axioms that did not hold in the last step."""

    @abstractmethod
    def step(self) -> int:
        """One period of the work cycle; the index of the transition taken, or -1.

        Raises `UndecidedTransition`, and whatever an operator raises.
        """

    def skip(self, periods: int) -> None:
        """Let whole periods pass without a step: `elapsed` and the timers of modes count them."""
        own = vars(self)
        if "_periods" in own:  # else nothing asks for the time
            own["_periods"] += periods
        for name in self.timers.get(self.state, ()):
            setattr(self.memory, name, getattr(self.memory, name) + periods)

    def violated(self, index: int) -> None:
        """Note that axiom `index` does not hold; the executor stops the run."""
        self.violations = (*self.violations, index)

    def undecided(self, cause: Cause, enabled: Sequence[int]) -> UndecidedTransition:
        """The fault to raise when the rows `enabled` hold where exactly one must."""
        rows = [str(self.transitions[index]) for index in enabled]
        undecided_rows = enabled or [
            index
            for index, row in enumerate(self.transitions)
            if (row.source, row.cause) == (self.state, cause)
        ]
        by_row = dict(enumerate(self.equations.rows))
        numbers = sorted({n for index in undecided_rows for n in by_row.get(index, ())})
        inputs = contents(self.x)
        return UndecidedTransition(self.name, self.state, cause, rows, inputs, numbers)

    def note_inputs(self) -> None:  # noqa: B027  # most have nobody who notes
        """Called when `x` has the inputs of a step that another process makes; for recordings."""


def contents(buffer: object) -> dict[str, object]:
    """The elements of a buffer that have a value, by name."""
    return {name: getattr(buffer, name) for name in slots(buffer) if hasattr(buffer, name)}


def input_name(subsystem: Subsystem, attribute: str) -> str:
    """An input as the specification names it, which only the module of its layouts knows."""
    package = type(subsystem).__module__.rpartition(".")[0]
    try:
        elements = import_module(f"{package}.layouts").LAYOUTS[subsystem.name].x
    except (Exception, SystemExit):  # noqa: BLE001  # there is none, or codecs raise anything
        return f"input {attribute}"
    names = (".".join(("x", *e.name)) for e in elements if e.attribute == attribute)
    return next(names, f"input {attribute}")
