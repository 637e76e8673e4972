"""What the readable formats share: a change in a few words, in order."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby

from specc.diagnostics.render.visible import visible
from specc.proof.verdict import Facts
from specc.tools.diff.record import Difference

LONGEST = 400


def headline(change: Difference) -> str:
    """What changed: `state S1 added`, `row S0 --terminal--> S1: condition changed`."""
    what = visible(f"{change.part} {change.name}".strip())
    if change.change != "changed":
        return f"{what} {change.change}"
    return f"{what}: {visible(change.aspect)} changed" if change.aspect else f"{what} changed"


def facts(found: Facts) -> str:
    """Facts of a witness in one line."""
    return visible(", ".join(f"{fact} is {answer}" for fact, answer in found))


def shortened(text: str) -> str:
    """A text that may be long, or of several lines, fit for a line."""
    return visible(text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}...")


def by_place(changes: Iterable[Difference]) -> Iterator[tuple[str, list[Difference]]]:
    """Changes of the system, then of each agent, subsystem and device in the order given."""
    for where, group in groupby(changes, key=lambda change: change.where):
        yield visible(where) or "system", list(group)


def counted(count: int, noun: str) -> str:
    """`1 difference`, `2 differences`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"
