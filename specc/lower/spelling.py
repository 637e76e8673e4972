"""Python for one node of an expression over the Python of its operands, with its rank."""

from __future__ import annotations

import math
from dataclasses import dataclass

from specc.lower.text import literal
from specc.model.types import Enum, Int, ListOf, Real, Type, Vector

CHOICE, OR, AND, NOT, COMPARE, SUM, PRODUCT, SIGN, POWER, PRIMARY, ATOM = range(11)
"""How tightly Python binds; an operand of lower rank than its place needs brackets."""
_BINARY = {"+": SUM, "-": SUM, "*": PRODUCT, "/": PRODUCT, "@": PRODUCT}


@dataclass(frozen=True, slots=True)
class Spelled:
    """Python text of an expression and how tightly it binds."""

    text: str
    rank: int = ATOM

    def at(self, rank: int) -> str:
        """The text for a place that needs at least `rank`."""
        return self.text if self.rank >= rank else f"({self.text})"


def number(value: float, type_: Type) -> Spelled:
    """A literal; reals get a point. Infinity has no literal in Python."""
    if not math.isfinite(value):
        return Spelled(f'float("{float(value)}")', PRIMARY)
    text = str(int(value)) if isinstance(type_, Int) else repr(float(value))
    return Spelled(text, SIGN if text.startswith("-") else ATOM)


def call(function: str, *args: Spelled) -> Spelled:
    """A call with its arguments."""
    return Spelled(f"{function}({', '.join(arg.text for arg in args)})", PRIMARY)


def sign(operand: Spelled) -> Spelled:
    """The negative; two signs never stand side by side."""
    rank = SIGN if operand.rank != SIGN else ATOM
    return Spelled(f"-{operand.at(rank)}", SIGN)


def negation(operand: Spelled) -> Spelled:
    """`not`."""
    return Spelled(f"not {operand.at(NOT)}", NOT)


def binary(op: str, left: Spelled, right: Spelled) -> Spelled:
    """Arithmetic between two operands."""
    if op == "**":
        return Spelled(f"{left.at(PRIMARY)} ** {right.at(SIGN)}", POWER)
    rank = _BINARY[op]
    return Spelled(f"{left.at(rank)} {op} {right.at(rank + 1)}", rank)


def compare(op: str, left: Spelled, right: Spelled) -> Spelled:
    """One comparison, never a chain."""
    return Spelled(f"{left.at(SUM)} {op} {right.at(SUM)}", COMPARE)


def logic(op: str, operands: list[Spelled]) -> Spelled:
    """`and`/`or`; an `and` inside an `or` keeps its brackets, for the reader."""
    return Spelled(f" {op} ".join(o.at(NOT) for o in operands), AND if op == "and" else OR)


def choice(test: Spelled, then: Spelled, otherwise: Spelled) -> Spelled:
    """`then if test else otherwise`."""
    return Spelled(f"{then.at(OR)} if {test.at(OR)} else {otherwise.at(CHOICE)}", CHOICE)


def among(item: Spelled, members: frozenset[str], type_: Type, *, negated: bool) -> Spelled:
    """Whether an item is one of some members, which come in the order of their declaration."""
    order = type_.members if isinstance(type_, Enum) else ()
    names = [literal(member) for member in order if member in members]
    if not names:
        return Spelled(str(negated))
    if len(names) == 1:
        return compare("!=" if negated else "==", item, Spelled(names[0]))
    verb = "not in" if negated else "in"
    return Spelled(f"{item.at(SUM)} {verb} {{{', '.join(names)}}}", COMPARE)


def quantifier(kind: str, variable: str, over: Spelled, body: Spelled, type_: Type) -> Spelled:
    """`all` or `any` over a tuple, or over an array as a list of Python's numbers."""
    items = over.at(PRIMARY) + ("" if is_tuple(type_) else ".tolist()")
    return Spelled(f"{kind}({body.text} for {variable} in {items})", PRIMARY)


def pairs(variable: str, over: Spelled, body: Spelled, type_: Type) -> Spelled:
    """Every item after the number that it is judged by."""
    items = over.at(PRIMARY) + ("" if is_tuple(type_) else ".tolist()")
    return Spelled(f"({body.text}, {variable}) for {variable} in {items}")


def component(value: Spelled, index: int, of: Type) -> Spelled:
    """One component: a number of Python's, not one of numpy's."""
    end = f"[{index}]" if is_tuple(of) else f".item({index})"
    return Spelled(value.at(PRIMARY) + end, PRIMARY)


def is_tuple(type_: Type) -> bool:
    """Whether values are tuples: lists, and vectors of anything but reals."""
    match type_:
        case Vector(element=Real()):
            return False
    return isinstance(type_, (Vector, ListOf))


def items(operands: list[Spelled]) -> Spelled:
    """A tuple."""
    inside = ", ".join(o.text for o in operands)
    return Spelled(f"({inside},)" if len(operands) == 1 else f"({inside})")
