"""Moore machines: conditions, functions, behaviours, states and transitions (2.3, 2.4)."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import chain
from typing import Literal

from specc.model.expr import Expr
from specc.model.types import Type
from specc.source import Place


@dataclass(frozen=True, slots=True)
class Trace:
    """Equation numbers, tables and figures; empty where a part has none."""

    eq: tuple[int, ...] = ()
    table: tuple[int, ...] = ()
    fig: tuple[int, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.eq or self.table or self.fig)

    def __str__(self) -> str:
        """`eq. 5`, `eqs 76, 77; Table 11`, or the empty text."""
        parts = (
            _numbered("eq.", "eqs", self.eq),
            _numbered("Table", "Tables", self.table),
            _numbered("Fig.", "Figs", self.fig),
        )
        return "; ".join(p for p in parts if p)


def _numbered(one: str, many: str, numbers: tuple[int, ...]) -> str:
    if not numbers:
        return ""
    return f"{one if len(numbers) == 1 else many} {', '.join(map(str, numbers))}"


ConditionKind = Literal["initial", "terminal", "error"]
Cause = str
"""What ends a state: `terminal`, `error`, or the name of one of several error conditions."""


def cause_words(cause: Cause) -> str:
    """A cause for readers: one that has a name as `error NAME`."""
    return cause if cause in ("terminal", "error") else f"error {cause}"


NEVER_LEFT = "never"
"""The value of the memory element `left(mode)` before a row leaves the mode for the first time."""
OTHERWISE = "otherwise"
"""As the initial condition of a row: none of the other rows of its state and cause applies."""


@dataclass(frozen=True, slots=True)
class Condition:
    """A predicate. `always` and `never` are conditions too, with kind-less names."""

    name: str
    kind: ConditionKind
    when: Expr
    title: str
    trace: Trace
    place: Place


@dataclass(frozen=True, slots=True)
class Assignment:
    """One target of a transition function. `peer` is "" for memory."""

    peer: str
    name: str
    value: Expr
    trace: Trace
    place: Place

    @property
    def target(self) -> str:
        return f"y.{self.peer}.{self.name}" if self.peer else self.name


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of a behaviour or function; `place` is its name in the signature."""

    name: str
    type: Type
    place: Place


@dataclass(frozen=True, slots=True)
class Generic:
    """A behaviour or function with parameters, as it is declared: `ParameterRef` stands in `part`.

    Each call of it is a part of its own, which has arguments in their place.
    """

    part: Behaviour | Function
    parameters: tuple[Parameter, ...]

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """The conditions that end it, if it is a behaviour."""
        part = self.part
        return tuple(c for _, c in part.endings) if isinstance(part, Behaviour) else ()

    @property
    def exprs(self) -> list[tuple[Place, Expr]]:
        """All expressions in it, each with the place of what it is the value of."""
        values = [(item.place, item.value) for item in self.part.assignments]
        return values + [(end.place, end.when) for end in self.conditions]


@dataclass(frozen=True, slots=True)
class Function:
    """A transition function: all values are of time stamp i, all results take effect at i+1.

    It is not complete if a target of it is not known. A call of a `generic` one has its arguments
    in its name.
    """

    name: str
    assignments: tuple[Assignment, ...]
    title: str
    trace: Trace
    place: Place
    is_complete: bool = True
    generic: Generic | None = None


@dataclass(frozen=True, slots=True)
class Behaviour:
    """Transition functions, a terminal condition and error conditions (eq. 3).

    Within a subsystem the name identifies what a behaviour does. In a state its `errors` begin with
    those of the modes around the state. It is not `is_complete` if a function or target of it is
    not known. A call of a `generic` one has its `arguments` in its name, too.
    """

    name: str
    functions: tuple[Function, ...]
    terminal: Condition
    errors: tuple[tuple[Cause, Condition], ...]
    """Of several that hold, the first one is the cause."""
    title: str
    trace: Trace
    place: Place
    is_complete: bool = True
    generic: Generic | None = None
    arguments: tuple[Expr, ...] = ()
    assignments: tuple[Assignment, ...] = field(init=False, repr=False, compare=False)

    @property
    def endings(self) -> tuple[tuple[Cause, Condition], ...]:
        """The causes of its end with their conditions, highest priority first (2.4)."""
        return *self.errors, ("terminal", self.terminal)

    @property
    def causes(self) -> tuple[Cause, ...]:
        """The causes of its end, the terminal condition first."""
        return "terminal", *(cause for cause, _ in self.errors)

    def ending(self, cause: Cause) -> Condition:
        """The condition that ends it, for a cause."""
        return next(condition for name, condition in self.endings if name == cause)

    def facts_after(self, cause: Cause) -> tuple[tuple[Expr, bool], ...]:
        """The conditions that held (True) or did not (False) when it ended by a cause."""
        before = [name for name, _ in self.endings].index(cause)
        excluded = ((condition.when, False) for _, condition in self.endings[:before])
        return (self.ending(cause).when, True), *excluded

    def __post_init__(self) -> None:
        found = tuple(chain.from_iterable([f.assignments for f in self.functions]))
        object.__setattr__(self, "assignments", found)


