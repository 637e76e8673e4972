"""Copies of parts of the working tree, to try in them what a newcomer would write."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]


def copied(scratch: Path, *names: str) -> Path:
    """The directory `scratch`, with files and folders of the working tree in it.

    What Python has compiled of them comes along: it goes by their dates, which are kept.
    """
    for name in names:
        source, target = ROOT / name, scratch / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("*.pyc.*"))
        else:
            shutil.copy2(source, target)
    return scratch


def in_copy(copy: Path, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """What `python -m` does with these arguments in a copy."""
    return subprocess.run(
        [sys.executable, "-m", *arguments],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": f"{copy}:{copy / 'runtime'}", **environment},
        capture_output=True,
        text=True,
        check=False,
    )
