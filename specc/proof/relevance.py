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
    places = _Places(things((part,)) for part in parts)
    return [parts[place] for place in places.taken(things(seeds))]


def components(parts: Sequence[Formula], things: Things = variables_of) -> Iterator[list[Formula]]:
    """The parts in groups that have nothing to do with each other."""
    places = _Places(things((part,)) for part in parts)
    for place, part in enumerate(parts):
        if place in places.left:
            places.left.remove(place)
            yield [part, *(parts[other] for other in places.taken(places.about[place]))]


class _Places:
    """Where parts stand in their sequence, found by what they are about; each is taken once."""

    def __init__(self, about: Iterable[Set[object]]) -> None:
        self.about = list(about)
        self.left = set(range(len(self.about)))
        self._constants = [place for place, names in enumerate(self.about) if not names]
        self._found: dict[object, list[int]] = {}
        for place, names in enumerate(self.about):
            for name in names:
                self._found.setdefault(name, []).append(place)

    def taken(self, things: Set[object]) -> list[int]:
        """The constants that are left, and then what is connected with some things."""
        taken = [place for place in self._constants if place in self.left]
        self._constants = []
        self.left.difference_update(taken)
        reached, open_ = set[object](), set(things)
        while open_:
            places = {place for thing in open_ for place in self._found.get(thing, ())}
            near = sorted(places & self.left)
            self.left.difference_update(near)
            taken += near
            reached |= open_
            open_ = {thing for place in near for thing in self.about[place]} - reached
        return taken
