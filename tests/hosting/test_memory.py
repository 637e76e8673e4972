"""Shared memory gives back what was written, or says that it cannot."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specc_runtime.hosting import memory as module
from specc_runtime.hosting.devices import DeviceError
from specc_runtime.hosting.memory import DEPTH, Memory, anonymous_file


@pytest.fixture
def ends() -> Iterator[tuple[Memory, Memory]]:
    file = anonymous_file()
    writer, reader = Memory(file, 3), Memory(os.dup(file), 3)
    yield writer, reader
    writer.close()
    reader.close()


WRITTEN = st.lists(st.tuples(st.integers(0, 2), st.binary(max_size=2000)), max_size=20)


@given(WRITTEN)
@settings(max_examples=30, deadline=None)
def test_the_newest_sample_of_each_element_is_read(written: list[tuple[int, bytes]]) -> None:
    file = anonymous_file()
    writer, reader = Memory(file, 3), Memory(os.dup(file), 3)
    newest: dict[int, tuple[int, bytes]] = {}
    for time_s, (index, data) in enumerate(written):
        writer.write(index, time_s, 1, data[:7], data[7:])
        newest[index] = time_s, data
        raw = reader.read(index)
        assert raw is not None and (raw.measured_s, raw.kind, raw.data) == (time_s, 1, data)
    for index in range(3):
        raw = reader.read(index)
        assert (raw is None) == (index not in newest)
        if raw is not None:
            assert (raw.measured_s, raw.data) == newest[index]
    writer.close()
    reader.close()


def test_a_sample_that_is_overwritten_while_it_is_copied_is_read_again(
    ends: tuple[Memory, Memory], monkeypatch: pytest.MonkeyPatch
) -> None:
    writer, reader = ends
    writer.write(0, 0.0, 0, b"old")

    def copied(data: memoryview) -> bytes:
        """Copy the first half, let the writer go round, copy the rest."""
        head = bytes(data[:1])
        if writer.number(0) < DEPTH:
            for _ in range(DEPTH):
                writer.write(0, 1.0, 0, b"NEW")
        return head + data[1:].tobytes()

    monkeypatch.setattr(module, "bytes", copied, raising=False)
    raw = reader.read(0)
    assert raw is not None and (raw.measured_s, raw.data) == (1.0, b"NEW")


def test_a_writer_that_died_on_the_way_leaves_the_sample_before(
    ends: tuple[Memory, Memory], monkeypatch: pytest.MonkeyPatch
) -> None:
    writer, reader = ends
    writer.write(0, 0.5, 0, b"whole")

    def killed(data: bytes, begin: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(writer, "_put", killed)
    with pytest.raises(KeyboardInterrupt):
        writer.write(0, 1.0, 0, b"other")
    raw = reader.read(0)
    assert raw is not None and raw.data == b"whole"


def test_a_value_that_is_too_large_is_refused(
    ends: tuple[Memory, Memory], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "LARGEST", 100)
    with pytest.raises(DeviceError, match="101 bytes"):
        ends[0].write(0, 0.0, 0, bytes(101))
    assert ends[1].read(0) is None


def test_the_beat_of_the_agent_is_heard(ends: tuple[Memory, Memory]) -> None:
    ends[1].beat_s = 12.5
    assert ends[0].beat_s == 12.5
