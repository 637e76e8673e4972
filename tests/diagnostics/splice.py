"""Examples of codes made into files: laid into host.yaml, or run as commands in a workspace."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from specc.diagnostics.code import Code
from tests.docs.examples import data, merged

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
PLANTS = ROOT / "tests/docs/plants"
PARTS: dict[str, tuple[str, ...]] = {
    "a specification": (),
    "an agent": ("agents", "irp"),
    "a subsystem": ("agents", "irp", "virtual_effectors", "m"),
}


def workspace(folder: Path) -> Path:
    """A folder with the files that examples name."""
    shutil.copytree(HERE / "workspace", folder, dirs_exist_ok=True)
    shutil.copytree(PLANTS, folder / "plants")
    with (folder / "recording.mcap").open("wb") as file:
        file.truncate(8_000_001)
    return folder


def whole(example: str, within: str) -> str:
    """The specification that an example is a part of."""
    if within not in PARTS:
        return example if example.startswith("specc:") else f"specc: 1\n{example}"
    part: Any = data(example)
    for key in reversed(PARTS[within]):
        part = {key: part}
    return json.dumps(merged(data((HERE / "host.yaml").read_text()), part))


def said_about(code: Code, example: str, folder: Path) -> str:
    """What specc prints about an example."""
    commands = "\n".join(line.removeprefix("$ ") for line in example.splitlines())
    if not code.is_session:
        (folder / "spec.yaml").write_bytes(whole(example, code.within).encode())
        commands = "specc validate spec.yaml"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "NO_COLOR": "1"}
    program = f'specc() {{ "{sys.executable}" -m specc "$@"; }}\n{commands}'
    done = subprocess.run(
        ["bash", "-c", program],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stderr
