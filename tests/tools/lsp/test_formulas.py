"""Requirements in the editor: what they name is renamed, explained, found and proposed."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import apply
from tests.seeds import every, short
from tests.tools.lsp.test_completion import labels
from tests.tools.lsp.workspace import edited, place

SYSTEM = """\
specc: 1.1
system: fleet
frames: {W: world}
types: {Mode: "enum[slow, fast]"}
constants: {near_by: {is: "0.2[m]", title: how near is near}}
operators: {gap: {signature: "(p: point[W]) -> real[m]", python: "fleet:gap"}}
agents:
  rovers:
    for: {i: 1..2}
    real_effectors: {wheel: {x: {v_d: "real[m/s]"}, y: {s: {type: "real[m]", title: the way}}}}
    virtual_effectors:
      wheel:
        rate: 10 Hz
        x: {E: {s: "real[m]"}}
        y: {E: {v_d: "real[m/s]"}}
        functions: {go: {y.E.v_d: "0[m/s]"}}
        behaviours: {go: {functions: [go], terminal: never}}
        states: {S0: go}
        initial_state: S0
    control:
      rate: 10 Hz
      y: {base: {n: int}}
      memory: {count: {type: int, init: 0, title: of all steps}, mode: {type: Mode, init: slow}}
      functions: {tell: {y.base.n: count, count: count + 1}}
      conditions: {terminal: {many: count > 9}}
      behaviours: {tell: {functions: [tell], terminal: many}, rest: {terminal: never}}
      states: {telling: tell, resting: rest}
      initial_state: telling
      transitions: [[telling, terminal, always, resting]]
  base:
    control:
      rate: 10 Hz
      x: {rovers: {n: int}}
      memory: {last: {type: int, init: 0}}
      functions: {hear: {last: "x.rovers[1].n if present(x.rovers[1].n) else last"}}
      behaviours: {hear: {functions: [hear], terminal: never}}
      states: {S0: hear}
      initial_state: S0
plant:
  model: arm.xml
  bind:
    rovers_{i}.E.wheel.v_d: {for: {i: 1..2}, actuators: ["m{i}"]}
    rovers_{i}.E.wheel.s: {for: {i: 1..2}, joints: ["j{i}"]}
  observe:
    at: {type: "point[W]", joints: [j1, j2, j3]}
let:
  hurry: {is: rovers_1.c.mode == fast}
  left: 9[m] - rovers_1.E.wheel.s
require:
  - {that: "always(all(state(r.c) == resting implies r.c.count > 9 for r in rovers))", because: a}
  - {that: "within(9[s], state(base.c) == S0 and base.c.last > 0 or
      base.c.x.rovers_1.n > 3)", because: b}
  - {that: "always(gap(plant.at) > near_by and rovers[1].c.mode != fast)", because: c}
  - {that: "always(rovers_1.E.wheel.s < 9[m] and present(rovers_2.c.y.base.n))", because: d}
  - {name: ends, let: {ending: "hurry and left < 2[m]"},
      that: "always(ending implies left >= near_by)", because: e}
