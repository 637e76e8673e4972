"""Laws of comparing: order says nothing, and both directions agree."""

from __future__ import annotations

import json
import random
import shutil
from itertools import product
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from specc.lang.evaluate import Environment, evaluate
from specc.model.expr import Expr
from specc.model.system import System
from specc.pipeline import read_spec
from specc.read import read_text
from specc.tools.diff import Difference, compare
from tests.seeds import every, examples, short
from tests.tools.diff.conftest import BASE, Differ, Reader, edited
from tests.tools.diff.test_changes import DIFFERENCES, REMARKS

ROOT = Path(__file__).resolve().parents[3]
SPECS = sorted(ROOT.glob("specs/*.yaml"))
ALL = [edits for edits, _ in (*DIFFERENCES, *REMARKS)]
FLIPPED = {"added": "removed", "removed": "added", "changed": "changed"}


def system_of(path: Path) -> System:
    result = read_spec(str(path))
    assert result.system is not None
    return result.system


def shuffled(value: Any, random_: random.Random) -> Any:
    """The same specification in another order: mappings and transition tables have none."""
    if isinstance(value, dict):
        keys = list(value)
        random_.shuffle(keys)
        return {
            key: _shuffled_list(value[key], random_)
            if key in ("transitions", "assume", "functions") and isinstance(value[key], list)
            else shuffled(value[key], random_)
            for key in keys
        }
    return [shuffled(item, random_) for item in value] if isinstance(value, list) else value


def _shuffled_list(items: list[Any], random_: random.Random) -> list[Any]:
    return random_.sample([shuffled(item, random_) for item in items], len(items))


def without_order(data: dict[str, Any], random_: random.Random) -> str:
    """Constants come in order of dependence, so they stay."""
    mixed = shuffled(data, random_)
    if "constants" in data:
        mixed["constants"] = data["constants"]
    return json.dumps(mixed)


@pytest.mark.parametrize(
    "path", short([*SPECS[:2], None], 2), ids=lambda p: p.stem if p else "base"
)
def test_order_says_nothing(path: Path | None, tmp_path: Path) -> None:
    text = BASE if path is None else path.read_text(encoding="utf-8")
    shutil.copytree(ROOT / "specs", tmp_path / "specs")
    copies = [tmp_path / "specs" / name for name in ("old.yaml", "new.yaml")]
    copies[0].write_text(text)
    for seed in range(3):
        copies[1].write_text(without_order(read_text("a", text).data, random.Random(seed)))
        assert compare(*map(system_of, copies)).changes == ()


def test_order_of_the_files_says_nothing_of_the_changes(read: Reader) -> None:
    old, new = read_text("a", BASE).data, read_text("a", edited(*_many())).data
    expected = compare(read(BASE), read(edited(*_many()))).changes
    for seed in range(3):
        first = read(without_order(old, random.Random(seed)))
        second = read(without_order(new, random.Random(seed + 10)))
        found = compare(first, second).changes
        assert [_plain(c) for c in found] == [_plain(c) for c in expected]


def _many() -> list[tuple[str, str]]:
    return [
        ("v_max: 0.5", "v_max: 0.6"),
        ("elapsed > 5[s]", "elapsed > 6[s]"),
        ("[going, error, always, idle]", "[going, error, always, creeping]"),
        ("creeping: creep}", "creeping: creep, done: wait, over: wait}"),
        ("title: Wheels", "title: Two wheels"),
    ]


def _plain(change: Difference) -> tuple[str, ...]:
    return change.where, change.part, change.name, change.change, change.aspect, change.note


@pytest.mark.parametrize("edits", every(4, ALL), ids=lambda value: str(value)[:60])
def test_both_directions_agree(edits: list[tuple[str, str]], read: Reader) -> None:
    old, new = read(BASE), read(edited(*edits))
    there, back = compare(old, new).changes, compare(new, old).changes

    def key(change: Difference, flip: bool) -> tuple[object, ...]:
        kind = FLIPPED[change.change] if flip else change.change
        texts = (change.new, change.old) if flip else (change.old, change.new)
        only = (change.only_new, change.only_old) if flip else (change.only_old, change.only_new)
        # What was renamed or reworded goes by its old name.
        name = "" if change.aspect in ("name", "text", "reason", "condition") else change.name
        return (change.where, change.part, name, kind, *texts, *map(bool, only), change.semantic)

    forward = sorted(
        key(c, False) for c in there if c.aspect not in ("name",) or c.part == "system"
    )
    backward = sorted(key(c, True) for c in back if c.aspect not in ("name",) or c.part == "system")
    assert forward == backward
    assert len(there) == len(back)


ATOMS = (
    "fresh(x.desk.order)",
    "fresh(x.desk.mode)",
    "x.desk.mode == slow",
    "x.desk.mode in {slow, stop}",
    "x.desk.mode != fast",
    "runs < 2",
    "runs >= 2",
    "runs == 1",
)


