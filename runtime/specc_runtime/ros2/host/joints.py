"""The newest number of each joint, where messages have some of the joints each."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from specc_runtime.hosting.devices import DeviceError

_MOST_KNOWN = 1000
"""Names of joints of others that are remembered, to say what there is."""


class _Number(NamedTuple):
    value: float
    measured_s: float
    came_s: float


class JointNumbers:
    """Joins messages of joint states, of one publisher or of several, into those of an element."""

    def __init__(
        self,
        topic: str,
        names: Iterable[str],
        field: str,
        max_gap_s: float | None,
        *,
        is_answered: bool = False,
    ) -> None:
        """`field` has the numbers; none of the joints may be silent for longer than `max_gap_s`.

        If it `is_answered`, that is a value, and no error.
        """
        self.is_changed = False
        """Whether there is something new since the last call of `joined`."""
        self._topic = topic
        self._names = tuple(names)
        self._field = field
        self._max_gap_s = max_gap_s
        self._is_answered = is_answered
        self._numbers: dict[str, _Number] = {}
        self._known: dict[str, None] = {}

    @property
    def known(self) -> list[str]:
        """All joints that messages had so far."""
        return list(self._known)

    @property
    def missing(self) -> list[str]:
        """Joints of the element that no message had so far."""
        return [name for name in self._names if name not in self._numbers]

    def take(self, message: Any, measured_s: float, now_s: float) -> bool:
        """Take a message that came now; whether its `field` has the numbers of its joints."""
        names, numbers = message.name, getattr(message, self._field)
        if len(self._known) < _MOST_KNOWN:
            self._known.update(dict.fromkeys(names))
        found = {name: n for n, name in enumerate(names) if name in self._names}
        for name, n in found.items():
            if n >= len(numbers):
                return False
            self._numbers[name] = _Number(numbers[n], measured_s, now_s)
        self.is_changed |= bool(found)
        return True

    def joined(self, now_s: float) -> tuple[dict[str, Any] | None, float]:
        """The fields of a message with all joints, once none is missing, and when its oldest number
        was measured.

        If a joint has been silent for too long it raises DeviceError, or gives None where that is
        answered.
        """
        self.is_changed = False
        every = [self._numbers[name] for name in self._names]
        for name, number in self._numbers.items():
            gap_s = now_s - number.came_s
            if self._max_gap_s is not None and gap_s > self._max_gap_s:
                if self._is_answered:
                    return None, now_s
                raise DeviceError(
                    f"{self._topic} has had no message with joint {name} for {gap_s:.3g} s, "
                    f"`max_gap` is {self._max_gap_s:g} s"
                )
        fields = {"name": list(self._names), self._field: [number.value for number in every]}
        return fields, min(number.measured_s for number in every)
