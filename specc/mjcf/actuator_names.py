"""What actuators without a name are called."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

_ACTED_ON = ("joint", "jointinparent", "tendon", "cranksite", "site", "body")
"""Attributes of an actuator that name the part it acts on."""


class ActuatorNames:
    """Names for the actuators of one file that have none; the simulator gets the same ones.

    An actuator is called after the part that it acts on. Where an actuator has that name, `_2`,
    `_3` and so on follows.
    """

    def __init__(self, named: Iterable[str]) -> None:
        self._taken = set(named)
        self._last: dict[str, int] = {}
        """The number of the last one that acts on a part."""

    def of(self, attributes: Mapping[str, str]) -> str:
        """The name of the next one; empty if the file does not say what it acts on."""
        part = next((attributes[key] for key in _ACTED_ON if attributes.get(key)), "")
        if not part:
            return ""
        number = self._last.get(part, 0) + 1
        while (name := part if number == 1 else f"{part}_{number}") in self._taken:
            number += 1
        self._last[part] = number
        self._taken.add(name)
        return name
