"""Repairs of random slips in names of all specifications: how many are made, which change more.

python bench/slips.py [COUNT [SEED]]
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[0] = str(ROOT)  # `tests` is a module beside this one


def main() -> int:
    """Print what came of it; 1 if a repair changed more than its place."""
    from tests.policy.slips import specifications
    from tests.policy.test_slips import wrong_repairs

    count, seed = (int(text) for text in (*sys.argv[1:], *("1000", "1")[len(sys.argv) - 1 :]))
    began_s = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        done, faults = wrong_repairs(specifications(Path(folder)), seed, count)
    spent_s = time.process_time() - began_s
    print("\n".join(faults))
    print(
        f"{count} slips, {done} repaired, {len(faults)} changed more; {spent_s:.0f} s of CPU time"
    )
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main())
