"""Which proofs about rows hold for NaN as well as for numbers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol

from specc.facts.presence import Presence
from specc.facts.unused_components import Carriers, is_real
from specc.model.expr import Expr
from specc.model.fsm import Cause
from specc.model.system import Subsystem
from specc.proof import Prover, RowVerdict, Witness

MakeProver = Callable[[Subsystem, Callable[[Expr], bool]], Prover]
"""The prover of a subsystem in which some numbers, which it tells, may be NaN."""


class Verdicts(Protocol):
    """What is known for numbers."""

    @property
    def carriers(self) -> Carriers:
        """Where NaN can come to."""

    def prover(self, subsystem: Subsystem) -> Prover:
        """The prover of a subsystem."""

    def verdict(
        self, subsystem: Subsystem, state: str, cause: Cause, *, without: int | None = None
    ) -> RowVerdict:
        """The verdict about rows, `without` one axiom, if given."""

    def presence(self, subsystem: Subsystem) -> Presence:
        """Where the inputs of a subsystem surely have values."""


class NotNumbers:
    """Asks again what is proved for numbers."""

    def __init__(self, verdicts: Verdicts, make: MakeProver) -> None:
        self._verdicts = verdicts
        self._make = make
        self._minding: dict[str, Prover | None] = {}
        self._strict: dict[str, Prover] = {}

    def witness(
        self, subsystem: Subsystem, state: str, cause: Cause, without: int | None
    ) -> Witness | None:
        """Where rows that are proved for numbers fail for NaN that is known to come up."""
        verdicts, minding = self._verdicts, self.minding(subsystem)
        if minding is None or not verdicts.verdict(subsystem, state, cause, without=without).proved:
            return None
        present = verdicts.presence(subsystem).in_conditions(state)
        decision = minding.prove_rows(state, cause, present=present, without=without).decision
        return decision.gap or decision.overlap

    def minding(self, subsystem: Subsystem) -> Prover | None:
        """The prover that minds NaN that is known to come up; None if conditions meet none."""
        name, carriers = subsystem.qualified_name, self._verdicts.carriers
        if name not in self._minding:
            may_be = partial(carriers.may_be_unused, subsystem=subsystem)
            minds = carriers.in_conditions(subsystem)
            self._minding[name] = self._make(subsystem, may_be) if minds else None
        return self._minding[name]

    def strict(self, subsystem: Subsystem) -> Prover:
        """The prover for which any real number that is not written down may be NaN."""
        name = subsystem.qualified_name
        if name not in self._strict:
            self._strict[name] = self._make(subsystem, is_real)
        return self._strict[name]

    def is_proved(self, subsystem: Subsystem, state: str, cause: Cause) -> bool:
        """Whether exactly one row applies, also if any real number there is may be NaN."""
        verdicts = self._verdicts
        if not verdicts.verdict(subsystem, state, cause).proved:
            return False
        if not verdicts.prover(subsystem).compares_reals(state, cause):
            return True
        present = verdicts.presence(subsystem).in_conditions(state)
        return self.strict(subsystem).prove_rows(state, cause, present=present).proved
