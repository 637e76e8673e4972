"""Data that comes out of a text."""

import pytest
from hypothesis import strategies as st

from specc.read import read_text
from tests.seeds import drawn

TEXT = st.text(alphabet=st.characters(codec="utf-8", exclude_categories=("C",)), max_size=12)
SCALARS = st.one_of(
    st.none(), st.booleans(), st.integers(-(2**40), 2**40), TEXT, st.floats(allow_nan=False)
)
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(TEXT, inner, max_size=4)),
    max_leaves=12,
)


def _flow(value: object) -> str:
    """A value in YAML's flow style, all text in double quotes."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_quoted(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_flow, value)) + "]"
    if isinstance(value, str):
        return _quoted(value)
    words = {None: "null", True: "true", False: "false"}
    if value is None or isinstance(value, bool):
        return words[value]
    return repr(value).replace("inf", ".inf")


def _quoted(text: str) -> str:
    escapes = {"\\": "\\\\", '"': '\\"', "\u2028": "\\L", "\u2029": "\\P"}
    return '"' + "".join(escapes.get(char, char) for char in text) + '"'


@drawn(st.dictionaries(TEXT, VALUES, min_size=1, max_size=5), few=15, many=100)
def test_values_come_back_as_written(value: dict[str, object]) -> None:
    document = read_text("a.yaml", _flow(value))
    assert document.diagnostics == ()
    assert document.data == value


def test_keys_are_text_however_they_look() -> None:
    document = read_text("a.yaml", "on: 1\n1: 2\ntrue: 3\n1.0: 4\n'': 5\n")
    assert document.ok
    assert document.data == {"on": 1, "1": 2, "true": 3, "1.0": 4, "": 5}


def test_quoted_scalars_stay_text() -> None:
    assert read_text("a.yaml", "a: '1'\nb: \"true\"\nc: |\n  2\n").data == {
        "a": "1",
        "b": "true",
        "c": "2\n",
    }


def test_a_number_keeps_its_own_digits() -> None:
    source = read_text("a.yaml", "a: 1.50\nb: [0x10]\n").source
    assert source.written(("a",)) == "1.50"
    assert source.written(("b", 0)) == "0x10"
    assert source.written(("c",)) == ""


def test_aliases_repeat_data_and_point_to_where_it_stands() -> None:
    from specc.source import Place

    document = read_text("a.yaml", "a: &limits [0, 1]\nb: *limits\nc: &text hello\nd: *text\n")
    assert document.data == {"a": [0, 1], "b": [0, 1], "c": "hello", "d": "hello"}
    assert document.source.span(Place("a.yaml", ("b", 1))).line == 1
    assert document.source.written(("d",)) == "hello"


@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_line_breaks_of_every_system(ending: str) -> None:
    from specc.source import Place

    document = read_text("a.yaml", ending.join(["a: 1", "b:", "  c: 2", ""]))
    assert document.data == {"a": 1, "b": {"c": 2}}
    span = document.source.span(Place("a.yaml", ("b", "c")))
    assert (span.line, span.col) == (3, 6)
    assert document.source.line(3) == "  c: 2"
