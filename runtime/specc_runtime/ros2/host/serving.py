"""An action that others call: goals are asked of the agent one by one, and each ends once."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future

from specc_runtime.hosting.devices import DeviceError
from specc_runtime.ros2.host.plain import fill, interface, plain

NONE, ACCEPTED, EXECUTING, REJECTED = "none", "accepted", "executing", "rejected"
SUCCEEDED, CANCELED, ABORTED = "succeeded", "canceled", "aborted"
_ENDS = (SUCCEEDED, CANCELED, ABORTED)
_WORDS = (NONE, ACCEPTED, REJECTED, EXECUTING, *_ENDS)
_BEGUN_S = 1.0
"""How long rclpy may take to tell that a goal is accepted."""
Put = Callable[[str, Any], None]


class ServedGoal:
    """A goal of a client: whether it is accepted, and how it ends."""

    def __init__(self, request: Any, due_s: float) -> None:
        """`due_s` is when it is rejected that nobody has accepted, s of `time.monotonic()`."""
        self.request = request
        self.due_s = due_s
        self.handle: Any = None
        """Of rclpy, once it is accepted and the client knows."""
        self.answer = Future()
        """A `GoalResponse`."""
        self.begun_by_s = math.inf
        """When rclpy has told of it that it is accepted."""
        self.outcome = Future()
        """How it ends, and the result."""

    def reject(self) -> None:
        """Have the client know that it is not pursued."""
        self.answer.set_result(GoalResponse.REJECT)

    def finish(self, status: str, result: Any) -> None:
        """Have it end, once; `canceled` is what a goal is only whose client has cancelled it."""
        if not self.outcome.done():
            self.outcome.set_result((status, result))

    @property
    def is_waiting(self) -> bool:
        """Whether a callback of rclpy waits for its answer or its end."""
        return not self.answer.done() or self.handle is not None

    @property
    def is_canceling(self) -> bool:
        """Whether its client wants it no more."""
        return self.handle is not None and self.handle.is_cancel_requested


class ServedAction:
    """A server of one action.

    The agent takes a goal while its status is `none`. It says `accepted` or `rejected`, then
    `executing`, and how the goal ends; `none` again is that it takes the next one. A status counts
    once, when it changes. All that concerns rclpy happens in the thread that spins the node.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        type_name: str,
        parts: Mapping[str, str],
        put: Put,
        *,
        when_busy: str,
        answer_within_s: float,
    ) -> None:
        """`parts` has the elements of `request` and `cancel`, which `put` reports.

        Raises DeviceError for a type that this ROS does not have.
        """
        self.type = interface(type_name, "action")
        self._parts = parts
        self._put = put
        self._when_busy = when_busy
        self._answer_within_s = answer_within_s
        self._commands: deque[tuple[str, Any]] = deque()
        self._status = NONE
        """What the agent said last."""
        self._result: Any = None
        """What it gave last for the goal that was asked last."""
        self._feedback: Any = None
        """What clients were told last of the goal that is active."""
        self._offer: ServedGoal | None = None
        """The agent has not answered it yet."""
        self._active: ServedGoal | None = None
        """The agent pursues it."""
        self._next: ServedGoal | None = None
        """It is asked when the agent takes one."""
        self._next_offer_s = 0.0
        """When the next goal may be asked after one that the agent has not answered in time."""
        self._open: list[ServedGoal] = []
        """Goals whose clients have not been told how they end."""
        self._is_cancelled = self._has_ended = False
        self._changed = node.create_guard_condition(self._follow)
        self._server = ActionServer(
            node,
            self.type,
            name,
            self._pursue,
            goal_callback=self._receive,
            handle_accepted_callback=self._begin,
            cancel_callback=self._cancel,
            # Callbacks wait for the agent, and others are called meanwhile.
            callback_group=ReentrantCallbackGroup(),
        )

    def command(self, part: str, value: Any) -> None:
        """Take a status, or the fields of feedback or of a result, from any thread.

        Raises DeviceError for fields that are not those of the message.
        """
        if part == "status" and value not in _WORDS:
            raise DeviceError(f"`{value}` is no status: {', '.join(_WORDS)} are")
        if part in ("feedback", "result") and value is not None:
            cls = self.type.Feedback if part == "feedback" else self.type.Result
            value = fill(cls(), value)
        self._commands.append((part, value))
        self._changed.trigger()

    def refuse(self, _: Any) -> None:
        """Reject the goal that the agent was asked, whose values are none for it."""
        self._commands.append(("request", None))
        self._changed.trigger()

    def end(self) -> None:
        """The run is over: reject and abort what is open."""
        self._commands.append(("", None))
        self._changed.trigger()

    @property
    def waiting(self) -> int:
        """Callbacks that wait for the agent."""
        return sum(goal.is_waiting for goal in self._open)

    @property
    def is_settled(self) -> bool:
        """Whether all clients have been told how their goals end."""
        return not (self._open or self._commands)

    def look(self) -> None:
        """Reject what the agent has not accepted in time."""
        now_s = time.monotonic()
        if self._offer is not None and now_s > self._offer.due_s:
            self._offer.reject()
            self._offer = None
            # The agent may answer yet, which must not be taken for an answer to the next one.
            self._next_offer_s = now_s + self._answer_within_s
        if self._next is not None and now_s > self._next.due_s:
            self._next.reject()
            self._next = None
        for goal in [goal for goal in self._open if now_s > goal.begun_by_s and not goal.handle]:
            self._forget(goal)
        self._offer_next()

    def _forget(self, goal: ServedGoal) -> None:
        """A goal that rclpy does not take, since there is one of its id, has no client."""
        self._open.remove(goal)
        if self._active is goal:
            self._active = None
            self._tell_cancelled(True)

    # What clients do.

    async def _receive(self, request: Any) -> GoalResponse:
        goal = ServedGoal(request, time.monotonic() + self._answer_within_s)
        self._open.append(goal)
        is_busy = self._offer is not None or self._active is not None
        if self._has_ended or (is_busy and self._when_busy == "reject"):
            goal.reject()
        elif self._next is None:
            self._next = goal
            self._offer_next()
        elif self._when_busy == "preempt":
            self._next.reject()
            self._next = goal
        else:
            goal.reject()
        response: GoalResponse = await goal.answer
        if response == GoalResponse.REJECT:
            self._open.remove(goal)
        return response

    def _begin(self, handle: Any) -> None:
        goal = next(goal for goal in self._open if goal.request is handle.request)
        goal.handle = handle
        handle.execute()

    async def _pursue(self, handle: Any) -> Any:
        goal = next(goal for goal in self._open if goal.handle is handle)
        status, result = await goal.outcome
        if status == SUCCEEDED:
            handle.succeed()
        elif status == CANCELED and handle.is_cancel_requested:
            handle.canceled()
        else:
            handle.abort()
        self._open.remove(goal)
        return self.type.Result() if result is None else result

    def _cancel(self, handle: Any) -> CancelResponse:
        if self._active is None or self._active.handle is not handle:
            return CancelResponse.REJECT  # it ends already
        self._tell_cancelled(True)
        return CancelResponse.ACCEPT

    # What the agent does.

    def _follow(self) -> None:
        while self._commands:
            part, value = self._commands.popleft()
            if not part:
                self._finish()
            elif part == "request":
                if self._offer is not None:
                    self._offer.reject()
                    self._offer = None
            elif part == "result":
                self._result = value
            elif part == "feedback":
                self._tell_feedback(value)
            elif value != self._status:
                self._status = value
                self._answer(value)
        self._offer_next()

    def _tell_feedback(self, feedback: Any) -> None:
        """Publish it if it has changed and somebody waits for the goal."""
        goal, is_new = self._active, feedback != self._feedback
        if feedback is not None and is_new and goal is not None and goal.handle is not None:
            goal.handle.publish_feedback(feedback)
            self._feedback = feedback

    def _answer(self, status: str) -> None:
        offer = self._offer
        self._next_offer_s = 0.0
        if offer is not None and status == REJECTED:
            offer.reject()
            self._offer = None
        elif offer is not None and (
            status == ACCEPTED or (self._active is None and status != NONE)
        ):
            self._finish_pre_empted()
            self._active, self._offer, self._feedback = offer, None, None
            self._tell_cancelled(False)
            offer.begun_by_s = time.monotonic() + _BEGUN_S
            offer.answer.set_result(GoalResponse.ACCEPT)
        elif status == ACCEPTED or (self._active is None and status == EXECUTING):
            # The answer is late: the goal that the agent pursues now was rejected.
            self._finish_pre_empted()
            self._tell_cancelled(True)
        if status in (*_ENDS, NONE):
            self._finish_active(ABORTED if status == NONE else status)

    def _finish_pre_empted(self) -> None:
        if self._active is not None:
            self._result = None  # it may be that of the goal that the agent has accepted now
            self._finish_active(CANCELED if self._active.is_canceling else ABORTED)

    def _finish_active(self, status: str) -> None:
        if self._active is not None:
            self._active.finish(status, self._result)
            self._active, self._result = None, None

    def _finish(self) -> None:
        self._has_ended = True
        for goal in (self._offer, self._next):
            if goal is not None:
                goal.reject()
        self._offer = self._next = None
        self._finish_active(ABORTED)

    # What the agent is asked.

    def _takes_goals(self) -> bool:
        """Whether a goal that comes now can be asked at once."""
        if self._has_ended or self._offer is not None or time.monotonic() < self._next_offer_s:
            return False
        if self._active is None:
            return self._status == NONE
        is_preempted = self._when_busy == "preempt" and not self._active.is_canceling
        return is_preempted and self._status == EXECUTING

    def _offer_next(self) -> None:
        if self._next is None or not self._takes_goals():
            return
        self._offer, self._next = self._next, None
        self._tell_cancelled(False)
        if "request" in self._parts:
            self._put(self._parts["request"], plain(self._offer.request))

    def _tell_cancelled(self, is_cancelled: bool) -> None:
        if is_cancelled != self._is_cancelled and "cancel" in self._parts:
            self._put(self._parts["cancel"], is_cancelled)
        self._is_cancelled = is_cancelled
