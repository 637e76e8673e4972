"""`specc fmt`: what it writes, prints and answers."""

import os
from pathlib import Path

import pytest

from specc.cli import main

LOOSE = "system: demo   # name\nspecc: 1\n"
NEAT = "specc: 1\nsystem: demo # name\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loose.yaml").write_text(LOOSE)
    (tmp_path / "neat.yaml").write_text(NEAT)
    (tmp_path / "part.yaml").write_text("subsystem: {}\nspecc: 1\n")
    (tmp_path / "other.yaml").write_text("b:   1\n")
    return tmp_path


def test_it_writes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    os.chmod(folder / "loose.yaml", 0o640)
    assert main(["fmt", "loose.yaml", "neat.yaml"]) == 0
    assert (folder / "loose.yaml").read_text() == NEAT
    assert (folder / "loose.yaml").stat().st_mode & 0o777 == 0o640
    assert capsys.readouterr().err.splitlines() == [
        "formatted: loose.yaml",
        "1 of 2 formatted, 1 left as they are",
    ]
    assert main(["fmt", "loose.yaml", "--check"]) == 0


def test_a_directory_means_its_specifications_and_parts(folder: Path) -> None:
    assert main(["fmt", "."]) == 0
    assert (folder / "part.yaml").read_text() == "specc: 1\nsubsystem: {}\n"
    assert (folder / "other.yaml").read_text() == "b:   1\n"


@pytest.mark.parametrize(("option", "code"), [("--check", 1), ("--diff", 0)])
def test_looking_changes_nothing(
    option: str, code: int, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fmt", option, "loose.yaml"]) == code
    assert (folder / "loose.yaml").read_text() == LOOSE
    printed = capsys.readouterr()
    assert ("+system: demo # name\n" in printed.out) == (option == "--diff")
    assert "would be formatted: loose.yaml" in printed.err


def test_what_is_no_yaml_is_left_and_said(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "bad.yaml").write_text("specc: [\n")
    assert main(["fmt", "bad.yaml", "loose.yaml", "none.yaml"]) == 2
    assert (folder / "bad.yaml").read_text() == "specc: [\n"
    assert (folder / "loose.yaml").read_text() == NEAT
    assert "error[E0009]" in capsys.readouterr().err


def test_a_link_stays_a_link(folder: Path) -> None:
    (folder / "link.yaml").symlink_to("loose.yaml")
    assert main(["fmt", "link.yaml"]) == 0
    assert (folder / "link.yaml").is_symlink()
    assert (folder / "loose.yaml").read_text() == NEAT


def test_a_write_that_fails_leaves_the_file(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "replace", refuse)
    assert main(["fmt", "loose.yaml"]) == 2
    assert (folder / "loose.yaml").read_text() == LOOSE
    assert "error[E0090]" in capsys.readouterr().err
    assert {path.name for path in folder.iterdir()} == {
        "loose.yaml",
        "neat.yaml",
        "part.yaml",
        "other.yaml",
    }
