"""Modes and named error conditions in an editor."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.describe import OutlineEntry
from specc.tools.lsp.project import Project
from specc.tools.lsp.rename import RenameError, apply
from tests.house.tree import ROOT
from tests.seeds import every
from tests.tools.lsp.workspace import place

ARM = (ROOT / "tests/tools/modes.yaml").read_text(encoding="utf-8")


@pytest.fixture
def arm(tmp_path: Path) -> tuple[Project, str]:
    path = tmp_path / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")
    project = Project((str(tmp_path),))
    project.put(str(path), ARM)
    project.analyse(str(path))
    return project, str(path)


def proposed(arm: tuple[Project, str], old: str, new: str) -> set[str]:
    """The proposals at the `|` of `new` in place of `old`."""
    project, path = arm
    assert ARM.count(old) == 1, old
    before, after = ARM.replace(old, new).split("|")
    project.put(path, before + after)
    project.analyse(path)
    return {item.label for item in features.completions(project, path, len(before))}


@pytest.mark.parametrize(
    ("old", "new", "there", "absent"),
    every(3, [
        # where states and modes stand
        ("[powered, tripped,", "[|, tripped,", "powered working looking halted", "resume(working)"),
        ("[[placing, retrying], error", "[[placing, |], error", "picking looking", "terminal"),
        ("always, resume(working)]", "always, |]", "working looking resume(working)", "terminal"),
        ("always, resume(working)]", "always, resume(|)]", "working picking",
         "looking resume(working)"),
        ("always, resume(working)]", "always, resume(wor|)]", "working picking", "looking"),
        ("initial: carrying", "initial: |", "carrying placing", "terminal"),
        ("[picking, placing, retrying]", "[picking, |]", "placing retrying", "slow"),
        # causes: those of the states of the row
        ("[powered, tripped,", "[powered, |,", "terminal error tripped slow missed tired", "never"),
        ("[working, tired,", "[working, |,", "terminal error tripped tired pause stuck", "never"),
        ("[[booting, homing], error,", "[[booting, homing], |,", "tripped slow", "tired missed"),
        ("[halted, terminal,", "[halted, |,", "terminal error", "tripped slow"),
        ("[grasping, terminal,", "[grasping, |,", "tired stuck missed", "slow"),
        # what is asked of modes
        ('"elapsed(working) > 60[s]"', '"elapsed(|) > 60[s]"', "working picking powered",
         "looking tries"),
        ('"elapsed(working) > 60[s]"', '"| > 60[s]"', "elapsed entered tries", "working"),
    ]),
)  # fmt: skip
def test_proposes(old: str, new: str, there: str, absent: str, arm: tuple[Project, str]) -> None:
    found = proposed(arm, old, new)
    assert set(there.split()) <= found
    assert not set(absent.split()) & found


def test_what_modes_remember_is_no_name(arm: tuple[Project, str]) -> None:
    found = proposed(arm, "error: {missed: x.desk.load == 25", "error: {missed: |")
    assert "tries" in found
    assert not {name for name in found if "(" in name}


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ("[|working, tired", ["mode", "working", "the task", "states: picking, placing, retrying"]),
        ("resume(|working)", ["mode", "the task"]),
        ("elapsed(|working)", ["mode", "the task"]),
        ("[working, |tired", ["error condition", "tired", "elapsed(working) > 60[s]"]),
        ("[[booting, homing], |error,",
         ["one of `booting`, `homing` has ended by its error condition `slow`"]),
        ("[picking, |error, again", ["`missed`: `x.desk.load == 25`", "of state `grasping`"]),
        ("[waiting, |terminal,", ["behaviour `wait` of state `waiting` has ended"]),
    ],
)  # fmt: skip
def test_says_what_it_is(at: str, words: list[str], arm: tuple[Project, str]) -> None:
    project, path = arm
    found = features.hover(project, path, place(ARM, at))
    assert found is not None
    assert [word for word in words if word not in found.text] == []


@pytest.mark.parametrize(
    ("at", "definition"),
    [
        ("resume(|working)", "        |working:\n"),
        ("elapsed(|working)", "        |working:\n"),
        ("[|working, tired", "        |working:\n"),
        ("[|picking, placing", "        |picking:\n"),
        ("initial: |picking", "        |picking:\n"),
        ("always, |placing]", "        |placing:\n"),
        ("[working, |pause,", "|pause: x.desk.pause}"),
        ("[powered, |tripped,", "{|tripped: x.desk"),
    ],
)
def test_goes_to_the_definition(at: str, definition: str, arm: tuple[Project, str]) -> None:
    project, path = arm
    found = features.definition(project, path, place(ARM, at))
    assert [each.start for each in found] == [place(ARM, definition)]


def renamed(arm: tuple[Project, str], at: str, new: str, text: str = ARM) -> str:
    project, path = arm
    edits = features.rename_at(project, path, place(text, at), new)
    return apply(project.source(path).text, edits)


def test_renames_a_mode_everywhere(arm: tuple[Project, str]) -> None:
    text = renamed(arm, "resume(|working)", "busy")
    assert "working" not in text
    for part in ("resume(busy)", "elapsed(busy) > 60[s]", "        busy:\n", "[busy, tired,"):
        assert part in text
    assert "waiting, busy, paused]" in text


def test_renames_a_cause_with_its_error_condition(arm: tuple[Project, str]) -> None:
    text = renamed(arm, "[working, |tired", "spent")
    assert "tired" not in text
    assert "[working, spent, always" in text and "{spent: " in text


def test_error_conditions_that_a_row_names_together_are_renamed_together(tmp_path: Path) -> None:
    text = ARM.replace(
        "move: {functions: [], terminal: there, error: slow}",
        "move: {functions: [], terminal: there, error: {slow: x.desk.load == 7}}",
    ).replace("[[placing, retrying], error,", "[[placing, retrying], slow,")
    path = tmp_path / "arm.yaml"
    path.write_text(text, encoding="utf-8")
    project = Project((str(tmp_path),))
    project.analyse(str(path))
    found = features.definition(project, str(path), place(text, "retrying], |slow,"))
    wanted = {
        place(text, 'error: {|slow: "x.desk.load'),
        place(text, "{|slow: x.desk.load == 7"),
    }
    assert {each.start for each in found} == wanted
    new = renamed((project, str(path)), "retrying], |slow,", "late_now", text)
    assert "slow" not in new


@pytest.mark.parametrize(
    ("at", "new", "words"),
    [
        ("resume(|working)", "looking", "is taken: state `looking`"),
        ("[|halted, terminal", "working", "is taken: mode `working`"),
        ("[working, |tired", "terminal", "would be an error"),
        ("[working, |tired", "pause", "is taken"),
    ],
)
def test_renames_nothing(at: str, new: str, words: str, arm: tuple[Project, str]) -> None:
    with pytest.raises(RenameError) as refused:
        renamed(arm, at, new)
    assert words in str(refused.value)


def test_the_outline_has_modes_with_their_error_conditions(arm: tuple[Project, str]) -> None:
    project, path = arm

    def flat(entries: list[OutlineEntry]) -> list[tuple[str, str, list[str]]]:
        found = []
        for entry in entries:
            found.append((entry.kind, entry.name, [child.name for child in entry.children]))
            found += flat(entry.children)
        return found

    modes = [each[1:] for each in flat(features.outline(project, path)) if each[0] == "mode"]
    assert modes == [
        ("powered", ["tripped"]),
        ("working", ["tired", "pause"]),
        ("picking", []),
        ("placing", []),
    ]


@pytest.mark.parametrize(
    ("lacking", "condition", "row"),
    [
        (
            "        - [backing, terminal, always, waiting]\n",
            "terminal condition of backing",
            "always, failed]\n        - [backing, terminal, always, backing]\n",
        ),
        (
            "        - [[placing, retrying], error, always, failed]\n",
            "error slow of carrying, lowering, releasing, backing, retrying",
            "\n        - [carrying, slow, always, carrying]\n",
        ),
    ],
)
def test_inserts_a_row_that_states_in_modes_lack(
    lacking: str, condition: str, row: str, tmp_path: Path
) -> None:
    text = ARM.replace(lacking, "")
    path = tmp_path / "arm.yaml"
    path.write_text(text, encoding="utf-8")
    project = Project((str(tmp_path),))
    project.analyse(str(path))
    (action,) = features.repairs(project, str(path), 0, len(text))
    assert action.title == f"Insert a row for the {condition}"
    assert row in apply(text, action.changes)
