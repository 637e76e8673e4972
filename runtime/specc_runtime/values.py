"""Names for the values that cross buffers; SI units, frames given where a value is used."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

Vector: TypeAlias = npt.NDArray[np.float64]
"""Shape (n,)."""

Spatial: TypeAlias = npt.NDArray[np.float64]
"""Shape (6,): three linear components along the axes of a frame, then three about them."""

Pose: TypeAlias = npt.NDArray[np.float64]
"""Shape (4, 4): homogeneous transform X_AB, pose of frame B in frame A."""

Rgb: TypeAlias = npt.NDArray[np.uint8]
"""Shape (h, w, 3)."""

Depth: TypeAlias = npt.NDArray[np.float32]
"""Shape (h, w): metres along the optical axis, 0 where there is no reading."""
