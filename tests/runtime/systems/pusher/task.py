"""How far the cart got, as the simulation knows it."""

from __future__ import annotations

from typing import Any

import numpy as np


class Somewhere:
    def place(self, plant: Any, rng: np.random.Generator) -> None:
        plant.reset(int(rng.integers(1000)))


class Farthest:
    criterion = "far"

    def __init__(self, plant: Any) -> None:
        self.plant = plant
        self.begin()

    def begin(self) -> None:
        self.farthest_m = 0.0
        self.error_m = 0.0

    def observe(self) -> None:
        self.farthest_m = max(self.farthest_m, self.plant.truth.joint_position("rail"))

    def watch(self, name: str, value: float) -> None:
        assert name == "place"
        self.error_m = max(self.error_m, abs(value - self.plant.truth.joint_position("rail")))

    def end_cycle(self) -> dict[str, Any]:
        result = {
            "far": self.farthest_m > 0.45,
            "farthest_m": np.float64(self.farthest_m),
            "error_m": self.error_m,
        }
        self.begin()
        return result
