"""What a task provides: a scene to begin with and a judge of each cycle.

Both see the plant as it really is. Nothing of them reaches an agent.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np


class Scene(Protocol):
    """Sets the plant up. Made without arguments."""

    def place(self, plant: Any, rng: np.random.Generator) -> None:
        """Called once, after the plant's reset; `rng` comes from the seed of the run."""


class Judge(Protocol):
    """Watches a run and says what each cycle was worth. Made with the plant, once the scene is set.

    `criterion` names the entry of a cycle's report that says whether the cycle was fulfilled.
    """

    criterion: str

    def observe(self) -> None:
        """Called after every base tick."""

    def watch(self, name: str, value: Any) -> None:
        """Called with the memory that the task names when it became visible; never with None."""

    def end_cycle(self) -> dict[str, Any]:
        """Called at the end of a cycle: what the report says of it. The next one begins."""
