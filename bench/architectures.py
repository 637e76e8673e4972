"""The ten runs that docs/architectures.md tells of; tests repeat fewer.

What the page says of each is compared with it, as the tests do.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.harness.tables import table
from tests.scenarios.architectures import ARCHITECTURES, Architecture
from tests.scenarios.test_architectures import met_of

RUNS = 10
TITLE = f"Runs that meet all requirements, of seeds 0 to {RUNS - 1}; CPU time with its processes"
HEAD = ("architecture", "simulated [s]", "met", "CPU of a run [s]")


def measured(each: Architecture) -> tuple[str, ...]:
    """The row of an architecture."""
    before_s = sum(os.times()[:4])
    with TemporaryDirectory(prefix="specc-architectures-") as scratch:
        met = met_of(each, RUNS, Path(scratch))
    cpu_s = sum(os.times()[:4]) - before_s
    return each.name, str(each.duration_s), f"{met} of {RUNS}", f"{cpu_s / RUNS:.0f}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the runs and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    known = [each.name for each in ARCHITECTURES]
    parser.add_argument("name", nargs="*", help=f"all by default: {', '.join(known)}")
    names = parser.parse_args(arguments).name
    if unknown := sorted({*names} - {*known}):
        parser.error(f"unknown: {', '.join(unknown)}")
    chosen = [each for each in ARCHITECTURES if not names or each.name in names]
    print(table(TITLE, HEAD, [measured(each) for each in chosen]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
