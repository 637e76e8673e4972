"""docs/sweeps.md: its example answers as it shows."""

from __future__ import annotations

import math
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from specc.cli.arguments import parser

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
EXAMPLE = re.compile(r"^```console\n\$ specc (.*?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def size(values: str) -> int:
    """How many values FROM:TO:COUNT, A,B,C or FROM:TO of seeds stands for."""
    first, *rest = values.split(":")
    return int(rest[-1]) - (int(first) if len(rest) == 1 else 0) if rest else values.count(",") + 1


def test_the_example_is_a_command() -> None:
    ((command, shown),) = EXAMPLE.findall(TEXT)
    asked = parser().parse_args(shlex.split(command))
    runs = math.prod(map(size, (*asked.set.values(), asked.seeds)))
    assert shown.startswith(f"specc: {runs} runs, ")


@pytest.mark.long
def test_the_example_answers_as_shown(tmp_path: Path) -> None:
    (tmp_path / "specs").symlink_to(ROOT / "specs")
    ((command, shown),) = EXAMPLE.findall(TEXT)
    done = subprocess.run(
        [sys.executable, "-m", "specc", *shlex.split(command), "--workers", "2"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    first, *rest = shown.splitlines()
    assert done.stderr.splitlines()[0] == first
    before, after = "\n".join(rest).split("\n...\n")
    assert done.stdout.startswith(before)
    assert done.stdout.endswith(f"{after}\n")
