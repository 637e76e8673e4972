"""Operators and a plant that give whatever a test puts into `GIVEN`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt


class Token:
    """A value that only operators look into."""


@dataclass(frozen=True)
class Grip:
    """A record with a class of its own."""

    width: float
    X: npt.NDArray[np.float64]
    sides: tuple[str, ...]


def usual() -> dict[str, Any]:
    """Values that are what they are declared to be; no two calls share one."""
    return {
        "side": "PORT",
        "point": np.array([1.0, 2.0, 3.0]),
        "length": 0.5,
        "count": 3,
        "ready": True,
        "label": "box",
        "pose": np.eye(4),
        "force": np.zeros(6),
        "sides": ("PORT", "STARBOARD"),
        "lengths": (0.1, 0.2),
        "some": (1,),
        "maybe": None,
        "grip": Grip(0.1, np.eye(4), ("PORT", "PORT")),
        "token": Token(),
        "weight": 9.81,
        "colours": np.zeros((2, 3, 3), np.uint8),
        "a.E.m.q": np.array([0.1, 0.2]),
        "a.E.m.n": 7,
        "a.E.m.I": np.ones((2, 3), np.float32),
        "a.E.m.X": np.eye(4),
    }


GIVEN: dict[str, Any] = {}


def _operator(name: str) -> Any:
    return lambda: GIVEN[name]


side, point, length, count = map(_operator, ("side", "point", "length", "count"))
ready, label, pose, force = map(_operator, ("ready", "label", "pose", "force"))
sides, lengths, some, maybe = map(_operator, ("sides", "lengths", "some", "maybe"))
grip, token, weight, colours = map(_operator, ("grip", "token", "weight", "colours"))


class Plant:
    """Devices that report what is in `GIVEN`."""

    def reset(self, seed: int) -> None: ...
    def sample(self, name: str) -> Any:
        return GIVEN[name]

    def actuate(self, name: str, value: Any) -> None: ...
    def advance(self, duration_s: float) -> None: ...
    def close(self) -> None: ...
