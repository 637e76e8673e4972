"""Commands that are killed leave nothing half-made: each file as it was, or as it was to be.

What SIGKILL leaves stands aside, and the next command removes it.
"""

from __future__ import annotations

import fcntl
import json
import os
import pty
import random
import shutil
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from specc_runtime.recording.reading import RecordFile

from specc.atomic_files import PREFIX
from specc.tools.fmt import format_text
from tests import seeds
from tests.cli.robots import SERVOS, arm
from tests.cli.test_interruption import GOOD

ROOT = Path(__file__).parents[2]
GATE = ROOT / "specs/conveyor_gate.yaml"
SIGNS = (signal.SIGHUP, signal.SIGTERM, signal.SIGKILL)
COUNT = 100

Tree = dict[str, bytes]
"""The files of a folder; folders end with a slash."""


def tree(folder: Path) -> Tree:
    """What is in a folder, but not aside; a folder aside is not entered."""
    found: Tree = {}
    for path in folder.rglob("*"):
        name = path.relative_to(folder).as_posix()
        if PREFIX not in name and "__pycache__" not in name:
            found[name if path.is_file() else f"{name}/"] = (
                path.read_bytes() if path.is_file() else b""
            )
    return found


def asides(folder: Path) -> list[str]:
    return [path.name for path in folder.rglob(f"{PREFIX}*")]


# What a command starts from, and what is half-made of what it writes.


def of_model(folder: Path) -> None:
    """The model is outside of the project, so that it is copied."""
    (folder / "models").mkdir()
    (folder / "models/robot.xml").write_text(arm(SERVOS))


def of_odd_files(folder: Path) -> None:
    for number in range(40):
        (folder / f"{number:02}.yaml").write_text(GOOD.replace("specc: 1", "specc:   1", 1))


def of_gate(folder: Path) -> None:
    shutil.copy(GATE, folder / "gate.yaml")
    (folder / "plants").mkdir()
    shutil.copy(ROOT / "specs/plants/conveyor_gate.xml", folder / "plants")


def of_gate_built(folder: Path) -> None:
    """What was built before gives way to something else."""
    of_gate(folder)
    (old := folder / "generated/conveyor_gate").mkdir(parents=True)
    (old / ".specc-output").write_text("")
    for number in range(20):
        (old / f"old_{number}.py").write_text("old")


def all_or_nothing(before: Tree, now: Tree, after: Tree) -> bool:
    """Empty folders are nothing."""
    return without_empty(now) in (without_empty(before), without_empty(after))


def without_empty(files: Tree) -> Tree:
    return {name: text for name, text in files.items() if not name.endswith("/")}


def each_file(before: Tree, now: Tree, after: Tree) -> bool:
    texts = {text.decode() for text in before.values()}
    known = {t.encode() for text in texts for t in (text, format_text(text))}
    return now.keys() == before.keys() and set(now.values()) <= known


def whole_recordings(before: Tree, now: Tree, after: Tree) -> bool:
    new = {name: text for name, text in now.items() if name not in before}
    recordings = without_empty(new)
    made_for_nothing = "traces/" in new and not recordings
    is_known = new.keys() <= after.keys() and not made_for_nothing
    return is_known and all(map(is_whole, recordings.values()))


def whole_run(before: Tree, now: Tree, after: Tree) -> bool:
    """A run that has begun ends with a report, and closes its recording."""
    report = now.get("report.json")
    ended = "completed" if report is None else json.loads(report)["ended"]
    recording = now.get("run.mcap")
    return ended in ("completed", "interrupted") and (recording is None or is_whole(recording))


def whole_sweep(before: Tree, now: Tree, after: Tree) -> bool:
    """Rows that are whole, and none of what runs worked with."""
    if any("/.work/" in name for name in now):
        return False
    log, about = now.get("out/runs.jsonl", b""), now.get("out/sweep.json", b"{}")
    lines = log.decode().split("\n")
    return all(map(json.loads, lines[:-1])) and not lines[-1] and json.loads(about) is not None


def is_whole(recording: bytes) -> bool:
    with TemporaryDirectory() as folder:
        path = Path(folder, "a.mcap")
        path.write_bytes(recording)
        reading = RecordFile(path)
        return any(True for _ in reading) and not reading.cut and not reading.damaged


@dataclass(frozen=True)
class Command:
    arguments: tuple[str, ...]
    prepare: Callable[[Path], None]
    is_well: Callable[[Tree, Tree, Tree], bool]
    """Whether a folder is, given what was there before, is now, and would be in the end."""


