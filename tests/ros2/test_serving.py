"""Goals of a served action end once each, whatever clients and agents do; stubs stand for rclpy."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from importlib import import_module
from random import Random
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from tests.seeds import Seeds, blocks

ACCEPT, REJECT = "accept", "reject"
STATUSES = ["none", "accepted", "rejected", "executing", "succeeded", "canceled", "aborted"]


class Future:
    """A value that a coroutine waits for."""

    def __init__(self) -> None:
        self.value: Any = None

    def set_result(self, value: Any) -> None:
        assert self.value is None, "it is set once"
        self.value = value

    def done(self) -> bool:
        return self.value is not None

    def __await__(self) -> Generator[None, None, Any]:
        while self.value is None:
            yield
        return self.value


class Handle:
    """A goal that was accepted."""

    def __init__(self, server: Server, request: Any) -> None:
        self.server, self.request = server, request
        self.is_cancel_requested = False
        self.ends: list[str] = []

    def execute(self) -> None:
        self.server.begin(self.server.pursue(self))

    def succeed(self) -> None:
        self.ends.append("succeeded")

    def abort(self) -> None:
        self.ends.append("aborted")

    def canceled(self) -> None:
        assert self.is_cancel_requested
        self.ends.append("canceled")

    def publish_feedback(self, feedback: Any) -> None:
        assert not self.ends


class Server:
    """The server of rclpy: callbacks wait, and are resumed by `spin`."""

    def __init__(self, *given: Any, **callbacks: Any) -> None:
        self.pursue: Callable[[Handle], Any] = given[3]
        self.callbacks = SimpleNamespace(**callbacks)
        self.waiting: list[Any] = []
        self.handles: list[Handle] = []
        self.answers: dict[int, str] = {}
        self.refuses: set[int] = set()
        """Goals that rclpy does not take though they are accepted."""

    def begin(self, coroutine: Any) -> None:
        self.waiting.append(coroutine)

    def spin(self) -> None:
        for coroutine in list(self.waiting):
            try:
                coroutine.send(None)
            except StopIteration:
                self.waiting.remove(coroutine)

    async def ask(self, number: int) -> None:
        request = SimpleNamespace(number=number)
        answer = await self.callbacks.goal_callback(request)
        assert number not in self.answers
        self.answers[number] = answer
        if answer == ACCEPT and number not in self.refuses:
            handle = Handle(self, request)
            self.handles.append(handle)
            self.callbacks.handle_accepted_callback(handle)

    def cancel(self, handle: Handle) -> None:
        if not handle.ends and self.callbacks.cancel_callback(handle) == ACCEPT:
            handle.is_cancel_requested = True


class Rig:
    """A served action, its clock, and what the agent is told."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, when_busy: str) -> None:
        answers = SimpleNamespace(ACCEPT=ACCEPT, REJECT=REJECT)
        self.servers: list[Server] = []
        for module, names in {
            "rclpy": {},
            "rclpy.action": {
                "ActionServer": self._serve, "CancelResponse": answers, "GoalResponse": answers
            },
            "rclpy.callback_groups": {"ReentrantCallbackGroup": object},
            "rclpy.node": {"Node": object},
            "rclpy.task": {"Future": Future},
            "specc_runtime.ros2.host.plain": {
                "fill": lambda _, fields: fields,
                "interface": lambda *_: SimpleNamespace(Result=dict, Feedback=dict),
                "plain": lambda request: request.number,
            },
        }.items():  # fmt: skip
            made = ModuleType(module)
            vars(made).update(names)
            monkeypatch.setitem(sys.modules, module, made)
        name = "specc_runtime.ros2.host.serving"
        monkeypatch.delitem(sys.modules, name, raising=False)
        module = import_module(name)
        monkeypatch.delitem(sys.modules, name)
        self.now_s = 0.0
        monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: self.now_s))
        self.follow: Callable[[], None] = lambda: None
        self.offers: list[int] = []
        self.is_cancelled = False
        parts = {"request": "request", "cancel": "cancel"}
        options = {"when_busy": when_busy, "answer_within_s": 1.0}
        node = SimpleNamespace(create_guard_condition=self._guard)
        self.action = module.ServedAction(node, "/pick", "a/B", parts, self._put, **options)

    def _serve(self, *given: Any, **callbacks: Any) -> Server:
        self.servers.append(Server(*given, **callbacks))
        return self.servers[-1]

    def _guard(self, follow: Callable[[], None]) -> Any:
        self.follow = follow
        return SimpleNamespace(trigger=lambda: None)

    def _put(self, element: str, value: Any) -> None:
        if element == "request":
            self.offers.append(value)
        else:
            self.is_cancelled = value

    def say(self, *statuses: str) -> None:
        for status in statuses:
            self.action.command("status", status)
        self.follow()
        self.spin()

    def spin(self) -> None:
        self.action.look()
        for _ in range(3):
            self.servers[0].spin()

    def ask(self, number: int) -> None:
        self.servers[0].begin(self.servers[0].ask(number))
        self.spin()

    def end_of(self, number: int) -> list[str]:
        found = [handle.ends for handle in self.servers[0].handles]
        by_number = {
            h.request.number: e for h, e in zip(self.servers[0].handles, found, strict=True)
        }
        return by_number.get(number, [self.servers[0].answers.get(number, "")])


