"""The type of the numerical values that operators exchange, and small ones that nobody can change.

Whoever is given an array copies it, since others might change it. Not so if its numbers are bytes.
"""

from collections.abc import Callable
from functools import cache
from struct import Struct
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
_FLOAT64 = np.dtype(np.float64)
_LAST_ROW = (0.0, 0.0, 0.0, 1.0)


def vector(*numbers: float) -> Array:
    """A vector (n,) that nobody can change."""
    return np.frombuffer(_packing(len(numbers))(*numbers))


def transform(*numbers: float) -> Array:
    """A homogeneous matrix (4, 4) that nobody can change, of the 12 numbers in its upper rows."""
    return np.ndarray((4, 4), _FLOAT64, _packing(16)(*numbers, *_LAST_ROW))


@cache
def _packing(size: int) -> Callable[..., bytes]:
    return Struct(f"{size}d").pack
