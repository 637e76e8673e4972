"""What the executor asks of a plant. Implementations live in `specc_runtime.plants`."""

from __future__ import annotations

from enum import Enum
from typing import Any, Final, Protocol


class NoSample(Enum):
    """The type of `NO_SAMPLE`."""

    NO_SAMPLE = "no sample"


NO_SAMPLE: Final = NoSample.NO_SAMPLE
"""What a plant gives for an element that is bound as sporadic and has no new value."""


class Plant(Protocol):
    """The real effectors and receptors, simulated or not.

    Names are those of elements, `agent.E.device.element` and `agent.R.device.element`; values are
    of their declared types. A plant that cannot go on raises `PlantError`, which ends the run.
    """

    def reset(self, seed: int) -> None:
        """Back to the initial state; the seed decides all noise from here on."""

    def sample(self, name: str) -> Any:
        """The value of an element that a device reports, now; `NO_SAMPLE` if none is new.

        Called once at each time stamp of its readers, or at its rate.
        """

    def actuate(self, name: str, value: Any) -> None:
        """What a device is commanded, from now on."""

    def advance(self, duration_s: float) -> None:
        """Let time pass: one base tick of the system."""

    def close(self) -> None:
        """Give up what the plant holds; called once, however the run ended."""


class Pictured(Protocol):
    """What a plant that can be filmed has besides."""

    def picture(self, camera: str, width: int, height: int) -> Any:
        """What a camera for people sees now: an array (height, width, 3) of uint8, RGB."""


class Viewable(Protocol):
    """What a plant that can be looked at in a window has besides."""

    def open_viewer(self) -> Any:
        """A window with `sync()`, `is_open` and `close()`."""