def test_a_goal_that_comes_meanwhile_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, "reject")
    rig.ask(1)
    rig.ask(2)
    rig.say("accepted", "executing", "succeeded")
    rig.ask(3)  # it waits until the agent says that it takes the next one
    assert rig.offers == [1]
    rig.say("none")
    rig.ask(4)
    assert [*map(rig.end_of, (1, 2, 3, 4))] == [["succeeded"], [REJECT], [""], [REJECT]]
    assert rig.offers == [1, 3]


def test_one_goal_waits_for_its_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, "queue")
    for number in (1, 2, 3):
        rig.ask(number)
    rig.say("executing", "aborted")
    assert rig.offers == [1]
    rig.say("none")
    assert rig.offers == [1, 2]
    rig.say("rejected")
    assert [*map(rig.end_of, (1, 2, 3))] == [["aborted"], [REJECT], [REJECT]]


def test_a_goal_pre_empts_another_one_if_the_agent_accepts_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch, "preempt")
    rig.ask(1)
    rig.say("accepted")
    rig.ask(2)
    assert rig.offers == [1]
    rig.say("executing")
    rig.say("executing")
    assert rig.offers == [1, 2]
    rig.say("rejected", "executing")
    rig.ask(3)
    rig.say("accepted", "executing")
    rig.servers[0].cancel(rig.servers[0].handles[1])
    assert rig.is_cancelled
    rig.ask(4)
    rig.say("canceled", "none")
    assert [*map(rig.end_of, (1, 2, 3))] == [["aborted"], [REJECT], ["canceled"]]
    assert rig.offers == [1, 2, 3, 4] and not rig.is_cancelled


def test_an_answer_that_is_late_is_for_no_other_goal(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, "queue")
    rig.ask(1)
    rig.now_s = 0.9
    rig.ask(2)
    rig.now_s = 1.1
    rig.spin()
    assert rig.end_of(1) == [REJECT] and rig.offers == [1]
    rig.say("accepted")
    assert rig.end_of(2) == [""] and rig.is_cancelled
    rig.say("executing", "canceled", "none")
    assert rig.offers == [1, 2] and not rig.is_cancelled


def test_a_goal_is_not_cancelled_with_the_one_that_it_pre_empts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch, "preempt")
    rig.ask(1)
    rig.say("accepted", "executing")
    rig.ask(2)
    rig.servers[0].cancel(rig.servers[0].handles[0])
    assert rig.is_cancelled
    rig.say("accepted")
    assert not rig.is_cancelled
    rig.say("executing", "succeeded")
    assert [*map(rig.end_of, (1, 2))] == [["canceled"], ["succeeded"]]


def test_a_goal_that_is_accepted_too_late_ends_the_one_before(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig = Rig(monkeypatch, "preempt")
    rig.ask(1)
    rig.say("accepted", "executing")
    rig.ask(2)
    rig.now_s = 1.1
    rig.spin()
    rig.say("accepted", "executing")
    assert rig.is_cancelled and [*map(rig.end_of, (1, 2))] == [["aborted"], [REJECT]]


def test_a_goal_that_rclpy_does_not_take_is_forgotten(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = Rig(monkeypatch, "reject")
    rig.servers[0].refuses.add(1)
    rig.ask(1)
    rig.say("accepted")
    assert rig.action.waiting == 0
    rig.now_s = 1.1
    rig.spin()
    assert rig.is_cancelled and rig.action.is_settled
    rig.say("canceled", "none")
    rig.ask(2)
    rig.say("executing", "succeeded")
    assert rig.end_of(2) == ["succeeded"]


@pytest.mark.parametrize("seeds", blocks(range(20), long=200, each=200))
@pytest.mark.parametrize("when_busy", ["reject", "queue", "preempt"])
def test_each_goal_is_answered_and_ends_once(
    monkeypatch: pytest.MonkeyPatch, when_busy: str, seeds: Seeds
) -> None:
    for seed in seeds:
        _try(Rig(monkeypatch, when_busy), Random(f"{seed} {when_busy}"), when_busy)


def _try(rig: Rig, random: Random, when_busy: str) -> None:
    asked = 0
    server = rig.servers[0]
    for _ in range(120):
        match random.randrange(6):
            case 0:
                asked += 1
                rig.ask(asked)
            case 1 if server.handles:
                server.cancel(random.choice(server.handles[-2:]))
            case 2:
                rig.now_s += random.choice((0.1, 1.1))
                rig.spin()
            case 3:
                rig.action.command("result", {"n": 1})
                rig.action.command("feedback", {"n": random.random()})
            case _:
                rig.say(random.choice(STATUSES))
        assert sum(not handle.ends for handle in server.handles) <= 1
        is_late = rig.action._active is None
        is_canceling = any(h.is_cancel_requested and not h.ends for h in server.handles)
        assert not rig.is_cancelled or is_canceling or is_late
        if when_busy != "preempt":
            waits = [n for n in rig.offers if n not in server.answers]
            assert not waits or all(handle.ends for handle in server.handles)
    rig.action.end()
    rig.follow()
    rig.spin()
    assert rig.action.is_settled and not server.waiting
    assert sorted(server.answers) == [*range(1, asked + 1)]
    assert all(len(handle.ends) == 1 for handle in server.handles)
    assert rig.offers == sorted(set(rig.offers))
