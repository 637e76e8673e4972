"""Files of a megabyte that stand for far more: 2 s and 300 MB open one, or it is refused."""

from __future__ import annotations

import os
import resource
import sys
from collections.abc import Callable, Iterator
from multiprocessing import get_context
from pathlib import Path
from time import process_time
from typing import Any

import pytest
from specc_runtime.recording import messages, replay, snapshots
from specc_runtime.recording.budget import Unusable
from specc_runtime.recording.reading import RecordFile

from specc.cli.main import main
from tests.recording.bombs import (
    MAGIC,
    MB,
    bombs,
    channel,
    chunk,
    message,
    metadata,
    recording,
    schema,
)
from tests.recording.test_foreign_code import TALK
from tests.seeds import short

pytestmark = pytest.mark.no_replay
COMMANDS = [
    ["replay", "bomb.mcap", "--spec", "talk.yaml"],
    ["recover", "bomb.mcap", "--out", "out.mcap"],
    ["why", "bomb.mcap@0.4", "--spec", "talk.yaml"],
    ["why", "bomb.mcap@0", "talker.c", "--spec", "talk.yaml"],
    ["coverage", "bomb.mcap"],
    ["plot", "bomb.mcap"],
    ["plot", "bomb.mcap", "talker.c", "--csv"],
    ["run", "talk.yaml", "--duration", "0.5", "--from", "bomb.mcap@0.4"],
]
MOST_LOOPS, MOST_MB = 6.0, 300.0
"""Of CPU, in loops that take 0.7 s, of which 3 are promised: a slower processor makes them slower
too, but the tests beside this one slow memory down more than loops; and of memory."""
TRIES = 3


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    Path("talk.yaml").write_text(TALK)
    yield


FAR_MORE: dict[str, Callable[[], list[bytes]]] = {
    "one message": lambda: [chunk(message(1, bytes(60 * MB)))],
    "nothing": lambda: [chunk(bytes(30 * MB))] * 100,
    "a list of lists": lambda: [chunk(message(1, b"[" + b"[]," * (2 * MB) + b"0]"))],
    "small messages": lambda: [chunk(message(1, b"{}") * 20_000)] * 30,
    "schemas": lambda: [chunk(schema(1, "s", b" " * 30 * MB), schema(2, "s", b" " * 20 * MB))],
    "names": lambda: [chunk(channel(1, "t" * 10 * MB, 1))] * 6,
}


