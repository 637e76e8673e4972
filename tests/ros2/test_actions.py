"""Goals of an action whose server takes its time, with stubs in the place of rclpy."""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
from specc_runtime.ros2.host import LAST

PARTS = {"goal": "goal", "status": "status"}


class Future:
    """An answer that the test gives."""

    def __init__(self) -> None:
        self.told: list[Callable[[Any], None]] = []
        self.answer: Any = None

    def add_done_callback(self, told: Callable[[Any], None]) -> None:
        self.told.append(told)

    def done(self) -> bool:
        return self.answer is not None

    def result(self) -> Any:
        return self.answer

    def give(self, answer: Any) -> None:
        self.answer = answer
        for told in self.told:
            told(self)


class Handle:
    """A goal that was accepted."""

    accepted, status = True, 2

    def __init__(self) -> None:
        self.cancelled = Future()
        self.is_cancelled = False

    def cancel_goal_async(self) -> Future:
        self.is_cancelled = True
        return self.cancelled

    def get_result_async(self) -> Future:
        return Future()


class Client:
    """A client of a server that is there."""

    def __init__(self) -> None:
        self.sent: list[Future] = []
        self.is_there = True

    def server_is_ready(self) -> bool:
        return self.is_there

    def send_goal_async(self, *_: Any) -> Future:
        self.sent.append(Future())
        return self.sent[-1]


class Rig:
    """An action, its client, and what is told of its elements."""

    def __init__(self, action: Callable[..., Any], client: Client) -> None:
        self.client = client
        self.told: dict[str, Any] = {}
        self.wanted: Callable[[], None] = lambda: None
        node = SimpleNamespace(create_guard_condition=self._guard)
        self.action = action(node, "/grasp", "cell/Grasp", PARTS, self.told.__setitem__)

    def _guard(self, wanted: Callable[[], None]) -> Any:
        self.wanted = wanted
        return SimpleNamespace(trigger=lambda: None)

    def pursue(self, *goals: tuple[int, Any]) -> None:
        for number, fields in goals:
            self.action.pursue(number, fields)
        self.wanted()

    def end(self) -> None:
        self.action.end()
        self.wanted()


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> Rig:
    name = "specc_runtime.ros2.host.actions"
    client = Client()
    for module, names in {
        "rclpy": {},
        "rclpy.action": {"ActionClient": lambda *_: client},
        "rclpy.node": {"Node": object},
        "specc_runtime.ros2.host.plain": {
            "fill": lambda _, fields: fields,
            "interface": lambda *_: SimpleNamespace(Goal=dict),
            "plain": lambda value: value,
        },
    }.items():
        made = ModuleType(module)
        vars(made).update(names)
        monkeypatch.setitem(sys.modules, module, made)
    monkeypatch.delitem(sys.modules, name, raising=False)
    action = import_module(name).Action
    monkeypatch.delitem(sys.modules, name)
    return Rig(action, client)


def test_a_goal_that_is_not_wanted_any_more_is_cancelled_when_it_is_accepted(rig: Rig) -> None:
    rig.pursue((1, {"n": 1}), (1, None), (2, {"n": 2}))
    one, two = rig.client.sent
    first, second = Handle(), Handle()
    one.give(first)
    two.give(second)
    assert (first.is_cancelled, second.is_cancelled) == (True, False)
    assert rig.told["status"] == (2, "accepted")
    assert not rig.action.is_settled
    first.cancelled.give("yes")
    assert rig.action.is_settled


def test_a_goal_that_was_cancelled_before_it_was_accepted(rig: Rig) -> None:
    rig.pursue((1, {"n": 1}), (1, None))
    handle = Handle()
    assert not rig.action.is_settled
    rig.client.sent[0].give(handle)
    assert handle.is_cancelled and rig.told["status"] == (1, "accepted")


def test_the_same_goal_is_sent_again_by_a_new_number(rig: Rig) -> None:
    rig.pursue((1, {"n": 1}), (1, {"n": 1}), (2, {"n": 1}))  # None between them was overtaken
    assert len(rig.client.sent) == 2


def test_a_server_that_goes_before_it_answers_is_told(rig: Rig) -> None:
    rig.pursue((1, {"n": 1}))
    rig.client.is_there = False
    rig.action.look()
    assert "nobody serves the action /grasp any more" in str(rig.told["status"])
    assert rig.action.is_settled


def opened(rig: Rig, *goals: tuple[int, Any]) -> list[Handle]:
    """Have goals sent and accepted."""
    rig.pursue(*goals)
    handles = [Handle() for _ in rig.client.sent]
    for sent, handle in zip(rig.client.sent, handles, strict=True):
        sent.give(handle)
    return handles


def test_all_goals_that_are_open_are_cancelled_at_the_end(rig: Rig) -> None:
    handles = opened(rig, (1, {"n": 1}), (2, {"n": 2}))
    rig.end()
    assert [handle.is_cancelled for handle in handles] == [True, True]
    assert not rig.action.is_settled


@pytest.mark.parametrize(("safe", "sent"), [({"n": 3}, 1), ({"n": 2}, 0), (None, 0)])
def test_a_goal_that_is_a_safe_output_outlives_the_run(
    rig: Rig, safe: dict[str, int] | None, sent: int
) -> None:
    first, second = opened(rig, (1, {"n": 1}), (2, {"n": 2}))
    rig.pursue((LAST, safe), (LAST, safe))  # of the last will and of the run
    assert len(rig.client.sent) == 2 + sent
    assert first.is_cancelled and second.is_cancelled == (safe != {"n": 2})
    handle = Handle()
    for last in rig.client.sent[2:]:
        last.give(handle)
    rig.end()
    assert not handle.is_cancelled and second.is_cancelled == (safe != {"n": 2})
