"""Seeded faults are found: of every class, as docs/mutation_score.md says of all."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bench.mutation import DOCUMENT, ROOT, every_bed
from bench.seeding.classes import FAULTS, MEASURED
from bench.seeding.fault import Fault, Seed
from bench.seeding.pairs import judge_pair, pairs
from bench.seeding.score import Bed, judge, spread
from bench.seeding.sheet import Edit, Sheet, misspelt
from tests.seeds import SOAK, every

SOIL = every_bed()
SAMPLES = pytest.param(1, marks=pytest.mark.long), pytest.param(2, marks=SOAK)
"""Places of each class of faults in each system."""
ROW = re.compile(r"^\| ([^|]+) " + r"\| (\d+) " * 7 + r"\|$", re.MULTILINE)
DOCUMENTED = {
    name: tuple(map(int, counts))
    for name, *counts in ROW.findall(DOCUMENT.read_text(encoding="utf-8"))
}
CLEAN = [
    bed for bed in SOIL if f"`{Path(bed.sheet.path).relative_to(ROOT)}`" in DOCUMENT.read_text()
]


def is_perfect(name: str) -> bool:
    seeded, found, at_line, shown, elsewhere, _more, extra = DOCUMENTED[name]
    return seeded == found == at_line + shown + elsewhere and extra == 0


def test_every_class_is_documented_and_has_places() -> None:
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) >= 25
    assert list(DOCUMENTED) == [fault.name for fault in FAULTS]
    assert [name for name, counts in DOCUMENTED.items() if counts[0] == 0] == []
    assert set(MEASURED["faults"]) <= set(DOCUMENTED)


@pytest.mark.parametrize("bed", every(3, CLEAN), ids=lambda bed: Path(bed.sheet.path).name)
def test_there_is_no_finding_without_a_fault(bed: Bed) -> None:
    assert bed.findings() == []


BY_SIZE = sorted(CLEAN, key=lambda bed: Path(bed.system).stat().st_size)
PERFECT = [fault for fault in FAULTS if is_perfect(fault.name)]


@pytest.mark.parametrize("fault", PERFECT[::10], ids=lambda fault: fault.name)
def test_a_fault_of_many_classes_is_found(fault: Fault) -> None:
    """The short form of the test below: every tenth class, in one of the smallest systems."""
    beds = [bed for bed in BY_SIZE if any(fault.seeds(bed.sheet))][:3]
    bed = beds[PERFECT.index(fault) % len(beds)]
    is_found_and_nothing_else(fault, next(iter(fault.seeds(bed.sheet))), bed)


@pytest.mark.parametrize("sample", SAMPLES)
@pytest.mark.parametrize("fault", PERFECT, ids=lambda fault: fault.name)
def test_faults_are_found_at_their_line_and_nothing_else_is(fault: Fault, sample: int) -> None:
    for bed in CLEAN:
        for seed in spread(list(fault.seeds(bed.sheet)), sample):
            is_found_and_nothing_else(fault, seed, bed)


def is_found_and_nothing_else(fault: Fault, seed: Seed, bed: Bed) -> None:
    outcome = judge(fault, seed, bed)
    told = (outcome.placed or outcome.absorbed, [f.diagnostic for f in outcome.extra])
    assert told == (True, []), seed


def test_most_classes_are_found_completely() -> None:
    assert sum(map(is_perfect, DOCUMENTED)) >= 0.85 * len(FAULTS)


@pytest.mark.parametrize("count", [1, pytest.param(12, marks=pytest.mark.long)])
def test_two_faults_in_different_subsystems_are_both_found(count: int) -> None:
    tried = pairs(CLEAN, count)
    assert len(tried) == count
    assert [pair for pair in tried if not judge_pair(pair)] == []


def test_a_finding_of_another_code_or_elsewhere_is_not_what_was_seeded() -> None:
    """A score can fall: another class, and places where nothing is."""
    bed = next(bed for bed in CLEAN if bed.sheet.path.endswith("conveyor_gate.yaml"))
    fault = next(fault for fault in FAULTS if fault.name == "undefined variable")
    seed = next(iter(fault.seeds(bed.sheet)))
    assert judge(fault, seed, bed).at_its_line
    lost = judge(fault, Seed(seed.edits, (0,)), bed)
    assert (lost.found, lost.placed) == (True, False)
    other = next(fault for fault in FAULTS if fault.name == "cyclic let")
    missed = judge(other, seed, bed)
    assert (missed.found, missed.placed, len(missed.extra)) == (False, False, 1)


def sheet(tmp_path: Path, text: str) -> Sheet:
    path = tmp_path / "a.yaml"
    path.write_text(text, encoding="utf-8")
    return Sheet.read(path)


def test_entries_are_taken_away_and_put_beside_others(tmp_path: Path) -> None:
    page = sheet(tmp_path, "a: {b: 1, c: 2}\nd:\n  - [x, y]\n  - [z]\ne:\n  f: 1 # one\n  g: 2\n")

    def edited(edit: Edit) -> str:
        return Seed((edit,), (0,)).text(page)

    assert edited(page.removed(("a", "b"))).startswith("a: {c: 2}\n")
    assert edited(page.removed(("a", "c"))).startswith("a: {b: 1}\n")
    assert "d:\n  - [z]\ne:" in edited(page.removed(("d", 0)))
    assert edited(page.removed(("e", "f"))).endswith("e:\n  g: 2\n")
    assert edited(page.beside(("a", "b"), "n: 0")).startswith("a: {n: 0, b: 1, c: 2}\n")
    assert "d:\n  - [w]\n  - [x, y]\n" in edited(page.beside(("d", 0), "[w]"))
    assert edited(page.beside(("e", "g"), "n: 0")).endswith("f: 1 # one\n  n: 0\n  g: 2\n")


def test_lines_are_those_of_the_edited_text(tmp_path: Path) -> None:
    page = sheet(tmp_path, "a: 1\nb: 2\nc: 3\n")
    gone = Seed((page.removed(("a",)),), (page.key(("a",)).start, page.key(("c",)).start))
    assert gone.lines(page) == {1, 2}
    more = Seed((page.beside(("b",), "n: 0"),), (page.key(("a",)).start, page.at(("c",)).start))
    assert more.lines(page) == {1, 4}


@pytest.mark.parametrize(
    ("name", "wrong"), [("rate", "raet"), ("is", "si"), ("eq", "qe"), ("T_dd", "Td_d"), ("S", "SS")]
)
def test_a_name_is_misspelt(name: str, wrong: str) -> None:
    assert misspelt(name) == wrong
