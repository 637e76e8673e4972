"""Whether `specc init --model` makes of each model a specification that holds its pose at once.

    python bench/from_models.py                           those of specs/plants
    python bench/from_models.py arm.xml gripper.xml base.xml

Nothing that is written is edited. A joint may go 0.05 rad or 5 mm from its start in the 5 s of a
run. Joints without an actuator are left out.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from bench.harness.building import SPECS
from bench.harness.held import farthest
from bench.harness.tables import table
from specc.cli import main as specc

TITLE = "Specifications of models as `init` writes them; joints without an actuator are left out"
HEAD = ("model", "init [s]", "lines", "findings", "run", "farthest, of 1", "joint")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table; 1 if a model has no specification that holds its pose."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    own = sorted((SPECS / "plants").glob("*.xml"))
    parser.add_argument("models", nargs="*", metavar="MODEL.xml", type=Path, default=own)
    rows = [_row(model) for model in parser.parse_args(arguments).models]
    print(table(TITLE, HEAD, rows))
    return int(any(row[3:5] != ("none", "completed") or not float(row[5]) < 1.0 for row in rows))


def _row(model: Path) -> tuple[str, ...]:
    name = "/".join(model.parts[-2:])
    with TemporaryDirectory(prefix="specc-bench-") as folder:
        begin = perf_counter()
        told = _said("init", folder, "--model", str(model))
        if told:
            return name, *"----", "inf", told.splitlines()[-1][:60]
        spent = f"{perf_counter() - begin:.1f}"
        (spec,) = Path(folder).glob("*.yaml")
        lines = str(spec.read_text(encoding="utf-8").count("\n"))
        found = _said("validate", "--strict", str(spec)) and "some"
        with farthest() as far:
            ended = _said("run", str(spec), "--cycle-limit", "6") and "failed"
        joint = max(far, key=far.__getitem__, default="")
        most = f"{far.get(joint, float('nan')):.3f}"
        return name, spent, lines, found or "none", ended or "completed", most, joint


def _said(*arguments: str) -> str:
    """What a command says that does not succeed."""
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as told:
        return "" if specc(arguments) == 0 else told.getvalue() or "refused"


if __name__ == "__main__":
    sys.exit(main())
