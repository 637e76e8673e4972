"""Ways through the transition table of a machine."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Iterator

from specc.model.fsm import Transition

MOST_PATHS = 6
"""Ways to a state that are tried, and ways through every other one."""

Path = tuple[Transition, ...]


def paths(rows: Iterable[Transition], start: str, end: str) -> Iterator[Path]:
    """Ways from a state to another one, the shortest first, no state twice."""
    leaving: dict[str, list[Transition]] = {}
    for row in rows:
        leaving.setdefault(row.source, []).append(row)
    open_: deque[Path] = deque([()])
    visits: Counter[str] = Counter()
    while open_:
        path = open_.popleft()
        here = path[-1].target if path else start
        visits[here] += 1
        if visits[here] > MOST_PATHS:
            continue
        if here == end:
            yield path
            continue
        been = {start, *(row.target for row in path)}
        open_ += [(*path, row) for row in leaving.get(here, ()) if row.target not in been]
