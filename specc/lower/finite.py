"""Where arithmetic on finite numbers may give infinity or NaN, and where that is noticed.

Infinity and NaN show in the result of any further arithmetic that they enter, so a value is checked
only once: before it is compared, written or handed to an operator.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from specc.model import expr as e
from specc.model.types import ListOf, PartialOf, Pose, Real, Spatial, Type, Vector

if TYPE_CHECKING:
    from specc.lower.terms import Term

FAR = 1e300
"""Numbers below this stay finite in one operation with numbers of their size."""
LONGEST_S = 1e12
"""No state lasts longer than this."""
_NO_LARGER = ("abs", "finite", "float", "max", "min", "position", "translation")
_SHOWING = ("inverse", "norm", "position", "sqrt", "translation")


def shows(node: e.Expr) -> range:
    """The operands in which a number that is not finite makes the result not finite."""
    match node:
        case e.Binary(op="/"):
            return range(1)
        case e.Binary(op="**", right=e.Number(value=exponent)):
            return range(1 if exponent >= 1 else 0)  # infinity to the power of -1 is 0
        case e.Binary(op="**"):
            return range(0)
        case e.Binary():
            return range(2)
        case e.Unary(op="-") | e.Component() | e.Sure():
            return range(1)
        case e.Builtin(name=name, args=args) if name in _SHOWING:
            return range(len(args))
        case e.Items(type=Vector() | Spatial(), items=items):
            return range(len(items))
    return range(0)


def is_raw(node: e.Expr, args: Sequence[Term], largest: float) -> bool:
    """Whether a term is the result of arithmetic that has to be looked at before it is used.

    Arrays always are, since they become read-only then; a number is unless it stays below
    `largest`, or is no larger than a finite one that it was made from.
    """
    if not _is_real(node.type):
        return False
    if any(args[place].is_raw for place in shows(node)):
        return True
    if largest < FAR and all(arg.is_constant for arg in args):
        return False
    match node:
        case e.Binary() | e.Unary(op="-") | e.Builtin(name="inverse") if is_array(node.type):
            return True
        case e.Binary(op="*"):
            return largest >= FAR and all(arg.largest > 1.0 for arg in args)
        case e.Binary(op="/"):
            divisor = _magnitude(args[1])
            return largest >= FAR and (divisor is None or divisor < 1.0)
        case e.Binary() | e.Builtin(name="norm"):
            return largest >= FAR
    return False


def largest(node: e.Expr, args: Sequence[Term]) -> float:
    """A bound of the size of the number, or of all components, that a term stands for."""
    sizes = [arg.largest for arg in args]
    match node:
        case e.Number(value=value):
            return abs(float(value)) if abs(value) < FAR else math.inf
        case e.Clock(name="elapsed"):
            return LONGEST_S
        case e.Binary():
            return _of_binary(node, args)
        case e.Choice():
            return max(sizes[1:])
        case e.Builtin(name=name) if name in _NO_LARGER:
            return max(sizes)
        case e.Unary(op="-") | e.Component() | e.Items() if sizes:
            return max(sizes)
    return math.inf


def place_type(node: e.Expr, place: int) -> Type | None:
    """The type that an operand has to have; None where any number will do."""
    match node:
        case e.Choice() if place:
            return node.type
        case e.Builtin(name="min" | "max"):
            return node.type
        case e.Items(type=ListOf(element=element)):
            return element
    return None


def _of_binary(node: e.Binary, args: Sequence[Term]) -> float:
    left, right = (arg.largest for arg in args)
    match node.op:
        case "+" | "-":
            return left + right
        case "*":
            return 0.0 if 0.0 in (left, right) else left * right
        case "/":
            return left / (_magnitude(args[1]) or 0.0) if _magnitude(args[1]) else math.inf
        case "**" if left < 1e30 and isinstance(node.right, e.Number) and 0 <= right < 10:
            return float(max(1.0, left) ** right)
    return math.inf


def _magnitude(term: Term) -> float | None:
    """The size of a number that is written out."""
    node = term.node
    return abs(float(node.value)) if isinstance(node, e.Number) else None


def is_array(type_: Type) -> bool:
    """Whether values of the type are numpy arrays of reals."""
    match type_:
        case Vector(element=Real()) | Spatial() | Pose() | PartialOf():
            return True
    return False


def _is_real(type_: Type) -> bool:
    return isinstance(type_, Real) or (is_array(type_) and not isinstance(type_, PartialOf))
