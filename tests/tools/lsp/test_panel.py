"""Editors know what is on the operator's panel."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from tests.house.tree import ROOT
from tests.tools.lsp.test_completion import labels
from tests.tools.lsp.test_rename import renamed
from tests.tools.lsp.workspace import place

TEXT = """\
specc: 1.3
system: demo
agents:
  desk:
    real_receptors: {buttons: {y: {go: bool, v: {type: "real[m/s]", title: the speed}}}}
    virtual_receptors: {buttons: {rate: 10 Hz, through: identity}}
    control:
      rate: 10 Hz
      x: {buttons: {go: bool, v: "real[m/s]"}}
      memory: {v: {type: "real[m/s]", init: 0}}
      functions: {keep: {v: "x.buttons.v if present(x.buttons.go) and x.buttons.go else v"}}
      behaviours: {keep: {functions: [keep], terminal: {when: "v > 0"}}}
      states: {S0: keep}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
plant:
  bind:
    desk.R.buttons.go: {panel: button, key: g}
    desk.R.buttons.v: {panel: slider, range: ["0[m/s]", "1[m/s]"], init: "0.5[m/s]"}
task:
  cycle: {of: desk.c, from: S0, to: S0}
  disturb:
    - {at: "1[s]", press: [desk.R.buttons.go], because: of the test}
    - {at: "2[s]", turn: {desk.R.buttons.v: "0.2[m/s]"}, because: of the test}
"""


@pytest.fixture
def opened(tmp_path: Path) -> tuple[Project, str]:
    path, project = tmp_path / "panel.yaml", Project()
    path.write_text(TEXT)
    project.analyse(str(path))
    assert project.view(str(path)) is not None
    return project, str(path)


def test_kinds_and_keys_are_proposed(opened: tuple[Project, str]) -> None:
    project, path = opened
    kinds = labels(project, path, TEXT, "{panel: button, key", "{panel: |, key")
    assert kinds == {"button", "switch", "slider", "choice", "number"}
    keys = labels(project, path, TEXT, "{panel: button, key: g}", "{panel: button, |}")
    assert {"hold", "range", "init", "key"} <= keys
    verbs = labels(project, path, TEXT, 'at: "1[s]", press', 'at: "1[s]", |press')
    assert {"press", "turn"} <= verbs


@pytest.mark.parametrize(
    "at", ['|v: {type: "real[m/s]", title', "buttons.|v: {panel", "turn: {desk.R.buttons.|v"]
)
def test_a_hover_says_how_the_operator_sets_it(opened: tuple[Project, str], at: str) -> None:
    project, path = opened
    hover = features.hover(project, path, place(TEXT, at))
    assert hover is not None
    assert "the speed" in hover.text
    assert "on the operator's panel: slider, 0[m/s] to 1[m/s], init 0.5[m/s]" in hover.text


@pytest.mark.parametrize(
    "at", ["|go: bool, v: {", "buttons.|go: {panel", "press: [desk.R.buttons.|go"]
)
def test_an_element_is_renamed_where_it_is_bound_and_pressed(
    opened: tuple[Project, str], at: str
) -> None:
    project, path = opened
    after = renamed(project, path, place(TEXT, at), "start")[path]
    for part in ("{y: {start: bool", "desk.R.buttons.start: {", "press: [desk.R.buttons.start]"):
        assert part in after
    after = renamed(project, path, place(TEXT, "|desk:"), "console")[path]
    assert "press: [console.R." in after and "turn: {console.R." in after


def test_a_member_that_only_an_operator_chooses_is_renamed(tmp_path: Path) -> None:
    path, project = tmp_path / "panel.yaml", Project()
    text = (ROOT / "tests/cases/plant/ok-panel.yaml").read_text("utf-8")
    path.write_text(text)
    project.analyse(str(path))
    after = renamed(project, str(path), place(text, "enum[|manual"), "by_hand")[str(path)]
    assert "Mode: enum[by_hand, automatic]" in after
    assert "{panel: choice, init: by_hand}" in after


SCENARIO = """\
scenarios:
  slow:
    because: of the test
    panel: [{at: "1[s]", press: go, turn: {v: "0.2[m/s]"}}]
    expect: within(2[s], desk.c.v > 0.1[m/s])
"""


@pytest.mark.parametrize("at", ["buttons.|go: {panel", "press: |go"])
def test_a_scenario_names_an_element_by_its_last_word(tmp_path: Path, at: str) -> None:
    path, project, text = tmp_path / "panel.yaml", Project(), TEXT + SCENARIO
    path.write_text(text)
    project.analyse(str(path))
    new = renamed(project, str(path), place(text, at), "run")[str(path)]
    assert 'press: run, turn: {v: "0.2[m/s]"}' in new
    assert "desk.R.buttons.run: {panel: button" in new
    keys = labels(project, str(path), text, "press: go", "|press: go")
    assert {"press", "turn", "delay"} <= keys and "block" not in keys
    hover = features.hover(project, str(path), place(text, "turn: {|v: "))
    assert hover is not None and "the speed" in hover.text
