"""However a run ends, its report is complete, its exit code as documented, its devices safe."""

from __future__ import annotations

import json
import os
import re
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.interruption import Interruption
from specc_runtime.plants.errors import PlantError

from tests.runtime.hinge import SPEC, hinge, run
from tests.seeds import short

ROOT = Path(__file__).parents[2]
ENDLESS = ["--duration", "10000"]
OLD = '{"spec": "old"}'
SLOW = "def drive(e):\n    time.sleep(0.005)\n    return 0.1 * e"
HANGS = "def drive(e):\n    while True:\n        pass"
NAPS = "def drive(e):\n    while True:\n        time.sleep(0.001)"
IN_C = "def drive(e):\n    time.sleep(1000)\n    return 0.0"
SWALLOWS = """def drive(e):
    while True:
        try:
            time.sleep(0.01)
        except:
            pass"""
HOLDS = "def drive(e):\n    return float(sum(range(10**12)))"
# The limits of the watchdog and of an interruption, made short.
SHORT = (
    "import sys\n"
    "from specc_runtime import interruption, watchdog\n"
    "watchdog.Watchdog.__init__.__defaults__ = (0.5,)\n"
    "interruption.GRACE_S = 0.5\n"
    "interruption.SAFE_S = 0.5\n"
    "from specc_runtime.main import main\n"
    "sys.exit(main())\n"
)


