"""Classes of defaults of an MJCF model, and what an element has by its class.

The outermost class holds for every element without another one, and a class has what the one
around it has. An element belongs to its own `class`, else to the `childclass` of the nearest body
or frame.
"""

from __future__ import annotations

from collections.abc import Mapping

_OUTERMOST = ""
_READ = (
    "actuator camera class ctrllimited ctrlrange cutoff data dim forcelimited forcerange gear "
    "inheritrange joint limited range resolution type"
)
"""All that anybody asks of the attributes of an element; a class may have any number of others."""
_ACTUATORS = "general motor position velocity intvelocity damper cylinder muscle adhesion plugin"


class Defaults:
    """Knows them once the whole model is read."""

    def __init__(self) -> None:
        self._set: dict[str, dict[str, dict[str, str]]] = {}
        self._outer: dict[str, str] = {}
        self._whole: dict[tuple[str, str], dict[str, str]] = {}
        """What each class has with those around it, for a kind of element, once it was asked."""

    def entered(self, tag: str, attributes: Mapping[str, str], around: str, *, inside: bool) -> str:
        """The class that holds inside an element, where another one holds around it.

        `inside` says whether the element stands in a section of defaults.
        """
        if tag != "default":
            return attributes.get("childclass", around)
        if not inside:
            self._outer.setdefault(attributes.get("class", "main"), _OUTERMOST)
            return _OUTERMOST
        name = attributes.get("class", around)
        if name != around:
            self._outer.setdefault(name, around)
        return name

    def set(self, name: str, tag: str, attributes: Mapping[str, str]) -> None:
        """Elements of a class have attributes."""
        own = self._set.setdefault(name, {}).setdefault(_kind(tag), {})
        read = _READ.split()
        own |= {key: value for key, value in attributes.items() if key in read}

    def applied(self, name: str, tag: str, attributes: Mapping[str, str]) -> dict[str, str]:
        """The attributes of an element with those of its class."""
        asked = name, _kind(tag)
        if asked not in self._whole:
            self._whole[asked] = self._of_class(*asked)
        return {**self._whole[asked], **attributes}

    def _of_class(self, name: str, kind: str) -> dict[str, str]:
        found: dict[str, str] = {}
        for _ in range(len(self._outer) + 1):
            found = {**self._set.get(name, {}).get(kind, {}), **found}
            if name == _OUTERMOST:
                break
            name = self._outer.get(name, _OUTERMOST)
        return found


def _kind(tag: str) -> str:
    """Actuators of all kinds share what a class sets."""
    return "actuator" if tag in _ACTUATORS.split() else tag
