"""What a node of ROS shows and changes of a run while it goes on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

from specc_runtime.companion import View
from specc_runtime.faults import Fault


class Run(Protocol):
    """A `specc_runtime.session.Session`, as far as a node of ROS knows it."""

    @property
    def live(self) -> Mapping[str, float]:
        """The values of live constants."""

    @property
    def faults(self) -> Sequence[Fault]:
        """What stopped the run."""

    def set_constant(self, name: str, value: float, by: str) -> None:
        """Change a live constant; raises ValueError for what it may not be."""

    def view(self) -> View:
        """The run as it is now, with the state of each subsystem."""

    def late(self) -> Mapping[str, tuple[float, int]]:
        """How late the last step of each subsystem began, in s, and the periods it has skipped."""

    def entered(self) -> Mapping[str, float]:
        """When each subsystem entered its state, in s of the run."""

    def ages(self) -> Mapping[str, float]:
        """How long ago the last sample of each sensor was measured, in s."""
