"""What a node of ROS shows and changes of a run while it goes on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Protocol

from specc_runtime.faults import Fault


class Ros2Run(Protocol):
    """A `specc_runtime.session.Session`, as far as a node of ROS knows it."""

    @property
    def time_s(self) -> float:
        """Time of the run."""

    @property
    def live(self) -> Mapping[str, float]:
        """The values of live constants."""

    @property
    def faults(self) -> Sequence[Fault]:
        """What stopped the run."""

    def set_constant(self, name: str, value: float, by: str) -> None:
        """Change a live constant; raises ValueError for what it may not be."""

    def operate(self, name: str, value: Any) -> None:
        """Operate an element of the panel; raises ValueError for what it does not take."""

    def late(self) -> Mapping[str, tuple[float, int]]:
        """How late the last step of each subsystem began, in s, and what it had skipped before."""

    def skipped(self) -> Mapping[str, int]:
        """Periods of each subsystem that are over and in which no step began."""

    def entered(self) -> Mapping[str, float]:
        """When each subsystem entered its state, in s of the run."""

    def ages(self) -> Mapping[str, float]:
        """How long ago the last sample of each sensor was measured, in s; inf of a lost device."""
