"""Examples of codes made into files: laid into host.yaml, or run as commands in a workspace."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Any

from tests.commands import specc
from tests.docs.examples import data, merged

HERE = Path(__file__).parent
PLANTS = HERE.parents[1] / "tests/docs/plants"
OUTSIDE_QUOTES = re.compile(r";\s*(?=(?:[^']*'[^']*')*[^']*$)")
"""What separates the commands of a line."""
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


def said_about(example: str, folder: Path) -> str:
    """What specc prints in a session; other programs run in a shell, specc in this process."""
    said = ""
    for line in example.splitlines():
        for part in OUTSIDE_QUOTES.split(line.removeprefix("$ ").partition("    #")[0]):
            program, *arguments = shlex.split(part)
            if program == "specc":
                said += specc(*arguments, cwd=folder).stderr
            else:
                subprocess.run(["bash", "-c", part], cwd=folder, check=True)
    return said
