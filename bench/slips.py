"""Repairs of random slips in names of all specifications: how many are made, which change more."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[0] = str(ROOT)  # `tests` is a module beside this one


def main() -> int:
    """Print what came of it; 1 if a repair changed more than its place."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=1000, help="slips")
    parser.add_argument("seed", type=int, nargs="?", default=1, help="of the random numbers")
    options = parser.parse_args()
    from tests.policy.slips import specifications
    from tests.policy.test_slips import wrong_repairs

    began_s = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        done, faults = wrong_repairs(specifications(Path(folder)), options.seed, options.count)
    spent_s = time.process_time() - began_s
    print("\n".join(faults))
    print(
        f"{options.count} slips, {done} repaired, {len(faults)} changed more; "
        f"{spent_s:.0f} s of CPU time"
    )
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
