"""Files of a megabyte that stand for far more: 2 s and 300 MB open one, or it is refused."""

from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from pathlib import Path

import pytest
from specc_runtime.recording import messages, replay, snapshots
from specc_runtime.recording.budget import Unusable
from specc_runtime.recording.reading import Reading

from specc.cli.main import main
from tests.recording.bombs import MB, bombs, channel, chunk, message, recording, schema
from tests.recording.test_foreign_code import TALK

pytestmark = pytest.mark.no_replay
COMMANDS = [
    ["replay", "bomb.mcap", "--spec", "talk.yaml"],
    ["recover", "bomb.mcap", "--out", "out.mcap"],
    ["run", "talk.yaml", "--duration", "0.5", "--from", "bomb.mcap@0.4"],
]
MOST_S, MOST_MB = 12.0, 300.0
"""Of CPU, six times what is promised, since processors and their loads differ; and of memory."""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    Path("talk.yaml").write_text(TALK)
    yield


def test_what_unpacks_to_far_more_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    opened = schema(1, "specc.Step.talker.c") + channel(1, "/talker.c", 1)
    for records in (
        [chunk(message(1, bytes(60 * MB)))],
        [chunk(bytes(30 * MB))] * 100,
        [chunk(message(1, b"[" + b"[]," * (2 * MB) + b"0]"))],
        [chunk(message(1, b"{}") * 20_000)] * 30,
        [chunk(schema(1, "s", b" " * 30 * MB), schema(2, "s", b" " * 20 * MB))],
        [chunk(channel(1, "t" * 10 * MB, 1))] * 6,
    ):
        Path("bomb.mcap").write_bytes(recording(opened, *records))
        assert main(["recover", "bomb.mcap", "--out", "out.mcap"]) == 2
        told = capsys.readouterr().err
        assert "bomb.mcap is not read: " in told and "far more than its size" in told
        assert not Path("out.mcap").exists()


def test_what_was_passed_over_stays_so() -> None:
    """A chunk that is not what it says is damaged."""
    for odd in (chunk(b"", claims=1 << 40), chunk(bytes(MB), claims=1)):
        Path("odd.mcap").write_bytes(recording(odd))
        reading = Reading(Path("odd.mcap"))
        assert [type(record).__name__ for record in reading] == ["Metadata", "Attachment"]
        assert reading.damaged == 1


def test_the_budget_is_that_of_the_whole_file() -> None:
    """Passes share it: what is looked for in vain is not looked for again and again."""
    opened = schema(1, "specc.Snapshot") + channel(1, "/snapshot", 1)
    texts = [b'{"tick":%d,"time":%d.0,"a":[%b0]}' % (i, i, b"0," * 10_000) for i in range(100)]
    chunks = [chunk(*(message(1, text) for text in texts))] * 20
    Path("run.mcap").write_bytes(recording(opened, *chunks))
    budget = snapshots.Budget(Path("run.mcap"))
    with pytest.raises(Unusable, match="far more than its size"):
        for tick in range(1000):
            snapshots.snapshot_of(Path("run.mcap"), f"{tick}x", budget)
    assert messages.recorded(Path("run.mcap"))[0]["format"] == "1"
    assert replay.Shelved(most_bytes=10).put("a", b"0" * 11) is None


@pytest.mark.long
def test_opening_takes_little() -> None:
    """Each command in a copy of this process, whose use of the machine is counted."""
    found = []
    for name, make in bombs():
        if (child := os.fork()) == 0:
            Path("bomb.mcap").write_bytes(make())
            os._exit(0)
        os.waitpid(child, 0)
        for command in COMMANDS:
            code, cpu_s, memory_mb, said = _measured(command)
            if code not in (0, 1, 2, 3) or cpu_s > MOST_S or memory_mb > MOST_MB or said > 10_000:
                found.append((name, command[0], code, cpu_s, memory_mb, said))
    assert not found


def _measured(command: list[str]) -> tuple[int, float, float, int]:
    """Exit code, CPU in s, memory in MB, and how much was said."""
    if (child := os.fork()) == 0:
        resource.setrlimit(resource.RLIMIT_CPU, (30, 30))
        said = os.open("said", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(said, 1)
        os.dup2(said, 2)
        with open(1, "w", errors="replace") as out, open(2, "w", errors="replace") as err:
            import sys

            sys.stdout, sys.stderr = out, err
            code = main(command)
        os._exit(code)
    _, status, used = os.wait4(child, 0)
    cpu_s = used.ru_utime + used.ru_stime
    return os.waitstatus_to_exitcode(status), cpu_s, used.ru_maxrss / 1024, os.stat("said").st_size
