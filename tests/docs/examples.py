"""The fenced YAML examples of a document, made into specifications that can be compiled.

An example is a whole file, or its first line says where it belongs: `# in: subsystem` splices it
into host.yaml, `# file: lib/a.yaml` makes it a file that other examples use. `# error: E0312` says
that it is refused with that code.
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from specc.read import read_text

HERE = Path(__file__).parent
FENCE = re.compile(r"^```yaml\n(.*?)^```$", re.MULTILINE | re.DOTALL)
MARK = re.compile(r"^# (in|file|error): (\S+)\n", re.MULTILINE)
CONTEXTS: dict[str, tuple[str, ...]] = {
    "top": (),
    "control": ("agents", "arm", "control"),
    "subsystem": ("agents", "arm", "virtual_effectors", "m"),
    "let": ("agents", "arm", "virtual_effectors", "m", "let"),
}


@dataclass(frozen=True, slots=True)
class Example:
    """A fenced block: the line it starts at, its text and its marks."""

    line: int
    text: str
    context: str
    file: str
    error: str

    def __str__(self) -> str:
        return f"line {self.line}"


def examples(document: Path) -> list[Example]:
    """The YAML examples of a document, in order."""
    text = document.read_text(encoding="utf-8")
    found = []
    for block in FENCE.finditer(text):
        marks = dict(MARK.findall(block[1]))
        line = text.count("\n", 0, block.start()) + 1
        place = (marks.get(key, "") for key in ("in", "file", "error"))
        found.append(Example(line, block[1], *place))
    return found


def put(example: Example, files: list[Example], folder: Path) -> Path:
    """Write the specification that an example makes, with the files that it may use."""
    shutil.copytree(HERE / "plants", folder / "plants")
    for file in files:
        path = folder / file.file
        path.parent.mkdir(exist_ok=True)
        path.write_text(file.text, encoding="utf-8")
    path = folder / "example.yaml"
    path.write_text(_whole(example), encoding="utf-8")
    return path


def _whole(example: Example) -> str:
    if not example.context:
        return example.text
    part: Any = data(example.text)
    for key in reversed(CONTEXTS[example.context]):
        part = {key: part}
    host = data((HERE / "host.yaml").read_text(encoding="utf-8"))
    return json.dumps(merged(host, part), ensure_ascii=False)


def data(text: str) -> Any:
    """What a YAML text says."""
    document = read_text("example", text, ())
    assert document.ok, document.diagnostics
    return document.data


def merged(base: Any, part: Any) -> Any:
    """`base` with `part` laid over it: mappings key by key, anything else as a whole."""
    if isinstance(base, Mapping) and isinstance(part, Mapping):
        return {
            key: merged(base.get(key), part.get(key, base.get(key))) for key in {**base, **part}
        }
    return base if part is None else part
