"""Slips of the pen in names of specifications, and what `--fix` makes of them."""

from __future__ import annotations

import random
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from specc.cli.fix import ROUNDS, apply_repairs
from specc.cli.inspect import inspect_all
from specc.diagnostics.report import Finding, report, resolve
from specc.pipeline import Result, check_spec, read_spec
from specc.policy import Overrides, clear_cache
from specc.read import read_file
from specc.source import TextNode
from specc.tools.diff import compare

ROOT = Path(__file__).resolve().parents[2]
_NAME = re.compile(r"[A-Za-z_]\w{2,}")
_UNFINISHED = ("irp_picking_as_published.yaml",)
"""What is missing has the name of the place where it is missing, so names are meaning there."""
_ELSEWHERE = "examples"
"""The folder of specifications whose models are installed beside `specs`."""
_PROSE = ("title", "because", "python", "eq", "fig", "table")


class Slip(NamedTuple):
    """A text with one mistake in it: `wrong` from `start` on, where `right` was meant."""

    path: Path
    start: int
    right: str
    wrong: str

    def text(self, good: str) -> str:
        return good[: self.start] + self.wrong + good[self.start + len(self.right) :]


class Outcome(NamedTuple):
    """What became of a slip: what was repaired, and how what is left differs, if anything was."""

    repaired: bool
    fault: str


def specifications(folder: Path) -> list[Path]:
    """A copy of all specifications, with what they need."""
    shutil.copytree(ROOT / "specs", folder / "specs", symlinks=True)
    (folder / "pyproject.toml").write_text("[tool.specc]\n")
    paths = sorted((folder / "specs").rglob("*.yaml"))
    return [p for p in paths if p.name not in _UNFINISHED and p.parent.name != _ELSEWHERE]


def slips(paths: list[Path], seed: int) -> Iterator[Slip]:
    """Slips without end: in any specification, in any name of it, of any kind."""
    rng = random.Random(seed)
    names = {path: _names(path) for path in paths}
    while True:
        path = rng.choice(paths)
        inside = [at for at, in_for in names[path] if in_for]
        every = inside if inside and rng.random() < 0.3 else [at for at, _ in names[path]]
        start, right = rng.choice(every)
        wrong = _slipped(right, rng)
        if wrong != right:
            yield Slip(path, start, right, wrong)


def _names(path: Path) -> list[tuple[tuple[int, str], bool]]:
    """Names with where they stand, and whether an index does too."""
    source = read_file(str(path)).source
    found = []
    for node in _scalars(source.spans):
        text = source.text[node.start : node.end]
        for name in _NAME.finditer(text):
            found.append(((node.start + name.start(), name[0]), "{" in text))
    return found


def _scalars(node: TextNode | None) -> Iterator[TextNode]:
    if node is None:
        return
    for step, key in node.keys.items():
        yield key
        if step not in _PROSE:
            yield from _scalars(node.values[step])
    yield from (n for s, v in node.values.items() if s not in node.keys for n in _scalars(v))
    if node.scalar is not None:
        yield node


def _slipped(name: str, rng: random.Random) -> str:
    at = rng.randrange(len(name))
    before, letter, behind = name[:at], name[at], name[at + 1 :]
    match rng.choice(("other", "dropped", "doubled", "swapped", "case")):
        case "other":
            return before + rng.choice("abcdefghijklmnopqrstuvwxyz") + behind
        case "dropped":
            return before + behind
        case "doubled":
            return before + letter + letter + behind
        case "swapped":
            return before + behind[:1] + letter + behind[1:]
    return before + letter.swapcase() + behind


def mended(slip: Slip, good: str, meant: Result, whole: bool = False) -> Outcome:
    """Make a slip, repair it as `--fix` does, and compare with what was `meant`.

    Unless it is the `whole`, only what is found without proofs is looked at.
    """
    path = str(slip.path)
    slip.path.write_text(slip.text(good), encoding="utf-8")
    try:
        repaired, earlier = False, set[str]()
        for _ in range(ROUNDS):
            if not apply_repairs(_findings(path, whole), [path], earlier):
                break
            repaired = True
        text = slip.path.read_text(encoding="utf-8")
        return Outcome(repaired, _fault(path, text, good, meant) if repaired else "")
    finally:
        slip.path.write_text(good, encoding="utf-8")


def _findings(path: str, whole: bool) -> list[Finding]:
    if whole:
        clear_cache()
        return list(inspect_all([path], Overrides()).findings)
    result = read(path)
    return list(report(resolve(result.diagnostics, result.sources), [path]).findings)


def read(path: str) -> Result:
    """A system without proofs; a part with them, since it has nothing that takes long."""
    return check_spec(path) if "/lib/" in path or "/parts/" in path else read_spec(path)


def _fault(path: str, text: str, good: str, meant: Result) -> str:
    if text == good:
        return ""
    now = read(path)
    if now.system is None or meant.system is None:
        return "no system"
    if len(now.diagnostics) > len(meant.diagnostics):
        return f"left with {now.diagnostics[0].message}"
    changes = compare(meant.system, now.system).differences
    return f"{changes[0].where} {changes[0].part} {changes[0].name}" if changes else ""
