"""Runs of specifications as a user starts them, each in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
FLAGSHIP = ROOT / "specs" / "irp_picking.yaml"


@cache
def run(spec: Path, *options: str) -> tuple[int, dict[str, Any]]:
    """Exit code and report of `specc run`; the same run is made once in a test session."""
    report = _scratch() / f"{spec.stem}{'_'.join(options).replace('/', '_')}.json"
    command = [sys.executable, "-m", "specc", "run", str(spec), "--report", str(report), *options]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=600)
    assert report.exists(), done.stderr
    return done.returncode, json.loads(report.read_text())


@cache
def _scratch() -> Path:
    import tempfile

    return Path(tempfile.mkdtemp(prefix="specc-runs-"))
