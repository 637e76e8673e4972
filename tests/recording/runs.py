"""Runs that are recorded, and their files as the library reads them."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

from mcap.reader import make_reader

from tests.commands import ROOT as ROOT
from tests.commands import specc as specc

CONVEYOR = ROOT / "specs" / "conveyor_gate.yaml"


def begun(*arguments: object) -> subprocess.Popen[str]:
    """Start a command in a process of its own."""
    command = [sys.executable, "-m", "specc", *map(str, arguments)]
    return subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


MEASURED = {"wall_s", "real_time_factor", "peak_memory_mb", "versions", "mean_step_us"}


def report_of(file: Path) -> dict[str, Any]:
    """What a run came to, without what depends on the machine."""

    def kept(data: Any) -> Any:
        if not isinstance(data, dict):
            return data
        return {name: kept(value) for name, value in data.items() if name not in MEASURED}

    return dict(kept(json.loads(file.read_text())))


def messages(file: Path) -> dict[str, list[tuple[Any, Any]]]:
    """The messages of a finished recording by topic, each with its record and its data."""
    found = defaultdict(list)
    with file.open("rb") as opened:
        for _, channel, message in make_reader(opened, validate_crcs=True).iter_messages():
            found[channel.topic].append((message, json.loads(message.data)))
    return dict(found)
