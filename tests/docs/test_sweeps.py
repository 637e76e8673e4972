"""docs/sweeps.md: its example answers as it shows."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
EXAMPLE = re.compile(r"^```console\n\$ specc (.*?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


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
