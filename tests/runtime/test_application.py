"""The command from arguments to exit code, with a plant, a task, faults and Ctrl-C."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from specc_runtime.clock import WallClock
from specc_runtime.interruption import Interruption
from specc_runtime.loading import load_system
from specc_runtime.main import main
from specc_runtime.options import Options, UsageError
from specc_runtime.session import Session

from tests.commands import forgotten
from tests.runtime.tiny import Node, system
from tests.seeds import short

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PUSHER = HERE / "systems" / "pusher"
KEYS = {
    "spec", "seed", "versions", "simulated_s", "wall_s", "real_time_factor", "peak_memory_mb",
    "cycles", "subsystems", "equations_executed", "records_sha256", "faults",
    "interrupted", "last_outputs", "ended",
}  # fmt: skip


def push(tmp_path: Path, *arguments: str, code: int = 0) -> dict[str, object]:
    """Run the pusher; its report."""
    report = tmp_path / "report.json"
    common = [str(PUSHER), "--base", str(PUSHER), "--report", str(report), "--renderer", "raycast"]
    assert main([*common, *arguments]) == code
    return json.loads(report.read_text())


def package(tmp_path: Path, name: str, nodes: str, head: str = "") -> Path:
    """A generated package of tiny nodes."""
    folder = tmp_path / name
    folder.mkdir()
    (folder / "__init__.py").touch()
    (folder / "system.py").write_text(
        "import time\nfrom tests.runtime.tiny import Node, system\n"
        f"{head}\ndef build(base):\n    return system({nodes})\n"
    )
    return folder


def test_report_has_the_promised_keys_and_figures(tmp_path: Path) -> None:
    report = push(tmp_path, "--cycles", "2", "--quiet")
    assert set(report) == KEYS
    assert report["spec"] == "pusher.yaml"
    assert report["seed"] == 0
    assert report["faults"] == []
    assert report["interrupted"] is False
    assert {"python", "specc", "numpy", "mujoco"} <= set(report["versions"])
    assert re.fullmatch("[0-9a-f]{64}", report["records_sha256"])
    first, second = report["cycles"]
    assert first["far"] is True and first["ended"] == second["ended"] == "completed"
    assert first["farthest_m"] > 0.45
    assert report["simulated_s"] == pytest.approx(
        first["simulated_s"] + second["simulated_s"], abs=0.003
    )
    control = report["subsystems"]["a.c"]
    assert sum(control["states_visited"].values()) == control["steps"]
    assert control["transitions_taken"]["S1 terminal home -> S0"] == 2
    for entry in report["subsystems"].values():
        assert list(entry["time_in_states_s"]) == list(entry["states_visited"])
        assert sum(entry["time_in_states_s"].values()) == pytest.approx(report["simulated_s"])
    last = control["last_transitions"][-1]
    assert last["transition"] in control["transitions_taken"]
    assert 0 <= last["first_s"] <= last["last_s"] <= report["simulated_s"] and last["times"] >= 1
    assert report["subsystems"]["a.m"]["steps"] == round(report["simulated_s"] / 0.002)
    # 9 is the error condition of a.m; 3 its only row.
    assert report["equations_executed"] == [1, 2, 3, 9, 10, 11, 20, 21, 22, 23]


def test_seed_decides_the_records_and_worker_threads_do_not(tmp_path: Path) -> None:
    def digest(*arguments: str) -> object:
        return push(tmp_path, "--duration", "0.6", "--quiet", *arguments)["records_sha256"]

    assert digest() == digest() == digest("--inline")


def test_rows_after_the_one_taken_are_not_counted_as_executed(tmp_path: Path) -> None:
    report = push(tmp_path, "--duration", "0.1", "--quiet")
    assert report["equations_executed"] == [1, 2, 3, 9, 10, 20, 21]


def test_progress_and_summary(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    push(tmp_path, "--cycles", "2")
    captured = capsys.readouterr()
    assert "cycle 2/2" in captured.err and "a.c S0" in captured.err
    for text in ("cycle", "farthest_m", "subsystem", "a.k", "times real time"):
        assert text in captured.out
    push(tmp_path, "--cycles", "1", "--quiet")
    assert capsys.readouterr() == ("", "")


@pytest.mark.long
def test_cycles_and_duration_go_together(tmp_path: Path) -> None:
    one = push(tmp_path, "--quiet", "--cycles", "1", "--duration", "100")
    assert len(one["cycles"]) == 1 and one["simulated_s"] < 50
    none = push(tmp_path, "--quiet", "--cycles", "1", "--duration", "0.1", code=1)
    assert none["cycles"] == [] and none["simulated_s"] == pytest.approx(0.1)


def test_cycle_that_does_not_end_is_given_up(tmp_path: Path) -> None:
    report = push(tmp_path, "--quiet", "--cycle-limit", "0.3", code=1)
    (cycle,) = report["cycles"]
    assert cycle["ended"] == "time limit"
    assert cycle["simulated_s"] == pytest.approx(0.3)


def test_fault_ends_with_report_and_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    head = "def boom(node):\n    if node.steps == 40:\n        raise ValueError('too hot')"
    folder = package(tmp_path, "boiler", "Node('a'), Node('b', 5, ('a',), boom)", head)
    report = tmp_path / "r.json"
    assert main([str(folder), "--report", str(report)]) == 1
    data = json.loads(report.read_text())
    (fault,) = data["faults"]
    assert fault["subsystem"] == "b" and "too hot" in fault["message"]
    assert data["simulated_s"] == pytest.approx(41 * 0.01)
    out = capsys.readouterr().out
    assert "too hot" in out and "\n      in self.y.value = self.compute(self)\n" in out


def test_value_that_cannot_be_recorded_is_a_fault(tmp_path: Path) -> None:
    folder = package(tmp_path, "lister", "Node('a', 1, (), lambda node: [node.steps])")
    report = tmp_path / "r.json"
    assert main([str(folder), "--report", str(report), "--quiet"]) == 1
    (fault,) = json.loads(report.read_text())["faults"]
    assert fault["fault"] == "UnrecordableValue"
    assert "value: values of builtins.list have no stable encoding" in fault["message"]


def test_diverging_plant_is_a_fault(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from specc_runtime.plants.errors import PlantError
    from specc_runtime.plants.mujoco import MujocoPlant

    advance = MujocoPlant.advance

    def diverge(plant: MujocoPlant, duration_s: float) -> None:
        if plant.time_s > 0.099:
            raise PlantError("the simulation diverged")
        advance(plant, duration_s)

    monkeypatch.setattr(MujocoPlant, "advance", diverge)
    report = push(tmp_path, "--quiet", code=1)
    (fault,) = report["faults"]
    assert (fault["fault"], fault["culprit"]) == ("PlantFailed", "plant")
    assert fault["time_s"] == pytest.approx(0.1)
    assert report["cycles"][0]["ended"] == "fault"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ([], "required: DIR"),
        (["nowhere"], "no system.py"),
        ([str(PUSHER), "--base", "nowhere"], "no model file"),
        ([str(PUSHER), "--cycles", "0"], "at least 1"),
        ([str(PUSHER), "--duration", "nan"], "positive number"),
        ([str(PUSHER), "--seed", "-1"], "whole number"),
        ([str(PUSHER), "--base", str(PUSHER), "--report", "no/such/r.json"], "no folder"),
        ([str(PUSHER), "--base", str(PUSHER), "--report", str(HERE)], "a folder"),
        ([str(PUSHER), "--base", str(PUSHER), "--video", "no/such/v.mp4"], "no folder"),
    ],
)
def test_wrong_usage(arguments: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    assert text in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--report", "--record", "--video"])
def test_no_output_takes_the_place_of_another_kind_of_file(
    option: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text("specc: 1\n")
    common = [str(PUSHER), "--base", str(PUSHER), "--duration", "0.01"]
    assert main([*common, option, str(spec)]) == 2
    assert "what is there is no " in capsys.readouterr().err
    assert spec.read_text() == "specc: 1\n"


def test_what_a_system_lacks_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = str(package(tmp_path, "lonely", "Node('a')"))
    assert main([folder, "--cycles", "1"]) == 2
    assert "no task" in capsys.readouterr().err
    assert main([folder, "--video", str(tmp_path / "v.mp4")]) == 2
    assert "no plant" in capsys.readouterr().err
    for variable in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    assert main([str(PUSHER), "--base", str(PUSHER), "--viewer"]) == 2
    assert "no display" in capsys.readouterr().err


def test_file_that_a_subsystem_cannot_read_is_wrong_usage(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = package(tmp_path, "reader", "Node(open('there-is-no-such.xml').name)")
    assert main([str(folder)]) == 2
    assert "there-is-no-such.xml" in capsys.readouterr().err


def test_video_shows_the_scene_and_the_states(tmp_path: Path) -> None:
    import cv2
    from specc_runtime.video import Film, annotated

    path = tmp_path / "run.mp4"
    push(tmp_path, "--duration", "0.4", "--quiet", "--video", str(path))
    film = cv2.VideoCapture(str(path))
    assert film.get(cv2.CAP_PROP_FPS) == 25.0
    assert film.get(cv2.CAP_PROP_FRAME_COUNT) == 10
    good, frame = film.read()
    assert good and frame.shape == (*reversed(Film.size_px), 3)
    assert frame.std() > 10.0
    plain = frame * 0
    drawn = annotated(plain, [("a.c", "S0")])
    assert drawn[:40, :120].max() == 255 and drawn[40:].max() == 0 and plain.max() == 0


def test_a_film_that_is_not_finished_shows_what_was_written(tmp_path: Path) -> None:
    import cv2
    from specc_runtime.video import Film

    path, rng = tmp_path / "run.mkv", np.random.default_rng(0)
    film = Film(path, 0.04, (320, 240))
    for _ in range(40):
        film.add(rng.integers(0, 256, (240, 320, 3), dtype=np.uint8))
    (tmp_path / "cut.mkv").write_bytes(path.read_bytes())
    pictures = cv2.VideoCapture(str(tmp_path / "cut.mkv"))
    count = 0
    while pictures.grab():
        count += 1
    assert 10 < count <= 40
    assert film.close() == ""


@pytest.mark.long
def test_animation_shows_the_same_in_fewer_pictures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import cv2
    from specc_runtime.video import Animation

    path = tmp_path / "run.webp"
    push(tmp_path, "--duration", "1", "--quiet", "--video", str(path))
    good, whole = cv2.imreadanimation(str(path))
    assert good and list(whole.durations) == [100] * 10
    assert whole.frames[0].shape[:2] == tuple(reversed(Animation.size_px))
    monkeypatch.setattr("specc_runtime.video.MOST_PICTURES", 4)
    push(tmp_path, "--duration", "1", "--quiet", "--video", str(path))
    _, thinned = cv2.imreadanimation(str(path))
    assert list(thinned.durations) == [400] * 3
    for now, then in zip(thinned.frames, whole.frames[::4], strict=True):
        assert abs(now.astype(float) - then).mean() < 5.0


@pytest.mark.long
@pytest.mark.parametrize("name", short(["run.mp4", "run.webp"], 0))
def test_a_film_has_a_picture_at_least(name: str, tmp_path: Path) -> None:
    import cv2

    path = tmp_path / name
    push(tmp_path, "--duration", "0.2", "--quiet", "--fps", "0.01", "--video", str(path))
    film = cv2.VideoCapture(str(path))
    good, picture = film.read()
    assert good and picture.std() > 10.0 and not film.grab()


@pytest.mark.long
def test_an_animation_of_large_pictures_has_fewer(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """They are in memory until it is written, so their bytes are bounded."""
    import cv2

    path = tmp_path / "run.webp"
    monkeypatch.setattr("specc_runtime.video.MOST_BYTES", 4 * 3 * 400 * 300)
    push(tmp_path, "--duration", "1", "--quiet", "--video", str(path))
    assert list(cv2.imreadanimation(str(path))[1].durations) == [400] * 3
    assert f"{path} will have 4 pictures at most" in capsys.readouterr().err


def test_video_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    common = [str(PUSHER), "--base", str(PUSHER), "--renderer", "raycast", "--quiet"]
    for path in (tmp_path / "run.mp4", tmp_path / "run.webp"):
        path.mkdir()
        assert main([*common, "--video", str(path)]) == 2
        assert "cannot write" in capsys.readouterr().err


@pytest.mark.parametrize("number", short([signal.SIGINT, signal.SIGTERM], 0))
def test_interrupt_ends_cleanly_with_the_report(tmp_path: Path, number: signal.Signals) -> None:
    head = "def slow(node):\n    time.sleep(0.002)\n    return 0"
    folder = package(tmp_path, "endless", "Node('a', 1, (), slow), Node('b', 50, ('a',))", head)
    report = tmp_path / "r.json"
    command = [sys.executable, "-m", "specc_runtime", str(folder), "--duration", "1000"]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT / "runtime"), str(ROOT)])}
    with subprocess.Popen(
        [*command, "--report", str(report)],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        deadline = time.monotonic() + 60
        line = process.stderr.readline()
        assert "running" in line and time.monotonic() < deadline
        process.send_signal(number)
        try:
            out, err = process.communicate(timeout=30)
        finally:
            process.kill()
    assert process.returncode == 128 + number
    assert "Traceback" not in err
    data = json.loads(report.read_text())
    assert set(data) == KEYS
    assert data["interrupted"] is True
    assert data["subsystems"]["a"]["steps"] > 10
    assert data["faults"] == []
    assert "subsystem" in out


def test_a_package_does_not_take_the_place_of_another_module(tmp_path: Path) -> None:
    for name in ("json", "numpy", "specc_runtime"):
        package = tmp_path / name
        shutil.copytree(PUSHER, package)
        assert load_system(package, tmp_path).subsystems
    assert sys.modules["json"] is json


def test_modules_beside_a_specification_are_looked_for_last(tmp_path: Path) -> None:
    head = "import graphlib\nfrom gains import NAME\nassert hasattr(graphlib, 'TopologicalSorter')"
    folder = package(tmp_path, "gained", "Node(NAME, 1)", head)
    sides = [tmp_path / name for name in ("left", "right")]
    for side in sides:
        side.mkdir()
        (side / "gains.py").write_text(f"NAME = '{side.name}'\n")
        (side / "graphlib.py").write_text("this shadows the module of Python\n")
    with forgotten(tmp_path):
        sys.modules.pop("graphlib", None)
        sys.path.insert(0, "")  # as `python -c` has it
        for side in [*sides, *sides]:
            assert [s.subsystem.name for s in load_system(folder, side).subsystems] == [side.name]
        with pytest.raises(UsageError, match="put it beside the specification"):
            load_system(folder, "")
        assert "" in sys.path and sys.modules["sys"] is sys


def test_report_replaces_an_old_one_whole(tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text('{"spec": "old"}')
    push(tmp_path, "--duration", "0.01", "--quiet")
    assert [path.name for path in tmp_path.iterdir()] == ["report.json"]


def test_the_command_starts_without_numerical_packages() -> None:
    code = "import sys, specc_runtime.main; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": str(ROOT / "runtime")},
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split()
    assert not {"numpy", "mujoco", "cv2", "rich"} & set(loaded)


class Waiting(WallClock):
    """Wall time that passes only while a step lets it."""

    now = 0.0

    def now_s(self) -> float:
        return self.now


@pytest.mark.parametrize("inline", [True, False])
def test_wall_time_begins_when_every_subsystem_has_made_its_first_step(inline: bool) -> None:
    clock = Waiting()

    def compute(node: Node) -> int:
        clock.now += 10.0 if node.steps == 0 else 1.0
        return node.steps

    built = system(Node("slow", 50, (), compute), Node("fast"))
    options = Options(Path(), duration_s=0.3, inline=inline)
    session = Session(options, built, None, None, clock, Interruption())
    session.run()
    report = session.report()
    assert report.wall_s == 2.0
    assert report.real_time_factor == pytest.approx(0.15)
