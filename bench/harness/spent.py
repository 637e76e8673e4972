"""What a command takes of the machine: processor time, and memory at most."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass
class Spent:
    """A command that has ended; a negative code is that of a signal."""

    code: int
    cpu_s: float
    memory_mb: float
    text: str


def spent(command: Sequence[str], folder: Path) -> Spent:
    """Run `specc` with arguments in a folder, in a process of its own."""
    with tempfile.TemporaryFile() as out:
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "specc", *command],
            cwd=folder,
            stdin=subprocess.DEVNULL,
            stdout=out,
            stderr=subprocess.STDOUT,
        )
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        text = out.read().decode(errors="replace")
    cpu_s = used.ru_utime + used.ru_stime
    return Spent(process.returncode, cpu_s, used.ru_maxrss / 1024, text)