"""


@pytest.fixture(scope="module")
def unchanged(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, str]:
    """For questions that change no text."""
    return edited(tmp_path_factory.mktemp("unchanged") / "fleet.yaml", SYSTEM)


@pytest.fixture
def project(tmp_path: Path) -> tuple[Project, str]:
    return edited(tmp_path / "fleet.yaml", SYSTEM)


@pytest.mark.parametrize(
    ("at", "new", "expected"),
    short([
        ("|count: {type", "steps", ["r.c.steps > 9"]),
        ("state(r.c) == |resting", "idle", ["state(r.c) == idle implies", "{telling: tell, idle:"]),
        ("base.c.|last", "newest", ["base.c.newest > 0", "memory: {newest:"]),
        ("|base:\n    control", "station", [
            "state(station.c) == S0 and station.c.last > 0 or", "station.c.x.rovers_1.n >",
            "present(rovers_2.c.y.station.n)", "y: {station: {n: int}}",
        ]),
        ("plant.|at)", "spot", ["spot: {type", "gap(plant.spot)"]),
        ("|gap(plant", "distance", ["operators: {distance:", "distance(plant.at)"]),
        ("> |near_by", "close", ["constants: {close:", "> close and"]),
        ("!= |fast", "quick", ["enum[slow, quick]", "!= quick)"]),
        ("E.wheel.|s <", "way", ["y: {way: {type", "rovers_1.E.wheel.way < 9[m]", "x: {E: {way:"]),
        ("|hurry: {is", "hurried", ["  hurried: {is:", '"hurried and left']),
        ("implies |left", "way", ["  way: 9[m]", "hurry and way < 2[m]", "implies way >= near_by"]),
        ("always(rovers_1.E.|wheel", "drive", ["rovers_1.E.drive.s", "real_effectors: {drive:"]),
    ], 1, 3, 5, 10),
)  # fmt: skip
def test_renaming_changes_what_is_required(
    unchanged: tuple[Project, str], at: str, new: str, expected: list[str]
) -> None:
    known, path = unchanged
    edits = features.rename_at(known, path, place(SYSTEM, at), new)
    text = apply(SYSTEM, edits)
    for part in expected:
        assert part in text
    before, after = known.compare({path: text})
    assert [found.code for found in before] == [found.code for found in after]


@pytest.mark.parametrize(
    ("at", "words", "line"),
    [
        ("r.c.|count > 9", "of all steps", "memory: {|count"),
        ("E.wheel.|s <", "the way", "y: {|s: {type"),
        ("> |near_by", "how near is near", "constants: {|near_by"),
        ("gap(plant.|at)", "point[W]", "|at: {type"),
        ("== |resting", "resting", "telling: tell, |resting"),
        ("implies |left", "real[m]", "|left: 9[m]"),
    ],
)
def test_what_is_named_is_explained_and_found(
    unchanged: tuple[Project, str], at: str, words: str, line: str
) -> None:
    known, path = unchanged
    offset = place(SYSTEM, at)
    hover = features.hover(known, path, offset)
    assert hover is not None and words in str(hover)
    assert place(SYSTEM, line) in [s.start for s in features.definition(known, path, offset)]


@pytest.mark.parametrize(
    ("old", "new", "there", "absent"),
    every(
        2,
        [
            (
                "always(gap(plant.at)",
                "|",
                "always within rovers base plant near_by gap state",
                "telling",
            ),
            ("always(gap(plant.at)", "always(gap(plant.|)", "at", "c wheel"),
            ("base.c.last", "base.|", "c", "last state"),
            ("base.c.last", "base.c.|", "last x", "state S0"),
            ("base.c.last", "base.c.x.rovers_1.|", "n", "last"),
            ("base.c.last", "rovers.|", "c wheel E", "last"),
            ("state(base.c) == S0", "state(base.|) == S0", "c", "last"),
            ("state(base.c) == S0", "state(rovers_1.c) == |", "telling resting", "S0"),
            ("within(9[s],", "within(9[|],", "s m", "base"),
            ("implies left >= near_by", "implies |", "left hurry within", "telling"),
        ],
    ),
)
def test_what_may_follow_is_proposed(
    project: tuple[Project, str], old: str, new: str, there: str, absent: str
) -> None:
    known, path = project
    found = labels(known, path, SYSTEM, old, new)
    assert set(there.split()) <= found
    assert not set(absent.split()) & found


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("base.c.last > 0", "base.c.lost > 0"),  # a name that is not there
        ("always(gap(plant.at)", "always(gap(plant.at) + gap("),  # no formula at all
        ("within(9[s],", "withn(9[s],"),
    ],
)
def test_an_error_in_a_formula_leaves_other_names_known(tmp_path: Path, old: str, new: str) -> None:
    text = SYSTEM.replace(old, new)
    known, path = edited(tmp_path / "fleet.yaml", text)
    for at, line in [
        ("or\n      base.c.x.rovers_1.|n", "x: {rovers: {|n: int}}"),
        ("state(base.c) == |S0", "states: {|S0: hear}"),
        ("E.wheel.|s <", "y: {|s: {type"),
    ]:
        found = features.definition(known, path, place(text, at))
        assert place(text, line) in [stretch.start for stretch in found], at
