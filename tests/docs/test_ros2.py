"""What docs/ros2.md shows is accepted, without any finding."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc import pipeline
from tests.docs.examples import HERE, Example, examples, put

DOCUMENT = HERE.parents[1] / "docs" / "ros2.md"


@pytest.mark.parametrize("example", examples(DOCUMENT), ids=str)
def test_example_compiles(example: Example, tmp_path: Path) -> None:
    found = pipeline.compile_spec(str(put(example, [], tmp_path))).diagnostics
    assert [f"{item.code} {item.message}" for item in found if item.severity == "error"] == []
