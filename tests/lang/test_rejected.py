"""Every way to be wrong, with all that is said about it (`rejected.txt`)."""

from dataclasses import replace

import pytest

from specc.diagnostics.code import all_codes
from specc.lang import Scope
from tests.lang.refusals import blocks, findings
from tests.strategies import SCOPE

BLOCKS = blocks()


def test_findings() -> None:
    for block in BLOCKS:
        assert findings(block.head) == block.findings, block.head


def test_the_table_has_every_code_of_typing_and_of_names_in_expressions() -> None:
    seen = {line.split()[0] for block in BLOCKS for line in block.findings.splitlines()}
    of_names = {"E0201", "E0221", "E0230", "E0234", "E0302", "E0304"}
    of_typing = {code for code in all_codes() if "E0310" <= code < "E0321"}
    assert {code for code in seen if code.startswith("E")} >= of_names | of_typing


CONSTANT = replace(SCOPE, inputs={}, memory={}, lets={}, allow_clock=False)
LATER = {*SCOPE.memory, *SCOPE.lets}
FIRST_PERIOD = replace(SCOPE, memory={}, lets={}, uninitialized=LATER, allow_clock=False)


@pytest.mark.parametrize(
    ("text", "scope", "message"),
    [
        ("x.c.d_d", CONSTANT, "`x.c.d_d` has no value here: there are no inputs"),
        ("fresh(x.c.b)", CONSTANT, "`x.c.b` has no value here: there are no inputs"),
        ("elapsed", CONSTANT, "`elapsed` has no value here: no state has been entered"),
        (
            "q_p",
            FIRST_PERIOD,
            "`q_p` has no value here: memory gets its initial values after this is evaluated",
        ),
        (
            "T_c",
            FIRST_PERIOD,
            "`T_c` has no value here: memory gets its initial values after this is evaluated",
        ),
    ],
)
def test_what_has_no_value_yet(text: str, scope: Scope, message: str) -> None:
    found = findings(text, scope)
    assert found.splitlines()[0].startswith("  E0230 ")
    assert message in found


def test_a_name_that_is_value_and_member_is_told_apart_by_the_expected_type() -> None:
    scope = replace(SCOPE, constants={**SCOPE.constants, "g": SCOPE.lets["ratio"]})
    assert findings("g > 1 and x.c.mode == g", scope) == ""
    scope = replace(SCOPE, constants={**SCOPE.constants, "g": SCOPE.inputs["c", "mode"]})
    assert "E0221 `g`: `g` is both a value and a member of `Mode`" in findings(
        "x.c.mode == g", scope
    )