@contextmanager
def begun(
    package: Path,
    *arguments: str,
    start: str = SHORT,
    command: Sequence[str] = (),
    **options: Any,
) -> Iterator[subprocess.Popen[str]]:
    """A run of the package in a process of its own, which does not outlive the test.

    `command` is what stands before the options, by default that of `python -m specc_runtime`.
    """
    folder = package.parent
    path = os.pathsep.join((str(folder), str(ROOT / "runtime"), str(ROOT)))
    common = [*(command or (str(package), "--base", str(folder))), "--report", f"{folder}/r.json"]
    with subprocess.Popen(
        [sys.executable, "-c", start, *common, "--renderer", "raycast", *arguments],
        env={**os.environ, "PYTHONPATH": path},
        cwd=folder,
        text=True,
        **{"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options},
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def report(package: Path) -> dict[str, Any]:
    return dict(json.loads((package.parent / "r.json").read_text()))


def until(process: subprocess.Popen[str], text: str) -> None:
    """Wait for a line on standard error."""
    assert process.stderr is not None
    while text not in (line := process.stderr.readline()):
        assert line


@pytest.mark.parametrize("number", short([signal.SIGINT, signal.SIGTERM], 1))
def test_a_signal_ends_a_run(tmp_path: Path, number: signal.Signals) -> None:
    package = hinge(tmp_path, drive=SLOW)
    with begun(package, *ENDLESS) as process:
        until(process, "arm.j")
        process.send_signal(number)
        process.communicate(timeout=60)
    assert process.returncode == 128 + number
    data = report(package)
    assert (data["ended"], data["interrupted"], data["faults"]) == ("interrupted", True, [])
    assert data["last_outputs"]["arm.E.j.tau"]["by"] == "safe"


DEAF = (
    "import ctypes\n"
    "from specc_runtime import application\n"
    "def _plant(*_):\n"
    "    print('loading', file=sys.stderr, flush=True)\n"
    "    lock, library = ctypes.create_string_buffer(256), ctypes.CDLL(None)\n"
    "    library.pthread_mutex_lock(lock)\n"
    "    library.pthread_mutex_lock(lock)\n"
    "application.made_plant = _plant\n"
)
"""Loading a model never comes back from C, as with one that has absurdly many parts."""


@pytest.mark.parametrize(
    ("number", "is_early"), short(product([signal.SIGINT, signal.SIGTERM], [False, True]), 0)
)
def test_a_signal_ends_a_run_whose_model_does_not_load(
    tmp_path: Path, number: signal.Signals, is_early: bool
) -> None:
    """Whether it comes while the model loads or, `is_early`, is handled just before."""
    early = f"def _plant(*_):\n    import signal\n    signal.raise_signal({number:d})\n"
    deaf = DEAF.replace("def _plant(*_):\n", early) if is_early else DEAF
    start = SHORT.replace("from specc_runtime.main", f"{deaf}from specc_runtime.main")
    package = hinge(tmp_path)
    with begun(package, start=start) as process:
        until(process, "loading")
        process.send_signal(number)
        process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert report(package)["interrupted"]


BEHIND = """def drive(e):
    if not globals().get("begun"):
        import os, subprocess, threading
        globals()["begun"] = True
        os.mkdir("else")
        os.chdir("else")
        threading.Thread(target=time.sleep, args=(1000,), name="mine").start()
        subprocess.Popen(["sleep", "1000"])
    return 0.1 * e"""


@pytest.mark.no_replay("its operator leaves things behind")
@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="the system tells of no children")
def test_what_operators_leave_behind_is_named_and_ended(tmp_path: Path) -> None:
    """The process ends, and its files are where they were asked for."""
    package = hinge(tmp_path, drive=BEHIND)
    arguments = ["--duration", "0.5", "--record", "r.mcap"]
    with begun(package, *arguments, command=("hinge", "--base", "."), start=LEAVING) as process:
        _, told = process.communicate(timeout=60)
    assert process.returncode == 0, told
    assert "the run has left the thread 'mine' behind" in told
    assert re.search(r"the run has left the process \d+ \(sleep\) behind", told)
    assert report(package)["ended"] == "completed"
    assert (tmp_path / "r.mcap").stat().st_size > 1000


LEAVING = "import runpy\nrunpy.run_module('specc_runtime', run_name='__main__')"


def test_an_operator_that_changes_the_limits_of_python_is_a_fault(tmp_path: Path) -> None:
    before = sys.getrecursionlimit()
    changes = "def drive(e):\n    import sys\n    sys.setrecursionlimit({})\n    return 0.1 * e"
    for limit in (200, 10**6):
        package = hinge(tmp_path, drive=changes.format(limit))
        (fault,) = run(package, "--duration", "1")["faults"]
        assert "operator drive has changed how deep Python may call" in fault["message"]
        assert sys.getrecursionlimit() == before


@pytest.mark.long
def test_signals_after_the_first_change_nothing(tmp_path: Path) -> None:
    slow = "def hold(q):\n    time.sleep(0.3)\n    return 3.0"
    package = hinge(tmp_path, drive=SLOW, hold=slow)
    with begun(package, *ENDLESS) as process:
        until(process, "arm.j")
        for number in (signal.SIGTERM, signal.SIGTERM, signal.SIGHUP):
            process.send_signal(number)
            time.sleep(0.05)
        process.communicate(timeout=60)
    assert process.returncode == 143
    assert report(package)["last_outputs"]["arm.E.j.tau"]["by"] == "safe"


def interrupted_twice(process: subprocess.Popen[str]) -> None:
    """Ends a run whose operator `drive` hangs."""
    until(process, "operator drive (hinge_parts:drive) in arm.j")
    process.send_signal(signal.SIGINT)
    time.sleep(0.2)  # two pending signals of one kind are one
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 130


@pytest.mark.long
def test_a_second_interrupt_waits_for_nothing(tmp_path: Path) -> None:
    package = hinge(tmp_path, drive=NAPS)
    patient = SHORT.replace("GRACE_S = 0.5", "GRACE_S = 1000.0")
    with begun(package, *ENDLESS, start=patient) as process:
        interrupted_twice(process)
    data = report(package)
    (fault,) = data["faults"]
    assert (fault["culprit"], data["interrupted"]) == ("operator drive (hinge_parts:drive)", True)
    assert fault["message"].startswith("KeyboardInterrupt")
    assert data["last_outputs"]["arm.E.j.tau"]["by"] == "safe"


PLANT = """
import sys
def say(text):
    print(text, file=sys.stderr, flush=True)
class Plant:
    def __init__(self):
        {init}
    def reset(self, seed):
        {reset}
    def sample(self, name):
        return 0.0
    def actuate(self, name, value):
        pass
    def advance(self, duration_s):
        pass
    def close(self):
        say("closing")
        {close}
        say("closed")
"""


def with_plant(folder: Path, **parts: str) -> Path:
    """A package whose plant is a class of its own."""
    given = {"init": "pass", "reset": "pass", "close": "pass"} | parts
    head, _, _ = SPEC.partition("plant:\n")
    plant = 'plant: {python: "hinge_parts:Plant", bind: {arm.E.j.tau: {}, arm.E.j.q: {}}}\n'
    return hinge(folder, head=PLANT.format(**given), spec=head + plant)


SLEEPS = "say('busy'); time.sleep({})"
SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.mark.parametrize(
    ("method", "number"), short(product(["init", "reset", "close"], SIGNALS), 4)
)
def test_a_signal_before_or_after_the_ticks_ends_a_run(
    tmp_path: Path, method: str, number: signal.Signals
) -> None:
    package = with_plant(tmp_path, **{method: SLEEPS.format(0.3)})
    with begun(package, "--duration", "0.1") as process:
        until(process, "busy")
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    data = report(package)
    assert (data["ended"], data["interrupted"], data["faults"]) == ("interrupted", True, [])
    assert err.count("closed") == 1
    assert bool(data["last_outputs"]) == (method != "init")


CATCHES = """say('busy')
        while True:
            try:
                time.sleep(0.01)
            except BaseException:
                pass"""


@pytest.mark.parametrize(
    ("method", "hangs"),
    short(product(["init", "reset", "close"], [SLEEPS.format(1000), CATCHES]), 0),
)
def test_a_plant_that_hangs_is_named_and_one_signal_is_enough(
    tmp_path: Path, method: str, hangs: str
) -> None:
    package = with_plant(tmp_path, **{method: hangs})
    name = "__init__" if method == "init" else method
    with begun(package, "--duration", "0.1") as process:
        until(process, "busy")
        until(process, f"no progress for 0.5 s: in {name} (hinge_parts.py:")
        process.send_signal(signal.SIGTERM)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 143
    data = report(package)
    assert data["interrupted"]
    assert ("closed" in err) == (method == "reset")
    if method == "close" or hangs != CATCHES:
        (fault,) = data["faults"]
        assert fault["fault"] == "PlantFailed" and "still computing 0.5 s after" in fault["message"]


@pytest.mark.long
def test_a_second_interrupt_of_specc_run_names_the_step(tmp_path: Path) -> None:
    """At 10 Hz the step is in a worker thread."""
    spec = SPEC.replace("rate: 100 Hz", "rate: 10 Hz").replace("rate: 50 Hz", "rate: 10 Hz")
    package = hinge(tmp_path, spec=spec, drive=NAPS)
    start = SHORT.replace("GRACE_S = 0.5", "GRACE_S = 1000.0").replace(
        "from specc_runtime.main import main", "from specc.cli.main import main"
    )
    with begun(package, *ENDLESS, start=start, command=["run", "hinge.yaml"]) as process:
        interrupted_twice(process)
    data = report(package)
    (fault,) = data["faults"]
    assert (fault["fault"], data["interrupted"]) == ("StepAbandoned", True)
    assert fault["culprit"] == "operator drive (hinge_parts:drive)"
    assert fault["message"].startswith("KeyboardInterrupt")


@pytest.mark.parametrize(
    "hold", short([each.replace("drive(e)", "hold(q)") for each in (NAPS, HANGS)], 0)
)
def test_a_safe_output_that_is_late_is_replaced(tmp_path: Path, hold: str) -> None:
    package = hinge(tmp_path, hold=hold)
    with begun(package, "--duration", "0.1") as process:
        process.communicate(timeout=60)
    last = report(package)["last_outputs"]["arm.E.j.tau"]
    assert (last["by"], last["value"]) == ("otherwise", "7.0")
    assert "safe: Abandoned: still computing 0.5 s after it began" in last["problem"]


@pytest.mark.parametrize(
    ("drive", "rate"),
    short(product([NAPS, IN_C, SWALLOWS, HANGS], ["100 Hz", "10 Hz"]), 3),
)
def test_an_operator_that_hangs_is_named_and_one_signal_is_enough(
    tmp_path: Path, drive: str, rate: str
) -> None:
    """At 10 Hz the step is in a worker thread."""
    spec = SPEC.replace("rate: 100 Hz", f"rate: {rate}").replace("rate: 50 Hz", "rate: 10 Hz")
    spec += "require: [{that: always(present(arm.E.j.tau)), because: of the test}]\n"
    package = hinge(tmp_path, spec=spec, drive=drive)
    with begun(package, *ENDLESS) as process:
        until(process, "operator drive (hinge_parts:drive) in arm.j")
        assert report(package)["ended"] == "running"
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert process.returncode == 130
    data = report(package)
    (fault,) = data["faults"]
    assert fault["fault"] == "StepAbandoned"
    assert fault["culprit"] == "operator drive (hinge_parts:drive)"
    assert fault["equations"] == [1]
    assert data["last_outputs"]["arm.E.j.tau"]["by"] == "safe"
    assert data["requirements"][0]["verdict"] != "met"


LEAVES = "raise SystemExit(0)"
SCENE = "    def __init__(self):\n        {}\n    def place(self, plant, rng):\n        pass"
PARTS_THAT_FAIL: list[tuple[dict[str, str], str]] = [
    ({"gain": f"def gain():\n    {LEAVES}"}, "StepFailed"),
    ({"drive": f"def drive(e):\n    {LEAVES}"}, "StepFailed"),
    ({"place": f"    def place(self, plant, rng):\n        {LEAVES}"}, "SceneFailed"),
    ({"place": SCENE.format(LEAVES)}, "SceneFailed"),
    ({"place": SCENE.format("1 / 0")}, "SceneFailed"),
    ({"init": f"    def __init__(self, plant):\n        {LEAVES}"}, "JudgeFailed"),
    ({"init": "    def __init__(self, plant):\n        1 / 0"}, "JudgeFailed"),
    ({"end_cycle": f"    def end_cycle(self):\n        {LEAVES}"}, "JudgeFailed"),
]


@pytest.mark.parametrize(("parts", "kind"), PARTS_THAT_FAIL)
def test_whatever_fails_leaves_one_fault_and_a_report(
    tmp_path: Path, parts: dict[str, str], kind: str
) -> None:
    data = run(hinge(tmp_path, **parts), "--cycles", "1")
    assert [fault["fault"] for fault in data["faults"]] == [kind]
    assert data["ended"] == "fault"


@pytest.mark.parametrize("method", ["reset", "close"])
def test_a_plant_that_fails_leaves_one_fault_and_a_report(
    tmp_path: Path, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from specc_runtime.plants.mujoco import MujocoPlant

    usual = getattr(MujocoPlant, method)
    made = []

    def fails(self: MujocoPlant, *arguments: int) -> None:
        made.append(usual(self, *arguments))
        if method == "close":
            raise SystemExit(0)
        if len(made) > 1:  # the first one is of the constructor
            raise PlantError("not at home")

    monkeypatch.setattr(MujocoPlant, method, fails)
    (tmp_path / "report.json").write_text(OLD)
    data = run(hinge(tmp_path), "--duration", "0.1")
    assert [fault["fault"] for fault in data["faults"]] == ["PlantFailed"]


EVIL = "\\x1b[31mred\\n::error::forged\\n##[error]too\\u202e"


@pytest.mark.parametrize("quiet", short([[], ["--quiet"]], 0))
def test_texts_of_strangers_steer_neither_a_terminal_nor_a_runner(
    tmp_path: Path, quiet: list[str]
) -> None:
    package = hinge(
        tmp_path,
        drive=f"def drive(e):\n    raise ValueError('{EVIL}')",
        end_cycle=f"    def end_cycle(self):\n        return {{'good': True, '{EVIL}': '{EVIL}'}}",
    )
    with begun(package, "--cycles", "1", *quiet) as process:
        out, err = process.communicate(timeout=60)
    for line in (out + err).split("\n"):
        assert not line.lstrip().startswith("::")
        assert "##[" not in line
        assert "\x1b" not in line and "\u202e" not in line
    assert "forged" in out + err


def test_a_judge_adds_nothing_to_a_fault(tmp_path: Path) -> None:
    fails = {"end_cycle": "    def end_cycle(self):\n        1 / 0"}
    data = run(hinge(tmp_path, drive="def drive(e):\n    1 / 0", **fails), "--cycles", "1")
    assert [fault["fault"] for fault in data["faults"]] == ["StepFailed"]


def test_what_a_judge_says_is_written_or_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    endless = "        x = {'good': True}\n        x['x'] = x\n        return x"
    package = hinge(tmp_path, end_cycle=f"    def end_cycle(self):\n{endless}")
    (tmp_path / "report.json").write_text(OLD)
    run(package, "--cycles", "1", "--duration", "20", code=2)
    assert "error: cannot write" in capsys.readouterr().err


def test_a_time_that_cuts_cycles_off_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package = hinge(tmp_path)
    run(package, "--cycles", "9", "--duration", "0.02")
    assert "not fulfilled: 0 of 9 cycles when 0.02 s were over" in capsys.readouterr().err
    run(package, "--cycles", "9", "--cycle-limit", "0.02")
    assert "not fulfilled: 1 of 9 cycles when one took 0.02 s" in capsys.readouterr().err


def test_a_limit_of_cycles_without_cycles_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    package = hinge(tmp_path)
    (tmp_path / "report.json").write_text(OLD)
    run(package, "--duration", "0.1", "--cycle-limit", "1", code=2)
    assert "--cycle-limit: the run does not count cycles; add --cycles" in capsys.readouterr().err


@pytest.mark.long
def test_what_holds_the_interpreter_is_named(tmp_path: Path) -> None:
    package = hinge(tmp_path, drive=HOLDS)
    with begun(package, *ENDLESS) as process:
        until(process, "in drive")  # the stack that faulthandler prints
        assert report(package)["ended"] == "running"
        process.kill()
        process.communicate(timeout=60)
    assert process.returncode == -signal.SIGKILL


@pytest.mark.long
def test_a_killed_run_leaves_a_report_and_a_film(tmp_path: Path) -> None:
    import cv2

    package = hinge(tmp_path, drive=SLOW)
    film = tmp_path / "run.mkv"
    with begun(package, *ENDLESS, "--video", str(film)) as process:
        deadline = time.monotonic() + 120
        while not film.exists() or film.stat().st_size < 80_000:
            assert time.monotonic() < deadline
            time.sleep(0.1)
        process.kill()
        process.communicate(timeout=60)
    assert report(package)["ended"] == "running"
    pictures = cv2.VideoCapture(str(film))
    count = 0
    while pictures.grab():
        count += 1
    assert count > 10


def _small_files() -> None:
    resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, 10_000))


