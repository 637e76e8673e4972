"""What is proposed at a cursor, in texts as they are while somebody types."""

from pathlib import Path

import pytest

from specc.tools.lsp import features
from specc.tools.lsp.cursor import TextCursor, cursors, enclosing_lines
from specc.tools.lsp.project import Project
from tests.seeds import every
from tests.tools.lsp.workspace import LIBRARY, SYSTEM, opened, place, write


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, str, str]:
    return opened(tmp_path_factory.mktemp("workspace"))


def labels(project: Project, path: str, text: str, old: str, new: str) -> set[str]:
    """Labels of the proposals at the `|` of `new`, typed in place of `old`."""
    assert text.count(old) == 1, f"{old} stands {text.count(old)} times"
    before, after = new.split("|")
    start = text.index(old)
    project.put(path, text[:start] + before + after + text[start + len(old) :])
    project.analyse(path)
    try:
        found = features.completions(project, path, start + len(before))
    finally:
        project.put(path, text)
        project.analyse(path)
    return {completion.label for completion in found}


@pytest.mark.parametrize(
    ("old", "new", "there", "absent"),
    every(
        2,
        [
            # expressions
            ('"near(q_p,', '"near(|', "q_p T_c limit DK near elapsed x", "S0 E"),
            ('"near(q_p,', '"near(q_|', "q_p", "always"),
            ('"near(q_p,', '"late(|', "x", "q_p DK"),
            ('"near(q_p,', '"near(age(x.c.|', "q_d mode", "q_m X_c"),
            ('"near(q_p,', '"near(x.|', "c E", "q_p m"),
            ('"near(q_p,', '"near(x.c.|', "q_d mode", "q_m X_c"),
            ("grip.width <", "grip.w| <", "width force", "q_p"),
            ("GR()}\n        let", "GR().|}\n        let", "width force", "q_p"),
            ("grip.width < 0.1[m]", "grip.width < 0.1[|", "m rad N", "q_p"),
            ("x.c.mode in {go}", "x.c.mode in {|}", "go halt", ""),
            (
                '"real[m]"}, y: {d_m',
                '{type: "real[m]", safe: |}}, y: {d_m',
                "limit DK",
                "q_p elapsed",
            ),
            ("init: x.E.q_m, title: prev", "init: |, title: prev", "limit DK", "grip T_c elapsed"),
            ('"0.5[rad]"', '"|"', "DK", "q_p x"),
            # names in the structure
            ("functions: [hold]", "functions: [|]", "hold move", "idle"),
            (
                "functions: [hold], terminal: always",
                "functions: [hold], terminal: |",
                "always never reached",
                "going",
            ),
            ("{S0: idle, S1: motion}", "{S0: |", "idle motion", "hold"),
            (
                "initial_state: S0\n        transitions:\n",
                "initial_state: |\n        transitions:\n",
                "S0 S1",
                "idle",
            ),
            ("[S0, terminal, going, S1]", "[S0, |", "terminal error", "S0"),
            ("[S0, terminal, going, S1]", "[S0, terminal, |", "going resting always", "reached"),
            ("when: always, to: S0}", "when: always, to: |", "S0 S1", "always"),
            ("cause: terminal, when", "cause: |, when", "terminal error", "S0"),
            # types
            (
                "mode: Mode}\n          E",
                "mode: |}\n          E",
                "Mode Joints pose point optional",
                "B q_p",
            ),
            (
                "mode: Mode}\n          E",
                'mode: "optional[|"}\n          E',
                "Mode Joints pose",
                "B",
            ),
            ('X_c: "pose[B, E]"}\n          E', 'X_c: "pose[|', "B E", "Mode"),
            # keys
            (
                "        initial_state: S0\n        transitions:\n",
                "        |\n        transitions:\n",
                "initial_state title assume",
                "states S0",
            ),
            (
                "hold: {title: stay, y.E",
                "hold: {title: stay, |, y.E",
                "q_p grip y.E.q_d y.c.X_c eq",
                "x.c.q_d T_c title",
            ),
            ('with: {tolerance: "0.001[m]"}', "with: {|}", "tolerance", "limit"),
            ("frames: {B", "|\nframes: {B", "title plant task", "rate"),
        ],
    ),
)
def test_proposes(
    old: str, new: str, there: str, absent: str, workspace: tuple[Project, str, str]
) -> None:
    project, system, _ = workspace
    found = labels(project, system, SYSTEM, old, new)
    assert set(there.split()) <= found
    assert not set(absent.split()) & found


