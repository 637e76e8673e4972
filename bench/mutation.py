"""The mutation score: seeds faults of many classes into specs/ and counts which are found.

A fault is an edit of the text that leaves the rest as it is. It is found if it is reported with a
code of its class, at its line if the finding or a place shown with it is on a line where the fault
can be seen, and an extra complaint is any finding that does not follow from it. No chance is
involved: the same specifications and the same compiler give the same table.

    python bench/mutation.py             print the table
    python bench/mutation.py --write     and put it into docs/mutation_score.md
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from bench.harness.tables import table
from bench.seeding.classes import FAULTS, GROUPS, MEASURED, RIVALS
from bench.seeding.fault import Fault
from bench.seeding.score import Bed, Score, beds, scores

ROOT = Path(__file__).parents[1]
DOCUMENT = ROOT / "docs/mutation_score.md"
MOST = 40
HEAD = ("fault", "seeded", "found", "at its line", "extra")

INTRODUCTION = """\
# Mutation score

Made by `python bench/mutation.py --write`. Faults of {classes} classes are seeded into
{files}, one at a time, by edits of the
text that leave the rest as it is: at every place that a class has in a file, at most {most} of
them, evenly spread. {seeded} faults were seeded, {found} were found, {line} of them at the right
line; {extra} brought another complaint. The files as they are give no finding.

- *found*: reported with a code of the class.
- *at its line*: the finding, or a place that is shown with it, is on a line where the fault can be
  seen: both ends of a connection, the rows of the state.
- *extra*: faults with a finding that does not follow from them.

The last columns say what other tools say when they load one such fault; an empty cell is a class
that they cannot express. Of the nine faults that were tried sismic found 2, the YAML loader of
python-statemachine 2 and transitions none. (a): one of the three, which was not noted down.
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table; with `--write` put it into the documentation."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help=f"write docs/{DOCUMENT.name}")
    parser.add_argument("--most", type=int, default=MOST, help="faults of a class in one file")
    options = parser.parse_args(arguments)
    soil = fertile(beds(ROOT / "specs"))
    found = [score for score, _ in scores(FAULTS, soil, options.most)]
    rows = [(s.fault.name, *map(str, s.counts)) for s in found]
    print(table(f"{len(soil)} files", HEAD, [*rows, ("all", *map(str, total(found)))]))
    if options.write:
        DOCUMENT.write_text(document(found, soil, options.most), encoding="utf-8")


def fertile(soil: Sequence[Bed]) -> list[Bed]:
    """The files that have no finding as they are; of any other this is said."""
    good = []
    for bed in soil:
        if bed.findings():
            print(f"{bed.sheet.path} has findings of its own and is left out", file=sys.stderr)
        else:
            good.append(bed)
    return good


def total(found: Sequence[Score]) -> tuple[int, ...]:
    """Sums over all classes of what `Score.counts` has."""
    return tuple(map(sum, zip(*(score.counts for score in found), strict=True)))


def document(found: Sequence[Score], soil: Sequence[Bed], most: int) -> str:
    """The page of the documentation."""
    seeded, hits, at_line, extra = total(found)
    by_fault: Mapping[Fault, Score] = {score.fault: score for score in found}
    introduction = INTRODUCTION.format(
        classes=len(found),
        files=", ".join(f"`{_shown(bed)}`" for bed in soil),
        most=most,
        seeded=seeded,
        found=hits,
        line=at_line,
        extra=extra,
    )
    parts = [introduction]
    for title, faults in GROUPS.items():
        parts += [f"\n## {title}\n\n", _row((*HEAD, *RIVALS)), _row(("---",) * 8)]
        parts += [_row(_cells(by_fault[fault])) for fault in faults if fault in by_fault]
    return "".join([*parts, *_shortcomings(found)])


def _cells(score: Score) -> tuple[str, ...]:
    rivals = MEASURED.get(score.fault.name, ("",) * len(RIVALS))
    return (score.fault.name, *map(str, score.counts), *rivals)


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |\n".replace("|  |", "| |")


def _shortcomings(found: Sequence[Score]) -> list[str]:
    """What is not found, not at its line or not alone, with the first example of each class."""
    bad = [score for score in found if not score.perfect]
    if not bad:
        return []
    lines = ["\n## Not as it should be\n\n"]
    for score in bad:
        worst = next(o for o in score.outcomes if not o.at_its_line or o.extra)
        line = min(worst.seed.lines(worst.sheet))
        text = worst.seed.text(worst.sheet).splitlines()[line - 1].strip()
        said = ", ".join(sorted({f.diagnostic.code for f in worst.extra})) or "nothing more"
        what = "not found" if not worst.found else "" if worst.at_its_line else "at another line"
        shown = text if len(text) <= 80 else f"{text[:77]}..."
        notes = "; ".join(filter(None, (what, f"also said: {said}" if worst.extra else "")))
        file = Path(worst.sheet.path).relative_to(ROOT).as_posix()
        lines.append(f"- {score.fault.name}: {file}, line {line}, `{shown}`: {notes}\n")
    return lines


def _shown(bed: Bed) -> str:
    return Path(bed.sheet.path).relative_to(ROOT).as_posix()


if __name__ == "__main__":
    main()
