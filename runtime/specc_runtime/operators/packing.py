"""Codecs: values that operators exchange as bytes, and back, bit for bit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import astuple, fields
from io import BytesIO
from struct import Struct, pack
from typing import Any, TypeVar

import numpy as np

from specc_runtime.operators.regulator import RegulatorState
from specc_runtime.operators.vision.camera import Intrinsics
from specc_runtime.operators.vision.values import (
    Cloud,
    FeatureCloud,
    Features,
    Matches,
    PoseHypothesis,
)

T = TypeVar("T")
_INTRINSICS = Struct("<4d")


def encode_arrays(value: Any) -> bytes:
    """The fields of a dataclass, arrays and numbers, each in NumPy's own format."""
    file = BytesIO()
    for part in fields(value):
        array = np.ascontiguousarray(getattr(value, part.name))
        np.lib.format.write_array(file, array, allow_pickle=False)
    return file.getvalue()


def _decoded(kind: Callable[..., T], count: int, data: bytes) -> T:
    """What `kind` makes of so many arrays, read-only. Raises ValueError for other bytes."""
    file = BytesIO(data)
    arrays = [np.lib.format.read_array(file, allow_pickle=False) for _ in range(count)]
    if file.read(1):
        raise ValueError("more bytes than the value has")
    for array in arrays:
        array.setflags(write=False)
    return kind(*arrays)


def decode_cloud(data: bytes) -> Cloud:
    """See `encode_arrays`."""
    return _decoded(Cloud, 2, data)


def decode_feature_cloud(data: bytes) -> FeatureCloud:
    """See `encode_arrays`."""
    return _decoded(FeatureCloud, 3, data)


def decode_features(data: bytes) -> Features:
    """See `encode_arrays`."""
    return _decoded(Features, 2, data)


def decode_matches(data: bytes) -> Matches:
    """See `encode_arrays`."""
    return _decoded(Matches, 3, data)


def decode_hypothesis(data: bytes) -> PoseHypothesis:
    """See `encode_arrays`."""
    model, pose, support = _decoded(lambda *parts: parts, 3, data)
    return PoseHypothesis(int(model[0]), pose, int(support[0]))


def encode_regulator(state: RegulatorState) -> bytes:
    """Three numbers for each axis, 24 bytes."""
    numbers = (*state.error, *state.integral, *state.lagged)
    return pack(f"<{len(numbers)}d", *numbers)


def decode_regulator(data: bytes) -> RegulatorState:
    """See `encode_regulator`. Raises ValueError for other bytes."""
    return RegulatorState(*map(tuple, np.frombuffer(data, dtype="<f8").reshape(3, -1).tolist()))


def encode_intrinsics(camera: Intrinsics) -> bytes:
    """Its four numbers."""
    return _INTRINSICS.pack(*astuple(camera))


def decode_intrinsics(data: bytes) -> Intrinsics:
    """See `encode_intrinsics`. Raises struct.error for other bytes."""
    return Intrinsics(*_INTRINSICS.unpack(data))
