"""What is decided of machines with unknown conditions in them, whatever these are."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import replace

from specc.facts.partial import View, possible, sure, unmet
from specc.facts.steps import CAUSES, Step, find_steps
from specc.model.fsm import Cause, Transition
from specc.model.system import Subsystem
from specc.proof import Decision, InputName, Prover, RowVerdict, Witness

Present = Collection[InputName]


class Views:
    """Answers about machines in the views that `specc.facts.partial` takes of them."""

    def __init__(self, prover: Callable[[Subsystem], Prover]) -> None:
        """`prover` makes one for a subsystem without unknowns."""
        self._new = prover
        self._provers: dict[tuple[str, View], Prover] = {}

    def verdict(
        self, subsystem: Subsystem, state: str, cause: Cause, present: Present
    ) -> RowVerdict | None:
        """What is certain of the rows; None if it is not known whether the cause occurs."""
        known, gaps, all_ = (
            self._decision(view(cause), subsystem, state, present)
            for view in (sure, unmet, possible)
        )
        if known.possible != all_.possible:
            return None
        decision = replace(all_, gap=gaps.gap, overlap=known.overlap, unknown="")
        return RowVerdict(_rows(subsystem, state, cause), decision)

    def overlap(
        self,
        subsystem: Subsystem,
        state: str,
        cause: Cause,
        pair: tuple[int, int],
        present: Present,
    ) -> Witness | None:
        """Where two rows of a state and cause, by their indices, surely apply together."""
        seen = sure(cause).of(subsystem)
        rows = _rows(seen, state, cause)
        two = replace(seen, transitions=tuple(rows[index] for index in pair))
        return self._new(two).prove_rows(state, cause, present=present).decision.overlap

    def steps(self, subsystem: Subsystem) -> tuple[Step, ...]:
        """The rows that may be taken whatever is unknown."""
        provers = {cause: self._new(sure(cause).of(subsystem)) for cause in CAUSES}

        def prove(state: str, cause: Cause) -> RowVerdict:
            decision = provers[cause].prove_rows(state, cause).decision
            return RowVerdict(_rows(subsystem, state, cause), decision)

        return find_steps(subsystem, prove)

    def _decision(self, view: View, subsystem: Subsystem, state: str, present: Present) -> Decision:
        key = subsystem.qualified_name, view
        if key not in self._provers:
            self._provers[key] = self._new(view.of(subsystem))
        return self._provers[key].prove_rows(state, view.cause, present=present).decision


def _rows(subsystem: Subsystem, state: str, cause: Cause) -> tuple[Transition, ...]:
    return tuple(row for _, row in subsystem.rows(state, cause))
