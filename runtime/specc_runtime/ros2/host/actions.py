"""An action as a device: its goal follows an element, its status and outcome are elements."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.action import ActionClient
from rclpy.node import Node

from specc_runtime.hosting.devices import DeviceError
from specc_runtime.ros2.host.plain import fill, interface, plain

NONE, REJECTED = "none", "rejected"
STATUSES = (NONE, "accepted", "executing", "canceling", "succeeded", "canceled", "aborted")
"""By the numbers of `action_msgs/GoalStatus`; a goal may be `REJECTED` as well."""
Put = Callable[[str, Any], None]


class Action:
    """A client of one action. The last goal counts: what comes of earlier ones is not told.

    All that concerns rclpy happens in the thread that spins the node; goals come from others.
    """

    def __init__(
        self, node: Node, name: str, type_name: str, parts: Mapping[str, str], put: Put
    ) -> None:
        """`parts` has the elements of `goal`, `status`, `feedback` and `result`, if there are any.

        `put` is called with an element and its new value. Raises DeviceError for a type that this
        ROS does not have.
        """
        self.name = name
        self.type = interface(type_name, "action")
        self._client = ActionClient(node, self.type, name)
        self._parts = parts
        self._put = put
        self._goals: deque[Any] = deque()
        self._sent: Any = None
        self._number = 0
        """Of the last goal."""
        self._handle: Any = None
        self._unanswered: set[int] = set()
        """Goals to which the server has not answered yet."""
        self._unwanted: set[int] = set()
        """Goals of these that are cancelled as soon as they are accepted."""
        self._cancelling: list[Any] = []
        self._status = ""
        self._wanted = node.create_guard_condition(self._pursue)
        self._forget()

    def _forget(self) -> None:
        """Nothing has become of the present goal yet."""
        for part, value in (("status", NONE), ("feedback", None), ("result", None)):
            self._tell(part, value)

    @property
    def is_there(self) -> bool:
        """Whether somebody serves it."""
        return bool(self._client.server_is_ready())

    def pursue(self, fields: Any) -> None:
        """Send a goal, by its fields, unless it is the present one; None cancels that.

        Raises DeviceError for fields that are not those of the goal.
        """
        goal = None if fields is None else fill(self.type.Goal(), fields)
        self._goals.append((goal, fields))
        self._wanted.trigger()

    @property
    def is_settled(self) -> bool:
        """Whether its server has answered, so that nobody has to wait for that."""
        is_told = all(future.done() for future in self._cancelling)
        return is_told and not (self._goals or self._unanswered)

    def look(self) -> None:
        """Tell the status if it has changed, or that the server of a goal is gone."""
        if self._handle is None and not self._unanswered:
            return
        if not self.is_there:
            for part, element in self._parts.items():
                if part != "goal":
                    why = f"nobody serves the action {self.name} any more"
                    self._put(element, DeviceError(why))
            self._handle = None
            self._unanswered.clear()
        elif self._handle is not None and self._handle.status < len(STATUSES):
            self._tell("status", STATUSES[max(1, self._handle.status)])

    def _tell(self, part: str, value: Any) -> None:
        if part == "status":
            if value == self._status:
                return
            self._status = value
        if part in self._parts:
            self._put(self._parts[part], value)

    def _pursue(self) -> None:
        while self._goals:
            goal, fields = self._goals.popleft()
            if fields == self._sent:
                continue
            self._sent = fields
            if goal is not None:
                self._send(goal)
            elif self._handle is not None:
                self._cancel(self._handle)
            else:
                self._unwanted |= self._unanswered

    def _cancel(self, handle: Any) -> None:
        self._cancelling = [future for future in self._cancelling if not future.done()]
        self._cancelling.append(handle.cancel_goal_async())

    def _send(self, goal: Any) -> None:
        self._handle = None
        self._forget()
        self._number += 1
        number = self._number

        def feedback(message: Any) -> None:
            if self._number == number:
                self._tell("feedback", plain(message.feedback))

        def answered(future: Any) -> None:
            handle = future.result()
            self._unanswered.discard(number)
            if number in self._unwanted and handle.accepted:
                self._cancel(handle)
            if self._number != number:
                return
            if not handle.accepted:
                self._tell("status", REJECTED)
                return
            self._follow(handle, number)

        self._unanswered.add(number)
        self._client.send_goal_async(goal, feedback).add_done_callback(answered)

    def _follow(self, handle: Any, number: int) -> None:
        self._handle = handle
        self._tell("status", STATUSES[1])

        def ended(future: Any) -> None:
            if self._number == number:
                outcome = future.result()
                self._handle = None
                self._tell("result", plain(outcome.result))
                self._tell("status", STATUSES[outcome.status])

        handle.get_result_async().add_done_callback(ended)
