"""`fmt --upgrade`: a specification of version 1 in the forms of 1.3 has the same transitions."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path
from random import Random

import pytest
from ruamel.yaml import YAML

from specc.model.expr import Logic, Node, Unary
from specc.pipeline import build, compile_spec
from specc.tools.fmt import format_text, upgrade
from tests.commands import specc
from tests.house.tree import ROOT
from tests.seeds import Seeds, blocks
from tests.soundness.specifications import specification

FILES = [*sorted(ROOT.glob("specs/skeletons/**/*.yaml")), ROOT / "specs/conveyor_gate.yaml"]


def untyped(part: object) -> object:
    """An expression without types and double negations, `and` and `or` without an order.

    `otherwise` is the negation of other rows: of `not p` it is `p`.
    """
    if isinstance(part, tuple):
        return tuple(map(untyped, part))
    match part:
        case Unary(op="not", operand=Unary(op="not", operand=inner)):
            return untyped(inner)
    if isinstance(part, Logic):
        return part.op, frozenset(map(untyped, part.operands))
    if not isinstance(part, Node):
        return part
    names = (field.name for field in fields(part) if field.compare and field.name != "type")
    return type(part).__name__, *(untyped(getattr(part, name)) for name in names)


def rows(path: Path) -> dict[str, set[tuple[object, ...]]]:
    """Source, cause, condition and target of all rows; the names of conditions do not count.

    Nor do types: what `position` gives is a vector in version 1 and a point of a frame in 1.1.
    """
    system = compile_spec(str(path)).system
    assert system is not None
    return {
        subsystem.name: {
            (r.source, r.cause, untyped(r.condition.when), r.target) for r in subsystem.transitions
        }
        for subsystem in system.subsystems
    }


def upgraded(path: Path, beside: Path) -> str:
    beside.write_text(format_text(path.read_text(encoding="utf-8"), upgrade), encoding="utf-8")
    text = beside.read_text(encoding="utf-8")
    assert format_text(text, upgrade) == text
    assert rows(path) == rows(beside)
    return text


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_committed_files(path: Path, tmp_path: Path) -> None:
    new = tmp_path / path.name
    for other in path.parent.iterdir():
        if other.is_dir():
            (tmp_path / other.name).symlink_to(other)
    assert "\nspecc: 1.3\n" in f"\n{upgraded(path, new)}"


@pytest.mark.parametrize("seeds", blocks([1006], also=[*range(4), 5985770], long=6, each=8))
def test_random_files(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        tree = specification(Random(seed))
        old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
        with old.open("w", encoding="utf-8") as file:
            YAML(typ="safe").dump(tree, file)
        upgraded(old, new)


MACHINE = """\
specc: 1
system: demo
agents:
  a:
    real_receptors: {eye: {y: {d: "real[m]"}}}
    control: {}
    virtual_receptors:
      eye:
        rate: 10 Hz
        x: {eye: {d: "real[m]"}}
        conditions:
          initial:
            near_by: x.eye.d < 1[m]
            far: {when: "not (x.eye.d < 1[m])"}
            away: {when: "not (x.eye.d < 1[m])", eq: 5}
        functions: {}
        behaviours: {look: {functions: [], terminal: always}}
        states: {S0: look, S1: look, S2: look}
        initial_state: S0
        transitions:
          - [S0, terminal, near_by, S1]
          - [S0, terminal, far, S0]
          - [S1, terminal, near_by, S1]
          - [S1, terminal, far, S2] # kept
          - [S2, terminal, near_by, S1]
          - [S2, terminal, away, S0]
