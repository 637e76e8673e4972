"""The digest of a run changes with every value in it, and only then."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from specc_runtime.records import RecordDigest, StepRecord, encode


@dataclass(frozen=True, slots=True)
class Item:
    X: Any
    label: str


@dataclass(frozen=True, slots=True)
class Other:
    X: Any
    label: str


RECORD = StepRecord("irp.m", 3, 0.006, "S1", 2, (("c_T_c", np.eye(4)),), (("O_s", None),))


def _digest(*records: StepRecord) -> str:
    digest = RecordDigest()
    for record in records:
        digest(record)
    return digest.hexdigest()


def _moved(pose: np.ndarray) -> np.ndarray:
    pose = pose.copy()
    pose[2, 3] = np.nextafter(0.0, 1.0)
    return pose


@pytest.mark.parametrize(
    "change",
    [
        {"subsystem": "irp.g"},
        {"stamp": 4},
        {"time_s": 0.0060000001},
        {"state": "S2"},
        {"transition": -1},
        {"sent": ()},
        {"sent": (("c_T_d", np.eye(4)),)},
        {"sent": (("c_T_c", _moved(np.eye(4))),)},
        {"sent": (("c_T_c", np.eye(4, dtype=np.float32)),)},
        {"sent": (("c_T_c", np.eye(4).reshape(16)),)},
        {"sent": (("c_T_c", np.eye(4)), ("O_s", None)), "watched": ()},
        {"watched": (("O_s", 0.0),)},
        {"watched": ()},
    ],
)
def test_digest_changes_with_every_field(change: dict[str, Any]) -> None:
    assert _digest(RECORD._replace(**change)) != _digest(RECORD)


def test_digest_depends_on_order_and_not_on_identity() -> None:
    twin = RECORD._replace(sent=(("c_T_c", np.eye(4)),))
    other = RECORD._replace(stamp=4)
    assert _digest(RECORD, other) == _digest(twin, other)
    assert _digest(RECORD, other) != _digest(other, RECORD)
    assert _digest(RECORD, RECORD) == _digest(RECORD, twin) != _digest(RECORD)


values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3).map(tuple) | st.builds(Item, inner, st.text()),
    max_leaves=6,
)


def _same(a: Any, b: Any) -> bool:
    if type(a) is not type(b):
        return False
    if isinstance(a, float):
        return a.hex() == b.hex()
    if isinstance(a, tuple):
        return len(a) == len(b) and all(map(_same, a, b))
    if isinstance(a, Item):
        return _same(a.X, b.X) and a.label == b.label
    return bool(a == b)


@given(values, values)
def test_encoding_is_injective(a: Any, b: Any) -> None:
    assert (encode(a) == encode(b)) == _same(a, b)


@pytest.mark.parametrize(
    ("a", "b"),
    [
        (1, 1.0),
        (1, True),
        ("1", 1),
        ((), None),
        (("a", "b"), ("ab",)),
        ((("a",), "b"), ("a", ("b",))),
        (0.0, -0.0),
        (Item(1.0, "a"), Other(1.0, "a")),
        (np.zeros(0), np.zeros((0, 3))),
        (np.zeros(2, "<U3"), np.zeros(3, "<U2")),
        (np.zeros(1000), np.zeros(1001)),
    ],
)
def test_encoding_separates_look_alikes(a: Any, b: Any) -> None:
    assert encode(a) != encode(b)


def test_encoding_sees_one_pixel_of_an_image() -> None:
    image = np.zeros((480, 640, 3), dtype=np.uint8)
    before = encode(image)
    image[479, 639, 2] = 1
    assert encode(image) != before
    assert len(before) < 100


def test_encoding_ignores_how_an_array_lies_in_memory() -> None:
    array = np.arange(12.0).reshape(3, 4)
    assert encode(np.asfortranarray(array)) == encode(array) == encode(array[::1])
    assert encode(np.float64(math.pi)) == encode(math.pi)


def test_values_without_an_encoding_are_refused() -> None:
    for value in (object(), [1], {"a": 1}, np.array([None])):
        with pytest.raises(TypeError, match="no stable encoding"):
            encode(value)
