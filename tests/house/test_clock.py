"""`specc/proof/clock.py` knows when time turns a condition."""

import re
from pathlib import Path

SPECC = Path(__file__).resolve().parents[2] / "specc"
ASKING = {
    "analysis/state_timing.py": "how long states last",
    "proof/clock.py": "the answer",
    "proof/translate.py": "conditions that time alone decides",
    "tools/explore/timing.py": "with values of a configuration filled in",
}


def test_one_module_computes_when_conditions_turn() -> None:
    asks = re.compile(r"Timer\(|\.turning_points\(|\.timer\.")
    found = {
        module.relative_to(SPECC).as_posix()
        for module in SPECC.rglob("*.py")
        if asks.search(module.read_text(encoding="utf-8"))
    }
    assert found == ASKING.keys()
