"""Phrases that several findings share."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from specc.model.fsm import Behaviour, Cause
from specc.proof import Witness


def situation(witness: Witness) -> str:
    """`when a is true and b is false`; empty if it is always so."""
    facts = [f"`{question}` is {answer}" for question, answer in witness.facts]
    return f"when {listed(facts, 'and')}" if facts else "whatever the conditions are"


def ms(seconds: Fraction) -> str:
    """A length of time in milliseconds."""
    return f"{float(1000 * seconds):.6g} ms"


def listed(names: Iterable[str], word: str) -> str:
    """`a`, `a and b`, `a, b and c`."""
    *most, last = names
    return f"{', '.join(most)} {word} {last}" if most else last


def ending(behaviour: Behaviour, cause: Cause) -> str:
    """How a behaviour ends by a cause: `by its terminal condition `idle_ended``."""
    condition = behaviour.terminal if cause == "terminal" else behaviour.error
    return f"by its {cause} condition `{condition.name}`"
