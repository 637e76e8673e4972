"""What is refused, where it is said to be, and that nothing but a diagnostic comes of it."""

import os
from pathlib import Path

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from specc.diagnostics.code import all_codes
from specc.limits import MAX_BYTES
from specc.read import Document, read_file, read_text
from tests.seeds import drawn, how_many


def located(document: Document) -> list[tuple[str, int, int]]:
    spans = [(item.code, document.source.span(item.primary)) for item in document.diagnostics]
    return [(code, span.line, span.col) for code, span in spans]


@pytest.mark.parametrize(
    ("text", "code", "line", "col"),
    [
        ("", "E0022", 1, 1),
        ("# only a comment\n", "E0022", 1, 1),
        ("a: 1\n---\nb: 2\n", "E0013", 2, 1),
        ("a: {T: pose[B, E]}\n", "E0009", 1, 12),
        ("a: 1\nb: c: d\n", "E0009", 2, 5),
        ("a: [1, 2\nb: 3\n", "E0009", 2, 2),
        ('a: "x\n', "E0009", 2, 1),
        ("a:\n  - x\n - y\n", "E0009", 3, 2),
        ("a: @x\n", "E0009", 1, 4),
        ("%YAML 2.0\n---\na: 1\n", "E0009", 1, 1),
        ("a:\n\tb: 1\n", "E0009", 2, 1),
        ("a:\n  b: 1\n  \tc: 2\n", "E0009", 3, 3),
        ("a: 1\nb: 2\na: 3\n", "E0011", 3, 1),
        ("m: {a: 1, 'a': 2}\n", "E0011", 1, 11),
        ("a:\n  ~: 1\n", "E0013", 2, 3),
        ("null: 1\n", "E0013", 1, 1),
        ("? [a]\n: 1\n", "E0013", 1, 3),
        ("a: &x b\n*x : 1\n", "E0013", 2, 1),
        ("a: &x {b: 1}\nc:\n  <<: *x\n", "E0013", 3, 3),
        ("a: !!str 5\n", "E0013", 1, 4),
        ("a: !include x\n", "E0013", 1, 4),
        ("a: *x\n", "E0009", 1, 4),
        ("a: &x [*x]\n", "E0009", 1, 8),
        ("a: 1e999\n", "E0018", 1, 4),
        ("a: x\0\n", "E0006", 1, 5),
        ('a: "\x1b[31m"\n', "E0006", 1, 5),
        ("a: x\u2028b: y\n", "E0006", 1, 5),
    ],
)
def test_a_fault_is_found_where_it_is(text: str, code: str, line: int, col: int) -> None:
    document = read_text("a.yaml", text)
    assert located(document) == [(code, line, col)]
    assert document.diagnostics[0].help
    assert not document.ok


def test_a_repeated_key_shows_both_places_and_keeps_the_first() -> None:
    document = read_text("a.yaml", "a: 1\nb: 2\na: 3\n")
    (finding,) = document.diagnostics
    (related,) = finding.related
    assert document.source.span(related.place).line == 1
    assert document.data == {"a": 1, "b": 2}


def test_all_faults_that_can_be_passed_over_are_reported_at_once() -> None:
    document = read_text("a.yaml", "a: 1\na: [1, {x: 2}]\n<<: 1\nb: !t 2\n~: 4\nc: 1e999\nd: 5\n")
    codes = [item.code for item in document.diagnostics]
    assert codes == ["E0011", "E0013", "E0013", "E0013", "E0018"]
    assert document.data["a"] == 1
    assert document.data["d"] == 5


def test_depth_is_bounded_also_through_aliases() -> None:
    assert read_text("a.yaml", "[" * 64 + "]" * 64).ok
    assert located(read_text("a.yaml", "[" * 65 + "]" * 65)) == [("E0017", 1, 65)]
    doubled = "a: &x " + "[" * 40 + "]" * 40 + "\nb: " + "[" * 40 + "*x" + "]" * 40
    assert [item.code for item in read_text("a.yaml", doubled).diagnostics] == ["E0017"]