"""


def test_what_says_more_stays(tmp_path: Path) -> None:
    old = tmp_path / "old.yaml"
    old.write_text(MACHINE)
    text = upgraded(old, tmp_path / "new.yaml")
    assert "far:" not in text
    assert "eq: 5" in text
    table = " ".join(text[text.index("transitions:") :].split())
    assert "- [[S0, S1, S2], terminal, near_by, S1]" in table
    assert "otherwise, S2] # kept" in table
    assert "- [S2, terminal, away, S0]" in table


def test_a_condition_beside_others_stays(tmp_path: Path) -> None:
    """Beside a third condition the remainder is another one."""
    old = tmp_path / "old.yaml"
    old.write_text(
        MACHINE.replace("[S2, terminal, away, S0]", "[S2, terminal, far, S0]").replace(
            "          - [S2, terminal, near_by, S1]\n",
            "          - [S2, terminal, away, S1]\n          - [S2, terminal, near_by, S1]\n",
        )
    )
    assert "otherwise" not in upgraded(old, tmp_path / "new.yaml")


@pytest.mark.parametrize(
    ("near", "far", "is_opposite"),
    [
        ("x.eye.d < 1[m] or entered", "not x.eye.d < 1[m] or entered", False),
        ("x.eye.d < 1[m] or entered", "not (x.eye.d < 1[m]  or entered)", True),
        ("entered", "not entered", True),
        ("not entered", "not not entered", True),
        ("(x.eye.d < 1[m])", "not x.eye.d<1[m]", True),
    ],
)
def test_only_a_negation_is_an_opposite(
    near: str, far: str, is_opposite: bool, tmp_path: Path
) -> None:
    """`not a or b` is not the opposite of `a or b`, although it begins with `not`."""
    old = tmp_path / "old.yaml"
    text = MACHINE.replace('far: {when: "not (x.eye.d < 1[m])"}', f"far: {far}", 1)
    old.write_text(text.replace("near_by: x.eye.d < 1[m]", f"near_by: {near}"))
    new = format_text(old.read_text(), upgrade)
    assert ("far:" not in new) == is_opposite


LISTS = """\
specc: 1.2
system: arm
agents:
  desk:
    control:
      rate: 10 Hz
      y: {arm: {halt: bool}}
      memory: {n: {type: int, init: 0}}
      functions: {count: {n: n + 1, y.arm.halt: n > 30 and n < 40}}
      behaviours: {count: {functions: [count], terminal: never}}
      states: {S0: count}
      initial_state: S0
  arm:
    control:
      rate: 20 Hz
      x: {desk: {halt: {type: bool, init: False}}}
      memory: {k: {type: int, init: 0}}
      conditions:
        initial: {few: k < 10, many: k >= 10}
        terminal: {there: "elapsed > 0.2[s]", reset: not x.desk.halt}
        error: {off: x.desk.halt}
      functions: {try: {k: k + 1}}
      behaviours:
        move: {functions: [try], terminal: there, error: off}
        brake: {functions: [try], terminal: reset}
      states: {a: move, b: move, c: move, d: move, e: move, halted: brake, broken: brake}
      initial_state: a
      transitions:
        - [[a, b, c, d, e], error, few, halted]
        - [[a, b, c, d, e], error, many, broken] # kept
        - [[a, b, c], terminal, few, d]
        - {from: [a, b, c], cause: terminal, when: many, to: e}
        - [d, terminal, few, b]
        - [d, terminal, many, c]
        - [e, terminal, always, a]
        - [[halted, broken], terminal, always, a]
"""


def code(path: Path) -> str:
    """The generated code of the arm without what says of modes that they are there."""
    text = build(str(path)).files["arm_c.py"]
    text = re.sub(r"    modes: ClassVar.*?\n    }\n", "", text, flags=re.DOTALL)
    return re.sub(r"(State \w+), in [\w ]+\.", r"\1.", text).replace("new.yaml", "old.yaml")


def test_lists_that_repeat_are_modes(tmp_path: Path) -> None:
    """Those inside others are modes inside modes; the flat machine is the same."""
    old, new = tmp_path / "old.yaml", tmp_path / "new.yaml"
    old.write_text(LISTS)
    text = upgraded(old, new)
    words = " ".join(text[text.index("modes:") :].split())
    assert words.startswith(
        "modes: mode_1: {states: [mode_2, d, e]} mode_2: {states: [a, b, c]} initial_state: a"
    )
    for row in (
        "- [mode_1, error, few, halted]",
        "- [mode_1, error, many, broken] # kept",
        "- [mode_2, terminal, few, d]",
        "- {from: mode_2, cause: terminal, when: many, to: e}",
        "- [[halted, broken], terminal, always, a]",
    ):
        assert row in words
    assert code(old) == code(new)
    reports = []
    for path in (old, new):
        done = specc("run", path, "--duration", "6", "--report", path.with_suffix(".json"))
        assert done.returncode == 0, done.stderr
        reports.append(json.loads(path.with_suffix(".json").read_text(encoding="utf-8")))
    assert reports[0]["records_sha256"] == reports[1]["records_sha256"]


@pytest.mark.parametrize(
    ("old", "new", "modes"),
    [
        # in one row only, with two states only, of which one is not known, in another order
        ("[[a, b, c], terminal, few, d]", "[[a, b], terminal, few, d]", "[a, b, c, d, e]"),
        ("[[a, b, c, d, e], error, few,", "[[a, b, c, d], error, few,", "[a, b, c]"),
        ("[[a, b, c, d, e], error, few,", "[[a, b, c, d, x], error, few,", "[a, b, c]"),
        (
            "[[a, b, c], terminal, few, d]",
            "[[c, a, b], terminal, few, d]",
            "[mode_2, d, e] [c, a, b]",
        ),
        # a name that is taken
        ("halted", "mode_1", "[mode_3, d, e] [a, b, c]"),
        # overlapping lists: the one in more rows, then the longer one, becomes a mode
        (
            "        - [e, terminal, always, a]",
            "        - [[c, d, e], terminal, few, a]\n        - [[c, d, e], terminal, many, b]",
            "[mode_2, d, e] [a, b, c]",
        ),
        # a machine that has modes
        ("      initial_state: a", "      modes: {m: {states: [a]}}\n      initial_state: a", ""),
    ],
)
def test_which_lists_are_modes(old: str, new: str, modes: str) -> None:
    assert old in LISTS
    text = format_text(LISTS.replace(old, new), upgrade)
    assert " ".join(re.findall(r"mode_\d: {states: (.*)}", text)) == modes
