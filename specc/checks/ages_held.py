"""Where a value may be so and so old, it is sent in every period or read only when it arrives."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.ages import Held
from specc.facts.places import below
from specc.facts.sources import bounded
from specc.facts.words import ms
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0416."""
    for node, element in bounded(facts):
        held, allowed = facts.ages.oldest(node), element.max_age_s
        if isinstance(held, Held) and held.sent.silent is not None and allowed is not None:
            sender, state = held.sent.sender.qualified_name, held.sent.silent
            whose = "it" if held.node == node else f"`{held.node}`, from which it is computed,"
            yield Diagnostic(
                "W0416",
                f"nothing limits the age of `{node.short}`",
                below(element.place, "max_age"),
                f"may be {ms(allowed)} old",
                (Related(state.place, f"`{sender}` does not send {whose} in this state"),),
                "send it in every state, or read it only where `fresh(...)` of it holds",
            )