def test_an_alias_bomb_is_refused_before_it_goes_off() -> None:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    for level in range(1, 40):
        inner = ", ".join([f"*a{level - 1}"] * 10)
        lines.append(f"a{level}: &a{level} [{inner}]")
    # Written out it would be 10^40 values: that this comes back at all is the point.
    document = read_text("a.yaml", "\n".join(lines))
    assert [item.code for item in document.diagnostics] == ["E0017"]


def test_many_plain_values_are_refused() -> None:
    text = "[" + "x," * 400_001 + "]"
    assert [item.code for item in read_text("a.yaml", text).diagnostics] == ["E0017"]


def test_files_that_give_no_text(tmp_path: Path) -> None:
    missing = read_file(str(tmp_path / "none.yaml"))
    assert [item.code for item in missing.diagnostics] == ["E0001"]
    assert [item.code for item in read_file("a\0b").diagnostics] == ["E0001"]
    assert [item.code for item in read_file(str(tmp_path)).diagnostics] == ["E0001"]
    os.mkfifo(tmp_path / "fifo")
    assert [item.code for item in read_file(str(tmp_path / "fifo")).diagnostics] == ["E0001"]
    below_a_file = tmp_path / "file"
    below_a_file.write_text("a: 1")
    assert [item.code for item in read_file(str(below_a_file / "x")).diagnostics] == ["E0001"]
    assert [item.code for item in read_file("x" * 5000).diagnostics] == ["E0001"]


def test_a_file_without_permission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.yaml"
    path.write_text("a: 1\n")

    def refuse(*_arguments: object) -> None:
        raise PermissionError(13, "Permission denied", str(path))

    # The superuser may read any file, so the refusal is made here.
    monkeypatch.setattr("builtins.open", refuse)
    (finding,) = read_file(str(path)).diagnostics
    assert finding.code == "E0001"
    assert "permission denied" in finding.message


def test_a_file_that_is_too_large(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"#" * (MAX_BYTES + 1))
    assert [item.code for item in read_file(str(path)).diagnostics] == ["E0004"]


def test_encodings(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(b"a: 1\nb: caf\xe9\n")
    assert located(read_file(str(path))) == [("E0005", 2, 7)]
    path.write_bytes("a: 1\n".encode("utf-16"))
    assert "UTF-16" in read_file(str(path)).diagnostics[0].message
    path.write_bytes(b"\xef\xbb\xbfa: 1\n")
    marked = read_file(str(path))
    assert [item.code for item in marked.diagnostics] == ["W0001"]
    assert marked.ok
    assert marked.data == {"a": 1}


YAMLISH = st.text(alphabet="ab1-:,[]{}&*!|>'\"%@`#?\\~<. \n\t\r", max_size=60)


@drawn(st.one_of(YAMLISH, st.text(max_size=60)), few=60, many=600)
@example("&a [*a, &b {*b : *a}]")
@example("? - : - ? -")
@example("\ufeff\ufeff")
def test_any_text_is_read_or_refused_with_known_codes_and_places_in_it(text: str) -> None:
    document = read_text("a.yaml", text)
    lines = text.count("\n") + text.count("\r") + 1
    for finding in document.diagnostics:
        assert finding.code in all_codes()
        span = document.source.span(finding.primary)
        assert 1 <= span.line <= lines
        assert span.col <= len(document.source.line(span.line)) + 1
    if document.ok:
        assert document.source.spans is not None


@settings(max_examples=how_many(300), deadline=None)
@given(st.binary(max_size=80))
@example(b"?")
def test_any_file_is_read_or_refused(tmp_path_factory: pytest.TempPathFactory, raw: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    path.write_bytes(raw)
    document = read_file(str(path))
    codes = {finding.code for finding in document.diagnostics}
    assert codes <= set(all_codes())
    assert document.data is not None or not document.ok or not codes
