"""The paper's experience as data: sweeps of the flagship, and docs/experiments.md made from them.

`python bench/experiments.py` prints what the page says by the data under docs/experiments/, and
`--write` makes the page from it. `--run` first makes the runs that are missing, which takes hours:
a few seeds of everything, then more. It can be ended at any time and goes on where it was.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.harness import experience

ROOT = Path(__file__).resolve().parents[1]
SPECS = ROOT / "specs"
FLAGSHIP = SPECS / "irp_picking.yaml"
WORK = ROOT / "sweeps" / "experiments"

Change = tuple[str, str]
"""A text of the flagship, and what stands in its place."""

LOW_HAND = ("X_EF", "translation(0, 0, -0.03[m])")
"""Fingers are believed shorter than they are: the palm meets the box before the grasp pose is
reached, so that only a force can end the approach (57)."""

CROWDED = ("irp6_picking:PickingScene", "irp6_picking:CrowdedScene")
TWO_PICKS = ("--cycles", "2")

PUBLISHED: Mapping[str, tuple[Change, ...]] = {
    "17": (('m_i: {is: "MI(m_0, m_1, elapsed)"', "m_i: {is: m_1"),),
    "27": (('q_d: {is: "IK(DK(q_p) @ AA(', 'q_d: {is: "IK(T_c @ AA('),),
    "29": (
        ("functions: [hold, sense, rest]", "functions: [hold, sense]"),
        ("remember_goal, rest]", "remember_goal]"),
    ),
    "53": (
        ("functions: [command_initial_pose, forget_scene]", "functions: [command_initial_pose]"),
    ),
    "57": (("    is: 2[N]\n", "    is: 0[N]\n"),),
    "58": (
        (
            "d_o: {is: norm(position(fingers.X_Bl) - position(fingers.X_Br)), eq: 67}",
            'd_o: {is: "norm(position(fingers.X_Bl) - position(fingers.X_Br)) + 0.004[m]", eq: 67}',
        ),
    ),
    "64": (("if fresh(x.k.O_c) else O_c", "if present(x.k.O_c) else O_c"),),
    "67": (('O_g: {is: "GO(O_c, X_EF, X_PG, q_s)"', "O_g: {is: O_c"), CROWDED),
}
"""Equation -> what makes the flagship do as it was published, where that runs."""


@dataclass(frozen=True)
class Experiment:
    """A sweep of the flagship, as it is or changed."""

    name: str
    seeds: int
    spec: Path = FLAGSHIP
    changes: tuple[Change, ...] = ()
    options: tuple[str, ...] = ()
    values: Mapping[str, str] = field(default_factory=dict)

    def made_to(self, seeds: int, workers: int) -> Path:
        """The table with that many seeds, or with all where these are fewer.

        Raises SystemExit when it cannot be made.
        """
        out = WORK / self.name
        sets = [
            part for name, value in self.values.items() for part in ("--set", f"{name}={value}")
        ]
        command = [sys.executable, "-m", "specc", "sweep", str(self._written()), *sets]
        command += ["--seeds", f"0:{min(seeds, self.seeds)}", "--out", str(out)]
        command += ["--workers", str(workers), "--cycles", "1", *self.options]
        if code := subprocess.run(command, check=False).returncode:
            raise SystemExit(code)
        return out / "runs.csv"

    def _written(self) -> Path:
        """The specification, changed in texts that occur exactly once."""
        if not self.changes:
            return self.spec
        folder = WORK / "specs" / self.name
        shutil.rmtree(folder, ignore_errors=True)
        for name in ("parts", "plants", "objects"):
            shutil.copytree(SPECS / name, folder / name)
        text = FLAGSHIP.read_text(encoding="utf-8")
        for old, new in self.changes:
            if text.count(old) != 1:
                raise SystemExit(f"{self.name}: not there, or more than once: {old}")
            text = text.replace(old, new)
        path = folder / FLAGSHIP.name
        path.write_text(text, encoding="utf-8")
        return path


CONTACT = Experiment(
    "contact",
    20,
    values={
        "D_z": "100,150,200,300,400,600,800,1000",
        "I_z": "0,5,20",
        LOW_HAND[0]: LOW_HAND[1],
    },
)
PICKS = Experiment("picks", 400)
TWICE = Experiment("twice", 20, options=TWO_PICKS)
CROWD = Experiment("crowded", 20, changes=(CROWDED,))
FORMS = [
    Experiment(
        f"published_{equation}",
        20,
        changes=changes,
        options=TWO_PICKS if equation in ("29", "53", "64") else (),
        values={LOW_HAND[0]: LOW_HAND[1]} if equation == "27" else {},
    )
    for equation, changes in PUBLISHED.items()
]
ALL = (PICKS, *FORMS, TWICE, CROWD, CONTACT)
ROUNDS = ((2, 10), (5, 50), (10, 100), (20, 400))
"""Seeds of experiments, and of picks, after each round: all of them grow together."""


def main() -> None:
    """Print or make the page, after the runs that are missing if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--run", action="store_true", help="make the runs that are missing")
    parser.add_argument("--write", action="store_true", help="make the page from the data")
    parser.add_argument("--workers", type=int, default=2, help="runs at once")
    options = parser.parse_args()
    for seeds, picks in ROUNDS if options.run else ():
        for one in ALL:
            experience.keep(
                one.name, one.made_to(picks if one is PICKS else seeds, options.workers)
            )
    if options.run:
        from bench.harness import recognition

        experience.keep_rows("recognition", list(recognition.trials()))
    if options.run or options.write:
        experience.write_page()
    else:
        print(experience.page(experience.PAGE.read_text(encoding="utf-8")))


if __name__ == "__main__":
    main()
