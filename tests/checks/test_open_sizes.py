"""Sizes of a description that nobody uses: equal where they are computed alike, and only there."""

from pathlib import Path

import pytest

from specc.pipeline import check_spec

INNER = """\
specc: 1.2
parameters: {k: int, l: int}
subsystem:
  title: Passes a vector on
  rate: 10 Hz
  x: {c: {v: {type: "vector[k]"}}}
  y: {E: {w: "vector[l]"}}
  through: {y.E.w: x.c.v}
"""
OUTER = """\
specc: 1.2
parameters: {a: int, b: int, c: int, d: int}
subsystem: {use: inner.yaml, with: {k: K, l: L}}
"""


@pytest.mark.parametrize(
    ("one", "other", "is_same"),
    [
        ("a + d", "d + a", True),
        ("2 * a", "a + a", True),
        ("a + d", "b + c", False),
        ("2 * b", "a + c", False),
        ("a * d", "b * c", False),
    ],
)
def test_sizes_that_are_computed(one: str, other: str, is_same: bool, tmp_path: Path) -> None:
    (tmp_path / "inner.yaml").write_text(INNER)
    (outer := tmp_path / "outer.yaml").write_text(OUTER.replace("K", one).replace("L", other))
    found = {each.code for each in check_spec(str(outer)).diagnostics}
    assert ("E0310" not in found) == is_same
