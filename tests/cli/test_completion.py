"""Shells complete what the parser knows, also what a command adds only once it is chosen."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.commands import specc


def completed(line: str, folder: Path) -> set[str]:
    """What a shell is told when it asks how a command line may go on."""
    asked = {
        "_ARGCOMPLETE": "1",
        "_ARGCOMPLETE_IFS": "\n",
        "_ARGCOMPLETE_STDOUT_FILENAME": str(folder / "told"),
        "COMP_LINE": line,
        "COMP_POINT": str(len(line)),
    }
    command = [sys.executable, "-c", "import sys; from specc.cli import main; sys.exit(main())"]
    subprocess.run(command, env={**os.environ, **asked}, cwd=folder, check=True, timeout=60)
    return {word.strip() for word in (folder / "told").read_text(encoding="utf-8").split("\n")}


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("specc vali", {"validate"}),
        ("specc run gate.yaml --cy", {"--cycles", "--cycle-limit"}),
        ("specc import f", {"fabric"}),
        ("specc import fabric --co", {"--connect"}),
        ("specc run gate.yaml --renderer ", {"auto", "gl", "raycast"}),
        ("specc run ga", {"gate.yaml"}),
    ],
)
def test_commands_options_choices_and_files_are_completed(
    line: str, words: set[str], tmp_path: Path
) -> None:
    (tmp_path / "gate.yaml").touch()
    assert completed(line, tmp_path) == words


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shell_reads_what_is_printed(shell: str) -> None:
    done = specc("completion", shell)
    assert (done.returncode, done.stderr) == (0, "")
    assert "_ARGCOMPLETE" in done.stdout and "specc" in done.stdout
