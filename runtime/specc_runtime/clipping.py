"""Commands that the actuators of a plant could not obey, as the report has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from specc_runtime.examination import shortcomings


class Clipping(Protocol):
    """What a plant has in addition that counts the commands which its actuators could not obey."""

    def clipped(self) -> Mapping[str, Mapping[str, Any]]:
        """By the elements with such commands: in how many `ticks`, and `first_s`, when first.

        Then the `value` was beyond the `range` of the `actuator`, or `of` what it moves.
        """


def clipped_data(plant: Any, tick_s: float) -> dict[str, dict[str, Any]]:
    """The entry of each element, by the first tick; none of a plant that does not count."""
    if plant is None or shortcomings(plant, Clipping):
        return {}
    found = sorted(plant.clipped().items(), key=lambda pair: pair[1]["first_s"])
    return {
        name: {
            **each,
            "first_s": round(each["first_s"], 9),
            "time_s": round(each["ticks"] * tick_s, 9),
        }
        for name, each in found
    }
