"""The mutation score: seeds faults of many classes into specs/ and counts which are found.

A fault is an edit of the text that leaves the rest as it is. It is found if it is reported with a
code of its class. Where that is and what else is told is counted apart; an extra complaint is any
finding that is not worth telling beside the first. The same specifications and the same compiler
give the same table.

    python bench/mutation.py             print the table
    python bench/mutation.py --write     and put it into docs/mutation_score.md
    python bench/mutation.py --only noise     a part of it, with what is not as it should be
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from bench.harness.tables import table
from bench.seeding.classes import FAULTS, GROUPS, MEASURED
from bench.seeding.fault import Fault, Follows
from bench.seeding.pairs import judge_pair, pairs
from bench.seeding.score import Bed, Score, beds, scores

ROOT = Path(__file__).parents[1]
DOCUMENT = ROOT / "docs/mutation_score.md"
MOST = 40
PAIRS = 200
ABSORBED = ("fault", "seeded", "still found", "absorbed", "extra")
HEAD = ("fault", "seeded", "found", "at its line", "shown", "elsewhere", "more", "extra")

INTRODUCTION = """\
# Mutation score

Made by `python bench/mutation.py --write --most {most}`. Faults of {classes} classes are seeded
into
{files}, one at a time, by edits of the
text that leave the rest as it is: at every place that a class has in a file, at most {most} of
them, evenly spread. {seeded} faults were seeded and {found} found. {alone} of them are told by one
finding alone; {more} bring other findings, which the section after the tables explains, and {extra}
an extra complaint. The files as they are give no finding.

- *found*: reported with a code of the class. A name that is like no other is an open point: what
  it refers to may still come.
- *at its line*: the finding is on the line of the edit, or on the line of the state, buffer or part
  that lacks what was taken away.
- *shown*: it is elsewhere, and that line is shown with it.
- *elsewhere*: it is where the fault is seen first, and its own line is not shown: an expression
  that no longer fits, a state whose rows no longer do.
- *more*: there are other findings that are worth telling.
- *extra*: there are findings that are noise.

Two faults in different subsystems of one file: {pairs} pairs were seeded, by chance but always the
same, of classes that leave the file readable; both were found in {both} of them.
"""

TAKEN_UP = """
## Absorbed by `otherwise`

A row with `otherwise` applies wherever no other row of its state and cause does. Where a row, or a
case of a condition, is lost beside it, what is left has a row for every case and may well be meant.
Such faults are in no other table; most of them nobody can find but the designer, who reads in
`specc diff` what `otherwise` covers now:

"""

CONSEQUENCES = """
## What is told besides

Where one fault gives several findings, each of them is one of these:

"""

BEYOND = """
## What is not found

What is well formed, fits and is provable, and is not what was meant:

- a number that is wrong in size: `0.1[m]` for `0.01[m]`, `1[deg]` for `1[rad]`, a rate of 50 Hz for
  500 Hz that no reader waits for;
- an `eq`, `table` or `fig` that is not that of the document, and a title or comment that is stale;
- `<` for `>`, and another element, memory element or operator of the same type;
- joints, sensors or actuators of a binding in the wrong order, or others of the same size; with
  `through` the sizes are not compared either;
- a row to another state that can be reached, prepared and left all the same;
- a function that a behaviour lacks, where others keep its outputs present;
- what the Python functions behind operators compute.
"""

OTHER_TOOLS = """
## Other tools

Machines of the same files with the same faults, each written for the tool as it reads them:
{versions}. `bench/rivals.py` says how. A cell has the faults that loading found and those that were
tried; an empty one is a class that the tool cannot express. No tool found anything in the
machines without a fault.

"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table; with `--write` put it into the documentation."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help=f"write docs/{DOCUMENT.name}")
    parser.add_argument("--only", default="", help="classes whose name this expression finds")
    parser.add_argument("--most", type=int, default=MOST, help="faults of a class in one file")
    options = parser.parse_args(arguments)
    if options.write and options.only:
        parser.error("the page has all classes: --write goes without --only")
    soil = fertile(every_bed())
    faults = [fault for fault in FAULTS if re.search(options.only, fault.name)]
    found = [score for score, _ in scores(faults, soil, options.most)]
    rows = [(s.fault.name, *map(str, s.counts)) for s in found]
    print(
        table(
            f"{len(soil)} files, without those that have findings of their own",
            HEAD,
            [*rows, ("all", *map(str, total(found)))],
        )
    )
    print(table("absorbed by `otherwise`", ABSORBED, list(_absorbed(found))))
    if options.only:
        print(*_shortcomings(found), sep="", end="")
        return
    judged = [judge_pair(pair) for pair in pairs(soil, PAIRS)]
    print(f"{len(judged)} pairs of faults, both found in {sum(judged)}")
    if options.write:
        page = document(found, soil, options.most, (len(judged), sum(judged)))
        DOCUMENT.write_text(page, encoding="utf-8")


