"""How often, and how fast, joint positions are found for random poses that arms can take.

    python bench/inverse_kinematics.py                      the arms of the project's specifications
    python bench/inverse_kinematics.py ur5e.xml base tip 6  another one, as `load_arm` takes it

Each pose is that of random joint positions within their ranges, a turn where there are none, and is
looked for from others. Times are of one processor and leave out the loading of models.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from time import perf_counter

import numpy as np
from specc_runtime.operators.arms.kinematics import direct_kinematics, inverse_kinematics
from specc_runtime.operators.arms.model import Arm, load_arm

from bench.harness.building import SPECS
from bench.harness.tables import table

OWN = (
    ("panda_bin.xml", "arm_panda_link0", "arm_wrist_site", 7),
    ("irp6_picking.xml", "world", "tool", 6),
)
TITLE = "Inverse kinematics of random poses within reach, from random seeds"
HEAD = ("arm", "poses", "found", "ms, mean", "ms, most", "|X - DK(IK(X))|, most")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; 1 if less than 99 % of the poses of an arm are found."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("arm", nargs="*", metavar="MODEL.xml BASE TIP N")
    parser.add_argument("--poses", type=int, default=1000)
    options = parser.parse_args(arguments)
    if len(options.arm) not in (0, 4):
        parser.error("an arm is a model, its base, its tip and the number of its joints")
    own = [(str(SPECS / "plants" / model), base, tip, n) for model, base, tip, n in OWN]
    given = [(*options.arm[:3], int(options.arm[3]))] if options.arm else own
    rows = [_row(model, base, tip, n, options.poses) for model, base, tip, n in given]
    print(table(TITLE, HEAD, rows))
    return int(any(int(row[2]) < 0.99 * int(row[1]) for row in rows))


def _row(model: str, base: str, tip: str, n: int, poses: int) -> tuple[str, ...]:
    arm = load_arm(model, base, tip, n)
    rng = np.random.default_rng(0)
    times_s, errors = [], []
    for _ in range(poses):
        X_BE, q_p = direct_kinematics(arm, _drawn(arm, rng)), _drawn(arm, rng)
        begin = perf_counter()
        found = inverse_kinematics(arm, X_BE, q_p)
        times_s.append(perf_counter() - begin)
        if found is not None:
            errors.append(float(np.abs(direct_kinematics(arm, found) - X_BE).max()))
    name = f"{model.rpartition('/')[2]} {tip}"
    mean, most = 1e3 * np.mean(times_s), 1e3 * max(times_s)
    worst = f"{max(errors, default=np.nan):.1e}"
    return name, str(poses), str(len(errors)), f"{mean:.2f}", f"{most:.1f}", worst


def _drawn(arm: Arm, rng: np.random.Generator) -> np.ndarray:
    lower, upper = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    return rng.uniform(lower, upper)


if __name__ == "__main__":
    sys.exit(main())
