"""Which of 80 mistakes are found, that a roboticist who did not know the checks made in specs/.

`bench/seeding/mistakes.yaml` has the mistakes. Each is labelled as visible or not to a reader who
does not know the intent of the design, with the reason. A mistake counts as found if the edited
system has a finding that the system as shipped does not have. Not judged is whether the finding
points at the mistake; runs of the generated code are left out.

    python bench/mistakes.py             print the table
    python bench/mistakes.py --list      and each mistake with its findings
    python bench/mistakes.py --only U01 T05
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from ruamel.yaml import YAML

from bench.harness.tables import table
from specc.pipeline import compile_spec
from specc.tools.explore.explorer import explore

ROOT = Path(__file__).parents[1]
MISTAKES = ROOT / "bench/seeding/mistakes.yaml"
BUDGET = 700_000
RUN_S = 200
"""How long a run may take on this machine; one that takes longer has lost its way."""
Heard = Counter[tuple[str, str]]
"""Findings by code and message."""


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake: edits of a file, and the system that is checked."""

    id: str
    kind: str
    file: str
    system: str
    edits: tuple[tuple[str, str], ...]
    mistake: str
    visible: bool
    because: str

    def make(self, root: Path) -> None:
        """Edit the file below a copy of the repository."""
        path = root / self.file
        text = path.read_text(encoding="utf-8")
        for old, new in self.edits:
            assert text.count(old) == 1, (self.id, old)
            text = text.replace(old, new)
        path.write_text(text, encoding="utf-8")


@dataclass(frozen=True, slots=True)
class Judged:
    """What is new with a mistake, by `validate` and by `explore`."""

    mistake: Mistake
    by_validate: Heard
    by_explore: Heard
    by_run: bool


def mistakes() -> list[Mistake]:
    """All mistakes, in the order of the file."""
    entries = YAML(typ="safe").load(MISTAKES.read_text(encoding="utf-8"))
    return [
        Mistake(**{**entry, "edits": tuple((e["old"], e["new"]) for e in entry["edits"])})
        for entry in entries
    ]


def heard(system: Path) -> tuple[Heard, Heard]:
    """What `validate` and `explore` say of a system."""
    result = compile_spec(str(system))
    told: Heard = Counter((d.code, d.message) for d in result.diagnostics)
    if not result.ok or result.system is None or result.is_part:
        return told, Counter()
    found = explore(result.proofs, BUDGET).findings
    return told, Counter((finding.code, finding.message) for finding in found)


def fails(root: Path, system: str) -> bool:
    """Whether a run says that something is wrong."""
    command = [sys.executable, "-m", "specc", "run", system, "--cycles", "1"]
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'runtime'}"}
    try:
        done = subprocess.run(
            command, cwd=root, env=environment, capture_output=True, timeout=RUN_S, check=False
        )
    except subprocess.TimeoutExpired:
        return True
    return done.returncode != 0


def use_copied_parts(specs: Path) -> None:
    """Let copied specifications use the copied parts of the library, in which mistakes are made."""
    for path in specs.rglob("*.yaml"):
        lib = os.path.relpath(specs / "lib", path.parent)
        text = path.read_text(encoding="utf-8")
        path.write_text(re.sub(r"\bspecc:(\w+)", rf"{lib}/\1.yaml", text), encoding="utf-8")


def judged(mistake: Mistake) -> Judged:
    """What is new with a mistake."""
    with TemporaryDirectory() as folder:
        root = Path(folder)
        shutil.copytree(ROOT / "specs", root / "specs")
        use_copied_parts(root / "specs")
        shutil.copy(ROOT / "pyproject.toml", root)  # the root of the project
        shutil.copytree(ROOT / "models", root / "models")
        before = heard(root / mistake.system)
        unreadable = [code for code, _ in before[0] if code.startswith("E00")]
        assert not unreadable, before  # the copy has what the system needs
        failed = fails(root, mistake.system)
        mistake.make(root)
        after = heard(root / mistake.system)
        by_run = not failed and fails(root, mistake.system)
    return Judged(mistake, after[0] - before[0], after[1] - before[1], by_run)


def main() -> int:
    """Print which mistakes are found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--list", action="store_true", help="print each mistake with its findings")
    parser.add_argument("--only", nargs="*", default=[], help="ids of the mistakes to judge")
    arguments = parser.parse_args()
    chosen = [m for m in mistakes() if not arguments.only or m.id in arguments.only]
    with ProcessPoolExecutor(2) as pool:
        results = list(pool.map(judged, chosen))
    if arguments.list:
        print("\n".join(line for each in results for line in listed(each)))
    title = "Mistakes of which a finding tells; whether it points at the mistake is left out"
    print(table(title, ("", "made", "found", "visible", "found"), [*rows(results)]))
    return 0


def listed(one: Judged) -> Iterator[str]:
    """A mistake with its findings."""
    visible = "visible" if one.mistake.visible else "not visible"
    yield f"{one.mistake.id} ({visible}) {one.mistake.file}: {one.mistake.mistake}"
    for by, findings in (("validate", one.by_validate), ("explore", one.by_explore)):
        yield from (f"    {by}: {code} {message}" for code, message in findings)
    if one.by_run:
        yield "    run: it fails"


def rows(results: list[Judged]) -> Iterator[tuple[str, ...]]:
    """By kind, and by what is used."""
    kinds = {each.mistake.kind: None for each in results}
    for kind in (*kinds, "all"):
        of = [each for each in results if kind in (each.mistake.kind, "all")]
        yield row(f"{kind}: validate", of, [bool(each.by_validate) for each in of])
        either = [bool(each.by_validate or each.by_explore) for each in of]
        yield row(f"{kind}: validate or explore", of, either)
        by_any = [one or each.by_run for one, each in zip(either, of, strict=True)]
        yield row(f"{kind}: validate, explore or a run", of, by_any)


def row(name: str, of: list[Judged], found: list[bool]) -> tuple[str, ...]:
    """How many were made and found, and how many visible ones were."""
    visible = [each.mistake.visible for each in of]
    both = sum(v and f for v, f in zip(visible, found, strict=True))
    return name, *map(str, (len(of), sum(found), sum(visible), both))


if __name__ == "__main__":
    sys.exit(main())
