"""What a task brings along: a scene to begin with and a judge of each cycle.

Both see the plant as it really is. Nothing of them reaches an agent.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from specc_runtime.records import StepRecord


class Scene(Protocol):
    """Sets the plant up. Made without arguments."""

    def place(self, plant: Any, rng: np.random.Generator) -> None:
        """Called once, after the plant's reset; the seed of the run is in `rng`."""


class Judge(Protocol):
    """Watches a run and says what each cycle was worth. Made without arguments."""

    period_s: float
    """How often `tick` wants to be called, in simulated time; 0 for every base tick."""

    def observe(self, record: StepRecord, plant: Any) -> None:
        """Called with every record when it is committed."""

    def tick(self, plant: Any) -> None:
        """Called every `period_s`, after the plant has moved."""

    def cycle(self, simulated_s: float) -> dict[str, Any]:
        """Called at the end of a cycle, with its duration: what the report says of it.

        Holds `fulfilled: bool` at least. The next cycle begins here.
        """