def conditions() -> st.SearchStrategy[str]:
    return st.recursive(
        st.sampled_from(ATOMS),
        lambda inner: st.one_of(
            inner.map(lambda a: f"not ({a})"),
            st.tuples(inner, inner).map(lambda p: f"({p[0]} and {p[1]})"),
            st.tuples(inner, inner).map(lambda p: f"({p[0]} or {p[1]})"),
            st.tuples(inner, inner, inner).map(lambda p: f"({p[0]} if {p[1]} else {p[2]})"),
        ),
        max_leaves=6,
    )


def worlds() -> list[Environment]:
    found = []
    for order, mode, member, runs in product((0, 1), (0, 1), ("slow", "fast", "stop"), (0, 1, 2)):
        fresh = {("desk", n) for n, is_ in (("order", order), ("mode", mode)) if is_}
        present = {("desk", "order"), ("desk", "mode")}
        inputs = {("desk", "mode"): member}
        found.append(Environment(inputs, fresh, present, memory={"runs": runs}))
    return found


WORLDS = worlds()


def asked_if(condition: str) -> str:
    return edited(
        ("asked: fresh(x.desk.order) or fresh(x.desk.mode)", f'asked: "{condition}"'),
        ("        - {that: \"not (fresh(x.desk.order) and fresh(x.desk.map))\", because: the desk"
         " sends one at a time}\n", ""),
        ("      assume:\n", ""),
    )  # fmt: skip


def condition_of(system: System) -> Expr:
    subsystem = next(s for s in system.subsystems if s.qualified_name == "cart.c")
    return next(c.when for c in subsystem.conditions if c.name == "asked")


@pytest.mark.parametrize("examples", examples(5, 30))
def test_verdicts_agree_with_all_worlds(examples: int, read: Reader) -> None:
    @settings(max_examples=examples, deadline=None)
    @given(conditions(), conditions())
    def agree(first: str, second: str) -> None:
        verdicts_agree_with_all_worlds(first, second, read)

    agree()


def verdicts_agree_with_all_worlds(first: str, second: str, read: Reader) -> None:
    """Equal exactly where no world tells the conditions apart; a witness tells them apart."""
    old, new = read(asked_if(first)), read(asked_if(second))
    a, b = condition_of(old), condition_of(new)
    lost = [w for w in WORLDS if evaluate(a, w) and not evaluate(b, w)]
    gained = [w for w in WORLDS if evaluate(b, w) and not evaluate(a, w)]
    found = [c for c in compare(old, new).differences if c.name == "asked"]
    assert bool(found) == bool(lost or gained)
    for change in found:
        assert bool(change.only_old) == bool(lost)
        assert bool(change.only_new) == bool(gained)
        for facts, worlds_ in ((change.only_old, lost), (change.only_new, gained)):
            described = [w for w in WORLDS if facts and all(_agrees(w, *f, read) for f in facts)]
            assert not facts or (described and all(w in worlds_ for w in described))


def _agrees(world: Environment, fact: str, answer: str, read: Reader) -> bool:
    if fact == "anything":
        return True
    if fact == "x.desk.mode":
        return world.inputs["desk", "mode"] in answer.split(" or ")
    value = evaluate(_expression(fact, read), world)
    return bool(value) == (answer == "true")


_KNOWN: dict[str, Expr] = {}


def _expression(text: str, read: Reader) -> Expr:
    if text not in _KNOWN:
        _KNOWN[text] = condition_of(read(asked_if(text)))
    return _KNOWN[text]


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("not (fresh(x.desk.order) or runs < 2)", "not fresh(x.desk.order) and not runs < 2"),
        ("x.desk.mode != slow", "x.desk.mode in {fast, stop}"),
        ("x.desk.mode == slow or x.desk.mode == fast", "x.desk.mode not in {stop}"),
        ("runs < 2", "not runs >= 2"),
        ("runs < 2", "2 > runs"),
        ("runs <= 1", "runs < 2"),
        ("near_goal", "not gap <= abs(x.wheels.s - goal)"),
        ("fresh(x.desk.mode) and near_goal", "near_goal if fresh(x.desk.mode) else False"),
    ],
)
def test_equivalent_conditions(first: str, second: str, differ: Differ) -> None:
    comparison = differ(asked_if(first), asked_if(second))
    assert comparison.differences == ()
    (remark,) = comparison.remarks
    assert (remark.name, remark.note) == ("asked", "proved equal")


def test_common_assumptions_are_used(differ: Differ) -> None:
    first = edited(("unsent: not fresh(x.desk.order)", "unsent: fresh(x.desk.map)"))
    second = edited(
        ("unsent: not fresh(x.desk.order)", "unsent: fresh(x.desk.map) and not fresh(x.desk.order)")
    )
    assert differ(first, second).differences == ()


def test_a_question_that_is_too_large_is_not_called_equal(differ: Differ) -> None:
    many = [f"blocked(x.desk.map, {n}[m])" for n in range(30)]
    first, second = " or ".join(many), " or ".join([*many, "fresh(x.desk.mode)"])
    (found,) = differ(asked_if(first), asked_if(second)).differences
    assert found.note.startswith("not proved equal: more than")
