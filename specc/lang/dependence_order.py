"""Something about each let or constant, found in order of dependence."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TypeVar

from specc.model.expr import ConstantRef, Expr, LetRef, walk
from specc.reachable import reachable

T = TypeVar("T")


class InDependenceOrder(Mapping[str, T]):
    """What `find` tells of named expressions, for each at most once, when it is first wanted.

    Those that it names come first: so `find` meets only names of which the answer is known, and no
    chain of them is followed by deep recursion.
    """

    def __init__(self, named: Mapping[str, Expr], find: Callable[[str], T]) -> None:
        """`named` in order of dependence: each names earlier ones only."""
        self._named = named
        self._find = find
        self._known: dict[str, T] = {}

    def __getitem__(self, name: str) -> T:
        if name not in self._known:
            missing = reachable([name], self._missing_in)
            for other in missing if len(missing) == 1 else filter(missing.__contains__, self):
                self._known[other] = self._find(other)
        return self._known[name]

    def _missing_in(self, name: str) -> Iterator[str]:
        nodes = walk(self._named[name])
        names = (node.name for node in nodes if isinstance(node, (LetRef, ConstantRef)))
        return (named for named in names if named in self._named and named not in self._known)

    def __contains__(self, name: object) -> bool:
        return name in self._named

    def __iter__(self) -> Iterator[str]:
        return iter(self._named)

    def __len__(self) -> int:
        return len(self._named)
