"""Two faults at once, in different subsystems of one file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from random import Random

from bench.seeding.classes import FAULTS, GROUPS
from bench.seeding.fault import Fault, Seed
from bench.seeding.machine import machines
from bench.seeding.score import Bed, is_on
from specc.source import Route


@dataclass(frozen=True, slots=True)
class Pair:
    """Two faults, each with its class, in one file."""

    bed: Bed
    faults: tuple[Fault, Fault]
    seeds: tuple[Seed, Seed]


def pairs(soil: Sequence[Bed], count: int, seed: int = 7) -> list[Pair]:
    """So many pairs, by chance, of faults that are errors and leave the file readable.

    Warnings about what is unused and the like are given once there are no errors.
    """
    random, found = Random(seed), list[Pair]()
    classes = [fault for fault in FAULTS if fault not in GROUPS["Text and keys"]]
    classes = [fault for fault in classes if any(code[0] == "E" for code in fault.codes)]
    places = [(bed, grown) for bed in soil if len(grown := _by_subsystem(bed, classes)) > 1]
    while places and len(found) < count:
        bed, grown = random.choice(places)
        one, other = random.sample(sorted(grown), 2)
        (a, first), (b, second) = random.choice(grown[one]), random.choice(grown[other])
        found.append(Pair(bed, (a, b), (first, second)))
    return found


def judge_pair(pair: Pair) -> bool:
    """Whether each of the two faults is reported, where it is or is seen first."""
    edits = tuple(edit for seed in pair.seeds for edit in seed.edits)
    both = [Seed(edits, seed.places, seed.elsewhere) for seed in pair.seeds]
    sheet = pair.bed.sheet
    findings = pair.bed.findings(both[0].text(sheet))
    return all(
        any(
            finding.diagnostic.code in fault.codes
            and any(
                is_on(spot, sheet, seed.lines(sheet) | seed.lines_elsewhere(sheet))
                for spot in (finding.primary, *finding.related)
            )
            for finding in findings
        )
        for fault, seed in zip(pair.faults, both, strict=True)
    )


def _by_subsystem(bed: Bed, classes: Sequence[Fault]) -> dict[Route, list[tuple[Fault, Seed]]]:
    """The faults of a file whose edits lie within one subsystem."""
    sheet = bed.sheet
    grown: dict[Route, list[tuple[Fault, Seed]]] = {}
    spans = {machine.route: sheet.at(machine.route) for machine in machines(sheet)}
    for fault in classes:
        for seed in (seed for seed in fault.seeds(sheet) if not seed.absorbable):
            for route, node in spans.items():
                if all(node.start <= e.start and e.end <= node.end for e in seed.edits):
                    grown.setdefault(route, []).append((fault, seed))
    return grown
