"""Names of other formats as names of a specification."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable

from specc.expr import RESERVED

_LONGEST = 60
PEERS = frozenset(("c", "E", "R"))
"""What no agent can be called: these stand for parts of the agent itself (docs/language.md 6)."""


class Names:
    """Gives every foreign name a legal one that nothing else has."""

    def __init__(self, used: Iterable[str] = ()) -> None:
        self._given: dict[str, str] = {}
        self._used = {*RESERVED, *used}
        self._counts: dict[str, int] = {}

    def of(self, foreign: str) -> str:
        """The name for a foreign one, the same whenever it is asked."""
        if foreign not in self._given:
            self._given[foreign] = self.new(foreign)
        return self._given[foreign]

    def new(self, wish: str) -> str:
        """A legal name that was not given before, as close to `wish` as possible."""
        base = re.sub(r"\W+", "_", wish, flags=re.ASCII).strip("_")[:_LONGEST] or "unnamed"
        if base[0].isdigit() or keyword.iskeyword(base):
            base = f"n_{base}"
        name, count = base, self._counts.get(base, 2)
        while name in self._used:
            name, count = f"{base}_{count}", count + 1
        self._used.add(name)
        self._counts[base] = count
        return name

    @property
    def changed(self) -> dict[str, str]:
        """Foreign names that could not be kept, with what they became."""
        return {old: new for old, new in self._given.items() if old != new}
