"""What is refuted of the rows of several states for one reason: it is told once."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from specc.diagnostics import Related
from specc.facts.facts import Decided, Facts
from specc.facts.words import ending, listed
from specc.model.expr import Expr
from specc.proof import Witness
from specc.proof.repair import opposite

MOST_NAMED = 3
"""States that a message names; further ones are counted."""
MOST_SHOWN = 12
"""States whose places are shown beside the first."""
MOST_COMPARED = 8
"""Refutations about the same conditions with which another one is compared."""
_Key = tuple[str, str, tuple[str, ...]]


@dataclass(slots=True)
class Shared:
    """Rows of several states that ask the same conditions and fail in the same situations.

    Whenever one of the `others` or the `first` state ends, the `widest` could end as well, so that
    all that is said of its rows, which is the `witness`, holds of theirs.
    """

    first: Decided
    widest: Decided
    witness: Witness
    others: list[Decided] = field(default_factory=list)

    @property
    def states(self) -> str:
        """The states in words: `state `S0``, `states `S0` and `S1``."""
        names = [f"`{decided.state.name}`" for decided in (self.first, *self.others)]
        if len(names) == 1:
            return f"state {names[0]}"
        if len(names) > MOST_NAMED:
            names[MOST_NAMED - 1 :] = [f"{len(names) - MOST_NAMED + 1} more"]
        return f"states {listed(names, 'and')}"

    @property
    def places(self) -> tuple[Related, ...]:
        """The other states."""
        return tuple(
            Related(other.state.place, f"ended {ending(other.state.behaviour, other.cause)}, too")
            for other in self.others[:MOST_SHOWN]
        )


def shared(facts: Facts, witness_of: Callable[[Decided], Witness | None]) -> Iterator[Shared]:
    """The refutations that `witness_of` selects, in the order of their first states."""
    alike: dict[_Key, list[Shared]] = {}
    for decided in facts.decided():
        witness = witness_of(decided)
        if witness is not None:
            asked = tuple(row.condition.name for row in decided.verdict.rows)
            known = alike.setdefault((decided.subsystem.qualified_name, decided.cause, asked), [])
            _tell(decided, witness, known, facts)
    yield from (told for known in alike.values() for told in known)


def _tell(decided: Decided, witness: Witness, known: list[Shared], facts: Facts) -> None:
    """Add a refutation to those about the same conditions: to one that says as much, if any does.

    If it says more than some of them, it is what is said in their place.
    """
    compared = known[:MOST_COMPARED]
    for told in compared:
        if _covers(told.widest, decided, facts):
            told.others.append(decided)
            return
    less = [told for told in compared if _covers(decided, told.widest, facts)]
    if not less:
        known.append(Shared(decided, decided, witness))
        return
    kept, *merged = less
    kept.widest, kept.witness = decided, witness
    for told in merged:
        kept.others += [told.first, *told.others]
        known.remove(told)
    kept.others.append(decided)


def _covers(one: Decided, other: Decided, facts: Facts) -> bool:
    """Whether what is refuted of one state's rows is refuted of those of another, which it has."""
    subsystem = one.subsystem
    there = [facts.presence(subsystem).in_conditions(d.state.name) for d in (one, other)]
    if not there[0] <= there[1]:
        return False
    context, fact = _ended(other), _ended(one)
    if context == fact:
        return True
    if facts.is_vague(one) or facts.is_vague(other):
        return False
    prover = facts.prover(subsystem)
    return all(prover.implies(context, part) for part in fact)


def _ended(decided: Decided) -> tuple[Expr, ...]:
    """What holds whenever a state ends by a cause: the error condition has priority (2.4)."""
    behaviour = decided.state.behaviour
    error = behaviour.error.when
    return (error,) if decided.cause == "error" else (behaviour.terminal.when, opposite(error))
