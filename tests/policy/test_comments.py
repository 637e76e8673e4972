"""Which stretches of a YAML text are comments."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from specc.read import read_text
from specc.read.document import comments_of


def comments(text: str) -> list[str]:
    return [item.text for item in comments_of(read_text("a.yaml", text).source)]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("a: 1 # one\n", ["# one"]),
        ("# head\na: 1\n", ["# head"]),
        ("a: 'x # no'\n", []),
        ("a: x#no\n", []),
        ("a: >- # header\n  text # no\nb: 1\n# after\n", ["# header", "# after"]),
        ("a: |\n  # no\n", []),
        ("a: [1, # one\n  2] # two\n", ["# one", "# two"]),
        ("a: &n 1 # one\nb: *n # two\n", ["# one", "# two"]),
        ("a: x\n  y # joined\n", ["# joined"]),
        ("a: 1 # one\r\nb: 2 # two\r\n", ["# one", "# two"]),
        ("a: [1 # not closed\n", []),
    ],
)
def test_comments(text: str, expected: list[str]) -> None:
    assert comments(text) == expected


def test_only_comments_alone_on_their_line_are_alone() -> None:
    found = comments_of(read_text("a.yaml", "# one\na: 1 # two\n  # three\n").source)
    assert [item.is_whole_line for item in found] == [True, False, True]


@given(st.lists(st.sampled_from(["x", "# no", "'", '"', " ", "#"]), max_size=8).map("".join))
def test_nothing_inside_a_scalar_is_a_comment(value: str) -> None:
    quoted = value.replace("'", "''")
    assert comments(f"a: '{quoted}' # yes\n") == ["# yes"]
