"""Codecs: values that operators exchange as bytes or arrays, and back, bit for bit."""

from __future__ import annotations

from dataclasses import astuple, fields
from struct import Struct, pack
from typing import Any

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

Arrays = tuple[Any, ...]
_INTRINSICS = Struct("<4d")


def encode_arrays(value: Any) -> Arrays:
    """The fields of a dataclass: arrays, numbers, the moves (m, 4, 4) of a cloud."""
    return tuple(_array(getattr(value, part.name)) for part in fields(value))


def _array(part: Any) -> Any:
    return np.array(part).reshape(-1, 4, 4) if type(part) is tuple else np.ascontiguousarray(part)


def decode_cloud(data: Arrays) -> Cloud:
    """See `encode_arrays`. Raises ValueError for other arrays."""
    points, colours, moves = data
    return Cloud(points, colours, tuple(moves))


def decode_feature_cloud(data: Arrays) -> FeatureCloud:
    """See `encode_arrays`. Raises ValueError for other arrays."""
    points, seen_from, descriptors, moves = data
    return FeatureCloud(points, seen_from, descriptors, tuple(moves))


def decode_features(data: Arrays) -> Features:
    """See `encode_arrays`. Raises TypeError for other arrays."""
    return Features(*data)


def decode_matches(data: Arrays) -> Matches:
    """See `encode_arrays`. Raises TypeError for other arrays."""
    return Matches(*data)


def decode_hypothesis(data: Arrays) -> PoseHypothesis:
    """See `encode_arrays`. Raises ValueError for other arrays."""
    model, pose, support = data
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
