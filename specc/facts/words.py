"""Phrases that several findings share."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction

from specc.expr import show
from specc.model.expr import Call, walk
from specc.model.fsm import Behaviour, Cause
from specc.proof import Witness


def situation(witness: Witness) -> str:
    """`when a is true and b is false`, or whatever else holds in all situations of a witness."""
    if witness.everywhere is not None:
        return f"when `{show(witness.everywhere)}`"
    if not witness.facts:
        return "whatever the conditions are"
    return f"when {facts_of(witness)}{', and not only then' if witness.some else ''}"


def facts_of(witness: Witness) -> str:
    """`a is true and b is false`: one situation of a witness."""
    return listed([f"`{question}` is {answer}" for question, answer in witness.facts], "and")


def operators_in(witness: Witness) -> str:
    """What a witness takes of operators, as a last remark; empty if it has to do with none."""
    nodes = (node for asked, _ in witness.answers for node in walk(asked))
    calls = (node.operator for node in nodes if isinstance(node, Call))
    names = [f"`{name}`" for name in dict.fromkeys(calls)]
    if not names:
        return ""
    kind = "an operator, which" if len(names) == 1 else "operators, which"
    verb = "is" if len(names) == 1 else "are"
    return f"; {listed(names, 'and')} {verb} {kind} may have any result for all that is known"


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
