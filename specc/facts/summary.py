"""What later passes may rely on."""

from __future__ import annotations

from specc.facts.facts import Facts
from specc.model.fsm import Cause
from specc.proof import InputName


class Proofs:
    """What the checks have established about a system without errors."""

    def __init__(self, facts: Facts) -> None:
        """`facts` are what it was established from."""
        self.facts = facts
        self._subsystems = {s.qualified_name: s for s in facts.subsystems}

    def is_proved(self, subsystem: str, state: str, cause: Cause) -> bool:
        """Whether exactly one row of a state and cause applies whenever that cause occurs.

        `subsystem` is a qualified name; one with errors has nothing proved.
        """
        found = self._subsystems.get(subsystem)
        return found is not None and self.facts.verdict(found, state, cause).proved

    def present(self, subsystem: str, state: str) -> frozenset[InputName]:
        """Inputs that surely have a value in the conditions and the functions of a state."""
        found = self._subsystems.get(subsystem)
        return self.facts.presence(found).in_functions[state] if found else frozenset()
