"""The report for people."""

import unicodedata
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.report import report, resolve
from specc.diagnostics.text import MAX_COLUMNS, excerpt, render
from specc.diagnostics.visible import visible, width
from specc.pipeline import compile_spec
from specc.read import read_text
from specc.source import Place, Route, Sources, Span
from tests.seeds import drawn


def text_of(text: str, *diagnostics: Diagnostic, colour: bool = False) -> str:
    sources = Sources([read_text("a.yaml", text).source])
    return render(report(resolve(diagnostics, sources), ["a.yaml"]), colour=colour)


def at(*route: str | int, **part: str) -> Place:
    steps: Route = route
    return Place("a.yaml", steps, "key" if part else "value")


def test_a_finding_in_full() -> None:
    finding = Diagnostic(
        "E0401",
        "the two ends of a buffer differ",
        at("x", "T_d"),
        "a pose",
        (Related(at("y", "T_d"), "a vector"),),
        "give both the same type\nor rename one",
    )
    text = 'x:\n  T_d: "pose[B, E]"\ny:\n' + "\n" * 6 + '  T_d: "vector[6, m]"\n'
    assert text_of(text, finding) == (
        "error[E0401]: the two ends of a buffer differ\n"
        "  --> a.yaml:2:8\n"
        "   |\n"
        ' 2 |   T_d: "pose[B, E]"\n'
        "   |        ^^^^^^^^^^^^ a pose\n"
        "  ::: a.yaml:10:8\n"
        "   |\n"
        '10 |   T_d: "vector[6, m]"\n'
        "   |        -------------- a vector\n"
        "   = help: give both the same type\n"
        "           or rename one\n"
        "\n"
        "1 file checked: 1 error, 0 warnings\n"
    )


def test_findings_stand_in_the_order_of_the_file_each_once() -> None:
    second, first = Diagnostic("W0602", "w", at("b")), Diagnostic("E0101", "e", at("a"))
    printed = text_of("a: 1\nb: 2\n", second, first, second)
    heads = [line for line in printed.splitlines() if "[" in line]
    assert heads == ["error[E0101]: e", "warning[W0602]: w"]
    assert printed.endswith("1 file checked: 1 error, 1 warning\n")


def test_nothing_wrong() -> None:
    assert text_of("a: 1\n") == "1 file checked: 0 errors, 0 warnings\n"


def test_a_place_without_text_has_no_excerpt() -> None:
    finding = Diagnostic("E0001", "no such file", Place("none.yaml"), label="here")
    printed = render(report(resolve([finding], Sources()), ["none.yaml"]))
    assert printed.splitlines()[1:3] == [" --> none.yaml:1:1", "  | here"]


def test_colour_is_there_only_when_asked_for() -> None:
    finding = Diagnostic("E0101", "m", at("a"))
    plain, coloured = (text_of("a: 1\n", finding, colour=flag) for flag in (False, True))
    assert "\x1b" not in plain
    assert "\x1b[1;31merror[E0101]\x1b[0m" in coloured


def test_paths_are_relative_below_the_working_directory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    below, beside = str(tmp_path / "d" / "a.yaml"), "/elsewhere/b.yaml"
    findings = [Diagnostic("E0001", "m", Place(path)) for path in (below, beside)]
    printed = render(report(resolve(findings, Sources()), [below]))
    assert "--> d/a.yaml:1:1" in printed
    assert "--> /elsewhere/b.yaml:1:1" in printed


def test_nothing_in_a_file_steers_the_terminal() -> None:
    evil = "\x1b]0;title\x07\u202e\u200b\x9b31m"
    source = read_text("a.yaml", f'a: "{evil}"\n').source
    finding = Diagnostic(
        "E0001", evil, Place(f"a{evil}.yaml"), evil, (Related(Place("a.yaml"), evil),), evil
    )
    printed = render(report(resolve([finding], Sources([source])), []))
    assert all(char.isprintable() or char == "\n" for char in printed)
    assert "\\x1b]0;title\\x07\\u{202e}\\u{200b}\\x9b31m" in printed


@drawn(st.text(), few=20, many=100)
def test_visible_text_is_printable(text: str) -> None:
    shown = visible(text)
    assert all(unicodedata.category(char)[0] != "C" for char in shown)
    shown.encode()


@pytest.mark.parametrize(
    ("line", "start", "end", "indent", "length"),
    [
        ("abc: def", 5, 8, 5, 3),
        ("\tab", 1, 3, 4, 2),
        ("漢字: x", 4, 5, 6, 1),
        ("x: 漢字", 3, 5, 3, 4),
        ("e\u0301a: x", 4, 5, 3, 1),
        ("x: ", 3, 3, 3, 1),
        ("abc", 9, 12, 3, 1),
    ],
)
def test_the_caret_stands_under_what_is_meant(
    line: str, start: int, end: int, indent: int, length: int
) -> None:
    shown = excerpt(line, Span("f", 1, start + 1, 1, end + 1))
    assert (shown.indent, shown.length) == (indent, length)


def test_a_span_of_several_lines_is_underlined_to_the_end_of_the_first() -> None:
    shown = excerpt("abc: [1,  ", Span("f", 1, 6, 4, 2))
    assert (shown.indent, shown.length) == (5, 3)


@given(
    st.text("ab漢\t\x1b", max_size=400),
    st.integers(0, 400),
    st.integers(0, 400),
)
def test_long_lines_are_cut_around_the_caret(line: str, start: int, length: int) -> None:
    start = min(start, len(line))
    end = min(start + length, len(line))
    shown = excerpt(line, Span("f", 1, start + 1, 1, end + 1))
    assert width(shown.text) <= MAX_COLUMNS
    assert shown.indent + shown.length <= MAX_COLUMNS + 1
    marked = _columns(shown.text, shown.indent)
    expected = visible(line[start:end])
    assert marked.startswith(expected[:10])


def _columns(text: str, skip: int) -> str:
    """The text from a column on."""
    for index in range(len(text) + 1):
        if width(text[:index]) == skip:
            return text[index:]
    raise AssertionError("the underline starts inside a character")


def test_what_is_wrong_comes_before_what_is_not_there(tmp_path: Path) -> None:
    path = tmp_path / "demo.yaml"
    path.write_text("specc: 1\nsystem: demo\nconstants: {a: True + 1}\n", encoding="utf-8")
    result = compile_spec(str(path))
    found = report(resolve(result.diagnostics, result.sources), [str(path)])
    assert [item.diagnostic.code for item in found.findings] == ["O0401", "E0313"]
    text = render(found)
    assert text.index("E0313") < text.index("O0401")
