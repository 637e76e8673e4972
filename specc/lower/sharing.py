"""Which terms a work cycle would compute twice, and which of them one method hands to the next.

The walk follows the order of evaluation along every path. What was evaluated before on the path
and is needed again is worth a name.
"""

from __future__ import annotations

from collections.abc import Iterable

from specc.lower.flow import Activity, Check, Enter, Flow, Stay
from specc.lower.terms import NONE, Term, Terms, Visits, in_order
from specc.model import expr as e


class Walk:
    """One method, followed along all its paths.

    `again` collects the terms that some path needs after it evaluated them. `offers` has, for
    every behaviour that is called, what was evaluated before.
    """

    def __init__(self) -> None:
        self.again: set[Term] = set()
        self.offers: list[tuple[Enter, Terms]] = []
        self._visits = Visits()

    def flow(self, flow: Flow, before: Terms = NONE) -> None:
        """A work cycle, when the terms `before` have been evaluated."""
        match flow:
            case Stay(enter=enter):
                self.enter(enter, before)
            case Check(test=test, rows=rows, otherwise=otherwise):
                if_true, if_false = self.test(test, before)
                self.flow(rows, if_true)
                self.flow(otherwise, if_false)
            case _:
                for row in flow.rows:
                    if_true, before = self.test(row.test, before)
                    if not flow.is_proved:
                        before |= if_true
                    else:
                        self.enter(row.enter, if_true)
                for row in () if flow.is_proved else flow.rows:
                    self.enter(row.enter, before)

    def enter(self, enter: Enter, before: Terms) -> None:
        """The call of a behaviour with its arguments."""
        if enter.is_entry:
            before = frozenset(term for term in before if not term.reads_clock)
        self.offers.append((enter, before))
        for term in enter.taken:
            if term in before:
                self.again.add(term)
            elif term in enter.needed:
                before = self.value(term, before)

    def values(self, terms: Iterable[Term], before: Terms = NONE) -> Terms:
        """Values one after the other; what has been evaluated then."""
        for term in terms:
            before = self.value(term, before)
        return before

    def value(self, term: Term, before: Terms) -> Terms:
        """A value; what has been evaluated after it."""
        if self._is_known(term, before):
            return before
        match term.node:
            case e.Logic() | e.Choice() | e.Unary(op="not"):
                if_true, if_false = self._parts(term, before)
                after = if_true | if_false
            case e.Quantifier():
                after = self.values((term.args[0], term.args[1], term.args[1]), before)
            case _:
                after = self.values(term.args, before)
        return after | {term} if term.is_kept else after

    def test(self, term: Term, before: Terms) -> tuple[Terms, Terms]:
        """A condition; what has been evaluated when it holds, and when it does not."""
        if self._is_known(term, before):
            return before, before
        match term.node:
            case e.Logic() | e.Choice() | e.Unary(op="not"):
                if_true, if_false = self._parts(term, before)
            case _:
                if_true = if_false = self.value(term, before)
        itself = frozenset({term}) if term.is_kept else NONE
        return if_true | itself, if_false | itself

    def _parts(self, term: Term, before: Terms) -> tuple[Terms, Terms]:
        match term.node:
            case e.Logic(op=op):
                ended = NONE
                for operand in term.args:
                    if_true, if_false = self.test(operand, before)
                    before, out = (if_true, if_false) if op == "and" else (if_false, if_true)
                    ended |= out
                return (before, ended) if op == "and" else (ended, before)
            case e.Choice():
                if_true, if_false = self.test(term.args[0], before)
                then, otherwise = (
                    self.test(term.args[1], if_true),
                    self.test(term.args[2], if_false),
                )
                return then[0] | otherwise[0], then[1] | otherwise[1]
        if_true, if_false = self.test(term.args[0], before)
        return if_false, if_true

    def _is_known(self, term: Term, before: Terms) -> bool:
        self._visits.add()
        if term not in before:
            return False
        self.again.add(term)
        return True


def parameters(activity: Activity, offered: Terms) -> tuple[Term, ...]:
    """The terms that a behaviour takes from its callers: the largest of those they offer."""
    found: set[Term] = set()
    seen: set[Term] = set()
    pending = [work.value for work in activity.works]
    while pending:
        term = pending.pop()
        if term in seen:
            continue
        seen.add(term)
        if term in offered and term.is_costly:
            found.add(term)
        else:
            pending.extend(term.args)
    return tuple(in_order(found))