RUN = ("gate.yaml", "--duration", "4")
COMMANDS = {
    "init": Command(
        ("init", "project/cell", "--model", "models/robot.xml"), of_model, all_or_nothing
    ),
    "fmt": Command(("fmt", "."), of_odd_files, each_file),
    "build": Command(("build", "gate.yaml"), of_gate_built, all_or_nothing),
    "explore": Command(("explore", "gate.yaml", "--traces", "traces"), of_gate, whole_recordings),
    "run": Command(
        ("run", *RUN, "--record", "run.mcap", "--report", "report.json"), of_gate, whole_run
    ),
    "sweep": Command(
        ("sweep", *RUN, "--seeds", "0:3", "--workers", "2", "--out", "out"), of_gate, whole_sweep
    ),
}


def begun(command: Command, folder: Path) -> subprocess.Popen[str]:
    """The command in a folder, with a folder for temporary files beside it."""
    (temporary := folder.with_name("temporary")).mkdir(exist_ok=True)
    return subprocess.Popen(
        [sys.executable, "-m", "specc", *command.arguments],
        cwd=folder,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={
            **os.environ,
            "TMPDIR": str(temporary),
            "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "runtime")]),
        },
    )


@cache
def undisturbed(name: str) -> tuple[float, Tree]:
    """How long a command takes, and what it makes."""
    with TemporaryDirectory() as scratch:
        (folder := Path(scratch, "folder")).mkdir()
        COMMANDS[name].prepare(folder)
        begin_s = time.monotonic()
        process = begun(COMMANDS[name], folder)
        _, said = process.communicate()
        assert process.returncode == 0, said
        return time.monotonic() - begin_s, tree(folder)


def cases(count: int) -> list[tuple[str, signal.Signals]]:
    return [(list(COMMANDS)[i % 6], SIGNS[i // 6 % 3]) for i in range(count)]


MARKS = {0: pytest.mark.long, 8: pytest.mark.long, 13: ()}
"""Of the cases that are not for campaigns only."""


@pytest.mark.no_replay("cut by the test")
@pytest.mark.parametrize(
    ("number", "name", "sign"),
    [
        pytest.param(number, *case, marks=MARKS.get(number, seeds.SOAK))
        for number, case in enumerate(cases(COUNT))
    ],
)
def test_a_killed_command_leaves_nothing_half_made(
    number: int, name: str, sign: signal.Signals, tmp_path: Path
) -> None:
    command = COMMANDS[name]
    duration_s, after = undisturbed(name)
    delay_s = random.Random(seeds.FIRST + number).uniform(0.05, 1.1) * duration_s
    (folder := tmp_path / "folder").mkdir()
    command.prepare(folder)
    before = tree(folder)
    process = begun(command, folder)
    time.sleep(delay_s)
    process.send_signal(sign)
    _, said = process.communicate(timeout=60)
    ending = f"{name}, {sign.name} after {delay_s:.3f} s: {process.returncode}\n{said}"
    if sign == signal.SIGKILL:
        process = begun(command, folder)
        _, said = process.communicate(timeout=60)
        ending += f"again: {process.returncode}\n{said}"
        # `init` has nothing to do where all was there already.
        assert process.returncode == 0 or "exist already" in said, ending
    else:
        # Before the command has been loaded a signal ends Python itself.
        assert process.returncode in (0, 128 + sign, -sign), ending
        assert "Traceback" not in said, ending
    assert asides(tmp_path) == [], ending
    assert list((tmp_path / "temporary").iterdir()) == [], ending
    now = tree(folder)
    assert command.is_well(before, now, after), f"{ending}{sorted(now)}"
    if sign == signal.SIGKILL:
        assert sorted(without_empty(now)) == sorted(without_empty(after)), ending


@pytest.mark.long
@pytest.mark.no_replay("cut by the test")
@pytest.mark.parametrize("name", seeds.short(["run", "sweep"], 0))
def test_a_terminal_that_closes_ends_a_command_in_order(name: str, tmp_path: Path) -> None:
    """What would be told cannot be written any more; files are."""
    ours, theirs = pty.openpty()
    command = COMMANDS[name]
    command.prepare(tmp_path)
    endless = [word if word != "4" else "100000" for word in command.arguments]
    pid = os.fork()
    if not pid:
        os.setsid()
        fcntl.ioctl(theirs, termios.TIOCSCTTY, 0)
        for stream in range(3):
            os.dup2(theirs, stream)
        os.closerange(3, 1024)
        os.chdir(tmp_path)
        os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), str(ROOT / "runtime")])
        os.execv(sys.executable, [sys.executable, "-m", "specc", *endless])
    os.close(theirs)
    said = b""
    while b"1 cycles" not in said and b"at once" not in said:
        said += os.read(ours, 65536)
    os.close(ours)
    _, status = os.waitpid(pid, 0)
    assert os.waitstatus_to_exitcode(status) == 128 + signal.SIGHUP
    assert asides(tmp_path) == []
    now = tree(tmp_path)
    assert command.is_well({}, now, {})
    assert ("report.json" in now) == (name == "run")
