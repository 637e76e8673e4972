"""One generated subsystem by itself, stepped with inputs that a test gives."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from specc_runtime.buffers import FRESH, PRESENT, lower_flags, setter, slots
from specc_runtime.subsystem import Subsystem


class Stepper:
    """Feeds a subsystem and steps it. Elements of `x` and of memory go by their attributes."""

    def __init__(self, subsystem: Subsystem) -> None:
        """`subsystem` is at its beginning."""
        self.subsystem = subsystem
        self._lower_fresh = lower_flags(subsystem.x)

    def feed(
        self, arrives: Mapping[str, Any], there: Mapping[str, Any], absent: Collection[str]
    ) -> None:
        """The inputs of the next period: fresh ones, old ones, and those without a value.

        All others keep their values, and are not fresh.
        """
        x = self.subsystem.x
        for name, value in there.items():
            setter(x, name)(value)
        self._lower_fresh()
        for name, value in arrives.items():
            setter(x, name)(value)
        for name in absent:
            self._remove(name)

    def _remove(self, name: str) -> None:
        x = self.subsystem.x
        if hasattr(x, name):
            delattr(x, name)
        for flag in {FRESH + name, PRESENT + name}.intersection(slots(x)):
            setattr(x, flag, False)

    def step(self) -> int:
        """The row taken in the next period, or -1; raises what the generated code raises."""
        self.subsystem.violations = ()
        return self.subsystem.step()

    def skip(self, periods: int) -> None:
        """Let whole periods pass without a step."""
        self.subsystem.skip(periods)

    def place(self, state: str, method: str) -> None:
        """Put it into a state, which `method` of the generated class works in."""
        self.subsystem.state = state
        vars(self.subsystem)["_work"] = getattr(self.subsystem, method)

    def settle(self) -> None:
        """Take over all memory as it is: some of the class is made of it, in the first period."""
        if (settle := getattr(self.subsystem, "_settle", None)) is not None:
            settle()

    def lasted(self, periods: int) -> None:
        """Let the state have lasted some periods when its conditions are asked next."""
        own = vars(self.subsystem)
        if "_periods" in own:  # else nothing asks for the time
            own["_periods"] = periods - 1


def array(value: Any) -> Any:
    """Numbers nested in tuples as arrays of the runtime."""
    return np.array(value)
