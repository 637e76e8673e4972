"""`specc run --real-time` with a plant in Python: it runs in the device host."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.hosting.rig import until

pytestmark = pytest.mark.long

SPEC = """\
specc: 1
system: lift
constants: {hold: {is: "12[N*m]", title: carries the weight}}
agents:
  lift:
    real_effectors:
      drive:
        x: {tau: {type: "real[N*m]", safe: {is: "min(hold * h / 1[m], 20[N*m])", otherwise: hold}}}
        y: {h: "real[m]"}
    virtual_effectors:
      drive:
        rate: 100 Hz
        x: {c: {h_d: {type: "real[m]", init: 0}}, E: {h: "real[m]"}}
        y: {E: {tau: "real[N*m]"}}
        functions: {move: {y.E.tau: "hold + (x.c.h_d - x.E.h) * 50[N]"}}
        behaviours: {move: {functions: [move], terminal: never}}
        states: {S0: move}
        initial_state: S0
    control:
      rate: 20 Hz
      y: {drive: {h_d: "real[m]"}}
      functions: {go: {y.drive.h_d: "0.5[m]"}}
      behaviours: {go: {functions: [go], terminal: never}}
      states: {S0: go}
      initial_state: S0
plant:
  python: "driver:Lift"
  bind: {lift.E.drive.tau: {}, lift.E.drive.h: {}}
"""
DRIVER = """\
import os
from specc_runtime import PlantError, NO_SAMPLE, Deferred

class Lift:
    def reset(self, seed):
        self.h, self.note, self.samples = 0.25, open("log", "a", buffering=1), 0
        self.note.write(f"{os.getpid()}\\n")

    def sample(self, name):
        self.samples += 1
        if self.samples > 10:
            self.fail()
        return self.h

    def fail(self):
        pass

    def actuate(self, name, value):
        self.note.write(f"{value}\\n")

    def advance(self, duration_s):
        self.h += 0.0

    def close(self):
        self.note.write("close\\n")
