"""What a recording has in memory does not grow with its length."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from mcap.reader import make_reader
from specc_runtime.recording import container as module
from specc_runtime.recording import steps
from specc_runtime.recording.cells import Shelf
from specc_runtime.recording.container import Container
from specc_runtime.recording.snapshots import Snapshots

CHANNELS, FEW, MANY = 8, 300, 1500


def write(container: Container, begin: int, end: int) -> None:
    for number in range(begin, end):
        container.chunk([(c + 1, number, number, b"{}") for c in range(CHANNELS)])


@pytest.mark.long
@pytest.mark.no_replay("of no run")
def test_the_index_of_chunks_is_in_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_INDEX_BYTES", 1 << 14)
    with (tmp_path / "a.mcap").open("wb") as file:
        container = Container(file, "test", tmp_path)
        schema = container.schema("s", b"{}")
        for number in range(CHANNELS):
            container.channel(f"/{number}", schema)
        write(container, 0, FEW)
        tracemalloc.start()
        write(container, FEW, MANY)
        grown_bytes, _ = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        container.finish()
    assert grown_bytes < 40 * (MANY - FEW), "an entry of the index has 200 bytes"
    assert [path.name for path in tmp_path.iterdir()] == ["a.mcap"]
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count == MANY
        assert summary.statistics.message_end_time == MANY - 1
        assert [m.log_time for *_, m in reader.iter_messages(topics=["/3"])] == [*range(MANY)]


@pytest.mark.parametrize("shelf", [Shelf, Snapshots])
def test_values_stored_aside_are_forgotten(shelf: type[Shelf]) -> None:
    """One that comes again later is written again."""
    kept, written = shelf.__new__(shelf), dict[str, float]()
    kept._time_s = 0.0
    for number in range(5000):
        assert kept._is_new(str(number), written)
    assert len(written) <= 2048
    assert not kept._is_new("4999", written) and kept._is_new("0", written)


def test_texts_of_passages_are_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    """Inputs are fresh in more combinations than can be kept."""
    monkeypatch.setattr(steps, "passage_of", lambda *_: {})
    layout: Any = SimpleNamespace(ends={})
    texts = steps._Passages((), layout, [f"x{i}" for i in range(20)])
    for number in range(10000):
        fresh = tuple(bool(number >> bit & 1) for bit in range(20))
        assert texts["", -1, "", fresh].count(b"true") == sum(fresh)
    assert len(texts) <= 4096
