"""Scenarios of inputs that are read before they have a value."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.seeds import every
from tests.witness.runs import CASES, run, written

PASSED_ON = "E0701-passed-on-without-safe"
"""Its buffers are those of its device, and stand nowhere."""
FILES = sorted(
    path
    for n in range(1, 5)
    for path in (CASES / "presence").glob(f"E070{n}-*")
    if path.stem != PASSED_ON
)
ELEMENT = re.compile(r"__c__([de])__E070\d$")


def given(text: str, element: str) -> str:
    """The text of a case with an initial value for an input of its virtual effector."""
    before, x, after = text.rpartition("        x: {c: {")
    return (
        before + x + re.sub(rf"\b{element}: real\b", f"{element}: {{type: real, init: 0}}", after)
    )


@pytest.mark.parametrize("case", every(2, FILES), ids=lambda path: path.stem)
def test_the_input_is_read_until_it_has_an_initial_value(case: Path, tmp_path: Path) -> None:
    copy = tmp_path / "spec.yaml"
    text = case.read_text(encoding="utf-8")
    copy.write_text(text, encoding="utf-8")
    scenarios = written(copy, tmp_path / "out")
    assert scenarios
    for scenario in scenarios:
        found = ELEMENT.search(scenario.stem)
        assert found
        error = run(scenario, tmp_path)
        assert isinstance(error, AttributeError)
        assert error.__notes__ == [f"`x.c.{found[1]}` has no value"]
        copy.write_text(given(text, found[1]), encoding="utf-8")
        error = run(scenario, tmp_path)
        # The other input of the case may still be missing.
        assert error is None or f"`x.c.{found[1]}` has no value" not in error.__notes__
        copy.write_text(given(given(text, "d"), "e"), encoding="utf-8")
        assert run(scenario, tmp_path) is None
        copy.write_text(text, encoding="utf-8")
