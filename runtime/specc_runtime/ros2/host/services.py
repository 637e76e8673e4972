"""Services: calls of the agent to others, and of others to the agent, which answers later."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from specc_runtime.ros2.host import LAST
from specc_runtime.ros2.host.plain import fill, interface, plain

Put = Callable[[str, Any], None]
_REFUSED = object()
"""Stands among responses for a request that is none for the agent."""
_MOST_CALLS = 16
"""Calls that wait for the agent; more are answered at once, with nothing set."""


class CalledService:
    """A client of one service. What is told has the number of the call, by which others know it."""

    def __init__(
        self,
        node: Node,
        name: str,
        type_name: str,
        parts: Mapping[str, str],
        put: Put,
        answer_within_s: float,
    ) -> None:
        """`parts` has the elements of `status` and `response`, if there are any.

        Raises DeviceError for a type that this ROS does not have.
        """
        self.type = interface(type_name, "srv")
        self._client = node.create_client(self.type, name)
        self._parts = parts
        self._put = put
        self._answer_within_s = answer_within_s
        self._requests: deque[tuple[int, Any]] = deque()
        self._number = 0
        self._fields: Any = None
        """Of the last request."""
        self._pending: dict[int, tuple[Any, float]] = {}
        """Calls without an answer, by their numbers, and when that is late."""
        self._changed = node.create_guard_condition(self._follow)
        self._tell("status", 0, "none")
        self._tell("response", 0, None)

    @property
    def is_there(self) -> bool:
        """Whether somebody serves it, or the agent is told that nobody does."""
        return "status" in self._parts or bool(self._client.service_is_ready())

    def call(self, number: int, fields: Any) -> None:
        """Call it, unless that has the number of the last call; None calls nothing.

        The number `LAST` is that of a safe output, which is called unless the last call has its
        fields. Raises DeviceError for fields that are not those of a request.
        """
        is_other = fields != self._fields if number == LAST else number != self._number
        self._fields = fields
        if fields is None or not is_other:
            return
        self._number = number
        self._requests.append((number, fill(self.type.Request(), fields)))
        self._changed.trigger()

    def end(self) -> None:
        """Nothing: calls that are under way go on to their answers."""

    waiting = 0
    """Callbacks that wait for the agent."""

    @property
    def is_settled(self) -> bool:
        """Whether no call is under way."""
        return not (self._requests or self._pending)

    def look(self) -> None:
        """Give up calls that are late."""
        now_s = time.monotonic()
        for number, (future, due_s) in list(self._pending.items()):
            if now_s > due_s:
                del self._pending[number]
                self._client.remove_pending_request(future)
                self._tell("status", number, "late")

    def _follow(self) -> None:
        while self._requests:
            number, request = self._requests.popleft()
            if not self._client.service_is_ready():
                self._tell("status", number, "missing")
                continue
            future = self._client.call_async(request)
            self._pending[number] = future, time.monotonic() + self._answer_within_s
            self._tell("status", number, "called")
            future.add_done_callback(lambda done, number=number: self._receive(number, done))

    def _receive(self, number: int, future: Any) -> None:
        if self._pending.pop(number, None) is not None:
            self._tell("response", number, plain(future.result()))
            self._tell("status", number, "answered")

    def _tell(self, part: str, number: int, value: Any) -> None:
        if part in self._parts and number in (0, self._number):
            self._put(self._parts[part], (number, value))


class ServedService:
    """A server of one service, which asks calls of the agent one by one.

    The agent takes a call while its response is None; the first other one answers it. A call that
    it does not answer in time gets a response in which nothing is set.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        type_name: str,
        parts: Mapping[str, str],
        put: Put,
        answer_within_s: float,
    ) -> None:
        """`parts` has the element of `request`, which `put` reports.

        Raises DeviceError for a type that this ROS does not have.
        """
        self.type = interface(type_name, "srv")
        self._parts = parts
        self._put = put
        self._answer_within_s = answer_within_s
        self._responses: deque[Any] = deque()
        self._response: Any = None
        """What the agent gave last."""
        self._calls: deque[tuple[Any, Future, float]] = deque()
        """Requests, their responses, and when they are late; the first one may have been asked."""
        self._is_offered = self._has_ended = False
        self._waiting = 0
        self._next_offer_s = 0.0
        """When the next call may be asked after one that the agent has not answered in time."""
        self._changed = node.create_guard_condition(self._follow)
        group = ReentrantCallbackGroup()  # callbacks wait for the agent
        self._server = node.create_service(self.type, name, self._receive, callback_group=group)

    def command(self, part: str, fields: Any) -> None:
        """Take the fields of a response, or None, from any thread.

        Raises DeviceError for fields that are not those of the message.
        """
        self._responses.append(None if fields is None else fill(self.type.Response(), fields))
        self._changed.trigger()

    def refuse(self, _: Any) -> None:
        """Answer the call that the agent was asked, whose values are none for it."""
        self._responses.append(_REFUSED)
        self._changed.trigger()

    def end(self) -> None:
        """The run is over: answer what is open."""
        self._has_ended = True

    @property
    def waiting(self) -> int:
        """Callbacks that wait for the agent, or to send what it has answered."""
        return self._waiting

    @property
    def is_settled(self) -> bool:
        """Whether all calls are answered."""
        return not self._waiting

    def look(self) -> None:
        """Answer calls that the agent has not answered in time."""
        now_s = time.monotonic()
        while self._calls and (self._has_ended or now_s > self._calls[0][2]):
            if self._is_offered:
                # The agent may answer yet, which must not be taken for an answer to the next call.
                self._next_offer_s = now_s + self._answer_within_s
            self._answer(self.type.Response())
        self._offer_next()

    async def _receive(self, request: Any, response: Any) -> Any:
        if self._has_ended or len(self._calls) >= _MOST_CALLS:
            return response
        answer = Future()
        self._calls.append((request, answer, time.monotonic() + self._answer_within_s))
        self._offer_next()
        self._waiting += 1
        try:
            return await answer
        finally:
            self._waiting -= 1

    def _follow(self) -> None:
        while self._responses:
            response = self._responses.popleft()
            if response is _REFUSED:
                if self._is_offered:
                    self._answer(self.type.Response())
                continue
            is_new, self._response = self._response is None, response
            self._next_offer_s = 0.0
            if response is not None and is_new and self._is_offered:
                self._answer(response)
        self._offer_next()

    def _answer(self, response: Any) -> None:
        _, answer, _ = self._calls.popleft()
        self._is_offered = False
        answer.set_result(response)

    def _offer_next(self) -> None:
        is_ready = self._response is None and time.monotonic() >= self._next_offer_s
        if self._calls and not self._is_offered and is_ready and not self._has_ended:
            self._is_offered = True
            self._put(self._parts["request"], plain(self._calls[0][0]))
