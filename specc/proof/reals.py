"""Which questions rest on comparisons of real numbers, all of which are false for NaN."""

from __future__ import annotations

from specc.model.expr import Builtin, Compare, Expr, children
from specc.model.types import Real
from specc.proof.formula import Atom
from specc.proof.numbering import Numbering
from specc.proof.variables import EnumItem


class OfReals:
    """Tells these questions from others, for one subsystem."""

    def __init__(self, numbering: Numbering) -> None:
        self._numbering = numbering
        self._known: dict[Atom, bool] = {}

    def __call__(self, atom: Atom) -> bool:
        """Whether the answer depends on such a comparison, however deep in what is asked."""
        if atom not in self._known:
            variable = atom.variable
            asked = variable.expr if isinstance(variable, EnumItem) else atom.expr
            self._known[atom] = asked is not None and self._compares(asked)
        return self._known[atom]

    def _compares(self, expr: Expr) -> bool:
        open_, seen = [expr], set[int]()
        while open_:
            part = self._numbering.looked_through(open_.pop())
            if id(part) in seen:
                continue
            seen.add(id(part))
            match part:
                case Compare(left=left, right=right):
                    if isinstance(left.type, Real) or isinstance(right.type, Real):
                        return True
                case Builtin(name="near"):
                    return True
            open_ += children(part)
        return False
