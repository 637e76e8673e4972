"""Messages arrive whole and in order; only plain data do."""

from __future__ import annotations

import os
import pickle
import socket
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specc_runtime.hosting.client import plain_of
from specc_runtime.hosting.devices import Array, DeviceError
from specc_runtime.hosting.wire import HostChannel, NotPlain, array_of, packed, parts_of, plain

from tests.seeds import how_many

PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats(allow_nan=False)
    | st.text()
    | st.binary(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)


@given(st.lists(st.tuples(st.text(max_size=4), PLAIN), max_size=6))
@settings(max_examples=how_many(40), deadline=None)
def test_messages_arrive_whole_and_in_order(messages: list[tuple[str, Any]]) -> None:
    here, there = map(HostChannel, socket.socketpair())
    found: list[tuple[Any, ...]] = []
    for message in messages:
        assert here.send(*message)
        found += there.received()
    assert found == messages
    here.close()
    assert not list(there.received()) and there.is_over
    there.close()


def test_what_the_other_end_does_not_take_yet_is_kept() -> None:
    here, there = map(HostChannel, socket.socketpair())
    large = os.urandom(3_000_000)
    assert here.send("a", large) and here.send("b")
    assert not here.flush()
    found: list[tuple[Any, ...]] = []
    while len(found) < 2:
        found += there.received()
        here.flush()
    assert found == [("a", large), ("b",)]


def test_last_words_are_heard() -> None:
    here, there = map(HostChannel, socket.socketpair())
    here.send("closed", "why")
    here.close()
    there.send("into the void")
    assert list(there.received()) == [("closed", "why")] and there.is_over


class Evil:
    def __reduce__(self) -> Any:
        return os.system, ("true",)


@pytest.mark.parametrize("value", [Evil(), np.zeros(3), os.system])
def test_nothing_but_plain_data_is_taken(value: object) -> None:
    with pytest.raises(NotPlain):
        plain(pickle.dumps(value, 4))


@pytest.mark.parametrize("data", [b"", b"\x80", b"garbage", b"\x80\x04K\x01"])
def test_bytes_that_are_nothing_are_refused(data: bytes) -> None:
    with pytest.raises(NotPlain):
        plain(data)


@pytest.mark.parametrize("value", [lambda: 0, Array("<f8", (1,), "text")])
def test_what_cannot_be_sent_is_an_error_of_the_device(value: object) -> None:
    with pytest.raises(DeviceError):
        parts_of(value)


def test_an_array_stays_as_it_is() -> None:
    value = np.arange(6, dtype=np.uint16).reshape(2, 3)
    _, parts = parts_of(Array(value.dtype.str, value.shape, value))
    array = array_of(b"".join(parts))
    assert (np.frombuffer(array.data, array.dtype).reshape(array.shape) == value).all()


def test_values_of_numpy_become_plain() -> None:
    value = {"a": np.float64(1.5), "b": (np.eye(2), [np.int64(3)]), "c": None}
    assert plain_of(value) == {"a": 1.5, "b": [[[1, 0], [0, 1]], [3]], "c": None}
    image = plain_of(np.zeros((100, 100, 3), dtype=np.uint8))
    assert image[:2] == ("|u1", (100, 100, 3)) and plain(packed(image)) == image
