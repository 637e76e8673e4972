"""Constants that may change, which others in ROS see and set as parameters of the node."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from specc_runtime.changes import PARAMETER
from specc_runtime.ros2.run import Run
from specc_runtime.system import LiveConstant

Asked = Mapping[str, tuple[int, float]]
"""By constants: the number of the last request of others, and the value."""


class Constants:
    """Passes on what others ask for, and tells the node what the constants are."""

    def __init__(self, run: Run, tell: Callable[[dict[str, Any]], None]) -> None:
        self._run = run
        self._tell = tell
        self._numbers = dict.fromkeys(run.live, 0)
        """Of the last requests of others that the run has got."""
        self._told = self._now()

    def take(self, asked: Asked) -> None:
        """Have the run change what others have asked for since the last time, at its next tick."""
        for name, (number, value) in asked.items():
            if number > self._numbers[name]:
                self._numbers[name] = number
                self._run.set_constant(name, value, PARAMETER)

    def tell(self) -> None:
        """Tell the node what has changed, by whomever; what was taken before has taken effect."""
        now = self._now()
        if now != self._told:
            self._told = now
            self._tell(now)

    def _now(self) -> dict[str, Any]:
        return {name: (self._numbers[name], value) for name, value in self._run.live.items()}


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
