"""`through`: a subsystem with one state is the one that it stands for, written out."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.model.system import System
from specc.pipeline import compile_spec
from specc.tools.lsp import features
from specc.tools.lsp.rename import apply
from tests.tools.lsp.workspace import edited, place

SPEC = """\
specc: 1.2
system: demo
interfaces:
  Seen: {d: "real[m]", k: {type: int, init: 0}}
agents:
  a:
    real_effectors:
      lift: {x: {h_d: {type: "real[m]", safe: {is: h, otherwise: "0[m]"}}}, y: {h: "real[m]"}}
    real_receptors: {eye: {y: {is: Seen, sure: bool}}}
    virtual_effectors:
      lift: LIFT
    virtual_receptors:
      eye: EYE
    control:
      title: Control
      rate: 10 Hz
      x: {lift: {h: {type: "real[m]", init: 0}}, eye: {d: "real[m]", k: int, sure: bool}}
      y: {lift: {h_d: "real[m]"}}
      functions: {go: {y.lift.h_d: "x.eye.d if present(x.eye.d) and x.lift.h < 1[m] else 0"}}
      behaviours: {go: {functions: [go], terminal: never}}
      states: {S0: go}
      initial_state: S0
"""
THROUGH = "{title: Lift, rate: 50 Hz, through: identity}"
MACHINE = (
    "behaviours: {through: {functions: [through], terminal: never}}, states: {through: through}"
)
WRITTEN = (
    '{title: Lift, rate: 50 Hz, x: {c: {h_d: {type: "real[m]", init: "0[m]"}}, E: {h: "real[m]"}},'
    ' y: {E: {h_d: "real[m]"}, c: {h: "real[m]"}},'
    " functions: {through: {y.E.h_d: x.c.h_d, y.c.h: x.E.h}},"
    f" {MACHINE}, initial_state: through}}"
)
EYE = "{title: Eye, rate: 50 Hz, through: identity}"
EYE_WRITTEN = (
    "{title: Eye, rate: 50 Hz, x: {R: {is: Seen, sure: bool}}, y: {c: {is: Seen, sure: bool}},"
    " functions: {through: {y.c.d: x.R.d, y.c.k: x.R.k, y.c.sure: x.R.sure}},"
    f" {MACHINE}, initial_state: through}}"
)


def text(lift: str = THROUGH, eye: str = EYE) -> str:
    return SPEC.replace("LIFT", lift).replace("EYE", eye)


def compiled(folder: Path, written: str) -> System:
    path = folder / "demo.yaml"
    path.write_text(written)
    result = compile_spec(str(path))
    assert [d for d in result.diagnostics if d.severity == "error"] == []
    assert result.system is not None
    return result.system


def without_places(system: System) -> object:
    return [
        (
            s.qualified_name,
            s.title,
            [(p.peer, p.direction, p.other_end, untold(p.elements)) for p in s.ports],
            [(f.name, [(a.peer, a.target, a.value) for a in f.assignments]) for f in s.functions],
            [(state.name, state.behaviour.name) for state in s.states],
            s.initial_state,
        )
        for agent in system.agents
        for s in agent.subsystems
    ]


def untold(elements: tuple[object, ...]) -> list[object]:
    return [(e.name, e.type, e.init) for e in elements]  # type: ignore[attr-defined]  # of any port


@pytest.mark.parametrize(
    "short",
    [
        text(),
        text(lift="{title: Lift, rate: 50 Hz, through: {rule: identity, y.c.h: x.E.h}}"),
        text(lift=THROUGH.replace("{title", '{x: {c: {h_d: {type: "real[m]", init: 0}}}, title')),
    ],
)
def test_what_passes_all_on_is_what_it_stands_for(short: str, tmp_path: Path) -> None:
    long = without_places(compiled(tmp_path, text(WRITTEN, EYE_WRITTEN)))
    assert without_places(compiled(tmp_path, short)) == long


def test_targets_stand_beside_lets_and_memory(tmp_path: Path) -> None:
    lift = (
        '{title: Lift, rate: 50 Hz, memory: {n: {type: int, init: 0}}, let: {up: "0.1[m]"},'
        " through: {title: Lifts, rule: identity, n: n + 1, y.E.h_d: x.c.h_d + up}}"
    )
    system = compiled(tmp_path, text(lift))
    (subsystem,) = (s for a in system.agents for s in a.subsystems if s.name == "lift")
    (function,) = subsystem.functions
    assert function.title == "Lifts"
    assert [a.target for a in function.assignments] == ["y.E.h_d", "y.c.h", "n"]


def test_an_element_is_renamed_at_all_ends_that_are_written(tmp_path: Path) -> None:
    written = text()
    project, path = edited(tmp_path / "demo.yaml", written)
    edits = features.rename_at(project, path, place(written, "x: {|h_d: {type"), "height")
    assert apply(written, edits) == written.replace("h_d", "height")


def test_targets_below_through_are_known_to_the_editor(tmp_path: Path) -> None:
    written = text(lift="{title: Lift, rate: 50 Hz, through: {rule: identity, y.c.h: 2 * x.E.h}}")
    project, path = edited(tmp_path / "demo.yaml", written)
    hover = features.hover(project, path, place(written, "2 * x.E.|h}"))
    assert hover is not None
    assert "real[m]" in hover.text


def test_what_a_device_reports_is_no_first_command(tmp_path: Path) -> None:
    path = tmp_path / "demo.yaml"
    path.write_text(text().replace('safe: {is: h, otherwise: "0[m]"}', "safe: h"))
    found = [d.code for d in compile_spec(str(path)).diagnostics if d.severity == "error"]
    assert found == ["E0412", "E0701"]
