"""What names mean, where a type comes from, and what is wrong with an expression."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeVar

from specc.diagnostics.nearest import is_typo, nearest, sole_correction
from specc.model.expr import (
    Binary,
    Builtin,
    Call,
    Choice,
    Component,
    ConstantRef,
    Expr,
    FieldOf,
    Input,
    LetRef,
    MemoryRef,
    ParameterRef,
    Unary,
    source_name,
)
from specc.model.system import Operator
from specc.model.types import Enum, Type
from specc.source import Place

# What the names in an expression stand for.


CLOCK_NAMES = ("elapsed", "entered", "period")
FOLLOW_UP = ""
"""Code of an error that is only that something has an error, which is reported at its place."""


Name = TypeVar("Name")
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Declaration:
    """The type of a name, where it is declared, and its value if it is a let or a constant."""

    type: Type
    place: Place | None = None
    value: Expr | None = None


def declarations(types: Mapping[Name, Type]) -> dict[Name, Declaration]:
    """Names of which nothing is known but their types."""
    return {name: Declaration(type) for name, type in types.items()}


@dataclass(frozen=True)
class Scope:
    """The names that an expression may use. A name is looked up in the order of the fields."""

    bound: Mapping[str, Declaration] = field(default_factory=dict)
    """Variables of the quantifiers around the expression."""
    parameters: Mapping[str, Declaration] = field(default_factory=dict)
    """Those of the behaviour or function around the expression."""
    memory: Mapping[str, Declaration] = field(default_factory=dict)
    lets: Mapping[str, Declaration] = field(default_factory=dict)
    constants: Mapping[str, Declaration] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)
    """Each with its name in the system."""
    enums: Mapping[str, tuple[Enum, ...]] = field(default_factory=dict)
    """Member -> the enums that have it; the expected type chooses among several."""
    operators: Mapping[str, Operator] = field(default_factory=dict)
    inputs: Mapping[tuple[str, str], Declaration] = field(default_factory=dict)
    """By peer and element, for `x.peer.element`."""
    uninitialized: Collection[str] = ()
    """Memory and lets, which have no value yet where the expression is evaluated."""
    later_constants: Collection[str] = ()
    """Constants that are computed later, or just now."""
    all_lets: Collection[str] = ()
    """All lets, of which some are looked at after this expression, which `defines` one."""
    defines: str = ""
    allow_clock: bool = False
    modes: Collection[str] = ()
    """Modes of the machine, for `elapsed(mode)` and `entered(mode)`."""
    has_points: bool = True
    """Whether `position(X)` is a point; before version 1.1 it was a vector."""

    def binding(self, name: str, type: Type) -> Scope:
        """The scope inside a quantifier over `name`."""
        return replace(self, bound={**self.bound, name: Declaration(type)})

    def value(self, name: str) -> tuple[str, Type] | None:
        """Kind and type of a named value, or None: the name may still be a member or a file."""
        for kind in ("bound", "parameters", "memory", "lets", "constants"):
            found: Declaration | None = getattr(self, kind).get(name)
            if found is not None:
                return kind, found.type
        return None

    def has(self, name: str) -> bool:
        """Whether a name stands for something of its own type, unlike members of enums."""
        is_clock = self.allow_clock and name in CLOCK_NAMES
        return self.value(name) is not None or name in self.files or is_clock or name == "pi"

    def values(self) -> Iterator[tuple[str, Type]]:
        """Every named value with its type."""
        for names in (self.parameters, self.memory, self.lets, self.constants):
            yield from ((name, declared.type) for name, declared in names.items())

    def elements(self, peer: str) -> list[str]:
        """The elements of the input buffer that is connected to a peer."""
        return [element for p, element in self.inputs if p == peer]

    @cached_property
    def known_peers(self) -> list[str]:
        """Peers with an input buffer, in order."""
        return list(dict.fromkeys(peer for peer, _ in self.inputs))

    def names(self) -> list[str]:
        """Every plain name that stands for something here."""
        clock = CLOCK_NAMES if self.allow_clock else ()
        values = [*self.bound, *self.parameters, *self.memory, *self.lets, *self.constants]
        others = [n for n in self.all_lets if n != self.defines and n not in self.lets]
        return [*values, *others, *self.files, *self.enums, *clock]


def enums_by_member(enums: Iterable[Enum]) -> dict[str, tuple[Enum, ...]]:
    """Member -> the enums that have it, as `Scope.enums` wants it."""
    found: dict[str, tuple[Enum, ...]] = {}
    for enum in dict.fromkeys(enums):
        for member in enum.members:
            found[member] = (*found.get(member, ()), enum)
    return found


# How an expression got its type: the declarations that gave it, for the reader of a mismatch.


@dataclass(frozen=True, slots=True)
class Origin:
    """A place that gave a type, and what it says in words."""

    place: Place
    words: str


def origins(expr: Expr, scope: Scope) -> Iterator[Origin]:
    """The declarations from which the type of `expr` follows, from left to right."""
    match expr:
        case ParameterRef(name=name):
            words = f"`{name}` is declared as `{expr.type}`"
            yield from _origin(scope.parameters.get(name), words)
        case MemoryRef(name=name):
            yield from _origin(scope.memory.get(name), f"`{name}` is declared as `{expr.type}`")
        case Input(peer=peer, element=element):
            words = f"`x.{peer}.{element}` is declared as `{expr.type}`"
            yield from _origin(scope.inputs.get((peer, element)), words)
        case LetRef(name=name):
            yield from _origin(scope.lets.get(name), f"`{name}` is `{expr.type}`")
        case ConstantRef(name=name):
            yield from _origin(scope.constants.get(name), f"`{name}` is `{expr.type}`")
        case Call(operator=operator) if (name := source_name(operator)) in scope.operators:
            yield Origin(scope.operators[name].place, f"`{name}` returns `{expr.type}`")
        case Binary(left=left, right=right):
            yield from origins(left, scope)
            yield from origins(right, scope)
        case Unary(operand=value) | FieldOf(value=value) | Component(value=value):
            yield from origins(value, scope)
        case Choice(then=value) | Builtin(args=(value, *_)):
            yield from origins(value, scope)


def _origin(declared: Declaration | None, words: str) -> Iterator[Origin]:
    """The declaration, if it is known; a let or constant has its type from an operator, if any."""
    if declared is None or declared.place is None:
        return
    if isinstance(declared.value, Call):
        words += f" because `{source_name(declared.value.operator)}` returns it"
    yield Origin(declared.place, words)


# What is wrong with an expression, as exceptions that carry the data of a diagnostic.


NEEDS_CONTEXT = ("E0221", "E0317", "E0318")
"""Codes of errors that an expression would not have if its type were expected there."""


_DEFAULT_HELP = {
    "E0201": "declare it, e.g. under `let:` or `constants:`",
    "E0234": "only records, vectors and spatial vectors have parts",
    "E0302": "write an operator for it",
    "E0310": "write a value of that type, or change the declaration",
    "E0311": (
        "only quantities of the same unit go together; multiply or divide to get the same unit"
    ),
    "E0312": "a pose between the two frames converts one to the other: `pose[A, B] @ pose[B, C]`",
    "E0313": "choose components, e.g. `v[0]` or `v.x`, or compute it in an operator",
    "E0315": "pass a value of that type",
    "E0321": (
        "give it to an operator that takes `partial[...]`, or keep the number as a value of its own"
    ),
}
"""What helps with a finding of a code where nothing better is known."""


class ExprErrors(Exception):
    """All errors of one text; `errors` has at least one entry, in text order.

    `expr` is its meaning all the same, if that is clear except for unknown parts.
    """

    def __init__(self, errors: Iterable[ExprError], expr: Expr | None = None) -> None:
        self.expr = expr
        self.errors: tuple[ExprError, ...] = tuple(
            sorted(errors, key=lambda error: (error.start, error.end))
        )
        super().__init__("\n".join(error.message for error in self.errors))


class ExprError(ExprErrors):
    """One finding: `code` of the registry, and character offsets into the text as it was given.

    `repair` is what should surely stand between the offsets in place of `wrong`, if anything does.
    `origins` say how the types that do not agree came about; `expected` is the type that the text
    around asked for.
    """

    def __init__(
        self, message: str, start: int, end: int, help: str = "", code: str = "E0310"
    ) -> None:
        self.message = message
        self.start = start
        self.end = end
        self.help = help or _DEFAULT_HELP.get(code, "")
        self.code = code
        self.repair = ""
        self.wrong = ""
        self.origins: tuple[Origin, ...] = ()
        self.expected: Type | None = None
        super().__init__((self,))

    def set_repair(self, name: str, close: Sequence[str]) -> ExprError:
        """Note the misspelt name and, if exactly one close name is a slip away, its correction.

        Returns self.
        """
        self.wrong, self.repair = name, sole_correction(name, close)
        return self

    def with_origins(self, origins: Iterable[Origin], expected: Type | None = None) -> ExprError:
        """Note the places that the types in this error come from; returns self."""
        self.origins = tuple(dict.fromkeys(origins))
        self.expected = expected
        return self

    def or_open_point(self, message: str, help: str, name: str, close: Sequence[str]) -> ExprError:
        """This finding, or an open point if the name is not a slip: it may be defined later."""
        if not is_typo(name, close):
            self.code, self.message, self.repair = "O0205", message, ""
            default = self.help in (help, *_DEFAULT_HELP.values())
            self.help = help if default else joined_help(help, self.help)
        return self

    def shifted(self, by: int) -> ExprError:
        """The same finding about a text that starts `by` characters earlier."""
        moved = ExprError(self.message, self.start + by, self.end + by, self.help, self.code)
        moved.wrong, moved.repair = self.wrong, self.repair
        return moved.with_origins(self.origins, self.expected)


def unknown_name(
    kind: str,
    name: str,
    known: Iterable[str],
    way: str,
    at: tuple[int, int],
    code: str,
    other: Iterable[str] = (),
) -> ExprError:
    """The name of something that is not known; an open point with a `way` to add it if no slip.

    Where no name is close, the `other` ones may be meant.
    """
    close = nearest(name, known)
    help = did_you_mean(close or other) or way
    error = ExprError(f"unknown {kind} `{name}`", *at, help, code)
    return error.set_repair(name, close).or_open_point(
        f"{kind} `{name}` is not there yet", way, name, close
    )


def did_you_mean(close: Iterable[object]) -> str:
    """A help text with names that are close to a wrong one; "" if there are none."""
    names = alternatives(close)
    return f"did you mean {names}?" if names else ""


def joined_help(way: str, suggestion: str) -> str:
    """A help text that joins how a part is added and which name may be meant instead."""
    joint = ", or " if suggestion.startswith("did you mean") else "; "
    return f"{way}{joint}{suggestion}" if suggestion else way


def alternatives(names: Iterable[object]) -> str:
    """Join names in backticks for a help text: a; a or b; a, b or c."""
    quoted = [f"`{name}`" for name in names]
    return " or ".join([", ".join(quoted[:-1]), quoted[-1]] if len(quoted) > 1 else quoted)


def quoted(names: Iterable[object]) -> str:
    """Names in backticks, with commas between."""
    return ", ".join(f"`{name}`" for name in names)


def collect(*jobs: Callable[[], T]) -> list[T]:
    """Run independent jobs and return their results; raises all of their errors together."""
    results: list[T] = []
    errors: list[ExprError] = []
    for job in jobs:
        try:
            results.append(job())
        except ExprErrors as found:
            errors += found.errors
    if errors:
        raise ExprErrors(errors)
    return results
