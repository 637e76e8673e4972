"""Requirements are compared by what they say; what has a name and says something else, by that."""

from __future__ import annotations

import pytest

from tests.tools.diff.conftest import BASE, Differ

SAID, OTHER = "within(5[s], state(cart.c) == going)", "within(6[s], state(cart.c) == going)"


def required(name: str, that: str) -> str:
    item = f'name: {name}, that: "{that}"' if name else f'that: "{that}"'
    return f"{BASE}require: [{{{item}, because: test}}]\n"


def test_what_a_name_stands_for_is_a_part_of_what_is_said(differ: Differ) -> None:
    old, new = (
        f"{BASE}let: {{goes: state(cart.c) == {state}}}\n"
        'require: [{that: "within(5[s], goes)", because: test}]\n'
        for state in ("going", "idle")
    )
    found = differ(old, new)
    assert [(d.part, d.name, d.aspect) for d in found.differences] == [("let", "goes", "formula")]


@pytest.mark.parametrize(
    ("old", "new", "changes", "remarks"),
    [
        (("", SAID), ("goes", SAID), [], [(SAID, "name")]),
        (("goes", SAID), ("moves", SAID), [], [(SAID, "name")]),
        (("goes", SAID), ("goes", OTHER), [("goes", "changed", "formula")], []),
        (("", SAID), ("", OTHER), [(SAID, "removed", ""), (OTHER, "added", "")], []),
    ],
)
def test_what_is_different_is_told(
    differ: Differ,
    old: tuple[str, str],
    new: tuple[str, str],
    changes: list[tuple[str, str, str]],
    remarks: list[tuple[str, str]],
) -> None:
    found = differ(required(*old), required(*new))
    assert [(d.name, d.change, d.aspect) for d in found.differences] == changes
    assert [(r.name, r.aspect) for r in found.remarks] == remarks


def test_a_constant_may_take_the_name_of_a_part(differ: Differ) -> None:
    old = BASE + (
        "let: {most: '2[s]'}\n"
        'require: [{that: "within(5[s], state(cart.c) == idle and most > 1[s])", because: test}]\n'
    )
    for most, changes in (("0.5[s]", ["formula"]), ("2[s]", [])):
        new = old.replace("let: {most: '2[s]'}\n", "").replace(
            "constants:\n", f"constants:\n  most: {most}\n"
        )
        found = [d.aspect for d in differ(old, new).differences if d.part == "requirement"]
        assert found == changes


def test_order_brackets_and_repetition_say_nothing(differ: Differ) -> None:
    p, q = (f"state(cart.c) == {state}" for state in ("going", "idle"))
    first = required("", f"within(5[s], {p} or ({q} or {p}))")
    assert differ(first, required("", f"within(5[s], {q} or {p})")).differences == ()
    assert differ(first, required("", f"within(5[s], {q} and {p})")).differences
    once = required("", f"within(5[s], within(1[s], {p}))")
    w = f"within(1[s], {p})"
    assert differ(once, required("", f"within(5[s], {w} and ({w} or {w}))")).differences == ()
    twice = required("", f"within(5[s], not (not within(1[s], {p})))")
    assert differ(twice, required("", f"within(5[s], not within(1[s], {p}))")).differences


def test_constants_may_have_other_names(differ: Differ) -> None:
    old = BASE.replace("constants:\n", "constants:\n  WAIT: 5[s]\n") + (
        "let: {goes: 'state(cart.c) == going and WAIT > 1[s]'}\n"
        'require: [{that: "within(WAIT, goes)", because: test}]\n'
    )
    assert differ(old, old.replace("WAIT", "rest")).differences == ()
    shorter = differ(old, old.replace("WAIT", "rest").replace("5[s]", "4[s]")).differences
    assert [(d.part, d.change) for d in shorter if d.part == "requirement"] == [
        ("requirement", "removed"),
        ("requirement", "added"),
    ]
