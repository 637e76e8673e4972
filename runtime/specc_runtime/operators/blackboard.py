"""What stands on a blackboard."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Entry(NamedTuple):
    """A post: what is said, about which object, of whom, where, and how uncertain that is."""

    what: str
    about: int
    who: int
    at: NDArray[np.float64]
    """(2,) m, in the world."""
    sigma: float
    """Standard deviation of `at`, m."""
