"""What a machine with a stop may lose is found: a member of a mode, a row, a condition, its part.

The cell of `specs/examples` and two small machines, each with a requirement that says what its
stop means. Every member of every mode is taken out once. What validating finds is not explored.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from shutil import copy

import pytest

from tests.commands import ROOT, specc
from tests.seeds import SOAK, every

MACHINES = {
    "cell": ROOT / "specs" / "examples" / "tray_cell.yaml",
    "base": Path(__file__).parent / "machines" / "base.yaml",
    "press": Path(__file__).parent / "machines" / "press.yaml",
}
STEPS = 200000
"""Enough to come to what the cell lost, though not to see all that it can do."""
FAR = 1500000
"""Enough for a state to which twelve others lead."""
SOURCE = re.compile(r"^ *\d+ \|.*$", re.MULTILINE)
FINDING = re.compile(r"^(?:error|warning|open)\[(\w\d{4})\]: (?:.+\n)+", re.MULTILINE)


@dataclass(frozen=True)
class Mutant:
    """What a mode of a machine loses.

    It is a member; the row of an error; the condition of an error, with its row; or a part of
    this condition: that it holds in the first periods of a state, too.
    """

    machine: str
    mode: str
    loss: str
    name: str

    def __str__(self) -> str:
        return f"{self.machine}: {self.loss} {self.name} of {self.mode}"

    @property
    def text(self) -> str:
        before = MACHINES[self.machine].read_text(encoding="utf-8")
        return {
            "member": self._without_member,
            "row": self._without_row,
            "condition": self._without_condition,
            "part": self._without_part,
        }[self.loss](before)

    def concerned(self) -> set[str]:
        """States and modes of which a finding about it tells one."""
        text = MACHINES[self.machine].read_text(encoding="utf-8")
        names = [self.name if self.loss == "member" else self.mode]
        for name in names:
            if found := _mode(name, text):
                names += _members(found[0])
        return {self.mode, *names}

    def _without_member(self, text: str) -> str:
        def others(states: re.Match[str]) -> str:
            return f"states: [{', '.join(n for n in _members(states[0]) if n != self.name)}]"

        return self._changed(r"states: \[.*?\]", others, text)

    def _without_row(self, text: str) -> str:
        return re.sub(rf"^ +- \[{self.mode}, +{self.name}, .*\n", "", text, flags=re.MULTILINE)

    def _without_condition(self, text: str) -> str:
        return self._without_row(self._changed(r",? +error: \{\w+: [^,}]*\}\n?", "", text))

    def _without_part(self, text: str) -> str:
        narrowed = r'\1"(\2) and elapsed > 0.1[s]"'
        return self._changed(rf"({self.name}: )([^,}}]*)", narrowed, text)

    def _changed(self, old: str, new: str | Callable[[re.Match[str]], str], text: str) -> str:
        """With a change in what is said of the mode."""
        found = _mode(self.mode, text)
        assert found is not None
        changed, count = re.subn(old, new, found[0], count=1)
        assert count == 1
        return text[: found.start()] + changed + text[found.end() :]


def _mode(name: str, text: str) -> re.Match[str] | None:
    """What is said of a mode, in one line or several."""
    return re.search(rf"^( +){name}:(?: \{{states: .*\n|\n(?:\1 +.*\n)+)", text, re.MULTILINE)


def _members(mode: str) -> list[str]:
    found = re.search(r"states: \[(.*?)\]", mode)
    return found[1].split(", ") if found else []


def of(machine: str, mode: str, loss: str, *names: str) -> list[Mutant]:
    return [Mutant(machine, mode, loss, name) for name in names]


VALIDATED = [
    *of("cell", "task", "member", "picking", "placing"),
    *of("cell", "picking", "member", "looking", "approaching", "descending", "lifting"),
    *of("cell", "placing", "member", "carrying", "lowering", "retreating"),
    *of("cell", "powered", "row", "tripped"),
    *of("cell", "powered", "condition", "tripped"),
    *of("base", "trip", "member", "leaving"),
    *of("base", "powered", "row", "tripped"),
    *of("base", "powered", "condition", "tripped"),
    *of("press", "powered", "row", "tripped"),
    *of("press", "powered", "condition", "tripped"),
]
EXPLORED = [
    *of("base", "powered", "member", "waiting", "trip", "held"),
    *of("base", "trip", "member", "cruising", "returning"),
    *of("base", "powered", "part", "tripped"),
    *of("base", "trip", "part", "halted"),
    *of("press", "powered", "member", "ready", "stroke", "lifting"),
    *of("press", "stroke", "member", "closing", "pressing", "dwelling"),
    *of("press", "powered", "part", "tripped"),
    *of("press", "stroke", "part", "intruded"),
]
CELL_EXPLORED = [
    *of("cell", "powered", "member", "waiting", "task", "paused", "gave_up", "homing"),
    *of("cell", "picking", "member", "closing"),
    *of("cell", "placing", "member", "opening"),
    *of("cell", "powered", "part", "tripped"),
    *of("cell", "task", "part", "halted"),
]


@pytest.mark.parametrize("machine", every(3, list(MACHINES)))
def test_nothing_is_found_as_long_as_nothing_is_lost(machine: str, tmp_path: Path) -> None:
    file = written(machine, MACHINES[machine].read_text(encoding="utf-8"), tmp_path)
    assert findings(specc("validate", file, together=True).stdout) == []
    if machine != "cell":
        explored = specc("explore", file, together=True).stdout
        assert findings(explored) == []
        assert "all in all: complete" in explored


def test_every_member_of_every_mode_is_lost_once() -> None:
    lost = [each for each in VALIDATED + EXPLORED + CELL_EXPLORED if each.loss == "member"]
    for machine, file in MACHINES.items():
        here = [(each.mode, each.name) for each in lost if each.machine == machine]
        there = [
            (name, member)
            for name in {mode for mode, _ in here}
            if (found := _mode(name, file.read_text(encoding="utf-8")))
            for member in _members(found[0])
        ]
        assert sorted(here) == sorted(there)
    assert len({*VALIDATED, *EXPLORED, *CELL_EXPLORED}) == 40


@pytest.mark.parametrize("mutant", every(3, VALIDATED), ids=str)
def test_validating_names_what_is_concerned(mutant: Mutant, tmp_path: Path) -> None:
    file = written(mutant.machine, mutant.text, tmp_path)
    assert names(specc("validate", file, together=True).stdout, mutant)


@pytest.mark.parametrize("mutant", every(4, EXPLORED), ids=str)
def test_exploring_names_what_is_concerned(mutant: Mutant, tmp_path: Path) -> None:
    file = written(mutant.machine, mutant.text, tmp_path)
    assert names(specc("explore", file, together=True).stdout, mutant)


@pytest.mark.long
@pytest.mark.parametrize(
    ("mutant", "steps"),
    [
        pytest.param(each, FAR, marks=SOAK) if each.name == "opening" else (each, STEPS)
        for each in CELL_EXPLORED
    ],
    ids=str,
)
def test_exploring_the_cell_names_what_is_concerned(
    mutant: Mutant, steps: int, tmp_path: Path
) -> None:
    file = written(mutant.machine, mutant.text, tmp_path)
    assert names(specc("explore", file, "--budget", steps, together=True).stdout, mutant)


def written(machine: str, text: str, folder: Path) -> Path:
    (folder / "pyproject.toml").touch()
    (folder / "plants").mkdir()
    copy(ROOT / "specs" / "plants" / "tray_cell.xml", folder / "plants")
    file = folder / "machines" / f"{machine}.yaml"
    file.parent.mkdir()
    file.write_text(text, encoding="utf-8")
    return file


def findings(output: str) -> list[str]:
    """What is said, without the lines of the file that are shown with it."""
    return [SOURCE.sub("", found[0]) for found in FINDING.finditer(output)]


def names(output: str, mutant: Mutant) -> bool:
    """Whether a finding tells of a state or mode that is concerned."""
    names = "|".join(sorted(mutant.concerned()))
    return any(re.search(rf"`(?:{names})`", found) for found in findings(output))
