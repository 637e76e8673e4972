"""The expressions of a subsystem with equal ones made identical and lets put in place.

A let is only a name that a term prefers. Equality of terms is identity, so finding what can be
computed once costs a look into a set, however deep the expressions are.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import fields, replace

from specc.lang.ranges import Range
from specc.lower.terms import (
    Term,
    constness,
    new_term,
    operand_type,
    propagating_operands,
    range_of,
)
from specc.model import expr as e
from specc.model.system import Device, Let, Subsystem, System
from specc.model.types import Bool, Int, Real, Type
from specc.model.units import SECOND

MAX_TERMS = 100_000
"""Most terms that one method may spell; conditional lets can multiply beyond any use."""


class TooLarge(Exception):
    """The work cycle of a subsystem would become too large a method."""

    def __init__(self, subsystem: str = "") -> None:
        self.subsystem = subsystem
        whose = f" of `{subsystem}`" if subsystem else ""
        super().__init__(
            f"one period{whose} evaluates more than {MAX_TERMS} terms, or terms nested too deep; "
            "lets that use other lets in both branches of a choice multiply: compute some in an "
            "operator"
        )


class TermTable:
    """All terms of a subsystem."""

    def __init__(
        self,
        lets: Iterable[Let] = (),
        computed: Iterable[str] = (),
        invariant_memory: Iterable[str] = (),
        constants: Mapping[str, e.Expr] | None = None,
        parameters: Mapping[str, tuple[Type, ...]] | None = None,
    ) -> None:
        """`computed`: constants whose value an operator or a file gives; `settled`: memory that
        keeps its initial value for ever; `constants`: the values of the others and of `period`;
        `parameters`: the types of the parameters of every operator.
        """
        self._terms: dict[object, Term] = {}
        self._lets: dict[str, Term] = {}
        self._computed = frozenset(computed)
        self._invariant_memory = frozenset(invariant_memory)
        self._constants = constants or {}
        self._parameters = parameters or {}
        for let in lets:
            self._lets[let.name] = self._name_term(self.of(let.value), let)

    def _name_term(self, term: Term, let: Let) -> Term:
        if term.args and not term.is_invariant and term.let is None:
            term.let = let
            term.mark_worth_local()
        return term

    def of(self, node: e.Expr, as_type: Type | None = None) -> Term:
        """The term of an expression that is compared, written or handed on: a number is finite.

        `as_type` is the type of the place; an integer becomes a real there.
        """
        term = self._unchecked(node)
        if term.is_unchecked:
            return self._intern(e.Builtin(e.FINITE, (term.node,), type=term.type), (term,))
        if isinstance(as_type, Real) and isinstance(term.type, Int):
            if isinstance(term.node, e.Number):
                return self._intern(e.Number(float(term.node.value), type=as_type), ())
            return self._intern(e.Builtin(e.FLOAT, (term.node,), type=as_type), (term,))
        return term

    def _unchecked(self, node: e.Expr) -> Term:
        """The term of an expression. What is not finite shows in all arithmetic that it enters, so
        that one look at the end is enough; wherever it could hide, it is looked at before."""
        if isinstance(node, e.LetRef):
            return self._lets[node.name]
        if isinstance(node, (e.Fresh, e.Present, e.Lag)):
            return self._intern(node, ())
        propagating = propagating_operands(node)
        args = (
            self._unchecked(child)
            if place in propagating
            else self.of(child, self._operand_type(node, place))
            for place, child in enumerate(e.children(node))
        )
        return self.fold(node, tuple(args))

    def _operand_type(self, node: e.Expr, place: int) -> Type | None:
        if isinstance(node, e.Call) and node.operator in self._parameters:
            return self._parameters[node.operator][place]
        return operand_type(node, place)

    def fold(self, node: e.Expr, args: tuple[Term, ...]) -> Term:
        """The term of a node over given operands, after folding what is known."""
        match node:
            case e.Unary(op="not"):
                return self._fold_not(node, args[0])
            case e.Logic():
                return self._fold_logic(node, args)
            case e.Choice() if isinstance(args[0].node, e.Truth):
                return args[1] if args[0].node.value else args[2]
        return self._intern(node, args)

    def truth(self, value: bool) -> Term:
        """The term of a constant truth value."""
        return self._intern(e.TRUE if value else e.FALSE, ())

    def negation(self, term: Term) -> Term:
        """The term that holds when `term` does not."""
        return self._fold_not(e.Unary("not", term.node, type=Bool()), term)

    def _fold_not(self, node: e.Unary, arg: Term) -> Term:
        match arg.node:
            case e.Truth(value=value):
                return self.truth(not value)
            case e.Unary(op="not"):
                return arg.args[0]
            case e.Compare(op="==" | "!=" as op):
                return self._intern(replace(arg.node, op="!=" if op == "==" else "=="), arg.args)
        return self._intern(node, (arg,))

    def _fold_logic(self, node: e.Logic, args: tuple[Term, ...]) -> Term:
        """`and`/`or` without operands that decide nothing; `a and not a` is decided."""
        decided = self.truth(node.op == "or")
        operands: list[Term] = []
        for arg in args:
            nested = isinstance(arg.node, e.Logic) and arg.node.op == node.op and arg.let is None
            for part in arg.args if nested else (arg,):
                if part is decided or self.negation(part) in operands:
                    return decided
                if not isinstance(part.node, e.Truth) and part not in operands:
                    operands.append(part)
        if len(operands) < 2:
            return operands[0] if operands else self.truth(node.op == "and")
        return self._intern(node, tuple(operands))

    def _intern(self, node: e.Expr, args: tuple[Term, ...]) -> Term:
        key = (type(node), node.type, _payload(node), tuple(arg.order for arg in args))
        if key not in self._terms:
            self._terms[key] = self._new_term(node, args)
        return self._terms[key]

    def _new_term(self, node: e.Expr, args: tuple[Term, ...]) -> Term:
        match node:
            case e.ConstantRef(name=name):
                is_constant, is_settled = name not in self._computed, True
            case e.MemoryRef(name=name):
                is_constant, is_settled = False, name in self._invariant_memory
            case _:
                is_constant, is_settled = constness(node, args)
        range_ = self._range(node, args)  # may make terms, so before this one has its number
        return new_term(len(self._terms), node, args, (is_constant, is_settled), range_)

    def _range(self, node: e.Expr, args: tuple[Term, ...]) -> Range:
        if isinstance(node, (e.ConstantRef, e.Clock)) and node.name in self._constants:
            return self._unchecked(self._constants[node.name]).range
        return range_of(node, args)


def term_table(system: System, part: Subsystem | Device, computed: Collection[str]) -> TermTable:
    """The terms of one part of a system; operators and files give the constants `computed`."""
    declared = (*system.constants, *part.constants)
    constants = {c.name: c.value for c in declared if c.name not in computed}
    parameters = {o.name: tuple(t for _, t in o.parameters) for o in system.operators}
    if isinstance(part, Device):
        return TermTable((), computed, (), constants, parameters)
    constants["period"] = e.Number(float(1 / part.rate_hz), type=Real(SECOND))
    changed = {a.name for b in part.behaviours for a in b.assignments if not a.peer}
    invariant = (item.name for item in part.memory if item.name not in changed)
    return TermTable(part.lets, computed, invariant, constants, parameters)


def _payload(node: e.Expr) -> object:
    """What tells two nodes of one kind apart besides their type and operands."""
    if isinstance(node, e.Number):
        return (type(node.value), repr(node.value))  # 0.0 and -0.0 are equal numbers
    if isinstance(node, (e.Fresh, e.Present)):
        return node.input
    if isinstance(node, e.Lag):
        return node.name, node.input
    values = (getattr(node, part.name) for part in fields(node) if part.name not in _COMMON)
    return tuple(v for v in values if isinstance(v, (str, int, float, bool, frozenset)))


_COMMON = ("type", "span")
