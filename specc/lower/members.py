"""Which members of an enum a quantifier's body accepts, when it asks nothing else."""

from __future__ import annotations

from specc.lower.terms import Term
from specc.model import expr as e
from specc.model.types import Enum, Vector


def accepted(quantifier: e.Quantifier, body: Term) -> frozenset[str] | None:
    """Members for which `body` holds; None if it depends on more than the variable."""
    over = quantifier.over.type
    if quantifier.kind not in ("all", "any"):
        return None
    if not (isinstance(over, Vector) and over.size and isinstance(over.element, Enum)):
        return None
    outcomes = {m: _holds(body, quantifier.variable, m) for m in over.element.members}
    if None in outcomes.values():
        return None
    return frozenset(member for member, holds in outcomes.items() if holds)


def _holds(term: Term, variable: str, member: str) -> bool | None:
    match term.node:
        case e.Truth(value=value):
            return value
        case e.Among(members=members) if _is_variable(term.args[0], variable):
            return member in members
        case e.Compare(op="==" | "!=" as op):
            return _equals(term.args, variable, member, wanted=op == "==")
        case e.Unary(op="not"):
            inner = _holds(term.args[0], variable, member)
            return None if inner is None else not inner
        case e.Logic(op=op):
            parts = [_holds(arg, variable, member) for arg in term.args]
            if None in parts:
                return None
            return all(parts) if op == "and" else any(parts)
    return None


def _equals(sides: tuple[Term, ...], variable: str, member: str, *, wanted: bool) -> bool | None:
    for side, other in (sides, sides[::-1]):
        if _is_variable(side, variable) and isinstance(other.node, e.Member):
            return (other.node.name == member) is wanted
    return None


def _is_variable(term: Term, variable: str) -> bool:
    return isinstance(term.node, e.Bound) and term.node.name == variable
