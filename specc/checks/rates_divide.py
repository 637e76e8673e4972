"""A value of every period comes at regular intervals to a subsystem that asks whether it came."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.places import below
from specc.facts.references import arrivals_asked
from specc.facts.sources import Node, Sent, received
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0418, where the age is not limited either; a sender that is faster is seen in any period."""
    readers = {s.qualified_name: s for s in facts.subsystems}
    asked = {name: arrivals_asked(reader) for name, reader in readers.items()}
    for node, element in received(facts):
        reader = readers.get(node.reader)
        if reader is None or (node.peer, node.element) not in asked[node.reader]:
            continue
        sender = _sender(node, facts)
        if sender is None or element.max_age_s is not None:
            continue
        ratio = reader.rate_hz / sender.rate_hz
        if ratio > 1 and ratio.denominator != 1:
            few = ratio.numerator // ratio.denominator
            yield Diagnostic(
                "W0418",
                f"`{node.short}` is fresh after {few} or {few + 1} periods of "
                f"`{reader.qualified_name}`, by turns",
                element.place,
                f"{float(sender.rate_hz):g} Hz does not divide {float(reader.rate_hz):g} Hz",
                tuple(_rate(s) for s in (sender, reader)),
                "choose rates that divide, or say with `max_age` how old the value may be",
            )


def _sender(node: Node, facts: Facts) -> Subsystem | None:
    """Who sends an element in every period."""
    sent = facts.ages.sources.of(node)
    return sent.sender if isinstance(sent, Sent) and sent.silent is None else None


def _rate(subsystem: Subsystem) -> Related:
    words = f"`{subsystem.qualified_name}`, {float(subsystem.rate_hz):g} Hz"
    return Related(below(subsystem.place, "rate"), words)
