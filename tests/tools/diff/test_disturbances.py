"""What happens to the plant is compared by what is done to what; its order says nothing."""

from __future__ import annotations

import pytest

from tests.seeds import every
from tests.tools.diff.conftest import BASE, Differ

MOVE = '{at: "1[s]", move: {s: "1[m]"}, because: it slips}'
SHIFT = '{at: "1[s]", shift: {s: "1[m]"}, because: it slips}'
PUSH = '{when: "state(cart.c) == idle", lasts: "1[s]", push: {cart: [0, 0, "1[N]"]}, because: wind}'
WRONG = (
    '{at: "1[s]", every: "3[s]", probability: 0.5, lasts: "1[s]", scale: {cart.E.wheel.s: 2}, '
    'bias: {cart.E.wheel.s: "1[m]"}, because: heat}'
)
BLOCK = '{at: "1[s]", block: [a, b], because: rust}'
MEASURED = "cart.E.wheel.s"
BOTH = f"bias {MEASURED}, scale {MEASURED}"


def disturbed(*disturbances: str) -> str:
    return BASE + "  disturb:\n" + "".join(f"    - {each}\n" for each in disturbances)


@pytest.mark.parametrize(
    ("old", "new", "changes"),
    every(
        2,
        [
            ((MOVE, PUSH, BLOCK), (BLOCK, MOVE, PUSH), []),
            ((BLOCK,), (BLOCK.replace("a, b", "b, a"),), []),
            ((MOVE,), (SHIFT,), [("move s", "removed", ""), ("shift s", "added", "")]),
            ((SHIFT,), (SHIFT, SHIFT), [("shift s (2)", "added", "")]),
            ((MOVE,), (MOVE.replace('at: "1', 'at: "2'),), [("move s", "changed", "at")]),
            ((MOVE,), (MOVE.replace('s: "1', 's: "2'),), [("move s", "changed", "move s")]),
            (
                (PUSH,),
                (PUSH.replace('"1[N]"', '"2[N]"'),),
                [("push cart", "changed", "push cart.z")],
            ),
            ((WRONG,), (WRONG.replace("3[s]", "4[s]"),), [(BOTH, "changed", "every")]),
            ((WRONG,), (WRONG.replace("0.5", "0.6"),), [(BOTH, "changed", "probability")]),
            ((WRONG,), (WRONG.replace(": 2", ": 3"),), [(BOTH, "changed", f"scale {MEASURED}")]),
            ((WRONG,), (WRONG.replace('"1[m]', '"2[m]'),), [(BOTH, "changed", f"bias {MEASURED}")]),
            ((PUSH,), (PUSH.replace("idle", "going"),), [("push cart", "changed", "when")]),
            ((PUSH,), (PUSH.replace('lasts: "1[s]", ', ""),), [("push cart", "changed", "lasts")]),
        ],
    ),
)
def test_what_is_different_is_told(
    differ: Differ, old: tuple[str], new: tuple[str], changes: list[tuple[str, str, str]]
) -> None:
    found = differ(disturbed(*old), disturbed(*new))
    assert [(d.name, d.change, d.aspect) for d in found.differences] == changes
    assert not found.remarks


def test_another_reason_is_a_remark(differ: Differ) -> None:
    found = differ(disturbed(MOVE), disturbed(MOVE.replace("it slips", "it falls")))
    assert not found.differences
    assert [(r.name, r.aspect) for r in found.remarks] == [("move s", "because")]
