"""Ctrl-C at any time: exit code 130, one line, and every file as it was or as it was to be."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import pytest

from specc.tools.fmt import format_text
from tests.seeds import every, short

GOOD = """specc: 1
system: alone
title: Counts
agents:
  counter:
    control:
      rate: 10 Hz
      y: {listener: {n: int}}
      memory: {k: {type: int, init: 0}}
      functions: {count: {k: k + 1, y.listener.n: k}}
      behaviours: {count: {functions: [count], terminal: never}}
      states: {S0: count}
      initial_state: S0
  listener:
    control:
      rate: 10 Hz
      x: {counter: {n: int}}
      memory: {last: {type: int, init: 0}}
      functions: {listen: {last: x.counter.n if present(x.counter.n) else last}}
      behaviours: {listen: {functions: [listen], terminal: never}}
      states: {S0: listen}
      initial_state: S0
"""
CLEAN = "1 file checked: 0 errors, 0 warnings\n"
WRONG = GOOD.replace("specc: 1", "specc: 1\nwrong: 1", 1)
LINE = "specc: interrupted\n"
# From the first import of the command on: what Python does before is not ours.
START = """
import os, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's background job ignores it
def told(event, args, open_=[True]):
    if open_ and event == "import" and args[0] == "specc.cli.main":
        open_.clear()
        os.write(1, b"up\\n")
sys.addaudithook(told)
from specc.cli import main
sys.exit(main())
"""
# One SIGINT at each instruction of `main` after the command is done, then of what `main` calls.
LATE = """
import itertools, os, signal, sys
from specc.cli import interruption, main
module = sys.modules["specc.cli.main"]
watched = {main.__code__, interruption.ignore_signals.__code__}
def command(arguments):
    global left
    left = at
    return 0
module._guarded = command
def trace(frame, event, argument):
    global left
    if frame.f_code not in watched:
        return None
    frame.f_trace_opcodes = True
    left -= 1
    if left == -1:
        os.kill(os.getpid(), signal.SIGINT)
    return trace
for at in itertools.count():
    left = -2
    interruption.is_finished = False
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.settrace(trace)
    code = main()
    sys.settrace(None)
    assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN
    print(code)
    if left >= 0:
        break
