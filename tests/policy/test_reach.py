"""Specifications read and commands write inside the project; `allow` names more folders."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from specc.cli import main
from specc.pipeline import compile_spec
from specc.policy import clear_cache
from tests.seeds import every

HEAD = "specc: 1\nsystem: demo\n"
FRAMES = "specc: 1\nframes: {B: robot base}\n"
MODEL = '<mujoco><include file="%s"/></mujoco>'
PLANT = HEAD + "plant: {model: %s}\n"
SECRET = "password: [hunter2\n"


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """A project beside files that are none of its business."""
    (tmp_path / "frames.yaml").write_text(FRAMES)
    (tmp_path / "secret").write_text(SECRET)
    (tmp_path / "part.xml").write_text("<mujocoinclude/>")
    folder = tmp_path / "project"
    (folder / "specs").mkdir(parents=True)
    (folder / "pyproject.toml").touch()
    (folder / "frames.yaml").write_text(FRAMES)
    (folder / "part.xml").write_text("<mujocoinclude/>")
    (folder / "link.yaml").symlink_to(tmp_path / "frames.yaml")
    (folder / "model.xml").write_text(MODEL % "../part.xml")
    return folder


def found(project: Path, text: str) -> str:
    """What is wrong with a specification in the folder `specs` of the project."""
    spec = project / "specs" / "spec.yaml"
    spec.write_text(text)
    findings = compile_spec(str(spec)).diagnostics
    return "\n".join(f"{d.code} {d.message} {d.help}" for d in findings if d.code[0] == "E")


@pytest.mark.parametrize(
    "text",
    [
        HEAD + "use: [../frames.yaml]\n",
        HEAD + "files: {frames: ../frames.yaml, folder: .}\n",
        HEAD + "agents: {a: {use: ../frames.yaml}}\n",
        PLANT % "../part.xml",
    ],
)
def test_files_of_the_project(text: str, project: Path) -> None:
    assert "outside" not in found(project, text)


OUTSIDE = [
    HEAD + "use: [../../frames.yaml]\n",
    HEAD + "use: [../link.yaml]\n",
    HEAD + "files: {frames: ../../frames.yaml}\n",
    HEAD + "files: {absent: ../../absent.yaml}\n",
    HEAD + "files: {folder: ../..}\n",
    HEAD + "agents: {a: {use: ../../frames.yaml}}\n",
    PLANT % "../../part.xml",
    PLANT % "../model.xml",
]


@pytest.mark.parametrize("text", OUTSIDE)
def test_files_outside_are_refused_unless_allowed(text: str, project: Path) -> None:
    said = found(project, text)
    assert "outside the project" in said
    assert 'allow = [".."]' in said
    assert "did you mean" not in said
    (project / "pyproject.toml").write_text('[tool.specc]\nallow = [".."]\n')
    clear_cache()
    assert "outside" not in found(project, text)


ASSETS = [
    '<mesh name="m" file="%s"/>',
    '<texture name="t" type="2d" file="%s"/>',
    '<texture name="t" type="cube" fileleft="%s"/>',
    '<hfield name="h" size="1 1 1 1" file="%s"/>',
    '<skin name="s" file="%s"/>',
    '<model name="m" file="%s"/>',
]


@pytest.mark.parametrize("asset", ASSETS)
def test_what_a_model_is_made_of_is_confined_too(asset: str, project: Path) -> None:
    def said(compiler: str, file: str) -> str:
        (project / "part.xml").write_text(f"<mujocoinclude>{asset % file}</mujocoinclude>")
        (project / "model.xml").write_text(
            f'<mujoco>{compiler}<asset><include file="part.xml"/></asset></mujoco>'
        )
        return found(project, PLANT % "../model.xml")

    assert "outside" in said("", "../secret")
    assert "outside" in said("", str(project.parent / "secret"))
    assert "outside" in said('<compiler assetdir=".."/>', "secret")
    (project / "inside").symlink_to(project.parent / "secret")
    assert "outside" in said("", "inside")
    assert "outside" not in said("", "specs/a")
    if asset.startswith(("<mesh", "<texture", "<hfield")):
        assert "outside" not in said('<compiler assetdir="specs"/>', "../a")
        assert "outside" not in said('<compiler strippath="true"/>', "/a/b/c")


def test_models_that_are_attached_are_confined_too(project: Path) -> None:
    mesh = '<mujoco><asset><mesh file="../../secret"/><model file="own.xml"/></asset></mujoco>'
    (project / "specs" / "own.xml").write_text(mesh)
    (project / "model.xml").write_text(
        '<mujoco><asset><model name="a" file="specs/own.xml"/></asset></mujoco>'
    )
    assert "secret lies outside" in found(project, PLANT % "../model.xml")


def test_a_link_in_a_folder_does_not_lead_out(project: Path) -> None:
    text = HEAD + "files: {folder: ../objects}\n"
    (project / "objects" / "a").mkdir(parents=True)
    (project / "objects" / "a" / "loop").symlink_to("..")
    (project / "objects" / "a" / "inside").symlink_to("../../frames.yaml")
    assert found(project, text) == ""
    (project / "objects" / "a" / "out").symlink_to(project.parent)
    assert "E0021 the file lies outside the project: " in found(project, text)


def test_without_a_project_file_the_folder_of_the_specification_counts(project: Path) -> None:
    (project / "pyproject.toml").unlink()
    assert "E0021" in found(project, HEAD + "use: [../frames.yaml]\n")
    (project / "specs" / "frames.yaml").write_text(FRAMES)
    assert found(project, HEAD + "use: [frames.yaml]\n") == ""


def test_pipes_are_not_opened(project: Path) -> None:
    os.mkfifo(project / "pipe")
    for text in ("use: [../pipe]\n", "files: {p: ../pipe}\n", "plant: {model: ../pipe}\n"):
        assert found(project, HEAD + text)
    (project / "pyproject.toml").unlink()
    os.mkfifo(project / "pyproject.toml")
    assert found(project, HEAD) == ""


@pytest.mark.parametrize("form", ["text", "json", "sarif", "github", "junit"])
def test_what_is_no_specification_is_not_shown(
    form: str, project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project / "secret").write_text(SECRET)
    (project / "spec.yaml").write_text(HEAD + "use: [secret]\n")
    assert main(["validate", "--format", form, str(project / "spec.yaml")]) == 1
    printed = capsys.readouterr()
    assert "hunter2" not in printed.out + printed.err
    assert "E0022" in printed.out + printed.err


COMMANDS = [
    ["validate"],
    ["validate", "--fix"],
    ["fmt"],
    ["fmt", "--diff"],
    ["build"],
    ["run"],
    ["status"],
    ["ages"],
    ["witness"],
    ["diff", str(Path(__file__).parents[2] / "specs" / "conveyor_gate.yaml")],
    ["import", "scxml"],
    ["import", "fabric"],
]
SECRETS = [SECRET, "password: hunter2\n", "<key>hunter2</key>\n", "\u00ff", "hunter2\0\n"]


@pytest.mark.parametrize("command", every(2, COMMANDS), ids=" ".join)
@pytest.mark.parametrize("secret", SECRETS)
def test_what_the_command_line_names_is_not_shown_either(
    command: list[str], secret: str, project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = project / "secret"
    path.write_text(secret)
    assert main([*command, str(path)]) == 1
    printed = capsys.readouterr()
    assert "hunter2" not in printed.out + printed.err
    assert ("E0803" if "import" in command else "E0022") in printed.err
    assert path.read_text() == secret


@pytest.mark.parametrize("command", COMMANDS[:-2], ids=" ".join)
def test_a_link_out_of_the_project_is_not_read(
    command: list[str], project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (project.parent / "outside.yaml").write_text(HEAD + "frmaes: {}\n")
    (project / "inside.yaml").symlink_to(project.parent / "outside.yaml")
    assert main([*command, str(project / "inside.yaml")]) == 1
    printed = capsys.readouterr()
    assert "frmaes" not in printed.out + printed.err
    assert "E0021" in printed.err
    (project / "pyproject.toml").write_text('[tool.specc]\nallow = [".."]\n')
    clear_cache()
    main([*command, str(project / "inside.yaml")])
    assert "E0021" not in capsys.readouterr().err


@pytest.mark.parametrize("command", [["fmt"], ["fmt", "--diff"], ["validate", "--fix"]])
def test_nothing_is_written_through_a_link_out_of_the_project(
    command: list[str], project: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    outside = project.parent / "outside.yaml"
    outside.write_text(HEAD + "frmaes: {B:   base}\n")
    (project / "inside.yaml").symlink_to(outside)
    before = outside.read_text()
    assert main([*command, str(project / "inside.yaml")])
    assert outside.read_text() == before
    assert "link leads out of the project" in capsys.readouterr().err


def test_a_build_does_not_follow_a_link_out_of_the_project(
    project: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    elsewhere = project.parent / "elsewhere"
    elsewhere.mkdir()
    specs, spec = Path(__file__).parents[2] / "specs", project / "conveyor_gate.yaml"
    for name in (spec.name, "plants/conveyor_gate.xml"):
        (project / name).parent.mkdir(exist_ok=True)
        (project / name).write_text((specs / name).read_text())
    (project / "generated").symlink_to(elsewhere)
    for folder in (project, project.parent):
        monkeypatch.chdir(folder)
        assert main(["build", str(spec)]) == 1
        assert "E0021" in capsys.readouterr().err
        assert not list(elsewhere.iterdir())
    assert main(["build", str(spec), "--out", str(elsewhere)]) == 0
    assert (elsewhere / "conveyor_gate" / "system.py").is_file()
