"""What the compiler says of seeded faults: found, at the right line, and nothing else."""

from __future__ import annotations

import os
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bench.seeding.fault import Fault, Follows, Seed
from bench.seeding.sheet import Sheet
from specc.diagnostics.report import Finding, RenderedLocation, resolve
from specc.pipeline import check_spec
from specc.read import Document, read_file, read_text
from specc.resolve import Findings
from specc.resolve.loader import Loader


@dataclass(frozen=True, slots=True)
class Outcome:
    """One seeded fault: was it reported, where, and what else was.

    Of the findings with a code of the class one is `at_its_line`, or else its line is `shown` with
    one of them, or else one is where the fault can be seen first.
    """

    seed: Seed
    sheet: Sheet
    found: bool
    at_its_line: bool
    shown: bool
    elsewhere: bool
    follows: tuple[tuple[str, Follows], ...]
    extra: tuple[Finding, ...]

    @property
    def placed(self) -> bool:
        """Whether it was reported at a right place."""
        return self.at_its_line or self.shown or self.elsewhere

    @property
    def absorbed(self) -> bool:
        """Whether it was not reported, and a row with `otherwise` applies in its place."""
        return self.seed.absorbable and not self.found

    @property
    def perfect(self) -> bool:
        """Whether it was found at a right place or absorbed, without any extra complaint."""
        return (self.placed or self.absorbed) and not self.extra


@dataclass(slots=True)
class Score:
    """The outcomes of one class of faults."""

    fault: Fault
    outcomes: list[Outcome] = field(default_factory=list)

    @property
    def counts(self) -> tuple[int, ...]:
        """Faults seeded, found, at their line, shown, elsewhere, with more findings, with extra.

        Those that a row with `otherwise` may absorb are not among them.
        """
        done = [o for o in self.outcomes if not o.seed.absorbable]
        return (
            len(done),
            sum(o.found for o in done),
            sum(o.at_its_line for o in done),
            sum(o.shown for o in done),
            sum(o.elsewhere for o in done),
            sum(bool(o.follows) for o in done),
            sum(bool(o.extra) for o in done),
        )

    @property
    def absorbable(self) -> tuple[int, ...]:
        """Faults that may be absorbed: seeded, found all the same, absorbed, with extra."""
        done = [o for o in self.outcomes if o.seed.absorbable]
        return (
            len(done),
            sum(o.found for o in done),
            sum(o.absorbed for o in done),
            sum(bool(o.extra) for o in done),
        )

    @property
    def perfect(self) -> bool:
        """Whether every fault was found at a right place or absorbed, and nothing else was said."""
        return all(o.perfect for o in self.outcomes)


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

        result = check_spec(self.system, Loader(Findings(), read))
        return resolve(result.diagnostics, result.sources)


def beds(specs: Path) -> list[Bed]:
    """A bed for every sound system in a folder, and for every file that one of them uses.

    The paper as published has faults of its own.
    """
    systems = sorted(set(specs.glob("*.yaml")) - set(specs.glob("*_as_published.yaml")))
    found = {path: Bed(Sheet.read(path), str(path)) for path in systems}
    for system, bed in list(found.items()):
        for route in bed.sheet.walk():
            text = bed.sheet.get(route)
            if "use" in route[-2:] and isinstance(text, str):
                part = specs / text
                found.setdefault(part, Bed(Sheet.read(part), str(system)))
    return list(found.values())


def judge(fault: Fault, seed: Seed, bed: Bed) -> Outcome:
    """Compile a bed with a fault in it."""
    findings = bed.findings(seed.text(bed.sheet))
    meant = [f for f in findings if f.diagnostic.code in fault.codes]
    lines, elsewhere = seed.lines(bed.sheet), seed.lines_elsewhere(bed.sheet)
    first = [f for f in meant if is_on(f.primary, bed.sheet, lines)]
    shown = [f for f in meant if any(is_on(spot, bed.sheet, lines) for spot in f.related)]
    far = [
        f
        for f in meant
        if is_on(f.primary, bed.sheet, elsewhere) or (fault.abroad and _is_abroad(f, bed.sheet))
    ]
    told = (first or shown or far or meant)[:1]
    follows, extra = _besides([f for f in findings if f not in told], fault)
    return Outcome(
        seed,
        bed.sheet,
        bool(meant),
        bool(first),
        bool(shown and not first),
        bool(far and not (first or shown)),
        tuple(follows),
        tuple(extra),
    )


def _besides(
    others: Sequence[Finding], fault: Fault
) -> tuple[list[tuple[str, Follows]], list[Finding]]:
    """What other findings follow from a fault, and which of them are extra complaints."""
    follows, extra = [], []
    for finding in others:
        code = finding.diagnostic.code
        why = fault.follows.get(code) or (fault.several if code in fault.codes else None)
        if why is None:
            extra.append(finding)
        else:
            follows.append((code, why))
    return follows, extra


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


def _is_abroad(finding: Finding, sheet: Sheet) -> bool:
    return os.path.abspath(finding.primary.span.file) != os.path.abspath(sheet.path)


def is_on(spot: RenderedLocation, sheet: Sheet, lines: Container[int]) -> bool:
    """Whether a spot is on one of the lines of a sheet."""
    same = os.path.abspath(spot.span.file) == os.path.abspath(sheet.path)
    return same and spot.span.line in lines