@pytest.mark.parametrize("name", short(FAR_MORE, 1, 2, 5))
def test_what_unpacks_to_far_more_is_refused(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    opened = schema(1, "specc.Step.talker.c") + channel(1, "/talker.c", 1)
    Path("bomb.mcap").write_bytes(recording(opened, *FAR_MORE[name]()))
    assert main(["recover", "bomb.mcap", "--out", "out.mcap"]) == 2
    told = capsys.readouterr().err
    assert "bomb.mcap is not read: " in told and "far more than its size" in told
    assert not Path("out.mcap").exists()


def test_what_was_passed_over_stays_so() -> None:
    """A chunk that is not what it says is damaged."""
    for odd in (chunk(b"", claims=1 << 40), chunk(bytes(MB), claims=1)):
        Path("odd.mcap").write_bytes(recording(odd))
        reading = RecordFile(Path("odd.mcap"))
        assert [type(record).__name__ for record in reading] == ["Metadata", "Attachment"]
        assert reading.damaged == 1


def test_no_record_is_looked_for_behind_zeros() -> None:
    """Zeros have no kind of record, so that nothing tells where the next one starts."""
    Path("odd.mcap").write_bytes(MAGIC + bytes(9 * 1000) + recording()[len(MAGIC) :])
    reading = RecordFile(Path("odd.mcap"))
    assert list(reading) == []
    assert reading.damaged == 1


def test_a_damaged_kind_loses_its_record_only() -> None:
    """A kind that became zero too: the length still tells where the next record starts."""
    damaged, behind = b"\0" + metadata("damaged", {})[1:], metadata("behind", {})
    Path("odd.mcap").write_bytes(recording(damaged, behind))
    reading = RecordFile(Path("odd.mcap"))
    assert [type(record).__name__ for record in reading] == ["Metadata", "Attachment", "Metadata"]
    assert reading.damaged == 1


def test_the_budget_is_that_of_the_whole_file(monkeypatch: pytest.MonkeyPatch) -> None:
    """Passes share it: what is looked for in vain is not looked for again and again."""
    opened = schema(1, "specc.Snapshot") + channel(1, "/snapshot", 1)
    texts = [b'{"tick":%d,"time":%d.0,"a":[%b0]}' % (i, i, b"0," * 10_000) for i in range(100)]
    for name, work in (("_FREE", 30_000_000), ("_PER_BYTE", 200)):
        monkeypatch.setattr(f"specc_runtime.recording.budget.{name}", work)
    chunks = [chunk(*(message(1, text) for text in texts))] * 4
    Path("run.mcap").write_bytes(recording(opened, *chunks))
    budget = snapshots.Budget(Path("run.mcap"))
    with pytest.raises(Unusable, match="far more than its size"):
        for tick in range(1000):
            snapshots.snapshot_of(Path("run.mcap"), f"{tick}x", budget)
    assert messages.recorded(Path("run.mcap"))[0]["format"] == "1"
    assert replay.Shelved(most_bytes=10).put("a", b"0" * 11) is None


@pytest.mark.long
def test_opening_takes_little() -> None:
    """Each command in a process of its own, whose use of the machine is counted."""
    found = []
    for name, _ in bombs():
        assert _ended(_made, name) == 0
        for command in COMMANDS:
            used = [_used(command)]
            while not _is_little(*used[-1]) and len(used) < TRIES:
                used.append(_used(command))
            if not _is_little(*used[-1]):
                found.append((name, command[0], *used))
    assert not found


def _used(command: list[str]) -> tuple[int | None, float, float, int]:
    """The exit code, loops of CPU, megabytes of memory, and characters that are printed."""
    code = _ended(_measured, command)
    loops, memory_mb = map(float, Path("used").read_text().split() or ("inf", 0))
    return code, loops, memory_mb, Path("said").stat().st_size


def _is_little(code: int | None, loops: float, memory_mb: float, said: int) -> bool:
    is_quick = loops <= MOST_LOOPS and memory_mb <= MOST_MB
    return code in (0, 1, 2, 3) and is_quick and said <= 10_000


def _ended(do: Callable[[Any], None], argument: Any) -> int | None:
    """The exit code of a copy of a process that has imported the commands and has no threads."""
    context = get_context("forkserver")
    context.set_forkserver_preload(["specc.cli.main", __name__])
    child = context.Process(target=_in_folder, args=(Path.cwd(), do, argument))
    child.start()
    child.join()
    return child.exitcode


def _in_folder(folder: Path, do: Callable[[Any], None], argument: Any) -> None:
    os.chdir(folder)
    do(argument)


def _made(name: str) -> None:
    Path("bomb.mcap").write_bytes(dict(bombs())[name]())


def _measured(command: list[str]) -> None:
    """Writes CPU time in loops and memory in MB to `used`, and all that is printed to `said`."""
    Path("used").write_text("")
    resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
    loop_s = _loop_s()
    with Path("said").open("w", errors="replace") as said:
        sys.stdout = sys.stderr = said
        os.dup2(said.fileno(), 1)
        os.dup2(said.fileno(), 2)
        code = main(command)
    used = resource.getrusage(resource.RUSAGE_SELF)
    # What was measured has the loop in it, which is a tenth.
    loops = (used.ru_utime + used.ru_stime - loop_s / 10) / max(loop_s, _loop_s())
    Path("used").write_text(f"{loops} {used.ru_maxrss / 1024}")
    os._exit(code)


def _loop_s() -> float:
    """CPU time of a loop of ten million steps, of which a tenth is made."""
    begin, total = process_time(), 0
    for i in range(1_000_000):
        total += i * i
    return 10 * (process_time() - begin)
