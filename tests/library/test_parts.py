"""Parts of the library, `specc:pose_tracker`: how they are named, found and described."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

from specc import resources
from specc.cli import main
from specc.pipeline import check_spec, compile_spec
from specc.read import read_file
from specc.read.document import AllowedPaths
from specc.resources import library_name, library_parts, on_disk
from specc.source import beside, real_path, relative_path
from specc.tools.parts import summary_of
from tests.commands import ROOT, specc

ARM = ROOT / "specs/skeletons/arm/arm.yaml"


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    """A project whose arm is a part of the library."""
    assert specc("init", tmp_path, "--skeleton", "arm").returncode == 0
    return tmp_path / "arm.yaml"


def test_every_part_is_right_by_itself_and_says_all_that_a_user_needs() -> None:
    for name in library_parts():
        assert check_spec(name).diagnostics == (), name
        part = summary_of(name)
        assert part is not None, name
        assert part.title, name
        assert part.about, name
        assert all(entry.words for entry in part.parameters), name
        assert part.outputs, name


def test_parts_name_nothing_but_parts() -> None:
    for name in library_parts():
        data = read_file(name).data
        assert all(used in library_parts() for used in data.get("use", ())), name
        assert "files" not in data, name


def test_a_part_has_one_name_on_all_machines(tmp_path: Path) -> None:
    part = "specc:joint_arm"
    assert beside("some/where/arm.yaml", part) == part
    assert beside("specc:way_drive", "specc:diff_drive") == "specc:diff_drive"
    assert relative_path(part, str(tmp_path)) == part
    assert real_path(part) == part
    assert library_name(on_disk(part)) == part
    assert library_name(str(tmp_path / "joint_arm.yaml")) == str(tmp_path / "joint_arm.yaml")
    assert AllowedPaths((str(tmp_path),)).contains(part)


@pytest.mark.parametrize(
    ("wish", "meant"),
    [
        ("specc:jiont_arm", "did you mean `specc:joint_arm`"),
        ("specc:pose_tracker.yaml", "did you mean `specc:pose_tracker`"),
        ("specc:zzz", "`specc lib` lists all parts"),
        ("specc:", "`specc lib` lists all parts"),
        ("specc:../rovers", "`specc lib` lists all parts"),
        ("specc:../lib/joint_arm", "`specc lib` lists all parts"),
        ("specc:/etc/passwd", "`specc lib` lists all parts"),
        ("specc:joint_arm\\0", "`specc lib` lists all parts"),
    ],
)
def test_an_unknown_part(arm: Path, wish: str, meant: str) -> None:
    text = arm.read_text(encoding="utf-8")
    arm.write_text(text.replace("use: specc:joint_arm", f'use: "{wish}"'), encoding="utf-8")
    (found,) = (d for d in compile_spec(str(arm)).diagnostics if d.severity == "error")
    assert found.code == "E0001"
    assert found.message.startswith("the library has no such part: specc:")
    assert found.primary.file == str(arm)
    assert meant in found.help


def test_a_folder_beside_the_specification_is_never_meant(arm: Path) -> None:
    shutil.copy(on_disk("specc:joint_arm"), arm.parent / "specc:mine.yaml")
    shutil.copy(on_disk("specc:joint_arm"), arm.parent / "specc:mine")
    text = arm.read_text(encoding="utf-8")
    arm.write_text(text.replace("specc:joint_arm", "specc:mine"), encoding="utf-8")
    assert {d.code for d in compile_spec(str(arm)).diagnostics} == {"E0001"}


def test_code_is_the_same_wherever_specc_is_installed(
    arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outputs = []
    for place in (resources.specs_dir() / "lib", tmp_path / "elsewhere/lib"):
        if not place.exists():
            shutil.copytree(resources.specs_dir() / "lib", place)
        monkeypatch.setattr(resources, "_library_dir", lambda place=place: place.resolve())
        out = tmp_path / f"out{len(outputs)}"
        assert specc("build", arm, "--out", out).returncode == 0
        outputs.append({p.relative_to(out): p.read_bytes() for p in out.rglob("*.py")})
    assert outputs[0] == outputs[1]
    assert not any(b"elsewhere" in text or b"specs/lib" in text for text in outputs[0].values())


@pytest.mark.long
def test_commands_work_with_a_part(arm: Path) -> None:
    folder = arm.parent
    report = folder / "report.json"
    done = specc("run", "arm.yaml", "--cycles", 1, "--record", "a.mcap", "--report", report,
                 cwd=folder)  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert json.loads(report.read_text())["faults"] == []
    same = specc("replay", "a.mcap", "--spec", "arm.yaml", cwd=folder)
    assert "arm.joints: " in same.stdout
    assert "differs" not in same.stdout
    why = specc("why", "a.mcap@1", "arm.joints", "--spec", "arm.yaml", cwd=folder).stdout
    assert "(specc:joint_arm:" in why
    assert specc("diff", "arm.yaml", "arm.yaml", cwd=folder).returncode == 0
    assert specc("ages", "arm.yaml", cwd=folder).returncode == 0
    dot = specc("graph", "arm.yaml", "arm.joints", "--format", "dot", cwd=folder).stdout
    assert "holding" in dot
    text = arm.read_text(encoding="utf-8")
    arm.write_text(text.replace("[1.5, 1.5]", "[1.5, 1]"), encoding="utf-8")
    other = specc("replay", "a.mcap", "--spec", "arm.yaml", cwd=folder).stdout
    assert "arm.joints differs first at" in other
    assert "specc:joint_arm:" in other


@pytest.mark.long
def test_a_recording_keeps_the_part_that_was_used(
    arm: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run that goes on with what was recorded takes it from the recording."""
    folder = arm.parent
    assert specc("run", arm.name, "--cycles", 1, "--record", "a.mcap", cwd=folder).returncode == 0
    other = tmp_path / "later/lib"
    shutil.copytree(resources.specs_dir() / "lib", other)
    part = other / "joint_arm.yaml"
    part.write_text(part.read_text().replace("braking", "slowing"), encoding="utf-8")
    monkeypatch.setattr(resources, "_library_dir", lambda: other.resolve())
    done = specc("why", "a.mcap@1", "arm.joints", "--spec", arm.name, cwd=folder)
    assert done.returncode == 0, done.stderr
    done = specc("run", arm.name, "--from", "a.mcap@1", "--cycles", 1, cwd=folder)
    assert done.returncode == 0, done.stderr


