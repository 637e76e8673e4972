"""What an operator can set, and to what, is compared."""

from __future__ import annotations

import pytest

from specc.tools.diff import compare
from tests.corpus import ROOT
from tests.tools.diff.conftest import Reader

TEXT = (ROOT / "tests/cases/plant/ok-panel.yaml").read_text("utf-8")
TURN = '  disturb: [{at: "1[s]", turn: {desk.R.buttons.n: 2}, because: of the test}]\n'
TASK = TEXT.replace("task: {cycle: {of: desk.c, from: S1, to: S0}}\n", "")
TASK += "task:\n  cycle: {of: desk.c, from: S1, to: S0}\n" + TURN


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("range: [1, 10]", "range: [1, 9]", "number, 1 to 10, init 3, key 1"),
        ("init: 3", "init: 4", "number, 1 to 10, init 4, key 1"),
        ("init: manual", "init: automatic", "choice, init automatic"),
        ("hold: true", "key: e", "button, hold, init False"),
        ("{panel: switch, key: x}", "{panel: switch}", "switch, init False, key x"),
        ('top: "0.2[m/s]"', 'top: "0.3[m/s]"', "slider, 0[m/s] to 0.3[m/s], init 0.05[m/s]"),
        ("turn: {desk.R.buttons.n: 2}", "turn: {desk.R.buttons.n: 3}", "2"),
        ("turn: {desk.R.buttons.n: 2}", "press: [desk.R.buttons.start]", ""),
        ("init: 3", "init: 1 + 2", None),
        ('"50[mm/s]"', '"0.05[m/s]"', None),
    ],
)
def test_a_change_of_the_panel_is_told(old: str, new: str, told: str | None, read: Reader) -> None:
    assert old in TASK
    found = compare(read(TASK), read(TASK.replace(old, new))).changes
    if told is None:
        assert found == ()
    else:
        assert any(told in (change.old, change.new) for change in found), found
