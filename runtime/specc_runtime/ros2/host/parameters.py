"""Constants that may change while a run goes on, as parameters of its node."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.node import Node
from rclpy.parameter import Parameter

from specc_runtime.hosting.devices import DeviceError

Requests = dict[str, tuple[int, float]]
"""By constants: the number of the last request, and the value."""
_MOST_A_SECOND = 50.0
"""Changes that are taken; each is kept in memory, in the report and in a recording."""
_MOST_AT_ONCE = 200
"""Parameters of one request, and changes that may come at once after a pause."""
_INTEGERS = -(2**63), 2**63 - 1
_OWN = ("use_sim_time", "start_type_description_service")
"""Parameters that every node has."""


class Parameters:
    """The parameters, as others ask for them and as the run says that they are.

    Others change them while the node spins. The run may tell what they are at any time, in any
    thread: that is taken by `look`, between two callbacks of the node.
    """

    def __init__(
        self, node: Node, constants: list[dict[str, Any]], tell: Callable[[Requests], None]
    ) -> None:
        """Declare the constants, each with `name`, `value`, `least`, `greatest`, `unit` and
        `title`; the node has declared what it was given behind `--ros-args`.

        `tell` is called with all that others have asked for, at once with what was given.

        `ignored` is why given parameters count for nothing. Raises DeviceError for a value that a
        constant may not have, and for the name of a parameter that every node has.
        """
        self._node = node
        self._constants = {constant["name"]: constant for constant in constants}
        self._tell = tell
        self._requests: Requests = {}
        self._news: deque[Requests] = deque()
        self._left, self._since_s = float(_MOST_AT_ONCE), time.monotonic()
        given = {
            name: parameter.value
            for name, parameter in node.get_parameters_by_prefix("").items()
            if name not in _OWN and not name.startswith("qos_overrides.")
        }
        for name in given:
            node.undeclare_parameter(name)
        for name, constant in self._constants.items():
            first = _checked(constant, given.pop(name)) if name in given else constant["value"]
            self._declare(name, first)
            if first != constant["value"]:
                self._requests[name] = 1, first
        self.ignored = self._why_ignored(given)
        own = {SetParameters: self._set_each, SetParametersAtomically: self._set_all}
        for service in node.services:  # those of parameters: there are no others yet
            service.callback = _answering(own.get(service.srv_type, service.callback))
        tell(self._requests)

    def follow(self, values: Requests) -> None:
        """The run says what constants are; any thread may call this."""
        self._news.append(values)

    def look(self) -> None:
        """Have the parameters as the run says that they are."""
        while self._news:
            changed = [
                Parameter(name, value=value)
                for name, (number, value) in self._news.popleft().items()
                # The run has not seen the last request yet: that is what it will be.
                if number >= self._number(name) and self._node.get_parameter(name).value != value
            ]
            if changed:
                self._node.set_parameters(changed)

    def _declare(self, name: str, value: float) -> None:
        constant = self._constants[name]
        if name in _OWN:
            raise DeviceError(f"{name} is a parameter of every node: name the constant otherwise")
        least, greatest = constant["least"], constant["greatest"]
        descriptor = ParameterDescriptor(description=_described(constant))
        if type(constant["value"]) is int:
            low, high = (min(max(each, _INTEGERS[0]), _INTEGERS[1]) for each in (least, greatest))
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high)]
        else:
            bounds = {"from_value": float(least), "to_value": float(greatest)}
            descriptor.floating_point_range = [FloatingPointRange(**bounds)]
        self._node.declare_parameter(name, value, descriptor)

    def _set_each(self, request: Any, response: Any) -> Any:
        response.results = [self._set([each]) for each in request.parameters]
        return response

    def _set_all(self, request: Any, response: Any) -> Any:
        response.result = self._set(request.parameters)
        return response

    def _set(self, messages: Sequence[Any]) -> Any:
        """Somebody sets parameters, all of them or none; raises ValueError for unknown types."""
        parameters = [Parameter.from_parameter_msg(message) for message in messages]
        if why := self._refusal(parameters):
            return SetParametersResult(successful=False, reason=why)
        for each in parameters:
            self._requests[each.name] = self._number(each.name) + 1, each.value
        self._tell(dict(self._requests))
        return self._node.set_parameters_atomically(parameters)

    def _refusal(self, parameters: list[Parameter]) -> str:
        for each in parameters:
            if each.name not in self._constants:
                known = ", ".join(self._constants)
                return f"{each.name[:40]} is no constant that may change; there are: {known}"[:500]
            try:
                _checked(self._constants[each.name], each.value)
            except DeviceError as error:
                return str(error)
        now_s = time.monotonic()
        left = self._left + _MOST_A_SECOND * (now_s - self._since_s)
        self._left, self._since_s = min(left, _MOST_AT_ONCE), now_s
        if self._left < len(parameters):
            return f"there are more than {_MOST_A_SECOND:g} changes a second"
        self._left -= len(parameters)
        return ""

    def _number(self, name: str) -> int:
        return self._requests[name][0] if name in self._requests else 0

    def _why_ignored(self, given: Mapping[str, Any]) -> str:
        if not given:
            return ""
        names, known = ", ".join(sorted(given)[:10]), ", ".join(self._constants) or "none"
        return (
            f"--ros-args: the node has no parameters {names}; constants that may change are: "
            f"{known}; --set gives others their values"
        )


def _checked(constant: Mapping[str, Any], value: Any) -> Any:
    """A value that a constant may have; raises DeviceError for any other one."""
    name, kind = constant["name"], type(constant["value"])
    if type(value) is not kind:
        what = "an integer" if kind is int else "a double, as 1.0"
        raise DeviceError(f"{name} is {what}, and not {str(value)[:40]}")
    least, greatest = constant["least"], constant["greatest"]
    if not (math.isfinite(value) and least <= value <= greatest):
        unit = f" {constant['unit']}" if constant["unit"] else ""
        raise DeviceError(
            f"{name} is not {value:g}{unit}: its range is {least:g} to {greatest:g}{unit}"
        )
    return value


def _described(constant: Mapping[str, Any]) -> str:
    """Title and unit."""
    return ", in ".join(filter(None, (constant["title"], constant["unit"])))


def _answering(answer: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    """What answers requests that are too long, or of which nothing can be made, as well.

    An exception would end the node.
    """

    def safely(request: Any, response: Any) -> Any:
        fields = ("parameters", "names", "prefixes")
        parts = next((getattr(request, each) for each in fields if hasattr(request, each)), ())
        why = f"a request has at most {_MOST_AT_ONCE} parameters"
        if len(parts) <= _MOST_AT_ONCE:
            try:
                return answer(request, response)
            except Exception as error:  # noqa: BLE001  # a stranger's request, whatever rclpy raises
                why = f"{type(error).__name__}: {error}"
        refused = SetParametersResult(successful=False, reason=why[:200])
        response = type(response)()
        if hasattr(response, "results"):
            response.results = [refused] * min(len(parts), _MOST_AT_ONCE)
        elif isinstance(getattr(response, "result", None), SetParametersResult):
            response.result = refused
        return response

    return safely