@pytest.mark.parametrize("name", short(["run.mp4", "run.webp"], 1))
@pytest.mark.long
def test_a_film_for_which_there_is_no_room_is_told(tmp_path: Path, name: str) -> None:
    package = hinge(tmp_path)
    film = str(tmp_path / name)
    with begun(
        package, "--duration", "2", "--quiet", "--video", film, preexec_fn=_small_files
    ) as process:
        _, err = process.communicate(timeout=120)
    assert process.returncode == 2
    assert f"error: the film {film} " in err
    assert report(package)["ended"] == "completed"


def _closed_output() -> None:
    os.close(1)


@pytest.mark.long
@pytest.mark.parametrize("before", short([None, _closed_output], 0))
def test_an_output_that_takes_nothing(tmp_path: Path, before: Callable[[], None] | None) -> None:
    package = hinge(tmp_path)
    with (
        Path("/dev/full").open("w") as full,
        begun(package, "--duration", "0.1", stdout=full, preexec_fn=before) as process,
    ):
        _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "the output cannot be written" in err and "Traceback" not in err
    assert report(package)["ended"] == "completed"


@pytest.mark.long
def test_an_output_that_nobody_reads(tmp_path: Path) -> None:
    package = hinge(tmp_path)
    read, write = os.pipe()
    os.close(read)
    with begun(package, "--duration", "0.1", stdout=write) as process:
        os.close(write)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 141
    assert "Traceback" not in err
    assert report(package)["ended"] == "completed"


