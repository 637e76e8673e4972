"""Sends files that no person would write through the compiler: no traceback, no hang, no flood.

A fifth of the files come from nothing (bytes, words of YAML, trees of known keys), the others are
specifications of the project with a few changes that know their structure. Every file is built and
its findings are rendered, within some CPU time (--limit) and 1 GB of memory; some also go through
another command, an editor, or as XML through an importer. The same seed gives the same files; what
fails is kept in the folder that is named with --keep.

    python bench/fuzz.py 1000 --seed 1
"""

from __future__ import annotations

import argparse
import resource
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from time import monotonic

from bench.fuzzing.edits import edited
from bench.fuzzing.others import tried_elsewhere
from bench.fuzzing.texts import random_bytes, random_tree, random_words
from bench.fuzzing.trial import Trial, beds, confined, tried
from bench.seeding.sheet import Sheet

ROOT = Path(__file__).parents[1]
SOURCES = (ROOT / "specs", ROOT / "bench/specs", ROOT / "tests/cases")
FROM_NOTHING = 0.2
MOST_CHANGES = 4
ELSEWHERE = 0.1
"""Share of files that also go through another command, an importer or the language server."""


@dataclass(slots=True)
class Tally:
    """What came of all files, each of which may take `limit_s` of CPU time."""

    limit_s: float
    files: int = 0
    others: int = 0
    accepted: int = 0
    slowest_s: float = 0.0
    codes: Counter[str] = field(default_factory=Counter)
    faults: list[tuple[bytes, str]] = field(default_factory=list)

    def note(self, content: bytes, trial: Trial) -> None:
        """Count what else was done with a file."""
        self.others += 1
        self._judge(content, trial)

    def add(self, content: bytes, trial: Trial) -> None:
        """Count one file."""
        self.files += 1
        self.accepted += trial.accepted
        self.codes.update(trial.codes)
        self._judge(content, trial)

    def _judge(self, content: bytes, trial: Trial) -> None:
        self.slowest_s = max(self.slowest_s, trial.seconds)
        slow = f"{trial.seconds:.1f} s of CPU time" if trial.seconds > self.limit_s else ""
        if fault := trial.fault or slow:
            self.faults.append((content, fault))


def main(arguments: Sequence[str] | None = None) -> int:
    """Try the files and print what came of them; 1 if anything went wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", type=int, nargs="?", default=500, help="how many")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers")
    parser.add_argument("--minutes", type=float, default=60.0, help="stop after this time")
    parser.add_argument("--limit", type=float, default=2.0, help="CPU time of a file, in seconds")
    parser.add_argument("--keep", type=Path, help="folder for the files that fail")
    options = parser.parse_args(arguments)
    confined()
    with TemporaryDirectory(prefix="specc-fuzz-") as scratch:
        tally = Tally(options.limit)
        fuzz(tally, options.files, options.seed, options.minutes, Path(scratch))
    print(summary(tally, options.seed))
    for number, (content, fault) in enumerate(tally.faults):
        print(f"\nfault {number}: {fault}", file=sys.stderr)
        if options.keep is not None:
            options.keep.mkdir(parents=True, exist_ok=True)
            (options.keep / f"{options.seed}_{number}.yaml").write_bytes(content)
    return 1 if tally.faults else 0


def fuzz(tally: Tally, files: int, seed: int, minutes: float, scratch: Path) -> None:
    """Try so many files, or as many as the time allows."""
    random, end = Random(seed), monotonic() + 60.0 * minutes
    folders = [f for n, source in enumerate(SOURCES) for f in beds(source, scratch / str(n))]
    originals = {folder: (folder / "spec.yaml").read_bytes() for folder in folders}
    for _ in range(files):
        if monotonic() > end:
            break
        folder = random.choice(folders)
        content = made(folder / "spec.yaml", originals[folder], random)
        path = folder / "fuzzed.yaml"
        path.write_bytes(content)
        tally.add(content, tried(path))
        if random.random() < ELSEWHERE:
            tally.note(content, tried_elsewhere(path, folder / "spec.yaml", random))


def made(spec: Path, original: bytes, random: Random) -> bytes:
    """The content of one file, from nothing or from a specification."""
    if random.random() < FROM_NOTHING:
        return random.choice((random_bytes, random_words, random_tree))(random)
    spec.write_bytes(original)
    text = original.decode("utf-8", "surrogateescape")
    for _ in range(random.randint(1, MOST_CHANGES)):
        try:
            text = edited(Sheet.read(spec), random)
        except (ValueError, IndexError):  # no longer YAML, or nothing to change
            break
        spec.write_bytes(text.encode("utf-8", "surrogatepass"))
    return spec.read_bytes()


def summary(tally: Tally, seed: int) -> str:
    """A few lines for a person."""
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return (
        f"{tally.files} files, seed {seed}: {tally.accepted} accepted, {len(tally.faults)} faults\n"
        f"{tally.others} of them tried elsewhere too; {len(tally.codes)} codes met; "
        f"slowest {tally.slowest_s:.2f} s, memory {peak_mb:.0f} MB"
    )


if __name__ == "__main__":
    sys.exit(main())