@pytest.mark.parametrize(
    ("above", "at"),
    [("frames: {", "frames: ["), ("  DK: {", "  DK {"), ("    control:\n", "    control\n")],
)
@pytest.mark.parametrize(
    ("old", "new", "there"),
    every(
        2,
        [
            ('"near(q_p,', '"near(q_|', "q_p T_c"),
            ("[S0, terminal, going, S1]", "[S0, terminal, |", "going resting always"),
            ("        let:\n", "        let:\n          new: x.c.|\n", "q_d mode"),
            ("        let:\n", "        let:\n          new: {is: q_|\n", "q_p"),
            (
                "          hold: {",
                "          new:\n            y.|\n          hold: {",
                "y.E.q_d y.c.X_c",
            ),
            ("        states: {", "        stat|\n        states: {", "states transitions"),
        ],
    ),
)
def test_proposes_below_an_error_in_a_file_that_was_never_understood(
    above: str, at: str, old: str, new: str, there: str, tmp_path: Path
) -> None:
    write(tmp_path)
    system = str(tmp_path / "arm.yaml")
    before, after = SYSTEM.replace(old, new).replace(above, at).split("|")
    project = Project((str(tmp_path),))
    project.put(system, before + after)
    for root in project.find_roots(system, search=True):
        project.analyse(root)
    found = {c.label for c in features.completions(project, system, len(before))}
    assert set(there.split()) <= found


def test_an_error_above_hides_no_hover(tmp_path: Path) -> None:
    write(tmp_path)
    system = str(tmp_path / "arm.yaml")
    text = SYSTEM.replace("frames: {", "frames: [")
    project = Project((str(tmp_path),))
    project.put(system, text)
    project.analyse(system)
    hover = features.hover(project, system, place(text, "X_c: |T_c, grip"))
    assert hover is not None
    assert "eq. 24" in hover.text


def test_proposes_parameters_of_a_reused_file(workspace: tuple[Project, str, str]) -> None:
    project, _, library = workspace
    offset = place(LIBRARY, 'x.E.d_m, |tolerance)", still')
    project.put(library, LIBRARY)
    found = {c.label for c in features.completions(project, library, offset)}
    assert {"tolerance", "d_p"} <= found
    assert "limit" not in found


def test_a_proposal_replaces_what_was_begun(tmp_path: Path) -> None:
    project, system, _ = opened(tmp_path)
    text = SYSTEM.replace("near(q_p,", "near(q_p, li")
    project.put(system, text)
    offset = place(text, "near(q_p, li|")
    (limit,) = (c for c in features.completions(project, system, offset) if c.label == "limit")
    assert text[offset - limit.replaces : offset] == "li"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", TextCursor((), True, "")),
        ("spe", TextCursor((), True, "spe")),
        ("specc: 1\nsub", TextCursor((), True, "sub", ("specc",))),
        ("a:\n  b: {c: [1, {d: x", TextCursor(("a", "b", "c", 1, "d"), False, "x")),
        ('a: {b: "x, [y', TextCursor(("a", "b"), False, "x, [y")),
        ("a: 'it''s ", TextCursor(("a",), False, "it's ")),
        ('a: "q\\" ', TextCursor(("a",), False, 'q" ')),
        ("a: >-\n  one 'two\n  three", TextCursor(("a",), False, "one 'two three")),
        ("a: it's [fine\nb: ", TextCursor(("b",), False, "")),
        ("# it's [not\nb: c", TextCursor(("b",), False, "c")),
        ("a: [b] # {\nc: d", TextCursor(("c",), False, "d")),
        ("a:\n  - [x, y]\n  - [z, ", TextCursor(("a", 1, 1), False, "")),
        ("a: {b: 1,\n  c: {d: [2],\n    e: x", TextCursor(("a", "c", "e"), False, "x")),
        ("- {a: b,\n   c: x", TextCursor((0, "c"), False, "x")),
    ],
)
def test_finds_the_cursor_in_unfinished_text(text: str, expected: TextCursor) -> None:
    assert expected in cursors(text, len(text))


@pytest.mark.parametrize("text", ["a: 1 # comment", "a: 'x' ", "a: [1] ", "}{", "\ta: b"])
def test_finds_no_cursor_where_nothing_can_be_written(text: str) -> None:
    assert [c for c in cursors(text, len(text)) if not c.is_key] == []


@pytest.mark.parametrize(
    ("head", "expected"),
    [
        ("a:\n  b: [1\n  c: x", "a:\n  b: 0\n  c: x"),
        ("a:\n  b: {c: 1,\n    d: x", "a:\n  b: {c: 1,\n    d: x"),
        ("a:\n  b: >-\n    one\n    two", "a:\n  b: >-\n    one\n    two"),
        ("a: 1\nb:\n- [x\n- [y, ", "a: 0\nb:\n- 0\n- [y, "),
        ("b:\n  - c: 1\n    d: ", "b:\n  - c:\n    d: "),
        ("a: 1\n  ", "a:\n  "),
        ("  'q: r': {\n    a", "  'q: r': {\n    a"),
    ],
)
def test_the_outline_of_a_line(head: str, expected: str) -> None:
    assert enclosing_lines(head) == expected