"""
HALF_MADE = """
import os, signal, sys
from specc.cli import main
class Half:
    def __init__(self):
        os.kill(os.getpid(), signal.SIGINT)
        self.made = True
    def __del__(self):
        self.made
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.modules["specc.cli.main"]._guarded = lambda arguments: Half() and 0
sys.exit(main())
"""
FEW_MS = [0, 2, 5, 10, 20, 35, 50, 80, 120, 180, 250, 350, 500]


def interrupted(arguments: list[str], where: Path, delay_ms: float) -> tuple[int, str, str]:
    """Exit code and outputs of the command after SIGINT to its whole group, as a terminal does."""
    with tempfile.TemporaryFile("w+") as err:  # a pipe would be full of what much was found
        process = subprocess.Popen(
            [sys.executable, "-c", START, *arguments],
            cwd=where,
            stdout=subprocess.PIPE,
            stderr=err,
            text=True,
            start_new_session=True,
        )
        assert process.stdout is not None
        assert process.stdout.readline() == "up\n"
        time.sleep(delay_ms / 1000)
        os.killpg(process.pid, signal.SIGINT)
        out, _ = process.communicate(timeout=30)
        err.seek(0)
        return process.returncode, out, err.read()


@pytest.mark.parametrize("delay_ms", short(FEW_MS, 6, 11))
def test_one_line_at_most(tmp_path: Path, delay_ms: float) -> None:
    (tmp_path / "a.yaml").write_text(GOOD)
    code, _, err = interrupted(["validate", "a.yaml"], tmp_path, delay_ms)
    assert (code, err) in ((130, LINE), (0, CLEAN), (130, CLEAN + LINE))


def test_an_interrupt_while_loading_is_one_line(tmp_path: Path) -> None:
    assert interrupted(["explain"], tmp_path, 0) == (130, "", LINE)


@pytest.mark.parametrize("sign", every(2, [signal.SIGTERM, signal.SIGHUP]))
@pytest.mark.parametrize("is_ignored", short([False, True], 1))
def test_other_signals_end_a_command_alike(
    tmp_path: Path, sign: signal.Signals, is_ignored: bool
) -> None:
    """A signal that is ignored from the beginning, as by `nohup`, stays ignored."""
    (tmp_path / "a.yaml").write_text(GOOD)
    code = (
        "import os, signal, sys\n"
        f"if {is_ignored}: signal.signal({int(sign)}, signal.SIG_IGN)\n"
        "from specc.cli import inspect, main\n"
        "kill = os.kill\n"
        f"signs = {int(sign)}, 15, 1\n"
        "inspect.find_targets = lambda _: [kill(os.getpid(), sign) for sign in signs]\n"
        "sys.exit(main())\n"
    )
    process = subprocess.run(
        [sys.executable, "-c", code, "fmt", "a.yaml"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    first = (signal.SIGHUP + signal.SIGTERM - sign) if is_ignored else sign
    assert (process.returncode, process.stderr) == (128 + first, LINE)


def test_of_what_was_half_made_nothing_is_said() -> None:
    done = subprocess.run(
        [sys.executable, "-c", HALF_MADE], capture_output=True, text=True, timeout=60, check=False
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINE)


def test_an_interrupt_after_the_work_is_done_changes_at_most_the_code() -> None:
    done = subprocess.run([sys.executable, "-c", LATE], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    codes = done.stdout.split()
    assert len(codes) > 30
    assert set(codes) == {"0", "130"}
    assert done.stderr == LINE * codes.count("130")


@pytest.mark.parametrize("delay_ms", short([60, 130, 200, 300, 450, 700], 3))
def test_formatted_files_stay_whole(tmp_path: Path, delay_ms: float) -> None:
    odd = GOOD.replace("specc: 1", "specc:    1", 1)
    new = format_text(odd)
    files = [tmp_path / f"{number:02}.yaml" for number in range(40)]
    for file in files:
        file.write_text(odd)
    code, _, err = interrupted(["fmt", "."], tmp_path, delay_ms)
    assert (code, err) == (130, LINE) or (code == 0 and "40 of 40" in err)
    assert sorted(tmp_path.iterdir()) == files
    texts = [file.read_text() for file in files]
    done = texts.count(new)
    assert texts == [new] * done + [odd] * (len(files) - done)


@pytest.mark.long
@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="nothing runs side by side")
def test_what_was_found_side_by_side_is_told(tmp_path: Path) -> None:
    count = 1000
    for number in range(count):
        (tmp_path / f"{number:03}.yaml").write_text(WRONG)
    # How fast files are checked differs; once in a while some are done and some are not.
    for delay_ms in range(200, 6000, 50):
        code, _, err = interrupted(["validate", "."], tmp_path, delay_ms)
        if code != 130:
            break
        assert err.endswith(LINE)
        assert "Traceback" not in err
        summary = re.search(r"^(\d+) files? checked: (\d+) errors?", err, re.MULTILINE)
        if not summary and "error[" in err:
            continue  # it came while the findings were told
        told = summary.groups() if summary else ("0", "0")
        assert told[0] == told[1] == str(err.count("error["))
        if 0 < int(told[0]) < count:
            return
    raise AssertionError("never were some files done and some not")


@pytest.mark.long
@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="nothing runs side by side")
@pytest.mark.parametrize("sign", short([signal.SIGKILL, signal.SIGTERM], 0))
def test_nothing_outlives_a_command_that_is_killed(tmp_path: Path, sign: signal.Signals) -> None:
    for number in range(600):
        (tmp_path / f"{number:04}.yaml").write_text(WRONG)
    command = [sys.executable, "-m", "specc", "validate", "."]
    killed = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE)
    children = Path(f"/proc/{killed.pid}/task/{killed.pid}/children")
    while killed.poll() is None and len(children.read_text().split()) < 2:
        time.sleep(0.01)
    killed.send_signal(sign)
    assert killed.wait(timeout=60) == (128 + sign if sign == signal.SIGTERM else -sign)
    # They hold its standard error, so this waits for their end.
    killed.communicate(timeout=60)
