"""Renaming changes every place that means the symbol, or nothing."""

import random
from pathlib import Path

import pytest

from specc.lsp import answers
from specc.lsp.project import Project
from specc.lsp.rename import RenameError, apply
from tests.editor.workspace import LIBRARY, SYSTEM, opened, place
from tests.house.tree import ROOT

FLAGSHIP = str(ROOT / "specs/irp_picking.yaml")
FRESH = "quite_new"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, str, str]:
    return opened(tmp_path_factory.mktemp("workspace"))


def renamed(project: Project, path: str, offset: int, new: str) -> dict[str, str]:
    """Texts after a renaming."""
    edits = answers.rename_at(project, path, offset, new)
    return {
        file: apply(project.source(file).text, [e for e in edits if e.path == file], new)
        for file in {edit.path for edit in edits}
    }


def samples() -> list[tuple[str, int]]:
    """One symbol of each kind in each subsystem of the flagship that can be renamed."""
    project = Project()
    view_of = {FLAGSHIP: project.analyse(FLAGSHIP).index}
    index = view_of[FLAGSHIP]
    found: dict[object, list[tuple[str, int]]] = {}
    for occurrence in index.occurrences(FLAGSHIP):
        symbol = occurrence.symbol
        try:
            answers.renameable(project, FLAGSHIP, occurrence.start)
        except RenameError:
            continue
        key = (symbol.kind, symbol.owner)
        found.setdefault(key, []).append((f"{symbol.kind} {symbol.name}", occurrence.start))
    rng = random.Random(3)
    return [rng.choice(places) for places in found.values()]


@pytest.mark.parametrize(("name", "offset"), samples())
def test_renaming_there_and_back_is_nothing(name: str, offset: int) -> None:
    project = Project()
    project.analyse(FLAGSHIP)
    before = project.source(FLAGSHIP).text
    texts = renamed(project, FLAGSHIP, offset, FRESH)
    assert texts
    for path, text in texts.items():
        project.put(path, text)
    project.analyse(FLAGSHIP)
    assert answers.notes(project)[FLAGSHIP] == []
    again = project.source(FLAGSHIP).text.index(FRESH)
    assert renamed(project, FLAGSHIP, again, name.split()[-1])[FLAGSHIP] == before


def test_renames_both_ends_in_both_files(workspace: tuple[Project, str, str]) -> None:
    project, system, library = workspace
    texts = renamed(project, system, place(SYSTEM, "g: {|d_c"), "width")
    assert set(texts) == {system, library}
    assert 'g: {width: "real[m]"}' in texts[system]
    assert 'y: {c: {width: "real[m]"}' in texts[library]
    assert "y.c.width: d_p" in texts[library]


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
        ("|q_p: {type", "1st", "no name"),
        ("|q_p: {type", "q p", "no name"),
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
        ("enum[|go,", "run", "Python"),
        ("|m: {x: {q_d", "arm", "edit the file"),
        ("all(v < |1[rad]", "one", "no name that specc knows"),
    ],
)
def test_refuses(at: str, new: str, reason: str, workspace: tuple[Project, str, str]) -> None:
    project, system, _ = workspace
    with pytest.raises(RenameError, match=reason):
        answers.rename_at(project, system, place(SYSTEM, at), new)


def test_refuses_while_a_text_that_may_mean_the_symbol_has_errors(tmp_path: Path) -> None:
    project, system, library = opened(tmp_path)
    text = SYSTEM.replace("near(q_p, x.E.q_m, limit)", "near(q_p, x.E.q_m, limits)")
    project.put(system, text)
    project.analyse(system)
    with pytest.raises(RenameError, match="mend"):
        answers.rename_at(project, system, place(text, "|q_p: {type"), FRESH)
    # Where the error cannot be about the symbol, renaming goes on.
    assert renamed(project, system, place(text, "|hold: {title"), FRESH)
    project.put(system, text.replace("specc: 1", "specc: ["))
    project.analyse(system)
    with pytest.raises(RenameError, match="mend"):
        answers.rename_at(project, library, place(LIBRARY, "y: {c: {|d_c"), FRESH)
