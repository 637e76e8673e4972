"""Shared memory gives back what was written, and what was read does not change."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from specc_runtime.blocks import Block
from specc_runtime.hosting import memory as module
from specc_runtime.hosting.devices import DeviceError
from specc_runtime.hosting.memory import MOST_PINNED, Memory, Raw

from tests.seeds import how_many

COUNT = 3


@contextmanager
def both() -> Iterator[tuple[Memory, Memory]]:
    """The memory of three elements, as the host and as the agent have it."""
    block = Block.of_bytes(Memory.size(COUNT))
    writer, reader = Memory(block, COUNT), Memory(Block(os.dup(block.descriptor)), COUNT)
    yield writer, reader
    writer.close()
    reader.close()


@pytest.fixture
def ends() -> Iterator[tuple[Memory, Memory]]:
    with both() as found:
        yield found


def read(memory: Memory, index: int = 0) -> Raw:
    raw = memory.read(index)
    assert raw is not None
    return raw


WRITTEN = st.lists(
    st.tuples(st.integers(0, COUNT - 1), st.binary(max_size=2000), st.integers(0, 7)), max_size=40
)


@given(WRITTEN)
@settings(max_examples=how_many(40), deadline=None)
def test_the_newest_is_read_and_what_is_kept_stays(written: list[tuple[int, bytes, int]]) -> None:
    """However many are kept for however long, up to the bound."""
    newest: dict[int, bytes] = {}
    kept: list[tuple[Raw, bytes]] = []
    with both() as (writer, reader):
        for time_s, (index, data, what) in enumerate(written):
            writer.write(index, time_s, 1, data[:7], data[7:])
            newest[index] = data
            raw = read(reader, index)
            assert (raw.measured_s, raw.extent.kind, raw.data) == (time_s, 1, data)
            assert reader.pinned(index) <= MOST_PINNED + 1
            if what % 2 and reader.pinned(index) <= MOST_PINNED:
                kept.append((raw, data))
            elif kept and what > 3:
                del kept[what % len(kept)]
            assert all(raw.data == data for raw, data in kept)
            del raw  # nobody holds a sample that is not kept while the next one is read
        for index in range(COUNT):
            assert reader.number(index) == sum(i == index for i, *_ in written)
            found = reader.read(index)
            assert (found and found.data) == newest.get(index)


def test_places_are_used_again(ends: tuple[Memory, Memory]) -> None:
    writer, reader = ends
    for number in range(100):
        writer.write(0, 0.0, 0, bytes(20_000))
        read(reader)
        if number == 3:
            size = writer.block.size
    assert writer.block.size == size


def test_a_sample_that_is_overwritten_before_it_is_pinned_is_not_read(
    ends: tuple[Memory, Memory], monkeypatch: pytest.MonkeyPatch
) -> None:
    writer, reader = ends
    for _ in range(2):
        writer.write(0, 0.0, 0, b"old")

    class Overtaking:
        """Lets the host go on between reading which sample is the newest and pinning it."""

        def __setitem__(self, at: int, word: int) -> None:
            if not word or writer.number(0) > 2:
                reader.block.bytes.cast("Q")[at] = word
                return
            for data in (b"NEW", b"NEWER"):
                writer.write(0, 1.0, 0, data)
            reader.block.bytes.cast("Q")[at] = word

        def __getitem__(self, at: int) -> int:
            return reader.block.bytes.cast("Q")[at]

    monkeypatch.setattr(reader.block, "words", Overtaking())
    raw = read(reader)
    assert (raw.number, raw.measured_s, raw.data) == (4, 1.0, b"NEWER")


def test_a_place_that_is_pinned_while_it_is_claimed_is_left_alone(
    ends: tuple[Memory, Memory], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The agent pins the newest sample but one just when the host claims its place."""
    writer, reader = ends
    writer.write(0, 0.0, 0, b"first")
    raw = read(reader)
    assert raw.data == b"first"
    writer.write(0, 0.0, 0, b"second")
    reader.block.words[raw._at + module._PIN] = 0

    def pin() -> None:
        reader.block.words[raw._at + module._PIN] = 1

    monkeypatch.setattr(writer, "_fence", pin)
    writer.write(0, 0.0, 0, b"third")
    assert raw.data == b"first" and read(reader).data == b"third"
    assert writer.block.words[raw._at + module._NUMBER] == raw.number


FLOOD = """\
import sys
from specc_runtime.blocks import Block
from specc_runtime.hosting.memory import Memory
memory, number = Memory(Block(int(sys.argv[1])), 1), 0
while not memory.beat_s:
    number += 1
    memory.write(0, float(number), 0, bytes([number % 251]) * 200_000)
"""


@pytest.mark.long
def test_what_is_read_does_not_change_under_a_host_that_writes_as_fast_as_it_can() -> None:
    memory = Memory(Block.of_bytes(Memory.size(1)), 1)
    file = memory.block.descriptor
    with subprocess.Popen([sys.executable, "-c", FLOOD, str(file)], pass_fds=(file,)) as writer:
        kept: list[Raw] = []
        numbers = set()
        while len(numbers) < 300:
            raw = memory.read(0)
            if raw is not None:
                numbers.add(raw.number)
                kept = [*kept[-3:], raw]
            for each in kept:
                assert bytes(each.data) == bytes([int(each.measured_s) % 251]) * 200_000
        memory.beat_s = 1.0
        assert writer.wait(20.0) == 0
    memory.close()


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
    assert read(reader).data == b"whole"


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
