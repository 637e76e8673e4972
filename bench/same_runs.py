"""Whether specifications that were rewritten do what they did: states, sent values and memory.

The specifications of a revision, with the parts that they use, are compared with those of the
working tree in runs of the same seeds, step by step. What modes remember is no memory of the
specification. Scalars are all keys and values of the YAML, with those of parts that have changed.

    python bench/same_runs.py REVISION                               the six of language 1.3
    python bench/same_runs.py REVISION specs/rovers.yaml --seeds 0:3 others
"""

from __future__ import annotations

import argparse
import filecmp
import hashlib
import io
import os
import re
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Iterator, Sequence
from itertools import zip_longest
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from ruamel.yaml import YAML
from ruamel.yaml.nodes import MappingNode, Node, SequenceNode
from specc_runtime import application, session
from specc_runtime.account import Account
from specc_runtime.options import Options
from specc_runtime.records import StepRecord, encode

from bench.harness.tables import table
from specc import output
from specc.pipeline import build

ROOT = Path(__file__).resolve().parents[1]
REWRITTEN = (
    "specs/architectures/two_cells.yaml",
    "specs/architectures/recovering_picking.yaml",
    "specs/architectures/syndicate.yaml",
    "specs/architectures/three_tier.yaml",
    "specs/architectures/two_tier.yaml",
    "specs/examples/panda_bin.yaml",
)
HEAD = ("specification", "scalars", "now", "fewer", "lines", "now", "steps", "the same")


# A run, in a process of its own.


def follow(spec: Path, seed: int, seconds: float, file: Path) -> int:
    """Run a specification; a line of `file` is a step: who, when, state, digest of the values."""
    built = build(str(spec))
    system = built.result.system
    assert system is not None
    declared = {
        s.qualified_name: [m.name for m in s.memory if "(" not in m.name] for s in system.subsystems
    }
    assert not list(output.write(file.parent / built.system, built.files))
    with file.open("w", encoding="utf-8") as lines:

        class Followed(Account):
            """An account that is told of every step as well."""

            def __init__(self, system: Any, *rest: Any) -> None:
                super().__init__(system, *rest)
                self._followed = {s.subsystem.name: s.subsystem for s in system.subsystems}

            @property
            def observers(self) -> tuple[Any, ...]:
                """Those of any account, and the file."""
                return (*super().observers, self._write)

            def _write(self, record: StepRecord) -> None:
                subsystem = self._followed[record.subsystem]
                memory = subsystem.memory
                kept = [(name, getattr(memory, name)) for name in declared[record.subsystem]]
                digest = hashlib.sha256(b"".join(map(_bytes, (*record.sent, *kept)))).hexdigest()
                step = record.subsystem, record.stamp, record.time_s, record.state, digest
                print(*step, file=lines)

        setattr(session, "Account", Followed)  # noqa: B010  # which it makes by this name
        return application.execute(
            Options(
                file.parent / built.system, spec.parent, seed=seed, duration_s=seconds, quiet=True
            )
        )


def _bytes(item: tuple[str, Any]) -> bytes:
    try:
        return encode(item)
    except TypeError:
        return encode(item[0])  # a value of an opaque type


# Both trees.


def files(spec: Path, specs: Path) -> set[Path]:
    """A file and those of `specs/parts` that it names, and these name; relative to `specs`."""
    text, found = spec.read_text(encoding="utf-8"), {spec.relative_to(specs)}
    for part in (specs / "parts").glob("*.yaml"):
        if part != spec and re.search(rf"\b{part.name}", text):
            found |= files(part, specs)
    return found


def scalars(node: Node) -> int:
    """How many keys and values there are."""
    if isinstance(node, MappingNode):
        return sum(scalars(key) + scalars(value) for key, value in node.value)
    return sum(map(scalars, node.value)) if isinstance(node, SequenceNode) else 1


def extents(before: Path, now: Path, spec: str) -> Iterator[tuple[int, int]]:
    """Scalars and lines, before and now, of a specification and of its parts that have changed."""
    names = files(now / spec, now / "specs") - {Path(spec).relative_to("specs")}
    pairs = [(before / "specs" / name, now / "specs" / name) for name in names]
    changed = [(old, new) for old, new in pairs if not filecmp.cmp(old, new, shallow=False)]
    for found in zip((before / spec, now / spec), *changed, strict=True):
        texts = [file.read_text(encoding="utf-8") for file in found]
        yield (
            sum(scalars(YAML().compose(text)) for text in texts),
            sum(t.count("\n") for t in texts),
        )


def steps(root: Path, spec: str, seed: int, seconds: float) -> list[str]:
    """What a run did."""
    with TemporaryDirectory() as scratch:
        file = Path(scratch) / "steps.txt"
        command: list[str | Path] = [
            sys.executable,
            __file__,
            "--follow",
            root / spec,
            str(seed),
            str(seconds),
            file,
        ]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        assert done.returncode in (0, 1) and file.exists() and file.stat().st_size, done.stderr
        return file.read_text(encoding="utf-8").splitlines()


def difference(before: Sequence[str], now: Sequence[str]) -> str:
    """The first step that is another one."""
    pairs = zip_longest(before, now, fillvalue="nothing")
    return next((f"{old}\n  now {new}" for old, new in pairs if old != new), "")


def trees(revision: str, folder: Path) -> Iterator[Path]:
    """Copies of the specifications of a revision and of the working tree."""
    archive = subprocess.run(
        ["git", "archive", revision, "specs"], cwd=ROOT, capture_output=True, check=True
    ).stdout
    for name in ("before", "now"):
        (folder / name).mkdir()
        (folder / name / "pyproject.toml").touch()
        shutil.copytree(ROOT / "models", folder / name / "models")
        yield folder / name
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        tar.extractall(folder / "before", filter="data")
    shutil.copytree(ROOT / "specs", folder / "now" / "specs")


def main() -> int:
    """Compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("revision", help="the one before they were rewritten")
    parser.add_argument("specs", nargs="*", default=REWRITTEN)
    parser.add_argument("--seeds", default="0:10", help="FIRST:END")
    parser.add_argument("--seconds", type=float, default=60.0)
    asked = parser.parse_args()
    seeds = range(*map(int, asked.seeds.split(":")))
    rows, fewer, wrong = [], [], 0
    with TemporaryDirectory() as folder:
        before, now = trees(asked.revision, Path(folder))
        for spec in asked.specs:
            count, same = 0, 0
            for seed in seeds:
                old, new = (steps(root, spec, seed, asked.seconds) for root in (before, now))
                differs = difference(old, new)
                if differs:
                    print(f"{spec}, seed {seed}: {differs}", file=sys.stderr)
                count, same = count + len(new), same + (not differs)
            wrong += len(seeds) - same
            (old_scalars, old_lines), (new_scalars, new_lines) = extents(before, now, spec)
            fewer.append(100 * (1 - new_scalars / old_scalars))
            sizes = (old_scalars, new_scalars, f"{fewer[-1]:.1f} %", old_lines, new_lines, count)
            rows.append((Path(spec).stem, *map(str, sizes), f"{same} of {len(seeds)}"))
    print(table(f"{median(fewer):.1f} % fewer scalars (median)", HEAD, rows))
    return wrong > 0


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if sys.argv[1:2] == ["--follow"]:
        sys.exit(follow(Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]), Path(sys.argv[5])))
    sys.exit(main())
