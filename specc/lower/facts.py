"""What a path through a work cycle has already found out shortens the conditions further on."""

from __future__ import annotations

from specc.lower.terms import Term, TermTable
from specc.model import expr as e
from specc.model.types import Bool

Facts = dict[Term, bool]


def learn(table: TermTable, facts: Facts, term: Term, outcome: bool) -> Facts:
    """`facts`, and what follows when `term` came out as `outcome`. Nothing is guessed."""
    known = dict(facts)
    pending = [(term, outcome)]
    while pending:
        item, value = pending.pop()
        known[item] = value
        known[table.negation(item)] = not value
        match item.node:
            case e.Unary(op="not"):
                pending.append((item.args[0], not value))
            case e.Logic(op=op) if value is (op == "and"):
                pending.extend((operand, value) for operand in item.args)
            case e.Fresh(input=source) if value:
                pending.append((table.of(e.Present(source, type=Bool())), True))
            case e.Present(input=source) if not value:
                known[table.of(e.Fresh(source, type=Bool()))] = False
    return known


def shortened(table: TermTable, term: Term, facts: Facts) -> Term:
    """A term equal to `term` wherever `facts` hold."""
    if term in facts:
        return table.truth(facts[term])
    match term.node:
        case e.Unary(op="not") | e.Logic():
            args = tuple(shortened(table, arg, facts) for arg in term.args)
            return term if args == term.args else table.make(term.node, args)
        case e.Choice():
            test = shortened(table, term.args[0], facts)
            same = test is term.args[0]
            return term if same else table.make(term.node, (test, *term.args[1:]))
    return term
