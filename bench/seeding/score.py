"""What the compiler says of seeded faults: found, at the right line, and nothing else."""

from __future__ import annotations

import os
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bench.seeding.fault import Fault, Seed
from bench.seeding.sheet import Sheet
from specc.diagnostics.report import Finding, resolve
from specc.pipeline import compile_spec
from specc.read import Document, read_file, read_text
from specc.resolve import Findings
from specc.resolve.loader import Loader


@dataclass(frozen=True, slots=True)
class Outcome:
    """One seeded fault: was it reported, where it is, and what else was."""

    seed: Seed
    sheet: Sheet
    found: bool
    at_its_line: bool
    extra: tuple[Finding, ...]


@dataclass(slots=True)
class Score:
    """The outcomes of one class of faults."""

    fault: Fault
    outcomes: list[Outcome] = field(default_factory=list)

    @property
    def counts(self) -> tuple[int, int, int, int]:
        """Faults seeded, found, found at their line, and found with extra complaints."""
        done = self.outcomes
        found = sum(o.found for o in done)
        return len(done), found, sum(o.at_its_line for o in done), sum(bool(o.extra) for o in done)

    @property
    def perfect(self) -> bool:
        """Whether every fault was found at its line, without any other complaint."""
        seeded, found, at_line, extra = self.counts
        return seeded == found == at_line and extra == 0


@dataclass(frozen=True, slots=True)
class Bed:
    """A file that faults are seeded into, and the system that is compiled to find them."""

    sheet: Sheet
    system: str

    def findings(self, text: str | None = None) -> list[Finding]:
        """Findings about the system, with another text of the file."""

        def read(path: str, row_keys: tuple[str, ...]) -> Document:
            if text is not None and Path(path) == Path(self.sheet.path):
                return read_text(path, text, row_keys)
            return read_file(path, row_keys)

        result = compile_spec(self.system, Loader(Findings(), read))
        return resolve(result.diagnostics, result.sources)


def beds(specs: Path) -> list[Bed]:
    """A bed for every sound system in a folder, and for every part that one of them uses.

    The paper as published has faults of its own.
    """
    systems = sorted(set(specs.glob("*.yaml")) - set(specs.glob("*_as_published.yaml")))
    found = {path: Bed(Sheet.read(path), str(path)) for path in systems}
    for system, bed in list(found.items()):
        for route in bed.sheet.walk():
            if route and route[-1] == "use" and isinstance(bed.sheet.get(route), str):
                part = specs / bed.sheet.get(route)
                found.setdefault(part, Bed(Sheet.read(part), str(system)))
    return list(found.values())


def judge(fault: Fault, seed: Seed, bed: Bed) -> Outcome:
    """Compile a bed with a fault in it."""
    findings = bed.findings(seed.text(bed.sheet))
    lines = seed.lines(bed.sheet)
    meant = [f for f in findings if f.diagnostic.code in fault.codes]
    hits = [f for f in meant if _points_at(f, bed.sheet, lines)]
    extra = [f for f in findings if f.diagnostic.code not in fault.codes | fault.with_]
    if fault.alone:
        extra += (hits or meant)[1:] + ([f for f in meant if f not in hits] if hits else [])
    return Outcome(seed, bed.sheet, bool(meant), bool(hits), tuple(extra))


def scores(
    faults: Sequence[Fault], soil: Sequence[Bed], most: int
) -> Iterator[tuple[Score, Mapping[str, int]]]:
    """The score of every class, and how many places each file has for it.

    At most `most` faults of a class are seeded into one file, evenly spread over its places.
    """
    for fault in faults:
        score, places = Score(fault), {}
        for bed in soil:
            every = list(fault.seeds(bed.sheet))
            places[bed.sheet.path] = len(every)
            score.outcomes += [judge(fault, seed, bed) for seed in spread(every, most)]
        yield score, places


def spread(items: Sequence[Seed], most: int) -> list[Seed]:
    """At most so many of the items, evenly spread and always the same."""
    if len(items) <= most:
        return list(items)
    return [items[index * len(items) // most] for index in range(most)]


def _points_at(finding: Finding, sheet: Sheet, lines: Container[int]) -> bool:
    """Whether a finding, or a place that is shown with it, is on one of the lines."""
    return any(
        os.path.abspath(spot.span.file) == os.path.abspath(sheet.path) and spot.span.line in lines
        for spot in (finding.primary, *finding.related)
    )
