"""The index of a recording says of each moment what all messages until then say, read in a row."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.recording import index as indexes
from specc_runtime.recording.budget import Budget, Unusable
from specc_runtime.recording.index import Index
from specc_runtime.recording.messages import Shelved, beginning_of, step_of, steps_of
from specc_runtime.recording.moment import Seen, seen_at
from specc_runtime.recording.reading import RecordFile

from tests.recording.bombs import channel, chunk, message, recording, schema
from tests.recording.runs import CONVEYOR, specc
from tests.recording.test_damage import _damaged_at
from tests.seeds import short

KEPT = Path(__file__).with_name("conveyor_gate.mcap")
pytestmark = pytest.mark.no_replay("damaged")


def _reference(file: Path) -> dict[str, list[tuple[float, bytes]]]:
    """The steps of each subsystem, one after the other."""
    found: dict[str, list[tuple[float, bytes]]] = {}
    for topic, time_s, text in steps_of(RecordFile(file), Shelved(0), images=False):
        if topic != "/plant":
            found.setdefault(topic[1:], []).append((time_s, text))
    return found


def _expected(steps: list[tuple[float, bytes]], time_s: float) -> dict[str, Any] | None:
    """What is known at a time, folded from the first step on."""
    known: dict[str, Any] | None = None
    since_s = entered_s = memory = None
    row, stamp, known_from = "", -2, -1
    recent: list[tuple[float, float, int, str]] = []
    for at_s, text in steps:
        if at_s > time_s + 1e-6:
            break
        begun = beginning_of(text)
        if begun.first != stamp + 1:
            known_from, since_s, row, memory = begun.stamp, None, "", None
        entered_s, stamp = since_s, begun.stamp
        if begun.row != -1 or not begun.before:
            since_s, row = at_s, begun.transition
            if row and recent and recent[-1][3] == row:
                recent[-1] = (recent[-1][0], at_s, recent[-1][2] + 1, row)
            elif row:
                recent.append((at_s, at_s, 1, row))
        step = step_of(text)
        known = {"step": step, "memory": memory, "entered_s": entered_s, "since_s": since_s}
        known |= {"row": row, "known_from": known_from, "recent": recent[-5:]}
        memory = step.get("memory")
    return known


def _same(file: Path, moments: int) -> None:
    chance, index, steps = Random(file.stat().st_size), Index(file), _reference(file)
    assert {name for name, changes in index.machines.items() if changes.times_s} == set(steps)
    times = [chance.uniform(index.begin_s, index.end_s) for _ in range(moments)]
    edges = [chance.choice(chance.choice([*steps.values()]))[0] for _ in range(moments)]
    for time_s in (*times, *edges, index.begin_s, index.end_s):
        found = {one.name: one for one in seen_at(index, time_s)}
        for name, every in steps.items():
            expected = _expected(every, time_s)
            if expected is None:
                assert name not in found
                continue
            shown = {key: getattr(found[name], key) for key in expected}
            if expected["known_from"] > 0:  # snapshots may know more
                for key in ("memory", "entered_s", "since_s"):
                    shown[key] = shown[key] if expected[key] is not None else None
            assert shown == expected, (name, time_s)
            assert [found[name]] == seen_at(index, time_s, name)


def test_a_whole_file() -> None:
    _same(KEPT, 60)


@pytest.mark.parametrize("count", short([2, 8], 0))
def test_damaged_cut_and_recovered_files(count: int, tmp_path: Path) -> None:
    data, chance = KEPT.read_bytes(), Random(3)
    for number in range(count):
        flipped = bytearray(data)
        for _ in range(3):
            flipped[chance.randrange(len(data) // 3, len(data))] ^= 1 << chance.randrange(8)
        file = tmp_path / f"{number}.mcap"
        file.write_bytes(flipped if number % 2 else data[: chance.randrange(60_000, len(data))])
        _same(file, 15)
    _damaged_at(2.0, tmp_path / "chunk.mcap")
    assert Index(tmp_path / "chunk.mcap").reading.damaged > 0
    _same(tmp_path / "chunk.mcap", 30)
    assert specc("recover", tmp_path / "chunk.mcap", "--out", tmp_path / "new.mcap").returncode == 0
    _same(tmp_path / "new.mcap", 30)


@pytest.mark.long
def test_a_run_that_goes_on(tmp_path: Path) -> None:
    file = tmp_path / "on.mcap"
    done = specc("run", CONVEYOR, "--duration", 9, "--from", f"{KEPT}@5", "--record", file)
    assert file.exists(), done.stderr
    _same(file, 30)


def test_a_moment_unpacks_few_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """However long the file is: that with the moment, and those before and beside it."""
    index, read = Index(KEPT), []
    content_at = indexes.content_at

    def counted(file: Any, place: int, budget: Budget) -> bytes:
        read.append(place)
        return content_at(file, place, budget)

    monkeypatch.setattr(indexes, "content_at", counted)
    for number in range(60):
        before = len(read)
        assert len(seen_at(index, number / 10)) == len(index.machines)
        assert len(read) - before <= 3, number
    assert read and sorted(read) == sorted(set(read)), "each once while time goes on"


def test_spans_are_those_of_a_plot() -> None:
    index = Index(KEPT)
    lines = specc("plot", KEPT, "--csv").stdout.splitlines()[1:]
    names = index.names.texts
    found = [
        f"{begin_s:.9g},{end_s:.9g},{name},{names[state]}"
        for name, changes in index.machines.items()
        for begin_s, end_s, state in index.spans(changes)
        if len(set(changes.states)) > 1
    ]
    assert sorted(found) == sorted(lines)


def test_steps_that_go_back_in_time_are_refused(tmp_path: Path) -> None:
    text = (
        b'{"stamp":%d,"time":0.0,"before":"","state":"s","cause":"","row":-1,"transition":"",'
        b'"conditions":{},"x":{},"fresh":{}}'
    )
    opened = schema(1, "specc.Step.talker.c") + channel(1, "/talker.c", 1)
    steps = [message(1, text % number, 10**9 - number) for number in range(2)]
    (tmp_path / "back.mcap").write_bytes(recording(opened, chunk(*steps)))
    with pytest.raises(Unusable, match="the step before was later"):
        Index(tmp_path / "back.mcap")


def test_a_file_that_changes_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    file.write_bytes(KEPT.read_bytes())
    index = Index(file)
    with file.open("r+b") as opened:
        opened.write(bytes(file.stat().st_size))
    with pytest.raises(Unusable, match="has changed since it was opened"):
        seen_at(index, 3.0)


def test_messages_outside_chunks_are_found(tmp_path: Path) -> None:
    text = (
        b'{"stamp":%d,"time":%d.0,"before":"%s","state":"s","cause":"","row":-1,"transition":"",'
        b'"conditions":{},"x":{},"fresh":{}}'
    )
    opened = schema(1, "specc.Step.talker.c") + channel(1, "/talker.c", 1)
    alone = [message(1, text % (n, n, b"s" if n else b""), n * 10**9) for n in range(3)]
    (tmp_path / "alone.mcap").write_bytes(recording(opened, *alone))
    (seen,) = seen_at(Index(tmp_path / "alone.mcap"), 1.5)
    assert isinstance(seen, Seen) and (seen.step["stamp"], seen.since_s) == (1, 0.0)
