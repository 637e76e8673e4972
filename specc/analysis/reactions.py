"""Whether a machine reacts to a member of an event's enum, or goes on as if nothing had come."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from specc.analysis.reads import Dependences
from specc.model.expr import Expr, Input, children
from specc.model.system import Subsystem
from specc.model.types import Bool, Enum
from specc.proof import InputName, Prover


class Reactions:
    """Reactions of one subsystem: what its conditions ask, and what its functions compute."""

    def __init__(self, subsystem: Subsystem, prover: Prover, dependences: Dependences) -> None:
        self._subsystem = subsystem
        self._prover = prover
        self._dependences = dependences

    def members(self, exprs: Iterable[Expr], key: InputName) -> frozenset[str]:
        """The members of an input's enum to which some expressions react.

        They do if one of them may be different because the member came. What reads the value other
        than in a condition reacts to all of them.
        """
        type_ = self._subsystem.inputs[key].type
        if not isinstance(type_, Enum):
            return frozenset()
        element = Input(*key, type=type_)
        asked = [part for expr in exprs for part in self._conditions_on(expr, key)]
        return frozenset(
            member
            for member in type_.members
            if any(
                not isinstance(part.type, Bool) or self._prover.reacts(part, element, member)
                for part in asked
            )
        )

    def _conditions_on(self, expr: Expr, key: InputName) -> Iterator[Expr]:
        """The conditions in an expression that depend on an input, and the input outside of any."""
        if key not in self._dependences.of(expr).inputs:
            return
        if isinstance(expr.type, Bool) or isinstance(expr, Input):
            yield expr
        else:
            whole = self._prover.numbering.resolve(expr)
            for part in children(expr) if whole is expr else (whole,):
                yield from self._conditions_on(part, key)
