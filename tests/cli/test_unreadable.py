"""Files and folders that cannot be read, vanish or never end: a clear error, and soon."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from specc.cli import inspect, main
from tests.cli.test_interruption import CLEAN, GOOD
from tests.commands import specc
from tests.seeds import short

_PLAIN = ("setpriv", "--inh-caps=-all", "--bounding-set=-all")
"""Root without its privileges obeys permissions like everybody else."""


def plainly(where: Path, *arguments: str) -> tuple[int, str]:
    """Exit code and standard error of the command, run with no privileges."""
    before: Sequence[str] = ()
    if os.geteuid() == 0:
        if shutil.which(_PLAIN[0]) is None:
            pytest.skip("nothing is forbidden to root")
        before = _PLAIN
    command = [*before, sys.executable, "-m", "specc", *arguments]
    done = subprocess.run(command, cwd=where, capture_output=True, text=True, timeout=30)
    return done.returncode, done.stderr


@pytest.mark.parametrize("command", short([["validate"], ["fmt", "--check"]], 0))
def test_what_a_folder_hides_is_told(tmp_path: Path, command: list[str]) -> None:
    (tmp_path / "locked").mkdir()
    for name in ("a.yaml", "b.yaml", "locked/c.yaml"):
        (tmp_path / name).write_text(GOOD)
    (tmp_path / "b.yaml").chmod(0)
    (tmp_path / "locked").chmod(0)
    try:
        code, err = plainly(tmp_path, *command, ".")
        alone = plainly(tmp_path, *command, "locked")
    finally:
        (tmp_path / "locked").chmod(0o700)
    assert code == alone[0] == 2
    assert "error[E0001]: the file cannot be read: permission denied\n --> b.yaml" in err
    assert "error[E0001]: the directory cannot be read: permission denied\n --> locked" in err
    assert err.count("error[") == 2
    assert alone[1].count("error[") == 1


def test_a_file_that_vanishes_after_it_was_listed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.yaml").write_text(GOOD)
    Path("b.yaml").write_text(GOOD)
    listed = inspect.find_targets

    def targets(arguments: Sequence[str]) -> object:
        found = listed(arguments)
        Path("b.yaml").unlink()
        return found

    monkeypatch.setattr(inspect, "find_targets", targets)
    assert main(["validate", "."]) == 2
    assert "error[E0001]: no such file\n --> b.yaml" in capsys.readouterr().err


@pytest.mark.parametrize("command", [("validate",), ("fmt", "--check"), ("status",)])
def test_what_is_no_file_or_too_large(tmp_path: Path, command: tuple[str, ...]) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    with open(tmp_path / "large.yaml", "w", encoding="utf-8") as file:
        file.write("specc: 1\nsystem: large\n")
        file.truncate(100_000_000)
    for name, code in (("pipe.yaml", "E0001"), ("/dev/zero", "E0001"), ("large.yaml", "E0004")):
        done = specc(*command, name, cwd=tmp_path)
        found = done.stderr.count("error["), f"error[{code}]" in done.stderr
        assert (done.returncode, *found) == (2, 1, True)


def test_a_pipe_in_a_folder_is_passed_over(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "a.yaml").write_text(GOOD)
    done = specc("validate", ".", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, CLEAN)
