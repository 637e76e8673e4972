"""`specc/model/fsm.py` says what ends a behaviour by a cause, and what has held then."""

import re
from pathlib import Path

SPECC = Path(__file__).resolve().parents[2] / "specc"
CHOOSES = re.compile(
    r"\.(terminal|error)\b.* if .*cause == |cause == \"(error|terminal)\".*\.(terminal|error)\b"
)


def test_no_module_chooses_between_the_conditions_that_end_a_behaviour() -> None:
    found = {
        module.relative_to(SPECC).as_posix()
        for module in SPECC.rglob("*.py")
        if CHOOSES.search(module.read_text(encoding="utf-8"))
    }
    assert found == set()
