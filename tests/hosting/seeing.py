"""A camera whose images are full of one number, and operators that look whether they stay so."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

SIZE = (64, 128, 3)
LOOKS = 20
NOTE = "SPECC_TEST_SEEING"
"""Names a file that shows that an image was seen."""


class Camera:
    """Counts images, modulo 251; each is a new one."""

    def reset(self, seed: int) -> None:
        self.number = 0

    def sample(self, name: str) -> Any:
        return np.full(SIZE, self.number, np.uint8)

    def actuate(self, name: str, value: Any) -> None: ...

    def advance(self, duration_s: float) -> None:
        self.number = (self.number + 1) % 251

    def close(self) -> None: ...


def black() -> Any:
    """Before the first image."""
    return np.zeros(SIZE, np.uint8)


def look(image: Any, before: Any) -> int:
    """What both are full of; raises ValueError for one that changes meanwhile."""
    found = int(image[0, 0, 0]), int(before[0, 0, 0])
    for _ in range(LOOKS):
        if not ((image == found[0]).all() and (before == found[1]).all()):
            raise ValueError("an image has changed")
    if image.flags.writeable:
        raise ValueError("an image can be changed")
    if note := os.environ.get(NOTE):
        Path(note).touch()
    return 1000 * found[0] + found[1]
