"""The blocks of docs/tutorial.md, and what its commands answer.

`python -m tests.docs.tutorial` writes the present answers into the tutorial.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from specc.cli import main

ROOT = Path(__file__).resolve().parents[2]
TUTORIAL = ROOT / "docs" / "tutorial.md"
VALIDATE = "$ specc validate specs/my_gate.yaml\n"
# A hidden line above a command names the lines that the reader is asked to take out.
BLOCK = re.compile(
    r"(?:^<!-- without: (?P<without>[^\n]*) -->\n)?^```(?P<kind>\w+)\n(?P<text>.*?)^```$",
    re.MULTILINE | re.DOTALL,
)


@dataclass(frozen=True, slots=True)
class Step:
    """A `specc validate` of the tutorial: what is in the file then, and the answer shown."""

    spec: str
    shown: str
    span: tuple[int, int]
    """Where the answer stands in the tutorial."""


def pieces(kind: str) -> list[str]:
    """The texts of the tutorial's blocks of one kind, in order."""
    blocks = BLOCK.finditer(TUTORIAL.read_text(encoding="utf-8"))
    return [block["text"] for block in blocks if block["kind"] == kind]


def steps() -> Iterator[Step]:
    """The steps in order; the file grows by the YAML blocks before each."""
    written = ""
    for block in BLOCK.finditer(TUTORIAL.read_text(encoding="utf-8")):
        if block["kind"] == "yaml":
            written += block["text"]
        elif block["text"].startswith(VALIDATE):
            out = shlex.split(block["without"] or "")
            kept = [line for line in written.splitlines() if line not in out]
            assert len(kept) == len(written.splitlines()) - len(out), out
            start, end = block.span("text")
            shown = block["text"].removeprefix(VALIDATE)
            yield Step("\n".join(kept) + "\n", shown, (start + len(VALIDATE), end))


def answer(step: Step) -> str:
    """What the command says."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        shutil.copytree(ROOT / "specs" / "plants", "specs/plants")
        Path("specs/my_gate.yaml").write_text(step.spec, encoding="utf-8")
        with contextlib.redirect_stderr(io.StringIO()) as said:
            main(["validate", "specs/my_gate.yaml"])
    return said.getvalue().strip() + "\n"


def refreshed() -> str:
    """The tutorial with the present answers."""
    text = TUTORIAL.read_text(encoding="utf-8")
    for step in reversed(list(steps())):
        start, end = step.span
        text = text[:start] + answer(step) + text[end:]
    return text


if __name__ == "__main__":
    TUTORIAL.write_text(refreshed(), encoding="utf-8")
