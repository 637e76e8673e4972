"""Renaming changes every place that means the symbol, or nothing."""

import random
from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import RenameError, apply
from tests.house.tree import ROOT
from tests.seeds import every, short
from tests.tools.lsp.workspace import LIBRARY, SYSTEM, opened, place, write

FLAGSHIP = str(ROOT / "specs/irp_picking.yaml")
FRESH = "quite_new"
PARTS_OF_ALL = 72
"""Tests among which symbols are shared out."""


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, str, str]:
    return opened(tmp_path_factory.mktemp("workspace"))


def renamed(project: Project, path: str, offset: int, new: str) -> dict[str, str]:
    """Texts after a renaming."""
    edits = features.rename_at(project, path, offset, new)
    return {
        file: apply(project.source(file).text, [e for e in edits if e.path == file])
        for file in {edit.path for edit in edits}
    }


def samples(project: Project) -> list[tuple[str, int]]:
    """One symbol of each kind in each subsystem of the flagship that can be renamed."""
    index = project.analyse(FLAGSHIP).index
    found: dict[tuple[str, object], list[tuple[str, int]]] = {}
    for occurrence in index.occurrences(FLAGSHIP):
        symbol = occurrence.symbol
        try:
            features.renameable(project, FLAGSHIP, occurrence.start)
        except RenameError:
            continue
        key = (symbol.kind, symbol.owner)
        found.setdefault(key, []).append((f"{symbol.kind} {symbol.name}", occurrence.start))
    rng = random.Random(3)
    return [rng.choice(places) for places in found.values()]


@pytest.fixture(scope="module")
def flagship() -> Project:
    """With the flagship as it is on the disk."""
    project = Project()
    project.analyse(FLAGSHIP)
    return project


@pytest.mark.parametrize("part", short(range(PARTS_OF_ALL), 0, in_ci=3))
def test_renaming_there_and_back_is_nothing(part: int, flagship: Project) -> None:
    for name, offset in samples(flagship)[part::PARTS_OF_ALL]:
        is_nothing_there_and_back(flagship, name, offset)


def is_nothing_there_and_back(project: Project, name: str, offset: int) -> None:
    before = project.source(FLAGSHIP).text
    texts = renamed(project, FLAGSHIP, offset, FRESH)
    assert texts, name
    for path, text in texts.items():
        project.put(path, text)
    project.analyse(FLAGSHIP)
    assert features.notes(project)[FLAGSHIP] == []
    again = project.source(FLAGSHIP).text.index(FRESH)
    assert renamed(project, FLAGSHIP, again, name.split()[-1])[FLAGSHIP] == before
    for path in texts:
        project.close(path)
    project.analyse(FLAGSHIP)


def test_renames_both_ends_in_both_files(workspace: tuple[Project, str, str]) -> None:
    project, system, library = workspace
    texts = renamed(project, system, place(SYSTEM, "g: {|d_c"), "width")
    assert set(texts) == {system, library}
    assert 'g: {width: "real[m]"}' in texts[system]
    assert 'y: {c: {width: "real[m]"}' in texts[library]
    assert "y.c.width: d_p" in texts[library]


PARTS = (
    SYSTEM
    + """\
  watch:
    control:
      rate: 10 Hz
      x: {irp: {n: int}}
      memory: {n: {type: int, init: 0}}
      functions: {look: {n: x.irp.n if present(x.irp.n) else n}}
      behaviours: {look: {functions: [look], terminal: never}}
      states: {S0: look}
      initial_state: S0
plant:
  model: arm.xml
  bind:
    irp.E.m.q_d: {actuators: [a, b]}
    irp.E.m.q_m: {joints: [a, b]}
    irp.E.g.d_d: {actuators: [c]}
    irp.E.g.d_m: {joints: [c]}
task:
  cycle: {of: irp.m, from: S1, to: S0}
  watch: [q_p]
"""
)
PARTS = PARTS.replace("      y: {m: {q_d: Joints,", "      y: {watch: {n: int}, m: {q_d: Joints,")
PARTS = PARTS.replace("{command: {y.m.q_d", "{command: {y.watch.n: 1, y.m.q_d")