"""
TAU = "lift.E.drive.tau"


class Folder:
    """A folder with the specification and its driver, in which `specc run` is called."""

    def __init__(self, path: Path) -> None:
        self.path = path
        (path / "lift.yaml").write_text(SPEC)
        (path / "driver.py").write_text(DRIVER)

    def edit(self, name: str, old: str, new: str) -> None:
        text = (self.path / name).read_text()
        assert old in text
        (self.path / name).write_text(text.replace(old, new))

    def start(self, *options: str) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "specc", "run", "lift.yaml", "--report", "r.json"]
        return subprocess.Popen(
            [*command, "--real-time", *options],
            cwd=self.path,
            env=os.environ | {"PYTHONPATH": str(self.path)},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def run(self, *options: str, code: int = 0) -> str:
        process = self.start("--duration", "0.3", *options)
        said = process.communicate(timeout=60)[1]
        assert process.returncode == code, said
        return said

    def report(self) -> Any:
        return json.loads((self.path / "r.json").read_text())

    def log(self) -> list[str]:
        path = self.path / "log"
        return path.read_text().split() if path.exists() else []


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    return Folder(tmp_path)


def is_there(pid: str) -> bool:
    return Path(f"/proc/{pid}").exists()


def test_a_run_and_its_replay(folder: Folder) -> None:
    folder.run("--record", "r.mcap")
    pid, *values, last = folder.log()
    assert last == "close" and len(values) > 5 and not is_there(pid)
    # hold + (0.5 m - 0.25 m) * 50 N, and hold * 0.25 m / 1 m at the end
    assert set(values[:-1]) <= {"-0.5", "24.5"} and values[-1] == "3.0"
    outputs = {TAU: {"value": "3.0", "by": "safe", "problem": ""}}
    assert folder.report()["last_outputs"] == outputs
    command = [sys.executable, "-m", "specc", "replay", "r.mcap", "--spec", "lift.yaml"]
    subprocess.run(command, cwd=folder.path, check=True, capture_output=True)


def test_a_simulation_that_says_so_stays_in_the_process_of_the_run(folder: Folder) -> None:
    folder.edit("driver.py", "class Lift:\n", "class Lift:\n    simulated = True\n\n")
    process = folder.start("--duration", "0.3")
    process.communicate(timeout=60)
    assert folder.log()[0] == str(process.pid)


def test_a_run_that_is_killed(folder: Folder) -> None:
    process = folder.start("--duration", "60")
    assert until(lambda: len(folder.log()) > 5)
    process.kill()
    process.communicate()
    assert until(lambda: folder.log()[-1] == "close")
    assert folder.log()[-2] == "3.0" and until(lambda: not is_there(folder.log()[0]))


def test_a_run_that_is_silent(folder: Folder) -> None:
    folder.edit(
        "lift.yaml",
        '        y: {h: "real[m]"}\n    virtual',
        '        y: {h: "real[m]"}\n        silence: 400 ms\n    virtual',
    )
    process = folder.start("--duration", "60")
    assert until(lambda: len(folder.log()) > 5)
    process.send_signal(signal.SIGSTOP)
    assert until(lambda: folder.log()[-1] == "3.0")
    process.send_signal(signal.SIGCONT)
    process.communicate(timeout=60)
    assert process.returncode == 1
    report = folder.report()
    assert [fault["culprit"] for fault in report["faults"]] == ["plant"]
    assert report["faults"][0]["message"].startswith(
        "lift.E.drive got its safe outputs from the device host: the run was silent for "
    )
    assert report["faults"][0]["message"].endswith("its `silence` is 0.4 s")
    assert report["last_outputs"] == {TAU: {"value": "3.0", "by": "safe", "problem": ""}}
    assert folder.log()[-3:] == ["3.0", "3.0", "close"]


def test_ctrl_c_ends_run_and_host(folder: Folder) -> None:
    process = folder.start("--duration", "60")
    assert until(lambda: len(folder.log()) > 5)
    for pid in (process.pid, int(folder.log()[0])):
        os.killpg(pid, signal.SIGINT)
    process.communicate(timeout=60)
    assert process.returncode == 128 + signal.SIGINT
    assert folder.log()[-2:] == ["3.0", "close"]
    report = folder.report()
    assert report["interrupted"] and not report["faults"]
    assert until(lambda: not is_there(folder.log()[0]))


@pytest.mark.parametrize(
    ("old", "new", "culprit", "message"),
    [
        ("        pass", "        raise PlantError('no echo')", "device lift.E.drive.h", "no echo"),
        ("return self.h\n", "return 'far'\n", "device lift.E.drive.h", "'far'"),
        (
            'self.note.write(f"{value}\\n")',
            "if value > 20: raise PlantError('too hot')",
            f"device {TAU}",
            "too hot",
        ),
        ("self.h += 0.0", "raise PlantError('no power')", "plant", "no power"),
        ("self.h += 0.0", "os._exit(3)", "plant", "the device host ended: exit code 3"),
        ('self.note.write("close\\n")', "raise OSError('stuck')", "plant", "OSError: stuck"),
    ],
)
def test_faults_of_devices(folder: Folder, old: str, new: str, culprit: str, message: str) -> None:
    folder.edit("driver.py", old, new)
    said = folder.run(code=1)
    fault = folder.report()["faults"][0]
    assert fault["culprit"] == culprit and message in fault["message"], said


def test_a_device_that_is_not_there(folder: Folder) -> None:
    folder.edit(
        "driver.py", "        self.h, ", "        raise PlantError('no port')\n        self.h, "
    )
    said = folder.run(code=2)
    assert "error: cannot open the devices: no port" in said


def test_a_scene_is_for_simulations(folder: Folder) -> None:
    text = (folder.path / "lift.yaml").read_text()
    task = 'task:\n  cycle: {of: lift.drive, from: S0, to: S0}\n  scene: "driver:Lift"\n'
    text = text.replace(
        "move: {functions: [move], terminal: never}}",
        "move: {functions: [move], terminal: always}}",
    )
    rows = "transitions: [[S0, terminal, always, S0]]"
    text = text.replace("states: {S0: move}", f"states: {{S0: move}}\n        {rows}")
    (folder.path / "lift.yaml").write_text(text + task)
    assert "`simulated = True` in its class" in folder.run(code=2)
