"""`specc init --model`: what is written validates without a finding and holds the pose."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from specc.cli import main
from tests.cli import robots
from tests.cli.robots import MOTORS, SERVOS, SPEEDS, arm

NEAR = {"hinge": 0.05, "slide": 0.005}


def started(text: str, folder: Path, *options: str) -> Path:
    """The specification of a model, which is written to a folder of its own."""
    model = folder / "models/robot.xml"
    model.parent.mkdir(parents=True)
    model.write_text(text)
    assert main(["init", str(folder / "cell"), "--model", str(model), *options]) == 0
    (spec,) = (folder / "cell").glob("*.yaml")
    return spec


def strayed(spec: Path, folder: Path) -> dict[str, float]:
    """How far each joint of the model is from the start in 5 s, by a report of what is observed."""
    report = folder / "report.json"
    done = main(["run", str(spec), "--report", str(report), "--cycle-limit", "8"])
    told = json.loads(report.read_text(encoding="utf-8"))
    assert told["faults"] == []
    assert (done, [cycle["ended"] for cycle in told["cycles"]]) == (0, ["completed"])
    return told


ROBOTS = {
    "servos": arm(SERVOS),
    "motors": arm(MOTORS),
    "speeds": arm(SPEEDS),
    "gripper": robots.GRIPPER,
    "base": robots.BASE,
    "walker": robots.WALKER,
}


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_holds_its_pose_at_once(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The cycle of its task ends once all joints are near the start after 5 s."""
    spec = started(ROBOTS[name], tmp_path)
    assert main(["validate", "--strict", str(spec)]) == 0, capsys.readouterr().err
    assert main(["fmt", "--check", str(spec)]) == 0
    text = spec.read_text()
    assert "NOT HELD" not in text
    assert max(map(len, text.splitlines())) < 140
    strayed(spec, tmp_path)