def test_nothing_is_repaired_in_the_library(arm: Path) -> None:
    before = {name: Path(on_disk(name)).read_bytes() for name in library_parts()}
    assert specc("validate", "--fix", ".", cwd=arm.parent).returncode == 0
    assert specc("fmt", ".", cwd=arm.parent).returncode == 0
    assert before == {name: Path(on_disk(name)).read_bytes() for name in library_parts()}


def test_lib_shows_parameters_inputs_and_outputs(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lib", "joint_arm", "specc:share_gripper"]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert lines[0] == "specc:joint_arm: Arm of n joints"
    assert "parameter n int how many joints the arm has" in lines
    assert "input x.c.q_d vector[n, rad] where to go, an event" in lines
    assert "output y.E.u real share of the largest opening" in lines
    assert main(["lib"]) == 0
    told = capsys.readouterr().out
    assert [name for name in library_parts() if f"{name}: " not in told] == []


def test_lib_of_an_unknown_part(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lib", "pose_trackr"]) == 2
    assert "did you mean specc:pose_tracker" in capsys.readouterr().err


def test_a_part_is_named_on_the_command_line(tmp_path: Path) -> None:
    assert specc("validate", "specc:pose_tracker", cwd=tmp_path).returncode == 0
    assert specc("status", "specc:pose_tracker", cwd=tmp_path).returncode == 0
    assert os.listdir(tmp_path) == []
