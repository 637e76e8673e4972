"""A real ROS 2 for tests, where there is one: that of `make ros`, or of SPECC_ROS_PYTHON."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from threading import Timer

import pytest

HERE = Path(__file__).parent
collect_ignore = [] if find_spec("rosbags") else ["test_bags.py"]  # of an older environment
ROOT = HERE.parents[1]
NAMED = os.environ.get("SPECC_ROS_PYTHON", "")
PYTHONS = NAMED.split(os.pathsep) if NAMED else sorted(map(str, ROOT.glob("ros/*/bin/python")))
"""Interpreters that have rclpy, of as many distributions as there are."""
Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture(params=PYTHONS or [""], ids=lambda python: python and Path(python).parents[1].name)
def ros(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """The Python of a ROS, in a domain of this test's own."""
    if not request.param:
        pytest.skip("no ROS 2: make ros, or SPECC_ROS_PYTHON=/path/to/python")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % 100))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    return str(request.param)


@pytest.fixture
def arm(ros: str) -> Iterator[Start]:
    """Starts the simulated arm, or another program beside this file; ends what was started."""
    started: list[subprocess.Popen[str]] = []

    def start(*options: str, program: str = "arm.py") -> subprocess.Popen[str]:
        command = [ros, str(HERE / program), *options]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        started.append(process)
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        return process

    yield start
    for process in started:
        end(process)


def says(process: subprocess.Popen[str], wanted: str) -> bool:
    """Whether a process that was started prints this line; one that does not in time is ended."""
    return lines(process, wanted)[-1:] == [wanted]


def lines(process: subprocess.Popen[str], last: str, wait_s: float = 60.0) -> list[str]:
    """What a process that was started prints up to this line; one that is late with it is ended."""
    assert process.stdout is not None
    ending = Timer(wait_s, process.kill)
    ending.start()
    found: list[str] = []
    while found[-1:] != [last] and (line := process.stdout.readline()):
        found.append(line.rstrip("\n"))
    ending.cancel()
    return found


def end(process: subprocess.Popen[str]) -> str:
    """End a process that was started; returns what it has printed.

    An executor of rclpy with several threads rarely hangs while it shuts down. Such a process is
    aborted, and prints where its threads are.
    """
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    if process.stdout is None or process.stdout.closed:
        return ""
    try:
        return process.communicate(timeout=20)[0]
    except subprocess.TimeoutExpired:
        process.send_signal(signal.SIGABRT)
        return process.communicate(timeout=20)[0]


@pytest.fixture
def spec(ros: str, tmp_path: Path) -> Callable[..., Path]:
    """Writes the specification of the arm, or another one, with pairs of texts replaced."""

    def write(*pairs: tuple[str, str], name: str = "arm") -> Path:
        text = (HERE / f"{name}.yaml").read_text(encoding="utf-8")
        for old, new in (("ros2: {", f"ros2: {{python: {ros}, "), *pairs):
            assert old in text, old
            text = text.replace(old, new)
        (tmp_path / "grasping.py").write_bytes((HERE / "grasping.py").read_bytes())
        path = tmp_path / f"{name}.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write
