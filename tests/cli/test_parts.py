"""Files that are there for systems to use: definitions, and parts of agents."""

import json
from pathlib import Path
from typing import Any

import pytest

from specc.cli.main import main

DEFINITIONS = """\
specc: 1
frames: {B: base}
types: {Grasp: {fields: {width: "real[m]"}}}
constants: {far: "2[m]", near_by: far / 2}
operators: {G0: {signature: "() -> Grasp", python: "arm.grasping:no_grasp"}}
"""
DESCRIPTION = """\
specc: 1
use: [definitions.yaml]
parameters: {threshold: "real[N]"}
subsystem:
  rate: 50 Hz
  x: {arm: {f: "real[N]"}}
  y: {arm: {pushed: bool}}
  let: {over: present(x.arm.f) and x.arm.f > threshold}
  functions: {watch: {y.arm.pushed: over}}
  conditions: {initial: {pushed: over, still: not over}}
  behaviours: {watch: {functions: [watch], terminal: always}}
  states: {S0: watch}
  initial_state: S0
  transitions: [[S0, terminal, pushed, S0], [S0, terminal, still, S0]]
"""
SYSTEM = """\
specc: 1
system: guarded
use: [definitions.yaml]
"""
NO_TYPE = ("-> Grasp", "-> Grip")
NO_ROW = ("still: not over", "still: False")


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    put("definitions.yaml", DEFINITIONS)
    put("description.yaml", DESCRIPTION)
    return tmp_path


def put(name: str, text: str, change: tuple[str, str] = ("", "")) -> None:
    assert change[0] in text
    Path(name).write_text(text.replace(*change) if change[0] else text)


def validated(capsys: pytest.CaptureFixture[str], *names: str) -> tuple[int, list[Any], list[Any]]:
    """The exit code, the place of each finding with its code, and the files that were checked."""
    code = main(["validate", *names, "--format", "json"])
    told = json.loads(capsys.readouterr().out)
    places = [(item["code"], item["location"]) for item in told["diagnostics"]]
    return code, [(of, at["file"], at["line"]) for of, at in places], told["summary"]["files"]


@pytest.mark.parametrize("name", ["definitions.yaml", "description.yaml"])
def test_a_right_part_passes_and_counts(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert validated(capsys, name) == (0, [], [name])


@pytest.mark.parametrize(
    ("change", "code", "line"),
    [
        (NO_TYPE, "O0205", 5),
        (("far / 2", "fra / 2"), "E0201", 4),
        (("far / 2", "'far + 1[rad]'"), "E0311", 4),
        (("operators:", "operatorz:"), "E0101", 5),
    ],
)
def test_wrong_definitions_are_told_at_their_line(
    change: tuple[str, str], code: str, line: int, capsys: pytest.CaptureFixture[str]
) -> None:
    put("definitions.yaml", DEFINITIONS, change)
    status, found, _ = validated(capsys, "definitions.yaml")
    assert (status, found) == (1, [(code, "definitions.yaml", line)])


@pytest.mark.parametrize(
    ("change", "code", "line"),
    [(NO_ROW, "E0601", 12), (("> threshold", "> treshold"), "E0201", 8)],
)
def test_a_wrong_description_is_told_at_its_line(
    change: tuple[str, str], code: str, line: int, capsys: pytest.CaptureFixture[str]
) -> None:
    put("description.yaml", DESCRIPTION, change)
    status, found, _ = validated(capsys, "description.yaml")
    assert (status, found[:1]) == (1, [(code, "description.yaml", line)])
    assert all(place[0].startswith("W") for place in found[1:])


@pytest.mark.parametrize("change", [NO_TYPE, ("operators:", "operatorz:")])
@pytest.mark.parametrize("with_system", [True, False])
def test_what_is_reached_twice_is_told_once(
    change: tuple[str, str], with_system: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    put("definitions.yaml", DEFINITIONS, change)
    if with_system:
        put("system.yaml", SYSTEM)
    code, found, files = validated(capsys, ".")
    assert code == 1
    assert [place[1] for place in found if place[0] != "O0401"] == ["definitions.yaml"]
    assert len(files) == 2 + with_system


def test_a_finding_that_names_frames_of_the_user_is_told_once(
    capsys: pytest.CaptureFixture[str],
) -> None:
    about_frames = DESCRIPTION.replace('"real[N]"}\nsub', '"real[N]", F: frame}\nsub')
    in_f = ('"real[N]"}}\n  y:', '"wrench[F]"}}\n  y:')
    put("description.yaml", about_frames, in_f)
    outer = "specc: 1\nframes: {K: a camera}\nagent: {control: {use: description.yaml, "
    put("outer.yaml", outer + "with: {threshold: '1[N]', F: K}}}\n")
    found = validated(capsys, "*.yaml")[1]
    assert [place[:2] for place in found] == [("E0313", "description.yaml")]


def test_a_part_of_a_part_has_its_tables_checked(capsys: pytest.CaptureFixture[str]) -> None:
    put("description.yaml", DESCRIPTION, NO_ROW)
    outer = "specc: 1\nagent: {control: {use: description.yaml, with: {threshold: '1[N]'}}}\n"
    put("outer.yaml", outer)
    found = validated(capsys, "*.yaml")[1]
    assert [place for place in found if not place[0].startswith("W")] == [
        ("E0601", "description.yaml", 12)
    ]


def test_a_comment_that_only_a_user_could_need_is_not_called_unused(
    capsys: pytest.CaptureFixture[str],
) -> None:
    why = "constants: # specc: ignore[W0240] for other robots\n  {"
    put("definitions.yaml", DEFINITIONS, ("constants: {", why))
    assert validated(capsys, "definitions.yaml") == (0, [], ["definitions.yaml"])


@pytest.mark.parametrize("command", ["build", "run"])
@pytest.mark.parametrize("name", ["definitions.yaml", "description.yaml"])
def test_a_part_is_neither_built_nor_run(
    command: str, name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, name]) == 1
    told = capsys.readouterr().err
    assert "describes no system, only parts for a system to use" in told
    assert told.count("error[") == 1


def test_a_file_with_agents_lacks_its_system(capsys: pytest.CaptureFixture[str]) -> None:
    put("agents.yaml", "specc: 1\nagents: {}\n")
    assert validated(capsys, "agents.yaml")[1] == [("E0102", "agents.yaml", 1)]


@pytest.mark.parametrize("name", ["posetracker", "Specc:pose_traker"])
def test_a_part_of_a_similar_name_is_suggested(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["lib", name]) == 2
    assert "did you mean specc:pose_tracker?" in capsys.readouterr().err


def test_a_name_that_is_like_none_is_answered_with_the_list(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["lib", "nope"]) == 2
    assert "`specc lib` lists all parts" in capsys.readouterr().err
