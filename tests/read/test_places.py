"""From places to lines and columns, down to single characters of a scalar."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from specc.read import read_text
from specc.source import Place, Route, Sources

SPEC = """\
specc: 1
agents:
  irp:                 # the robot
    rate: 500 Hz
    x: {c: {T_d: "pose[B, E]", b: 'it''s'}}
    rows:
      - [S0, terminal, ready, S1]
      - {from: S1, cause: error, when: always, to: S0}
    empty:
"""
ROW = ("from", "cause", "when", "to")


def text_at(text: str, place: Place) -> tuple[str, int]:
    source = read_text(place.file, text, ROW).source
    span = source.span(place)
    assert span.line == span.end_line
    return source.line(span.line)[span.col - 1 : span.end_col - 1], span.line


@pytest.mark.parametrize(
    ("route", "part", "expected"),
    [
        (("specc",), "key", ("specc", 1)),
        (("agents", "irp"), "key", ("irp", 3)),
        (("agents", "irp", "rate"), "value", ("500 Hz", 4)),
        (("agents", "irp", "x", "c"), "value", ("{T_d: \"pose[B, E]\", b: 'it''s'}", 5)),
        (("agents", "irp", "x", "c", "T_d"), "value", ('"pose[B, E]"', 5)),
        (("agents", "irp", "x", "c", "T_d", "type"), "value", ('"pose[B, E]"', 5)),
        (("agents", "irp", "rows", 0, "when"), "value", ("ready", 7)),
        (("agents", "irp", "rows", 0, 1), "value", ("terminal", 7)),
        (("agents", "irp", "rows", 1, "to"), "value", ("S0", 8)),
        (
            ("agents", "irp", "rows", 1),
            "key",
            ("{from: S1, cause: error, when: always, to: S0}", 8),
        ),
        (("agents", "irp", "kind"), "value", ("irp", 3)),
        (("agents", "irp", "kind", "letters", 3), "key", ("irp", 3)),
        (("agents", "irp", "empty"), "value", ("", 9)),
    ],
)
def test_routes(route: Route, part: str, expected: tuple[str, int]) -> None:
    place = Place("a.yaml", route, "key" if part == "key" else "value")
    assert text_at(SPEC, place) == expected


@pytest.mark.parametrize(
    ("yaml", "value", "word"),
    [
        ("a: DK(MJ(m))", "DK(MJ(m))", "MJ"),
        ('a: "DK(MJ(m))"', "DK(MJ(m))", "MJ"),
        ("a: 'x == ''c'' or MJ(m)'", "x == 'c' or MJ(m)", "MJ"),
        (r'a: "\u0141\t\"x\" + MJ"', 'Ł\t"x" + MJ', "MJ"),
        ("a: first +\n   second + MJ\n", "first + second + MJ", "MJ"),
        ('a: "first +\\\n   second + MJ"\n', "first +second + MJ", "MJ"),
        ('a: "first\n\n   second + MJ"\n', "first\nsecond + MJ", "MJ"),
        ("a: |\n  first\n    second\n  MJ\n", "first\n  second\nMJ\n", "MJ"),
        ("a: >-  # folded\n  first\n  second\n\n  MJ\n", "first second\nMJ", "MJ"),
        ("a: &x DK(MJ)", "DK(MJ)", "MJ"),
        ("zażółć: gęś + MJ", "gęś + MJ", "MJ"),
    ],
)
def test_characters_inside_a_scalar(yaml: str, value: str, word: str) -> None:
    document = read_text("a.yaml", yaml)
    ((key, data),) = document.data.items()
    assert data == value
    start = value.index(word)
    place = Place("a.yaml", (key,), "value", start, start + len(word))
    assert text_at(yaml, place)[0] == word


WORDS = st.lists(st.text("abcxyz'\"\\\tęł(+", min_size=1, max_size=6), min_size=1, max_size=6)


@given(WORDS, st.sampled_from(["'", '"', "|", ">"]))
def test_every_visible_character_maps_to_itself(words: list[str], style: str) -> None:
    value = "x" + " ".join(words)
    escaped = value.replace("\\", "\\\\").replace('"', '\\"').replace("\t", "\\t")
    doubled = value.replace("'", "''")
    spelled = {
        "'": f"'{doubled}'",
        '"': f'"{escaped}"',
        "|": f"|-\n  {value}",
        ">": f">-\n  {value}",
    }
    text = f"a: {spelled[style]}\n"
    document = read_text("a.yaml", text)
    read = document.data["a"]
    for offset, char in enumerate(read):
        if not char.isspace():
            span = document.source.span(Place("a.yaml", ("a",), "value", offset, offset + 1))
            found = document.source.line(span.line)[span.col - 1 : span.end_col - 1].strip()
            assert found in (char, f"\\{char}", char * 2)


def test_offsets_beyond_the_scalar_are_held_inside_it() -> None:
    assert text_at("a: abc", Place("f", ("a",), "value", 1, 99)) == ("bc", 1)
    assert text_at("a: abc", Place("f", ("a",), "value", 99, 120)) == ("", 1)
    assert text_at("a: abc", Place("f", ("a",), "value", 2, 1)) == ("", 1)


def test_a_block_collection_ends_with_its_last_part() -> None:
    text = "a:\n  b: 1\n  c: 2\n\n\nd: 3\n"
    span = read_text("f", text).source.span(Place("f", ("a",)))
    assert (span.line, span.col, span.end_line, span.end_col) == (2, 3, 3, 7)


def test_sources_answer_for_files_that_were_never_read() -> None:
    first, second = (read_text(name, f"a: {name}\n").source for name in ("x", "y"))
    sources = Sources([first])
    sources.add(second)
    assert sources.get("y") is second
    assert sources.line("y", 1) == "a: y"
    assert sources.line("y", 7) == ""
    assert sources.line("z", 1) == ""
    span = sources.span(Place("z", ("a",)))
    assert (span.file, span.line, span.col) == ("z", 1, 1)
