"""Which parts of a conjunction have to do with each other: those that ask about one variable."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence, Set

from specc.proof.formula import Formula, atoms_of
from specc.proof.variables import Variable


def conjuncts(formulas: Iterable[Formula]) -> list[Formula]:
    """The parts of a conjunction of formulas."""
    return [p for f in formulas for p in (f.parts if f.kind == "and" else (f,))]


def variables_of(formulas: Iterable[Formula]) -> set[Variable]:
    """The variables that the formulas ask about."""
    return {atom.variable for atom in atoms_of(formulas)}


Things = Callable[[Iterable[Formula]], Set[object]]
"""What formulas are about; those that have something in common are connected."""


def related(
    parts: Sequence[Formula], seeds: Iterable[Formula], things: Things = variables_of
) -> list[Formula]:
    """The parts that are connected with the seeds, directly or through other parts.

    A constant is connected with everything.
    """
    reached = set(things(seeds))
    left = [(part, things((part,))) for part in parts]
    found = [part for part, names in left if not names]
    while True:
        near = [(part, names) for part, names in left if names & reached]
        if not near:
            return found
        left = [item for item in left if item not in near]
        for part, names in near:
            found.append(part)
            reached |= names


def components(parts: Sequence[Formula], things: Things = variables_of) -> Iterator[list[Formula]]:
    """The parts in groups that have nothing to do with each other."""
    left = list(parts)
    while left:
        group = [left[0], *related(left[1:], left[:1], things)]
        yield group
        left = [part for part in left if part not in group]
