"""Each of the faults in breaks.yaml applies to one place, and validation lets it pass."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from specc.pipeline import compile_spec
from specc.source import real_path
from tests.scenarios.runs import ROOT

CELLS = yaml.safe_load(Path(__file__).with_name("breaks.yaml").read_text(encoding="utf-8"))
EACH = [
    pytest.param(cell["specification"], each, id=f"{name}-{each['name']}")
    for name, cell in CELLS.items()
    for each in cell["breaks"]
]


def test_there_are_six_breaks_of_five_cells() -> None:
    assert [len(cell["breaks"]) for cell in CELLS.values()] == [6] * 5


@pytest.mark.long
@pytest.mark.parametrize(("specification", "fault"), EACH)
def test_a_break_applies_and_validates(specification: str, fault: dict[str, Any]) -> None:
    file = ROOT / fault.get("file", specification)
    text = file.read_text(encoding="utf-8")
    assert text.count(fault["old"]) == 1
    changed = text.replace(fault["old"], fault["new"])
    result = compile_spec(str(ROOT / specification), {}, {real_path(str(file)): changed})
    assert result.ok, [each.message for each in result.diagnostics]
