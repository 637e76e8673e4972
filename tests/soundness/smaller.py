"""Makes a specification smaller while it stays interesting, part by part."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from typing import Any

from tests.soundness.specifications import Tree

Route = tuple[Any, ...]


def smaller(tree: Tree, interesting: Callable[[Tree], bool], most: int = 2000) -> Tree:
    """A specification from which no single part can go; `most` are tried."""
    tree, tries = copy.deepcopy(tree), 0
    again = True
    while again:
        again = False
        for route in sorted(_routes(tree), key=len):
            candidate = _without(tree, route)
            if candidate is None or tries >= most:
                continue
            tries += 1
            if interesting(candidate):
                tree, again = candidate, True
    return tree


def _routes(part: Any, route: Route = ()) -> Iterator[Route]:
    """Ways to the parts of a tree, last items of lists first; a row of a table is one part."""
    if isinstance(part, dict):
        for key in reversed(list(part)):
            yield (*route, key)
            yield from _routes(part[key], (*route, key))
    elif isinstance(part, list):
        yield from ((*route, index) for index in reversed(range(len(part))))


def _without(tree: Tree, route: Route) -> Tree | None:
    """The tree without a part; None if it is gone already."""
    made = copy.deepcopy(tree)
    part: Any = made
    for step in route[:-1]:
        try:
            part = part[step]
        except (KeyError, IndexError, TypeError):
            return None
    try:
        del part[route[-1]]
    except (KeyError, IndexError, TypeError):
        return None
    return made
