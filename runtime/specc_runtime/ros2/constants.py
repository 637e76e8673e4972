"""Constants that may change, which others in ROS see and set as parameters of the node."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from specc_runtime.changes import PARAMETER
from specc_runtime.live import Change
from specc_runtime.ros2.run import Ros2Run
from specc_runtime.system import LiveConstant

Requests = Mapping[str, tuple[int, float]]
"""By constants: the number of the last request of others, and the value."""


class Constants:
    """Passes on what others ask for, and tells the node what the constants are."""

    def __init__(self, run: Ros2Run, tell: Callable[[dict[str, Any]], None]) -> None:
        self._run = run
        self._tell = tell
        self._numbers = dict.fromkeys(run.live, 0)
        """Of the last requests of others that the run has got."""
        self._now = {name: (0, value) for name, value in run.live.items()}
        """Of the last requests that have taken effect, and the values."""
        self._is_news = False

    def take(self, requests: Requests) -> None:
        """Have the run change what others have asked for since the last time, at its next tick."""
        for name, (number, value) in requests.items():
            if number > self._numbers[name]:
                self._numbers[name] = number
                self._run.set_constant(name, value, PARAMETER)

    def changed(self, change: Change) -> None:
        """A change takes effect, whoever has made it."""
        name = change.constant
        is_request = change.by == PARAMETER
        self._now[name] = self._numbers[name] if is_request else self._now[name][0], change.value
        self._is_news = True

    def tell(self) -> None:
        """Tell the node what has changed, and which requests are in it."""
        if self._is_news:
            self._is_news = False
            self._tell(dict(self._now))


def constants_config(constants: Iterable[LiveConstant]) -> list[dict[str, Any]]:
    """What the node is told of them, for its parameters: plain data, in SI units."""
    return [
        {
            "name": each.name,
            "value": each.initial,
            "least": each.least,
            "greatest": each.greatest,
            "unit": each.unit,
            "title": each.title,
        }
        for each in constants
    ]
