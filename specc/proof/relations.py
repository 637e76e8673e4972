"""Whether answers to different questions have to do with each other: lazily, the solver's matter.

Tables treat the variables of conditions as independent. What they prove is true all the same; where
they refute, variables computed from the same value may not be independent.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING

from specc.model.expr import (
    Among,
    Binary,
    Bound,
    Builtin,
    Call,
    Choice,
    Compare,
    Component,
    Expr,
    Items,
    Logic,
    Quantifier,
    Unary,
    children,
)
from specc.model.types import Bool, Enum, Int, Text, Vector
from specc.proof.clock import ELAPSED
from specc.proof.formula import (
    Apart,
    Arrival,
    Atom,
    EnumItem,
    Formula,
    Quantity,
    Variable,
    atoms_of,
)
from specc.proof.numbering import Numbering

if TYPE_CHECKING:
    from specc.proof.solver import Session, Theory

Answered = tuple[Atom, bool]
"""A question, and whether the answer is yes."""

_LOOKED_INTO = (
    Among, Binary, Choice, Compare, Component, Items, Logic, Quantifier, Unary
)  # fmt: skip
_COMPUTED = ("abs", "float", "max", "min")


class UnsureError(Exception):
    """The solver gave no answer within its bounds, or is not installed; the message says so."""


class Relations:
    """Relations between the atoms of one subsystem."""

    def __init__(self, numbering: Numbering) -> None:
        self._numbering = numbering
        self._roots: dict[Atom, frozenset[object]] = {}

    def between(self, atoms: Sequence[Atom]) -> DecisionProcedure | None:
        """What decides about answers of the atoms; None if all are possible together."""
        met: dict[object, Variable] = {}
        for atom in atoms:
            variable = atom.variable
            if isinstance(variable, Quantity) and self._computes(atom):
                return self.procedure(atoms)
            if any(met.setdefault(root, variable) != variable for root in self._of(atom)):
                return self.procedure(atoms)
        return None

    def in_sums(self, atoms: Sequence[Atom]) -> bool:
        """Whether numbers are compared that are not constant, or sums."""
        return any(
            isinstance(atom.variable, Quantity)
            and (atom.variable.kind == "difference" or self._computes(atom))
            for atom in atoms
        )

    def procedure(self, atoms: Sequence[Atom]) -> DecisionProcedure:
        """What decides about answers of the atoms, whatever they have in common."""
        return DecisionProcedure(partial(self._theory, atoms))

    def _theory(self, atoms: Sequence[Atom], *, exact: bool) -> Theory:
        session = self._session
        from specc.proof.solver import Theory

        return Theory(session, self._numbering, atoms, exact=exact)

    @property
    def has_solver(self) -> bool:
        """Whether a question has needed the solver."""
        return "_session" in self.__dict__

    @cached_property
    def _session(self) -> Session:
        try:
            from specc.proof.solver import Session
        except ImportError:
            raise UnsureError("it needs the solver, which is not installed") from None
        return Session()

    def things(self, formulas: Iterable[Formula]) -> set[object]:
        """The variables that formulas ask about, and what the answers depend on."""
        found: set[object] = set()
        for atom in atoms_of(formulas):
            found.add(atom.variable)
            found |= self._of(atom)
        return found

    def _of(self, atom: Atom) -> frozenset[object]:
        if atom not in self._roots:
            self._roots[atom] = frozenset(self._find(atom))
        return self._roots[atom]

    def _find(self, atom: Atom) -> Iterator[object]:
        """Numbers of what an answer is computed from, as far as the solver knows how."""
        variable = atom.variable
        if isinstance(variable, (Apart, Arrival)):
            return
        if isinstance(variable, Quantity) and variable.kind == "periods":
            yield self._numbering.number(ELAPSED)
            return
        seen: set[int] = set()
        open_ = [variable.expr if isinstance(variable, EnumItem) else atom.expr]
        while open_:
            part = open_.pop()
            if part is None:
                continue
            expr = self._numbering.looked_through(part)
            if id(expr) in seen:
                continue
            seen.add(id(expr))
            if isinstance(expr, _LOOKED_INTO) or _is_looked_into(expr):
                open_ += children(expr)
                continue
            if not isinstance(expr, Bound):
                yield self._numbering.number(expr)
            if isinstance(expr, Builtin) and expr.name == "len":
                open_ += expr.args
            elif isinstance(expr, Call) and any(_is_discrete(arg) for arg in expr.args):
                yield "operator", expr.operator
                open_ += [arg for arg in expr.args if _is_discrete(arg)]

    def _computes(self, atom: Atom) -> bool:
        """Whether a comparison alone may have fewer answers than it seems."""
        expr, in_time = atom.expr, getattr(atom.variable, "kind", "") == "periods"
        return (
            isinstance(expr, Compare)
            and not in_time
            and any(
                isinstance(side, (Binary, Choice))
                or (isinstance(side, Builtin) and side.name in _COMPUTED)
                for side in map(self._numbering.looked_through, (expr.left, expr.right))
            )
        )


class DecisionProcedure:
    """Tells which answers are impossible together; z3 is not imported before it is asked."""

    def __init__(self, theory: Callable[..., Theory]) -> None:
        self._theory = theory

    @cached_property
    def exact(self) -> Theory:
        """Of exact numbers. Raises UnsureError without a solver or for too large a question."""
        return self._theory(exact=True)

    @cached_property
    def rounded(self) -> Theory:
        """Of floats, which all runs satisfy. Raises UnsureError like `exact`."""
        rounded = self._theory(exact=False)
        return rounded if rounded.rounds else self.exact


def _is_looked_into(expr: Expr) -> bool:
    """Whether the solver knows a function of the language by what it computes."""
    return isinstance(expr, Builtin) and (
        expr.name in _COMPUTED or (expr.name == "near" and len(expr.args) == 3)
    )


def _is_discrete(expr: Expr) -> bool:
    """Whether equal values of an expression are the same value to an operator."""
    kind = expr.type.element if isinstance(expr.type, Vector) else expr.type
    return isinstance(kind, (Bool, Enum, Int, Text))