def every_bed() -> list[Bed]:
    """The beds of the specifications, and of those that are there for the faults alone."""
    return [*beds(ROOT / "specs"), *beds(ROOT / "bench/seeding/specs")]


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


def document(found: Sequence[Score], soil: Sequence[Bed], most: int, pairs: tuple[int, int]) -> str:
    """The page of the documentation."""
    counts = total(found)
    outcomes = [o for score in found for o in score.outcomes if not o.seed.absorbable]
    by_fault: Mapping[Fault, Score] = {score.fault: score for score in found}
    introduction = INTRODUCTION.format(
        classes=len(found),
        files=", ".join(f"`{_shown(bed)}`" for bed in soil),
        most=most,
        seeded=counts[0],
        found=counts[1],
        alone=sum(o.found and not o.follows and not o.extra for o in outcomes),
        more=counts[5],
        extra=counts[6],
        pairs=pairs[0],
        both=pairs[1],
    )
    parts = [introduction]
    for title, faults in GROUPS.items():
        parts += [f"\n## {title}\n\n", _row(HEAD), _row(("---",) * len(HEAD))]
        parts += [
            _row((fault.name, *map(str, by_fault[fault].counts)))
            for fault in faults
            if fault in by_fault
        ]
    parts += [
        TAKEN_UP,
        _row(ABSORBED),
        _row(("---",) * len(ABSORBED)),
        *map(_row, _absorbed(found)),
    ]
    return "".join([*parts, *_consequences(found), *_others(), BEYOND, *_shortcomings(found)])


def _consequences(found: Sequence[Score]) -> Iterator[str]:
    """What findings besides the first are, with the numbers of faults and the classes."""
    yield CONSEQUENCES
    for why in Follows:
        by_class = {
            score.fault.name: sum(any(w is why for _, w in o.follows) for o in score.outcomes)
            for score in found
        }
        named = [f"{name} ({count})" for name, count in by_class.items() if count]
        if named:
            yield f"- {why}, {sum(by_class.values())} faults: {', '.join(named)}\n"


def _absorbed(found: Sequence[Score]) -> Iterator[tuple[str, ...]]:
    """The classes with faults that may be absorbed, and their numbers."""
    for score in found:
        if score.absorbable[0]:
            yield (score.fault.name, *map(str, score.absorbable))


def _others() -> Iterator[str]:
    """What other tools find."""
    tools, versions = MEASURED["tools"], MEASURED["versions"]
    listed = ", ".join(f"{name} {version}" for name, version in versions.items())
    yield OTHER_TOOLS.format(versions=listed)
    yield _row(("fault", *tools))
    yield _row(("---",) * (len(tools) + 1))
    for name, cells in MEASURED["faults"].items():
        yield _row((name, *cells))


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |\n".replace("|  |", "| |")


def _shortcomings(found: Sequence[Score]) -> list[str]:
    """What is not found, not at its line or not alone, with the first example of each class."""
    bad = [score for score in found if not score.perfect]
    if not bad:
        return []
    lines = ["\n## Not as it should be\n\n"]
    for score in bad:
        worst = next(o for o in score.outcomes if not o.perfect)
        line = min(worst.seed.lines(worst.sheet))
        text = worst.seed.text(worst.sheet).splitlines()[line - 1].strip()
        said = ", ".join(sorted({f.diagnostic.code for f in worst.extra})) or "nothing more"
        right = worst.placed or worst.absorbed
        what = "" if right else "at another line" if worst.found else "not found"
        shown = text if len(text) <= 80 else f"{text[:77]}..."
        notes = "; ".join(filter(None, (what, f"also said: {said}" if worst.extra else "")))
        file = Path(worst.sheet.path).relative_to(ROOT).as_posix()
        lines.append(f"- {score.fault.name}: {file}, line {line}, `{shown}`: {notes}\n")
    return lines


def _shown(bed: Bed) -> str:
    return Path(bed.sheet.path).relative_to(ROOT).as_posix()


if __name__ == "__main__":
    main()
