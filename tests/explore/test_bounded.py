"""Bounded response is decided: the head of each specification says what exploring says of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import compile_spec
from specc.tools.explore.explorer import explore

CASES = sorted(Path(__file__).parent.glob("bounded/*.yaml"))
DEAR = {"fast_motion"}
"""Thousands of periods are counted there."""


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, marks=[pytest.mark.long] if c.stem in DEAR else []) for c in CASES],
    ids=lambda case: case.stem,
)
def test_bounded_response_is_decided(case: Path) -> None:
    verdict = case.read_text(encoding="utf-8").partition(":")[0].removeprefix("# ")
    result = compile_spec(str(case))
    assert result.ok, [d for d in result.diagnostics if d.severity == "error"]
    found = explore(result.proofs, 700_000)
    assert [judged.words().partition(" ")[0] for judged in found.requirements] == [verdict]
    assert found.status == "complete"