@dataclass(frozen=True, slots=True)
class State:
    name: str
    behaviour: Behaviour
    title: str
    trace: Trace
    place: Place
    ignores: tuple[tuple[str, str], ...] = ()
    """Events that may come in it without being looked at, by peer and element."""
    holds: tuple[tuple[str, str], ...] = ()
    """Outputs that keep their last value in it on purpose, by peer and element."""
    modes: tuple[str, ...] = ()
    """The modes around it, outermost first."""
    for_modes: Function | None = None
    """The last function of its behaviour, if it updates the memory of modes."""

    @property
    def with_modes(self) -> str:
        """The state and the modes around it: `lifting in working in powered`."""
        return " in ".join((self.name, *reversed(self.modes)))


@dataclass(frozen=True, slots=True)
class Mode:
    """A group of states, by its name in the subsystem.

    `states` are those in it and in the modes inside, in the order of the file. `initial` is the
    state in which it is entered; "" if it is never entered by its name.

    What a mode remembers is memory of the subsystem: `periods(mode)`, the periods that passed while
    it was active; `entered(mode)`, whether it was entered anew in this period; `left(mode)`, the
    state that a row left last when it left the mode. Each is there if something asks for it.
    """

    name: str
    states: tuple[str, ...]
    parent: str
    initial: str
    errors: tuple[tuple[Cause, Condition], ...]
    title: str
    trace: Trace
    place: Place


ModeAspect = Literal["elapsed", "periods", "entered", "left"]
"""What is known of a mode: `elapsed(mode)` is a let, the others are memory."""


def mode_name(aspect: ModeAspect, mode: str) -> str:
    """The name of that let or memory element, which no file can give to one of its own."""
    return f"{aspect}({mode})"


def mode_of(aspect: ModeAspect, name: str) -> str:
    """The mode of such a name; "" for every other name."""
    begin = f"{aspect}("
    return name[len(begin) : -1] if name.startswith(begin) else ""


@dataclass(frozen=True, slots=True)
class Transition:
    """A row of the transition table: `source`, ended by `cause`, under `condition`, to `target`.

    If it `is_otherwise`, it applies where no other row of that state and cause does.
    """

    source: str
    cause: Cause
    condition: Condition
    target: str
    trace: Trace
    place: Place
    is_otherwise: bool = False
    resumes: str = ""
    """The mode that it resumes."""
    is_return: bool = False
    """Whether it goes back to a state that was left when that mode was left."""
    sets: tuple[tuple[str, Expr], ...] = ()
    """Memory of modes and the constants that it gets before the functions of `target` read it."""
    source_mode: str = ""
    """The mode that the row of the file names as its source; "" if it names the state."""
    target_mode: str = ""
    """The mode that the row of the file enters by its name; "" if it names the state."""

    @property
    def identity(self) -> object:
        """The same for a row in a whole system and for that of a subsystem alone."""
        return self.place, self.source, self.cause, self.target

    @property
    def written(self) -> tuple[Place, str]:
        """The same for rows that one row of the file stands for in the states of one mode, and for
        those by which it resumes one in its states.
        """
        return self.place, self.source_mode or self.source

    @property
    def label(self) -> str:
        """The row as faults and recordings of runs name it."""
        resumed = f" by resume({self.resumes})" if self.resumes else ""
        cause, condition = cause_words(self.cause), self.condition.name
        return f"{self.source} {cause} {condition} -> {self.target}{resumed}"


@dataclass(frozen=True, slots=True)
class Axiom:
    """An assumption that the proofs may use, with the designer's reason."""

    that: Expr
    because: str
    place: Place
