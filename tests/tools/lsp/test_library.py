"""A file that no system uses is checked as far as it goes by itself."""

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from tests.house.tree import ROOT
from tests.tools.lsp.workspace import LIBRARY, place

AGENT = """\
specc: 1
parameters: {step: int, F: frame}
constants: {twice: step + step}
agent:
  title: Counts in steps
  real_receptors: {k: {y: {F_m: "wrench[F]"}}}
  virtual_receptors:
    k:
      rate: 10 Hz
      x: {R: {F_m: "wrench[F]"}}
      y: {c: {z: "real[N]"}}
      functions: {look: {y.c.z: x.R.F_m.z}}
      behaviours: {look: {functions: [look], terminal: never}}
      states: {S0: look}
      initial_state: S0
  control:
    rate: 10 Hz
    x: {k: {z: "real[N]"}}
    y: {listener: {n: int}}
    memory: {k: {type: int, init: 0}}
    functions: {count: {k: k + twice, y.listener.n: k}}
    behaviours: {count: {functions: [count], terminal: always}}
    states: {S0: count}
    initial_state: S0
    transitions: [[S0, terminal, always, S0]]
"""


def found(path: Path, text: str) -> set[str]:
    project = Project((str(path.parent),))
    project.put(str(path), text)
    for root in project.roots(str(path), search=True):
        project.analyse(root)
    return {note.diagnostic.code for note in features.notes(project)[str(path)]}


@pytest.mark.parametrize("text", [LIBRARY, AGENT])
def test_nothing_is_said_of_what_only_a_user_could_mend(text: str, tmp_path: Path) -> None:
    assert found(tmp_path / "alone.yaml", text) == set()


def test_the_library_of_the_flagship_is_right_by_itself() -> None:
    library = ROOT / "specs/parts/two_finger_gripper.yaml"
    project = Project()
    assert project.analyse(str(library)).diagnostics == ()


@pytest.mark.parametrize(
    ("text", "old", "new", "code"),
    [
        (LIBRARY, "d_p: x.E.d_m}}", 'd_p: "1[N]"}}', "E0310"),
        (LIBRARY, ", [S0, terminal, still, S0]]", "]", "E0601"),
        (LIBRARY, 'moved: "not near', 'moved: "near', "E0602"),
        (AGENT, "k + twice", "k or twice", "E0310"),
        (AGENT, "step + step", "step or step", "E0310"),
        (AGENT, "x.R.F_m.z", "x.R.F_m", "E0310"),
        (AGENT, "[count], terminal: always", "[counts], terminal: always", "E0201"),
    ],
)
def test_what_is_wrong_in_it_is_said(
    text: str, old: str, new: str, code: str, tmp_path: Path
) -> None:
    assert text.count(old) == 1
    assert code in found(tmp_path / "alone.yaml", text.replace(old, new))


def test_its_names_have_types(tmp_path: Path) -> None:
    path = str(tmp_path / "alone.yaml")
    project = Project()
    project.put(path, LIBRARY)
    project.analyse(path)
    hover = features.hover(project, path, place(LIBRARY, 'moved: "not near(|d_p'))
    assert hover is not None
    assert "real[m]" in hover.text
