"""What can be known of a function of the language: the columns of the table of functions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, Protocol

from specc.lang.functions import Rule
from specc.lang.ranges import ANY, Operation, Range
from specc.lang.values import Value
from specc.model.types import Type

RUNTIME = "specc_runtime.builtins"


class SolverTerms(Protocol):
    """What terms of the solver can be made of, besides their own `+`, `-` and comparisons."""

    def constant(self, value: float | Fraction) -> Any:
        """The term of a number."""

    def whole(self, value: int) -> Any:
        """The term of a whole number."""

    def choice(self, test: Any, then: Any, otherwise: Any) -> Any:
        """`then if test else otherwise`."""

    def floor(self, number: Any) -> Any:
        """The greatest whole number that is not greater."""

    def representable(self, number: Any) -> Any:
        """A number of which it is known that a float has it."""


ArgumentChoices = Iterator[tuple[int, Value]]
"""Indices of arguments, each with a value that it could have."""
Encoding = Callable[..., Any]
"""From a `SolverTerms` and terms of arguments, also of the result where that is unknown."""


@dataclass(frozen=True, slots=True)
class Form:
    """How a call is written without its name: a place for each argument, with how tightly what
    stands there has to bind, and how tightly the whole binds.
    """

    text: str
    binding: str


@dataclass(frozen=True, slots=True)
class BuiltinFunction:
    """A function of the language. What is said of a result holds of each of its components.

    The defaults are what is safe to believe of a function that nobody has thought about.
    """

    signature: str
    """Parameters, result and what it is, for editors: `X -> pose: pose[B, A] of a pose[A, B]`."""
    rule: Rule | None
    """Types a call; None for a function that only the compiler calls."""
    is_overridable: bool = False
    """Whether an operator of that name takes its place; version 1 did not have it."""

    # What it computes, and how.

    value: Callable[..., Any] = NotImplemented
    """What it computes on plain Python values, with integers as floats if the result is a real."""
    python: str = RUNTIME
    """The module that has it for generated code; "" for a function of Python's own."""
    form: Callable[[Type], Form | str] = lambda type: ""
    """How generated code writes it, by the type of the first argument: in a form, by another name
    of its module, or as a call if that is "". `show` writes what has no rule in this form, too."""
    rounds: bool = True
    """Whether its result may differ from that of exact numbers."""
    may_fail: bool = True
    """Whether it raises for some arguments, so that it is called only where it is needed."""
    constants_checked: bool = False
    """Whether checks find the constant arguments for which it raises."""
    overflows: bool = True
    """Whether finite arguments may give a result that is not finite."""
    propagates: bool = False
    """Whether an argument that is not finite gives a result that is not finite, or an error."""
    is_costly: bool = False
    """Whether calling it again costs more than keeping its result; arrays always do."""

    # What proofs know of it.

    is_foldable: bool = False
    """Whether `value` is what every machine computes, so that it is known of known arguments."""
    bounds: Range = ANY
    """The least and greatest value that the result ever has."""
    range: Operation | None = None
    """The least and greatest value of the result by those of the arguments."""
    chooses: bool = False
    """Whether its result is one of its arguments."""
    picks: int = 0
    """-1 if the result is the least of its arguments, 1 if it is the greatest."""
    limits: tuple[int, int] | None = None
    """The arguments between which the result lies: the lower and the upper limit."""
    is_size: bool = False
    """Whether it is its argument without the sign."""
    compares: bool = False
    """Whether it says how its first two arguments, which may change places, compare within what
    the others allow, as `near` does."""
    term: Encoding | None = None
    """What the solver has for a number: a term, made by `SolverTerms` of those of arguments, which
    is the result itself. What rounds has `laws`."""
    stays_float: bool = False
    """Whether the result, a whole number, is one that a float has if the argument is a float."""
    laws: Callable[..., Iterable[Any]] | None = None
    """Where it has no such term: facts, made by a `SolverTerms` of the term of the result, which is
    otherwise not known, and those of the arguments."""
    inverse: Callable[[Sequence[Type], Sequence[Value], Value], ArgumentChoices] | None = None
    """What arguments may be so that the result is a wanted one: from their types, their present
    values and the result that is wanted."""

    # Which calls cannot be meant.

    same_arguments: str = ""
    """What is wrong with two arguments that have one value, with braces for it; "" if nothing."""
    direction: int | None = None
    """The argument that says a direction: a vector of length 1."""
    neutral: tuple[int, float, str] | None = None
    """An argument, its value with which the call gives the first one as it is, and a way out."""

    @property
    def is_modelled(self) -> bool:
        """Whether proofs have its result by the values of its arguments."""
        return self.term is not None or self.compares


exact = partial(BuiltinFunction, rounds=False, may_fail=False, overflows=False)
"""A row of a function that neither rounds nor fails, and is finite for what is finite."""
