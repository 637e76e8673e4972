"""Where a value may be so and so old, it is sent in every period or read only when it arrives."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.ages import Held
from specc.facts.places import below
from specc.facts.sources import Measured, Node, Sent, bounded
from specc.facts.words import ms
from specc.model.system import System

_WAYS_OUT = {
    Sent: "send it in every state, or read it only where `fresh(...)` of it holds",
    Measured: "say with `max_gap` for how long there may be none, or read it only where "
    "`fresh(...)` of it holds",
}


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0416."""
    for node, element in bounded(facts):
        held, allowed = facts.ages.oldest(node), element.max_age_s
        if isinstance(held, Held) and allowed is not None:
            yield Diagnostic(
                "W0416",
                f"nothing limits the age of `{node.short}`",
                below(element.place, "max_age"),
                f"may be {ms(allowed)} old",
                tuple(_silence(held, node)),
                _WAYS_OUT[type(held.source)],
            )


def _silence(held: Held, node: Node) -> Iterator[Related]:
    source = held.source
    if isinstance(source, Measured):
        name = f"{source.device}.{held.node.element}"
        yield Related(source.place, f"`{name}` may have no new sample for any length of time")
    elif source.silent is not None:
        sender = source.sender.qualified_name
        whose = "it" if held.node == node else f"`{held.node}`, from which it is computed,"
        yield Related(source.silent.place, f"`{sender}` does not send {whose} in this state")
