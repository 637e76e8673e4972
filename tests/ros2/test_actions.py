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
        self.cancelled, self.ended = Future(), Future()
        self.is_cancelled = False

    def cancel_goal_async(self) -> Future:
        self.is_cancelled = True
        return self.cancelled

    def get_result_async(self) -> Future:
        return self.ended


class Client:
    """A client of a server that is there, and the graph."""

    def __init__(self) -> None:
        self.sent: list[Future] = []
        self.servers = [b"first"]

    def server_is_ready(self) -> bool:
        return bool(self.servers)

    def publishers(self, topic: str) -> list[Any]:
        assert topic == "/grasp/_action/status"
        return [SimpleNamespace(endpoint_gid=[*gid]) for gid in self.servers]

    def send_goal_async(self, *_: Any) -> Future:
        self.sent.append(Future())
        return self.sent[-1]


class Rig:
    """An action, its client, and what is told of its elements."""

    def __init__(self, action: Callable[..., Any], client: Client, is_answered: bool) -> None:
        self.client = client
        self.told: dict[str, Any] = {}
        self.wanted: Callable[[], None] = lambda: None
        node = SimpleNamespace(
            create_guard_condition=self._guard, get_publishers_info_by_topic=client.publishers
        )
        put = self.told.__setitem__
        self.action = action(node, "/grasp", "cell/Grasp", PARTS, put, is_answered=is_answered)

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
    return made(monkeypatch, is_answered=False)


@pytest.fixture
def answered(monkeypatch: pytest.MonkeyPatch) -> Rig:
    """The loss of the server is answered."""
    return made(monkeypatch, is_answered=True)


def made(monkeypatch: pytest.MonkeyPatch, *, is_answered: bool) -> Rig:
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
    actions = import_module(name)
    monkeypatch.setattr(actions, "_LOOK_S", 0.0)
    monkeypatch.delitem(sys.modules, name)
    return Rig(actions.Action, client, is_answered)


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
    rig.client.servers = []
    rig.action.look()
    assert "nobody serves the action /grasp any more" in str(rig.told["status"])
    assert rig.action.is_settled


def opened(rig: Rig, *goals: tuple[int, Any]) -> list[Handle]:
    """Have goals sent and accepted."""
    before = len(rig.client.sent)
    rig.pursue(*goals)
    handles = [Handle() for _ in goals]
    for sent, handle in zip(rig.client.sent[before:], handles, strict=True):
        sent.give(handle)
    return handles


def test_another_server_in_its_place_is_told(rig: Rig) -> None:
    opened(rig, (1, {"n": 1}))
    rig.client.servers = [b"second"]
    rig.action.look()
    assert "/grasp was replaced while it had a goal" in str(rig.told["status"])


@pytest.mark.parametrize("servers", [[], [b"second"]])
def test_a_server_that_goes_is_a_status_where_that_is_answered(
    answered: Rig, servers: list[bytes]
) -> None:
    (first,) = opened(answered, (1, {"n": 1}))
    answered.client.servers = [b"first", b"second"]
    answered.action.look()
    assert answered.told["status"] == (1, "executing")
    answered.client.servers = servers
    answered.action.look()
    assert answered.told["status"] == (1, None) and answered.action.is_settled
    answered.client.servers = [b"second"]
    (second,) = opened(answered, (2, {"n": 1}))
    assert answered.told["status"] == (2, "accepted")
    first.ended.give(SimpleNamespace(result=None, status=4))
    answered.action.look()
    assert answered.told["status"] == (2, "executing")
    # Should the first one be there after all, nobody wants what it does.
    assert (first.is_cancelled, second.is_cancelled) == (True, False)


def test_a_goal_without_a_server_is_lost_at_once(answered: Rig) -> None:
    answered.client.servers = []
    answered.pursue((1, {"n": 1}))
    assert answered.told["status"] == (1, None) and not answered.client.sent


def test_a_goal_that_was_lost_before_it_was_accepted_is_cancelled(answered: Rig) -> None:
    answered.pursue((1, {"n": 1}))
    answered.client.servers = []
    answered.action.look()
    assert answered.told["status"] == (1, None)
    handle = Handle()
    answered.client.sent[0].give(handle)
    answered.client.servers = [b"first"]
    answered.action.look()
    assert answered.told["status"] == (1, None) and handle.is_cancelled


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
