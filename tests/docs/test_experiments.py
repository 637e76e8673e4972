"""docs/experiments.md says what the data under docs/experiments/ says, and nothing else."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bench.harness.experience import DATA, PAGE, draw, page

TEXT = PAGE.read_text(encoding="utf-8")


def test_tables_are_those_of_the_data() -> None:
    assert page(TEXT) == TEXT


@pytest.mark.long
def test_pictures_are_those_of_the_data(tmp_path: Path) -> None:
    draw(tmp_path)
    made = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    assert made == {path.name: path.read_bytes() for path in DATA.glob("*.svg")}
    assert set(made) == set(re.findall(r"\(experiments/([\w.]+\.svg)\)", TEXT))


def test_no_figure_of_the_experiments_is_typed_by_hand() -> None:
    """Outside of what the data says there are only what was set, and what the paper claims."""
    prose = re.sub(r"<!-- (\w+) -->.*?<!-- end -->", "", TEXT, flags=re.DOTALL)
    numbers = re.findall(r"(?<![\w(])\d+(?:\.\d+)?(?= (?:%|N|mm|degrees|cm/s|kg/s))", prose)
    assert numbers == ["95", "200", "400", "30", "1", "2", "10", "5"]