@pytest.mark.parametrize(
    ("at", "new", "expected"),
    every(
        3,
        [
            (
                "|irp:\n    real",
                "arm",
                [
                    ("irp:\n    real", "arm:\n    real"),
                    ("x: {irp: {n", "x: {arm: {n"),
                    ("x.irp.n if present(x.irp.n)", "x.arm.n if present(x.arm.n)"),
                    ("irp.E.m.q_d:", "arm.E.m.q_d:"),
                    ("irp.E.m.q_m:", "arm.E.m.q_m:"),
                    ("irp.E.g.d_d:", "arm.E.g.d_d:"),
                    ("irp.E.g.d_m:", "arm.E.g.d_m:"),
                    ("of: irp.m", "of: arm.m"),
                ],
            ),
            (
                "of: irp.|m",
                "hand",
                [
                    ("m: {x: {q_d", "hand: {x: {q_d"),
                    ("m:\n        rate", "hand:\n        rate"),
                    ("x: {m: {X_c", "x: {hand: {X_c"),
                    ("m: {q_d: Joints, mode", "hand: {q_d: Joints, mode"),
                    ("y.m.q_d: q_home", "y.hand.q_d: q_home"),
                    ("y.m.mode", "y.hand.mode"),
                    ("irp.E.m.q_d:", "irp.E.hand.q_d:"),
                    ("irp.E.m.q_m:", "irp.E.hand.q_m:"),
                    ("of: irp.m", "of: irp.hand"),
                ],
            ),
            (
                "enum[|go",
                "run",
                [
                    ("enum[go", "enum[run"),
                    ("mode in {go}", "mode in {run}"),
                    ("mode: go", "mode: run"),
                ],
            ),
        ],
    ),
)
def test_renames_parts_wherever_they_are_named(
    at: str, new: str, expected: list[tuple[str, str]], tmp_path: Path
) -> None:
    system, _ = write(tmp_path)
    project = Project((str(tmp_path),))
    project.put(system, PARTS)
    before = project.analyse(system).diagnostics
    texts = renamed(project, system, place(PARTS, at), new)
    wanted = PARTS
    for old, given in expected:
        assert wanted.count(old) == 1, old
        wanted = wanted.replace(old, given)
    assert texts == {system: wanted}
    project.put(system, wanted)
    after = project.analyse(system).diagnostics
    assert sorted(d.code for d in after) == sorted(d.code for d in before)


def test_a_virtual_effector_with_uses_and_its_device_have_names_of_their_own(
    tmp_path: Path,
) -> None:
    system, _ = write(tmp_path)
    text = SYSTEM.replace("      m:\n        rate", "      m:\n        uses: [m]\n        rate")
    project = Project((str(tmp_path),))
    project.put(system, text)
    project.analyse(system)
    device = renamed(project, system, place(text, "|m: {x: {q_d"), "motor")[system]
    assert "motor: {x: {q_d" in device
    assert "uses: [motor]" in device
    assert "      m:\n        uses" in device
    virtual = renamed(project, system, place(text, "|m:\n        uses"), "hand")[system]
    assert "hand:\n        uses: [m]" in virtual
    assert "m: {x: {q_d" in virtual


def test_members_that_python_knows_keep_their_names(tmp_path: Path) -> None:
    system, _ = write(tmp_path)
    text = SYSTEM.replace(
        "  GR: {", '  SG: {signature: "(m: Mode) -> bool", python: "arm:sg"}\n  GR: {'
    )
    project = Project((str(tmp_path),))
    project.put(system, text)
    project.analyse(system)
    with pytest.raises(RenameError, match="operator `SG`"):
        features.rename_at(project, system, place(text, "enum[|go"), "run")


def test_a_frame_does_not_get_the_name_of_a_variable_of_a_signature(tmp_path: Path) -> None:
    system, _ = write(tmp_path)
    text = SYSTEM.replace(
        "  GR: {", '  TP: {signature: "(X: pose[P, E]) -> pose[P, E]", python: "arm:tp"}\n  GR: {'
    )
    project = Project((str(tmp_path),))
    project.put(system, text)
    project.analyse(system)
    with pytest.raises(RenameError, match="any frame"):
        features.rename_at(project, system, place(text, "frames: {|B"), "P")


def test_renames_in_every_system_that_uses_a_library(tmp_path: Path) -> None:
    system, library = write(tmp_path)
    other = tmp_path / "other.yaml"
    other.write_text(SYSTEM.replace("system: arm", "system: other"))
    project = Project((str(tmp_path),))
    project.put(system, SYSTEM)
    project.analyse(system)
    texts = renamed(project, system, place(SYSTEM, "g: {|d_c"), "width")
    assert set(texts) == {system, library, str(other)}
    assert texts[str(other)] == texts[system].replace("system: arm", "system: other")


def test_refuses_what_would_break_another_system(tmp_path: Path) -> None:
    system, library = write(tmp_path)
    other = tmp_path / "other.yaml"
    text = SYSTEM.replace("system: arm", "system: other")
    other.write_text(text.replace('g: {d_c: "real[m]"}', 'g: {d_c: "real[m]", width: "real[m]"}'))
    project = Project((str(tmp_path),))
    project.put(system, SYSTEM)
    project.analyse(system)
    with pytest.raises(RenameError, match="taken"):
        features.rename_at(project, library, place(LIBRARY, "y: {c: {|d_c"), "width")


