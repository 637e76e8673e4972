"""Interfaces and many agents of a kind are known to the editor like anything written out."""

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import RenameError
from tests.tools.lsp.workspace import edited, place

CASES = Path(__file__).resolve().parents[2] / "cases" / "structure"
SYSTEM = """\
specc: 1.1
system: pair
frames: {W: world}
types: {Mode: "enum[slow, fast]"}
interfaces:
  Report: {frames: [F], X: "pose[F, W]", mode: {type: Mode, title: how it drives}}
agents:
  rover:
    control:
      rate: 10 Hz
      y: {base: "Report[W]"}
      functions: {tell: {y.base.mode: slow, y.base.X: identity()}}
      behaviours: {tell: {functions: [tell], terminal: never}}
      states: {S0: tell}
      initial_state: S0
  base:
    control:
      rate: 10 Hz
      x: {rover: "Report[W]"}
      memory: {last: {type: Mode, init: slow}}
      functions: {hear: {last: x.rover.mode if present(x.rover.mode) else last}}
      behaviours: {hear: {functions: [hear], terminal: never}}
      states: {S0: hear}
      initial_state: S0
"""


@pytest.fixture
def project(tmp_path: Path) -> tuple[Project, str]:
    return edited(tmp_path / "pair.yaml", SYSTEM)


@pytest.mark.parametrize(
    ("marked", "definition"),
    [
        ("last: x.rover.mo|de if", "|mode: {type"),
        ("y.base.mo|de: slow", "|mode: {type"),
        ('x: {rover: "Rep|ort[W]"}', "|Report: {frames"),
        ('x: {rover: "Report[|W]"}', "|W: world"),
    ],
)
def test_names_lead_to_the_interface(
    project: tuple[Project, str], marked: str, definition: str
) -> None:
    analysed, path = project
    index = analysed.analyse(path).index
    found = index.name_at(path, place(SYSTEM, marked))
    assert found is not None
    assert index.offsets(found.symbol.place)[0] == place(SYSTEM, definition)


def test_hover_tells_of_an_element(project: tuple[Project, str]) -> None:
    found = features.hover(*project, place(SYSTEM, "last: x.rover.mo|de if"))
    assert found is not None
    assert "how it drives" in found.text
    assert "from rover.c to base.c" in found.text


def test_an_interface_and_its_elements_are_proposed(project: tuple[Project, str]) -> None:
    analysed, path = project
    for old, new, label in (
        ("if present(x.rover.mode)", "if present(x.rover.|)", "mode"),
        ('x: {rover: "Report[W]"}', "x: {rover: |}", "Report"),
        ('x: {rover: "Report[W]"}', "x: {rover: |}", "same"),
        ('x: {rover: "Report[W]"}', 'x: {rover: "Report[|"}', "W"),
        ("{tell: {y.base.mode: slow,", "{tell: {|,", "y.base.mode"),
    ):
        before, after = new.split("|")
        start = SYSTEM.index(old)
        analysed.put(path, SYSTEM[:start] + before + after + SYSTEM[start + len(old) :])
        proposed = features.completions(analysed, path, start + len(before))
        analysed.put(path, SYSTEM)
        assert label in {completion.label for completion in proposed}, new


def test_renaming_an_element_renames_it_wherever_it_is_used(project: tuple[Project, str]) -> None:
    analysed, path = project
    index = analysed.analyse(path).index
    found = index.name_at(path, place(SYSTEM, "last: x.rover.mo|de if"))
    assert found is not None
    places = {o.start for _, o in index.occurrences_of(found.symbol.declarations)}
    assert len(places) == 4


def test_many_of_a_kind_are_known_by_the_name_of_their_template() -> None:
    path = str(CASES / "ok-ring.yaml")
    project = Project((str(CASES),))
    text = Path(path).read_text(encoding="utf-8")
    project.put(path, text)
    analysis = project.analyse(path)
    assert analysis.diagnostics == ()
    index = analysis.index
    for marked in ('x: {"rob|ots_{i}": {for', '"y.rob|ots_{i}.halt"'):
        found = index.name_at(path, place(text, marked))
        assert found is not None
        assert found.symbol.place.route == ("agents", "robots")
        with pytest.raises(RenameError, match="the name of many"):
            features.rename_at(project, path, place(text, marked), "others")


def test_a_reader_of_many_is_understood() -> None:
    path = str(CASES / "ok-reader-of-many.yaml")
    project = Project((str(CASES),))
    text = Path(path).read_text(encoding="utf-8")
    project.put(path, text)
    analysis = project.analyse(path)
    assert analysis.diagnostics == ()
    found = analysis.index.name_at(path, place(text, "x: {rob|ots: Report}"))
    assert found is not None
    assert found.symbol.place.route == ("agents", "robots")
    assert analysis.index.occurrences(path)
    assert features.hover(project, path, place(text, "kno|wn: all(")) is not None


SAME = SYSTEM.replace('x: {rover: "Report[W]"}', "x: {rover: END}").replace(
    'y: {base: "Report[W]"}', 'y: {base: {X: "pose[W, W]", mode: {title: pace, type: Mode}}}'
)


@pytest.mark.parametrize(
    ("end", "declared", "count"),
    [
        ("same", "|mode: {title", 4),
        ("{is: same, mode: {init: slow}}", "|mode: {init", 5),
    ],
)
def test_an_end_that_is_same_has_the_elements_of_the_other(
    end: str, declared: str, count: int, tmp_path: Path
) -> None:
    text = SAME.replace("END", end)
    analysed, path = edited(tmp_path / "pair.yaml", text)
    index = analysed.analyse(path).index
    used = place(text, "last: x.rover.mo|de if")
    found = index.name_at(path, used)
    assert found is not None
    assert index.offsets(found.symbol.place)[0] == place(text, declared)
    assert len({o.start for _, o in index.occurrences_of(found.symbol.declarations)}) == count
    hover = features.hover(analysed, path, used)
    assert hover is not None
    assert "from rover.c to base.c" in hover.text
    assert len(features.rename_at(analysed, path, used, "gait")) == count
    typed = text.replace("present(x.rover.mode)", "present(x.rover.)")
    analysed.put(path, typed)
    labels = features.completions(analysed, path, place(typed, "present(x.rover.|)"))
    assert {"mode", "X"} <= {completion.label for completion in labels}


HOIST = """\
specc: 1.2
system: hoist
agents:
  hoist:
    real_effectors:
      lift: {x: {h_d: {type: int, safe: 0}}, y: {h: {type: int, init: 0}}, through: 50 Hz}
    control:
      rate: 10 Hz
      through: {y.lift.h_d: x.lift.h + 1}
"""


def test_a_device_that_is_passed_on_is_known_to_its_agent(tmp_path: Path) -> None:
    analysed, path = edited(tmp_path / "hoist.yaml", HOIST)
    for marked, declared, count in (
        ("{y.lift.h_|d: x", "{x: {|h_d: {type", 2),
        (": x.lift.|h +", "y: {|h: {type", 2),
        (": x.li|ft.h +", "|lift: {x: {h_d", 3),
    ):
        found = analysed.analyse(path).index.name_at(path, place(HOIST, marked))
        assert found is not None
        assert found.symbol.place.route
        start = analysed.analyse(path).index.offsets(found.symbol.place)[0]
        assert start == place(HOIST, declared)
        assert features.hover(analysed, path, place(HOIST, marked)) is not None
        assert len(features.rename_at(analysed, path, place(HOIST, marked), "other")) == count
