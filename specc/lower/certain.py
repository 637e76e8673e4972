"""What is evaluated in any case: what may be computed early, because it will be needed anyway.

A term behind a guard (a later operand of `and` and `or`, a branch of a choice, the body of a
quantifier over a list) is not, unless all paths come to it.
"""

from __future__ import annotations

from specc.lower.terms import NONE, Term, Terms, in_order
from specc.model import expr as e
from specc.model.types import Vector


class Certain:
    """Answers for terms worth keeping. The values of the terms `known` are there already."""

    def __init__(self, known: Terms = NONE) -> None:
        self._known = known
        self._found: dict[Term, Terms] = {}

    def of(self, *terms: Term) -> Terms:
        """Terms that an evaluation of all `terms` evaluates in any case, themselves among them."""
        for term in in_order(self._missing(terms)):
            itself = frozenset({term}) if term.is_kept else NONE
            self._found[term] = itself | self._operands(term)
        return NONE.union(*map(self._get, terms))

    def before(self, term: Term, if_true: Terms, if_false: Terms) -> Terms:
        """Terms evaluated in any case when `term` is tested and one of two things follows.

        `if_true` and `if_false` are evaluated in any case after the test came out that way.
        """
        self.of(term)
        return self._before(term, if_true, if_false)

    def _missing(self, terms: tuple[Term, ...]) -> set[Term]:
        missing: set[Term] = set()
        pending = list(terms)
        while pending:
            term = pending.pop()
            if term not in self._known and term not in self._found and term not in missing:
                missing.add(term)
                pending.extend(term.args)
        return missing

    def _get(self, term: Term) -> Terms:
        return NONE if term in self._known else self._found[term]

    def _before(self, term: Term, if_true: Terms, if_false: Terms) -> Terms:
        if term in self._known:
            return if_true & if_false
        itself = frozenset({term}) if term.is_kept else NONE
        match term.node:
            case e.Truth(value=value):
                return if_true if value else if_false
            case e.Unary(op="not"):
                return itself | self._before(term.args[0], if_false, if_true)
            case e.Logic(op=op):
                for operand in reversed(term.args):
                    outcome = self._before(operand, if_true, if_false)
                    if_true, if_false = (outcome, if_false) if op == "and" else (if_true, outcome)
                return itself | outcome
            case e.Choice():
                test, then, otherwise = term.args
                after_then = self._before(then, if_true, if_false)
                after_else = self._before(otherwise, if_true, if_false)
                return itself | self._before(test, after_then, after_else)
        return self._get(term) | (if_true & if_false)

    def _operands(self, term: Term) -> Terms:
        match term.node:
            case e.Logic(op=op):
                after = NONE
                for operand in reversed(term.args):
                    outcomes = (after, NONE) if op == "and" else (NONE, after)
                    after = self._before(operand, *outcomes)
                return after
            case e.Choice():
                test, then, otherwise = term.args
                return self._before(test, self._get(then), self._get(otherwise))
            case e.Quantifier():
                over, body = term.args
                never_empty = isinstance(over.type, Vector) and over.type.size > 0
                inside = (t for t in self._get(body) if not t.bound)
                return self._get(over) | (frozenset(inside) if never_empty else NONE)
        return NONE.union(*map(self._get, term.args))