def test_renames_a_variable_in_its_text_only(workspace: tuple[Project, str, str]) -> None:
    project, system, _ = workspace
    texts = renamed(project, system, place(SYSTEM, "all(|v <"), "joint")
    assert texts[system] == SYSTEM.replace(
        "all(v < 1[rad] for v in", "all(joint < 1[rad] for joint in"
    )


@pytest.mark.parametrize(
    ("at", "new", "reason"),
    [
        ("|q_p: {type", "grip", "taken"),
        ("|q_p: {type", "limit", "taken"),
        ("|q_p: {type", "T_c", "taken"),
        ("|q_p: {type", "halt", "taken"),
        ("|q_p: {type", "elapsed", "word of the language"),
        ("|q_p: {type", "1st", "not a valid name"),
        ("|q_p: {type", "q p", "not a valid name"),
        ("|q_p: {type", "q_p", "has"),
        ("|S0: idle, S1", "S1", "taken"),
        ("|hold: {title", "move", "taken"),
        ("c: {|q_d: {type", "mode", "taken"),
        ("|limit: {is", "q_p", "taken"),
        ("all(|v <", "grip", "taken"),
        ("|Mode: {type", "Joints", "taken"),
        ("|Mode: {type", "rad", "unit"),
        ("|Joints: vector", "vector", "word"),
        ("|reached:", "never", "word"),
        ("|m: {x: {q_d", "g", "taken"),
        ("|m: {x: {q_d", "E", "word of the language"),
        ("|control:", "brain", "everywhere"),
        ("|irp:", "m", "taken"),
        ("all(v < |1[rad]", "one", "no known name here"),
    ],
)
def test_refuses(at: str, new: str, reason: str, workspace: tuple[Project, str, str]) -> None:
    project, system, _ = workspace
    with pytest.raises(RenameError, match=reason):
        features.rename_at(project, system, place(SYSTEM, at), new)


def test_refuses_while_a_text_that_may_mean_the_symbol_has_errors(tmp_path: Path) -> None:
    project, system, library = opened(tmp_path)
    text = SYSTEM.replace("near(q_p, x.E.q_m, limit)", "near(q_p, x.E.q_m, limits)")
    project.put(system, text)
    project.analyse(system)
    with pytest.raises(RenameError, match="first correct"):
        features.rename_at(project, system, place(text, "|q_p: {type"), FRESH)
    # Where the error cannot be about the symbol, renaming goes on.
    assert renamed(project, system, place(text, "|hold: {title"), FRESH)
    project.put(system, text.replace("specc: 1", "specc: ["))
    project.analyse(system)
    with pytest.raises(RenameError, match="correct the errors"):
        features.rename_at(project, library, place(LIBRARY, "y: {c: {|d_c"), FRESH)


LIVE = """\
specc: 1.2
system: demo
constants:
  v: {is: 2, range: [1, 3], live: true, title: the speed}
  w: 2 * v
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {n: int}}
      functions: {tell: {y.b.n: v + w}}
      behaviours: {tell: {functions: [tell], terminal: {when: elapsed > 1}}}
      states: {S0: tell}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
  b:
    control:
      rate: 10 Hz
      x: {a: {n: {type: int, init: 0}}}
      memory: {n: {type: int, init: v}}
      functions: {keep: {n: x.a.n + n}}
      behaviours: {keep: {functions: [keep], terminal: never}}
      states: {S0: keep}
      initial_state: S0
task:
  cycle: {of: a.c, from: S0, to: S0}
  disturb: [{at: "1[s]", adjust: {v: 3}, because: of the test}]
require:
  - {that: "always(v < 4 or b.c.n > v)", because: of the test}
"""


def test_a_constant_that_may_change_has_its_name_wherever_it_changes(tmp_path: Path) -> None:
    path = tmp_path / "live.yaml"
    path.write_text(LIVE)
    project = Project()
    project.analyse(str(path))
    at = place(LIVE, "adjust: {|v: 3")
    hover = features.hover(project, str(path), at)
    assert hover is not None
    assert "range: 1, 3" in hover.text and "the speed" in hover.text
    after = renamed(project, str(path), at, "speed")[str(path)]
    for part in (
        "  speed: {is: 2,",
        "w: 2 * speed",
        "y.b.n: speed + w",
        "init: speed}",
        "adjust: {speed: 3}",
        "always(speed < 4 or b.c.n > speed)",
    ):
        assert part in after
