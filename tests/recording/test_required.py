"""Requirements on recordings: what a run says of them, a replay of its recording says too."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.recording.replay import replay

from specc.cli import main
from tests.recording.runs import messages
from tests.runtime.test_ground_truth import MODEL, SPEC, WORLD

REQUIRED = (
    "always(near(plant.at.x, plant.s, 1e-9[m]))",
    "within(0.9[s], plant.s > 0.3[m])",
    "always(abs(plant.s - cart.E.wheel.s) < 0.02[m])",  # the noise is larger
    "always(cart.wheel.s >= -0.1[m] and state(cart.c) == S0)",
    "always(present(cart.wheel.x.c.v_d) and cart.wheel.x.c.v_d <= 0.4[m/s])",
    "always(throughout(0.3[s], cart.wheel.y.E.v_d >= 0[m/s]))",  # the end is not known
    "always(near(plant.up, [0, -1, 0], 1e-6))",
)


def spec_with(folder: Path, name: str, *required: str, plant: str = MODEL) -> Path:
    """A specification of the cart with these requirements."""
    (folder / "world.xml").write_text(WORLD)
    items = "".join(f'  - {{that: "{that}", because: of the test}}\n' for that in required)
    path = folder / f"{name}.yaml"
    path.write_text(f"{SPEC}{plant}require:\n{items}")
    return path


def recorded(folder: Path, *options: str) -> tuple[Path, Path, dict[str, Any]]:
    """Specification, recording and report of a run."""
    spec, file, report = (
        spec_with(folder, "cart", *REQUIRED),
        folder / "run.mcap",
        folder / "r.json",
    )
    told = ["--duration", "1.01", "--record", str(file), "--report", str(report), *options]
    assert main(["run", str(spec), *told]) == 1
    return spec, file, json.loads(report.read_text())


def judged(spec: Path, file: Path, **options: Any) -> list[dict[str, Any]]:
    """What a replay says of the requirements of a specification."""
    assert main(["build", str(spec), "--out", str(spec.parent / "built")]) == 0
    (package,) = (spec.parent / "built").iterdir()
    _, watch = replay(package, spec.parent, file, **options)
    assert watch is not None
    return watch.as_data()


@pytest.mark.parametrize("options", [("--record-exact",), ()])
def test_a_recorded_run_is_judged_as_the_run_was(tmp_path: Path, options: tuple[str]) -> None:
    spec, file, report = recorded(tmp_path, *options)
    told = judged(spec, file)
    assert [found.pop("missing") for found in told] == [[]] * len(REQUIRED)
    assert told == report["requirements"]
    assert [found["verdict"] for found in told] == [
        "met", "met", "violated", "met", "violated", "unknown", "met"
    ]  # fmt: skip


def test_the_command_tells_it_and_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spec, file, _ = recorded(tmp_path)
    capsys.readouterr()
    assert main(["replay", str(file), "--spec", str(spec)]) == 1
    out = capsys.readouterr().out
    assert "cart.c: 11 steps are the same\n" in out
    assert f"met {REQUIRED[1]}" in out
    assert f"violated {REQUIRED[2]}" in out
    assert main(["replay", str(file), "--spec", str(spec), "--subsystem", "cart.c"]) == 0
    assert "met" not in capsys.readouterr().out


def test_requirements_of_later_are_judged_on_what_is_there(tmp_path: Path) -> None:
    _, file, _ = recorded(tmp_path)
    later = spec_with(
        tmp_path,
        "later",
        "within(0.5[s], plant.s > 0.1[m])",
        "always(plant.turn < 1[rad])",
        "always(plant.late < 1[rad])",
        plant=MODEL + "    late: {type: 'real[rad]', joints: [hinge]}\n",
    )
    told = judged(later, file)
    assert [found["verdict"] for found in told] == ["met", "met", "unknown"]
    assert [found["missing"] for found in told] == [[], [], ["plant.late"]]


@pytest.mark.parametrize(
    ("rate", "of_plant"),
    [("25 Hz", ("violated", [])), ("100 Hz", ("unknown", ["plant.s"]))],
)
def test_what_had_another_rate_is_not_known(
    tmp_path: Path, rate: str, of_plant: tuple[str, list[str]]
) -> None:
    """Its steps were at other times, and so was what is really so if the base tick is new."""
    _, file, _ = recorded(tmp_path)
    required = "within(0.3[s], plant.s > 0.2[m])", "always(cart.wheel.s < 1[m])"
    later = spec_with(tmp_path, "later", *required, "always(state(cart.c) == S0)")
    later.write_text(later.read_text().replace("rate: 50 Hz", f"rate: {rate}"))
    told = judged(later, file)
    of_wheel, of_control = ("unknown", ["cart.wheel.s"]), ("met", [])
    assert [(each["verdict"], each["missing"]) for each in told] == [
        of_plant,
        of_wheel,
        of_control,
    ]


def test_until_ends_the_run_that_is_judged(tmp_path: Path) -> None:
    _, file, _ = recorded(tmp_path)
    spec = spec_with(
        tmp_path, "early", "within(0.8[s], plant.s > 0.1[m])", "always(plant.s < 0.1[m])"
    )
    early = [found["verdict"] for found in judged(spec, file, until_s=0.1)]
    assert early == ["unknown", "met"]
    assert [found["verdict"] for found in judged(spec, file)] == ["met", "violated"]


@pytest.mark.no_replay("cut before the first step")
def test_of_a_recording_without_steps_nothing_is_known(tmp_path: Path) -> None:
    spec, file, _ = recorded(tmp_path)
    file.write_bytes(file.read_bytes()[:1500])
    told = judged(spec, file)
    assert {found["verdict"] for found in told} == {"unknown"}
    assert told[0]["missing"] == ["plant.at", "plant.s"]


def test_what_is_really_so_is_a_topic(tmp_path: Path) -> None:
    _, file, _ = recorded(tmp_path)
    told = [data for _, data in messages(file)["/plant"]]
    assert [data["stamp"] for data in told] == list(range(51))
    assert told[0].keys() == {"stamp", "time", "y"}
    assert told[0]["y"].keys() == {"at", "box", "up", "s", "turn"}
