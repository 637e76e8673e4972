"""What an editor offers where a specification uses a part of the library."""

from __future__ import annotations

from pathlib import Path

import pytest
from pygls import uris

from specc.resources import library_parts, on_disk
from specc.tools.lsp import features
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import RenameError
from specc.tools.lsp.session import EditorSession
from tests.commands import ROOT
from tests.tools.lsp.workspace import edited, place

TEXT = (ROOT / "specs/skeletons/arm/arm.yaml").read_text(encoding="utf-8")


@pytest.fixture
def editor(tmp_path: Path) -> tuple[Project, str]:
    return edited(tmp_path / "arm.yaml", TEXT)


def labels(project: Project, path: str, old: str, new: str) -> dict[str, int]:
    assert TEXT.count(old) == 1
    before, after = new.split("|")
    start = TEXT.index(old)
    project.put(path, TEXT[:start] + before + after + TEXT[start + len(old) :])
    project.analyse(path)
    found = features.completions(project, path, start + len(before))
    return {completion.label: completion.replaces for completion in found}


@pytest.mark.parametrize(
    ("typed", "replaces"), [("use: |", 0), ("use: spe|", 3), ("use: specc:jo|", len("specc:jo"))]
)
def test_parts_are_proposed(editor: tuple[Project, str], typed: str, replaces: int) -> None:
    found = labels(*editor, "use: specc:joint_arm", typed)
    assert {name: found.get(name) for name in library_parts()} == dict.fromkeys(
        library_parts(), replaces
    )


def test_parameters_of_a_part_are_proposed(editor: tuple[Project, str]) -> None:
    found = labels(*editor, "          a_max:", "          |a_max:")
    assert "v_max" not in found  # it is given already
    found = labels(*editor, '          v_max: "[1.5, 1.5] * 1[rad/s]"\n', "          |\n")
    assert "v_max" in found


def test_a_hover_tells_what_a_part_takes(editor: tuple[Project, str]) -> None:
    hover = features.hover(*editor, place(TEXT, "use: specc:jo|int_arm"))
    assert hover is not None
    assert "Arm of n joints" in hover.text
    assert "- parameter `v_max: vector[n, rad/s]`, largest velocities" in hover.text


def test_the_definition_is_in_the_installation(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(TEXT, encoding="utf-8")
    project, path = edited(tmp_path / "arm.yaml", TEXT)
    (found,) = features.definition(project, path, place(TEXT, "use: specc:jo|int_arm"))
    assert found.path == "specc:joint_arm"
    session = EditorSession()
    uri = session.uri(found.path)
    assert uris.to_fs_path(uri) == on_disk("specc:joint_arm")
    # The editor opens that file: it is the same part.
    assert session.path(uri) == "specc:joint_arm"


def test_parameters_of_a_part_are_not_renamed(editor: tuple[Project, str]) -> None:
    with pytest.raises(RenameError, match="the library of specc"):
        features.rename_at(*editor, place(TEXT, '          v_|max: "[1.5'), "fastest")


def test_elements_of_a_part_are_not_renamed(editor: tuple[Project, str]) -> None:
    with pytest.raises(RenameError, match="the library of specc"):
        features.rename_at(*editor, place(TEXT, "mov|ing: {type: bool"), "busy")


def test_what_is_no_part_is_said_where_it_is_used(editor: tuple[Project, str]) -> None:
    project, path = editor
    project.put(path, TEXT.replace("specc:joint_arm", "specc:jiont_arm"))
    project.analyse(path)
    codes = {note.diagnostic.code for note in features.notes(project)[path]}
    assert codes == {"E0001", "E0501"}  # there is no model in this folder
