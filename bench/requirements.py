"""What exploring says of every requirement of the specifications of the project."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bench.harness.tables import table
from specc.pipeline import compile_spec
from specc.tools.explore.explorer import explore

SPECS = Path(__file__).resolve().parents[1] / "specs"
BUDGET = 700_000
"""That of `specc explore`."""
LONGEST = 90
HEAD = ("specification", "requirement", "verdict")


def judged(spec: Path) -> Iterator[tuple[str, str, str]]:
    """The rows of a specification."""
    result = compile_spec(str(spec))
    if not result.ok or result.system is None:
        yield spec.stem, "", "has errors"
        return
    for each in explore(result.proofs, BUDGET).requirements:
        that = each.requirement.name or each.requirement.that
        if len(that) > LONGEST:
            that = f"{that[: LONGEST - 3]}..."
        yield spec.stem, f"`{that}`", each.summary()


def main(arguments: Sequence[str] | None = None) -> int:
    """Explore and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("spec", type=Path, nargs="*", help="all of the project by default")
    places = ("*.yaml", "architectures/*.yaml", "examples/*.yaml")
    every = sorted(spec for place in places for spec in SPECS.glob(place))
    rows = [row for spec in parser.parse_args(arguments).spec or every for row in judged(spec)]
    said = Counter(" ".join(verdict.split()[:2]).strip(",") for *_, verdict in rows)
    title = "; ".join(f"{number} {verdict}" for verdict, number in said.most_common())
    print(table(f"Requirements: {title}", HEAD, rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
