"""What the executor asks of a plant. Implementations live in `specc_runtime.plants`."""

from __future__ import annotations

from typing import Any, Protocol


class Plant(Protocol):
    """The real effectors and receptors, simulated or not. Names are those of the bindings."""

    def reset(self, seed: int) -> None:
        """Back to the initial state; the seed decides all noise from here on."""

    @property
    def time_s(self) -> float:
        """Simulated time."""

    def sample(self, name: str) -> Any:
        """The value of a sensor now."""

    def actuate(self, name: str, value: Any) -> None:
        """Command an actuator from now on."""

    def advance(self, duration_s: float) -> None:
        """Let time pass."""

    def close(self) -> None:
        """Give up what the plant holds."""
