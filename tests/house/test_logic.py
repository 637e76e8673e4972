"""`specc/model/expr.py` makes conditions of conditions, where no text says them."""

import re
from pathlib import Path

SPECC = Path(__file__).resolve().parents[2] / "specc"
OTHERS = {
    "lang/operators.py": "as the text has it",
    "lower/terms.py": "of terms",
}
"""Who else negates, and what."""
MADE = re.compile(r'(?<!case )(?<!case \w\.)\bUnary\(\s*"not"')


def test_one_module_negates_conditions() -> None:
    negating = {
        module.relative_to(SPECC).as_posix()
        for module in SPECC.rglob("*.py")
        if MADE.search(module.read_text(encoding="utf-8"))
    }
    assert negating == {"model/expr.py", *OTHERS}
