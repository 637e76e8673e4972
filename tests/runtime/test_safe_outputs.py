"""Whatever ends a run, devices get their safe outputs before the plant is closed, once."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from specc_runtime.plants.mujoco import MujocoPlant

from tests.runtime.hinge import hinge, run

NO = "raise ValueError('no')"
TAU = "arm.E.j.tau"


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, Any]]:
    """What the plant was commanded last, and when it was closed."""
    seen: list[tuple[str, Any]] = []
    actuate, close = MujocoPlant.actuate, MujocoPlant.close

    def commanded(plant: MujocoPlant, name: str, value: Any) -> None:
        seen.append((name, value))
        actuate(plant, name, value)

    def closed(plant: MujocoPlant) -> None:
        seen.append(("close", None))
        close(plant)

    monkeypatch.setattr(MujocoPlant, "actuate", commanded)
    monkeypatch.setattr(MujocoPlant, "close", closed)
    return seen


@pytest.mark.parametrize(
    ("parts", "code"),
    [
        ({}, 0),
        ({"drive": f"def drive(e):\n    {NO}"}, 1),
        ({"drive": "def drive(e):\n    raise SystemExit"}, 1),
        ({"torque": f"def torque(command, raw):\n    {NO}"}, 1),
        ({"observe": f"    def observe(self):\n        {NO}"}, 1),
        ({"drive": "def drive(e):\n    return 1e9 * e"}, 1),
    ],
)
def test_the_last_thing_sent_is_safe(
    tmp_path: Path, calls: list[tuple[str, Any]], parts: dict[str, str], code: int
) -> None:
    report = run(hinge(tmp_path, **parts), "--duration", "0.3", code=code)
    assert calls[-2:] == [(TAU, 3.0), ("close", None)]
    assert calls.count(("close", None)) == 1
    assert report["last_outputs"] == {TAU: {"value": "3.0", "by": "safe", "problem": ""}}


@pytest.mark.parametrize(
    ("hold", "problem"),
    [(NO, "safe: ValueError: no"), ("return float('nan')", "safe: ")],
)
def test_a_constant_is_sent_where_safe_fails(
    tmp_path: Path, calls: list[tuple[str, Any]], hold: str, problem: str
) -> None:
    report = run(hinge(tmp_path, hold=f"def hold(q):\n    {hold}"), "--duration", "0.1", code=0)
    assert calls[-2:] == [(TAU, 7.0), ("close", None)]
    assert report["last_outputs"][TAU]["by"] == "otherwise"
    assert report["last_outputs"][TAU]["problem"].startswith(problem)


def test_a_constant_is_sent_before_the_first_sample(
    tmp_path: Path, calls: list[tuple[str, Any]]
) -> None:
    report = run(hinge(tmp_path, angle=f"def angle(raw):\n    {NO}"), "--duration", "0.1")
    assert calls == [(TAU, 7.0), ("close", None)]
    assert "AttributeError" in report["last_outputs"][TAU]["problem"]


def test_a_plant_is_closed_when_the_scene_fails(
    tmp_path: Path, calls: list[tuple[str, Any]]
) -> None:
    run(hinge(tmp_path, place=f"    def place(self, plant, rng):\n        {NO}"))
    assert calls == [("close", None)]


def test_what_takes_no_safe_output_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = hinge(tmp_path)

    def broken(plant: MujocoPlant, name: str, value: Any) -> None:
        if value in (3.0, 7.0):
            raise OSError("no connection")

    monkeypatch.setattr(MujocoPlant, "actuate", broken)
    report = run(package, "--duration", "0.1", code=0)
    last = report["last_outputs"][TAU]
    assert last["by"] == "arm.j"
    assert last["problem"] == "safe: OSError: no connection; otherwise: OSError: no connection"
