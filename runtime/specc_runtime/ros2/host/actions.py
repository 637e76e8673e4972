"""An action as a device: its goal follows an element, its status and outcome are elements."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.action import ActionClient
from rclpy.node import Node

from specc_runtime.hosting.devices import DeviceError
from specc_runtime.ros2.host import LAST
from specc_runtime.ros2.host.plain import fill, interface, plain

NONE, REJECTED = "none", "rejected"
STATUSES = (NONE, "accepted", "executing", "canceling", "succeeded", "canceled", "aborted")
"""By the numbers of `action_msgs/GoalStatus`; a goal may be `REJECTED` as well."""
_LOOK_S = 0.1
"""How often it is seen whether the server is still the same."""
Put = Callable[[str, Any], None]


class Action:
    """A client of one action. What is told has the number of its goal, by which others know it.

    All that concerns rclpy happens in the thread that spins the node; goals come from others.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        type_name: str,
        parts: Mapping[str, str],
        put: Put,
        *,
        is_answered: bool = False,
    ) -> None:
        """`parts` has the elements of `goal`, `status`, `feedback` and `result`, if there are any.

        `put` is called with an element and the number of a goal with its new value. If the loss of
        the server `is_answered`, the status of its goal is None then, and an error otherwise.
        Raises DeviceError for a type that this ROS does not have.
        """
        self.name = name
        self.type = interface(type_name, "action")
        self._client = ActionClient(node, self.type, name)
        self._node = node
        self._is_answered = is_answered
        self._parts = parts
        self._put = put
        self._orders: deque[tuple[int, Any, Any] | None] = deque()
        """Numbers, fields and goals that are still to be pursued; None is the end of the run."""
        self._number = 0
        """Of the last goal."""
        self._fields: Any = None
        """Of the last goal; None if it is not wanted any more."""
        self._goal_number = 0
        """The goal that outlives the run, if one does."""
        self._unanswered: set[int] = set()
        """Goals to which the server has not answered yet."""
        self._unwanted: set[int] = set()
        """Goals of these that are cancelled as soon as they are accepted."""
        self._open: dict[int, Any] = {}
        """The handles of goals that were accepted and have not ended."""
        self._cancelling: dict[int, Any] = {}
        """The answers to cancelling these."""
        self._servers: frozenset[bytes] = frozenset()
        """Those who were there when the last goal was sent or accepted, by what they publish."""
        self._looked_s = 0.0
        self._lost: list[Any] = []
        """The handles of goals whose server was gone: they are cancelled if it comes back."""
        self._status = (0, "")
        self._changed = node.create_guard_condition(self._follow_orders)
        for part, value in (("status", NONE), ("feedback", None), ("result", None)):
            self._tell(part, 0, value)

    waiting = 0
    """Callbacks that wait for the agent."""

    @property
    def is_there(self) -> bool:
        """Whether somebody serves it."""
        return bool(self._client.server_is_ready())

    def pursue(self, number: int, fields: Any) -> None:
        """Send a goal, by its fields, unless it has the number of the last one; None cancels all.

        A goal with the number `LAST` is sent unless the last one has its fields: all others are
        cancelled, and `end` leaves it. Raises DeviceError for fields that are not those of a goal.
        """
        goal = None if fields is None else fill(self.type.Goal(), fields)
        self._orders.append((number, fields, goal))
        self._changed.trigger()

    def end(self) -> None:
        """Cancel the goals that are open."""
        self._orders.append(None)
        self._changed.trigger()

    @property
    def is_settled(self) -> bool:
        """Whether its server has answered, so that nobody has to wait for that."""
        is_cancelled = all(future.done() for future in self._cancelling.values())
        return is_cancelled and not (self._orders or self._unanswered)

    def look(self) -> None:
        """Tell the status if it has changed, or that the server of a goal is gone."""
        if self._lost and self.is_there:
            for handle in self._lost:
                handle.cancel_goal_async()
            self._lost.clear()
        if not (self._open or self._unanswered):
            return
        if self._is_gone():
            self._lose()
            return
        handle = self._open.get(self._number)
        if handle is not None and handle.status < len(STATUSES):
            self._tell("status", self._number, STATUSES[max(1, handle.status)])

    def _is_gone(self) -> bool:
        """Whether no server is left that can know of the last goal; one that was started since then
        does not.
        """
        if not self.is_there:
            return True
        now_s = time.monotonic()
        if now_s < self._looked_s + _LOOK_S:
            return False
        self._looked_s = now_s
        return bool(self._servers) and self._servers.isdisjoint(self._present())

    def _present(self) -> frozenset[bytes]:
        topic = f"{self.name}/_action/status"
        ends = self._node.get_publishers_info_by_topic(topic)
        return frozenset(bytes(end.endpoint_gid) for end in ends)

    def _lose(self) -> None:
        """The goals that were open are over."""
        is_pursued = self._number in {*self._open, *self._unanswered}
        self._lost += self._open.values()
        self._open.clear()
        self._unanswered.clear()
        self._cancelling.clear()
        if not self._is_answered:
            why = f"nobody serves the action {self.name} any more"
            if self.is_there:
                why = f"the server of the action {self.name} was replaced while it had a goal"
            for part, element in self._parts.items():
                if part != "goal":
                    self._put(element, DeviceError(why))
        elif is_pursued:
            self._tell("status", self._number, None)

    def _tell(self, part: str, number: int, value: Any) -> None:
        """Tell what has become of a goal, unless there is a later one."""
        if number != self._number:
            return
        if part == "status":
            if (number, value) == self._status:
                return
            self._status = number, value
        if part in self._parts:
            self._put(self._parts[part], (number, value))

    def _follow_orders(self) -> None:
        while self._orders:
            order = self._orders.popleft()
            if order is None:
                self._cancel_open()
            else:
                self._follow(*order)

    def _follow(self, number: int, fields: Any, goal: Any) -> None:
        is_last = number == LAST
        is_other = fields != self._fields if is_last else number != self._number
        is_new = goal is not None and is_other
        self._fields = fields
        if is_new:
            self._number = number
        if is_last:
            self._goal_number = 0 if goal is None else self._number
        if is_last or goal is None:
            self._cancel_open()
        if is_new:
            self._send(goal, number)

    def _cancel_open(self) -> None:
        """Cancel the goals that have not ended, but for one that outlives the run."""
        self._unwanted |= self._unanswered - {self._goal_number}
        for number in self._open.keys() - {self._goal_number}:
            self._cancel(number)

    def _cancel(self, number: int) -> None:
        if number not in self._cancelling:
            self._cancelling[number] = self._open[number].cancel_goal_async()

    def _send(self, goal: Any, number: int) -> None:
        def feedback(message: Any) -> None:
            self._tell("feedback", number, plain(message.feedback))

        def answered(future: Any) -> None:
            handle = future.result()
            if number not in self._unanswered:  # given up as lost
                self._lost += [handle] if handle.accepted else []
                return
            self._unanswered.remove(number)
            if handle.accepted:
                self._accepted(handle, number)
            else:
                self._tell("status", number, REJECTED)

        if self._is_answered and not self.is_there:
            self._tell("status", number, None)
            return
        self._servers = self._present()
        self._unanswered.add(number)
        self._client.send_goal_async(goal, feedback).add_done_callback(answered)

    def _accepted(self, handle: Any, number: int) -> None:
        self._open[number] = handle
        self._servers = self._present()
        self._tell("status", number, STATUSES[1])
        if number in self._unwanted:
            self._cancel(number)

        def ended(future: Any) -> None:
            outcome = future.result()
            if self._open.pop(number, None) is None:  # given up as lost
                return
            self._tell("result", number, plain(outcome.result))
            self._tell("status", number, STATUSES[outcome.status])

        handle.get_result_async().add_done_callback(ended)