@pytest.mark.long
def test_a_report_for_which_there_is_no_room_is_told(tmp_path: Path) -> None:
    package = hinge(tmp_path)

    def none() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

    with begun(package, "--duration", "0.1", preexec_fn=none) as process:
        _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert "cannot write" in err and "Traceback" not in err


UNHEARD = """
import ctypes, operator, os, signal, time
from collections import deque
from functools import partial
from specc_runtime.interruption import Abandoned, Interruption
os_kill = ctypes.PyDLL(None).kill
calls = [partial(os_kill, os.getpid(), int(signal.SIGTERM)), partial(time.sleep, 1000)]
try:
    with Interruption():
        deque(map(operator.call, calls))  # without an instruction in between
except Abandoned as abandoned:
    print(abandoned)
"""


@pytest.mark.long
def test_a_signal_just_before_a_call_that_blocks_is_heard() -> None:
    done = subprocess.run(
        [sys.executable, "-c", UNHEARD], capture_output=True, text=True, timeout=60, check=True
    )
    assert done.stdout == "still computing 2 s after the run was interrupted\n"


class HeardLate(Interruption):
    """A signal comes as soon as somebody has looked whether one came."""

    @property
    def requested(self) -> bool:
        seen, self._asked = self._asked, True
        return seen

    @requested.setter
    def requested(self, value: bool) -> None:
        self._asked = value


def test_a_signal_while_the_time_that_is_left_is_set_is_not_lost() -> None:
    with HeardLate() as interruption:
        interruption.allow(always=False)
        assert signal.getitimer(signal.ITIMER_REAL)[0] > 0.0


PROGRAM = (
    "import sys\n"
    "from pathlib import Path\n"
    "from specc_runtime.main import program\n"
    "package = Path(sys.argv.pop(1))\n"
    "sys.exit(program('hinge', package, package.parent))\n"
)


def test_a_program_that_is_stopped_has_done_what_it_should(tmp_path: Path) -> None:
    package = hinge(tmp_path, drive=SLOW)
    with begun(package, start=PROGRAM, command=(str(package),)) as process:
        until(process, "arm.j")
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=60)
    assert process.returncode == 0
    assert report(package)["ended"] == "interrupted"
