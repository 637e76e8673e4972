"""Values that show what was refuted of rows, for people who read the finding."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from specc.example.leaves import says_all
from specc.facts.facts import Facts
from specc.facts.words import facts_of
from specc.model.fsm import Cause, State
from specc.model.system import Subsystem
from specc.proof import Witness

if TYPE_CHECKING:
    from specc.facts.showing import Finder


class Examples:
    """Examples for the findings of one check; without findings it does nothing."""

    def __init__(self, facts: Facts) -> None:
        self._facts = facts

    def text(self, subsystem: Subsystem, state: State, cause: Cause, witness: Witness) -> str:
        """Values of an example of a witness about rows, in words.

        Where none are found, the facts of the witness are an example if more is said than these.
        Empty if they are what is said, or if its answers are all there is to say.
        """
        is_said = witness.everywhere is None
        if is_said and all(says_all(asked) for asked, _ in witness.answers):
            return ""
        found = self._finder.find(subsystem, state, cause, witness)
        if found:
            return found.text
        return "" if is_said else facts_of(witness)

    @cached_property
    def _finder(self) -> Finder:
        from specc.facts.showing import Finder

        return Finder(self._facts)
