"""Standard streams that are closed, full or no longer read: no traceback, a plain exit code."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.seeds import short

SPEC = "specc: 1\nsystem: demo\n"
SPECC = f"{sys.executable} -m specc"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a.yaml").write_text(SPEC)
    (tmp_path / "many.yaml").write_text(
        f"{SPEC}constants: {{{', '.join(f'c{n}: unknown_{n}' for n in range(1000))}}}\n"
    )
    return tmp_path


def shell(command: str, folder: Path) -> tuple[int, str]:
    """Exit code and standard error of a command of a shell."""
    # Unbuffered, Python itself loses the error of a write that was done in part.
    clean = {k: v for k, v in os.environ.items() if k != "PYTHONUNBUFFERED"}
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command.replace("specc", SPECC, 1)],
        cwd=folder,
        env=clean,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    return done.returncode, done.stderr


@pytest.mark.parametrize(
    ("command", "code"),
    short(
        [
            ("specc validate a.yaml 2>&-", 0),
            ("specc validate a.yaml >&-", 0),
            ("specc validate a.yaml <&-", 0),
            ("specc validate a.yaml <&- >&- 2>&-", 0),
            ("specc validate a.yaml 2>/dev/full", 2),
            ("specc validate a.yaml --format json 2>&-", 0),
            ("specc validate nothing.yaml 2>/dev/full", 2),
        ],
        3,
        4,
    ),
)
def test_what_nobody_reads_is_no_fault(command: str, code: int, folder: Path) -> None:
    assert shell(command, folder)[0] == code


@pytest.mark.parametrize("where", short([">&-", ">/dev/full"], 1))
@pytest.mark.parametrize(
    "command",
    short(["explain", "validate a.yaml --format json", "schema", "diff a.yaml many.yaml"], 1),
)
def test_data_that_cannot_be_written_is_said(command: str, where: str, folder: Path) -> None:
    (folder / "many.yaml").write_text(SPEC.replace("demo", "other"))
    code, said = shell(f"specc {command} {where}", folder)
    assert code == 2
    assert said.startswith("specc: the output cannot be written: ")


@pytest.mark.parametrize("form", short(["json", "sarif", "github", "junit"], 0))
def test_a_reader_that_goes_away_ends_the_command(form: str, folder: Path) -> None:
    code, said = shell(f"specc validate many.yaml --format {form} | head -1 >/dev/null", folder)
    assert (code, said) == (141, "")


@pytest.mark.long
def test_a_reader_of_messages_may_go_away_too(folder: Path) -> None:
    code, said = shell("specc validate many.yaml 2>&1 | head -1 >/dev/null", folder)
    assert (code, said) == (141, "")
