"""What is wrong with a value that came from outside, and who gave it."""

from __future__ import annotations

from typing import Any

import numpy as np

_SHOWN = 40


class Unfit(Exception):
    """A value, or the part of it at `path`, is not of its type.

    `came` says what it is, `wanted` what it has to be.
    """

    def __init__(self, came: str, wanted: str, path: str = "") -> None:
        super().__init__(came, wanted, path)
        self.came = f"{came} as {path}" if path else came
        self.wanted = wanted
        self._parts = came, wanted, path

    def inside(self, part: str) -> Unfit:
        """The same, of a part of a value."""
        came, wanted, path = self._parts
        return Unfit(came, wanted, part + path)


class Blamed(Exception):
    """Code outside of the generated code broke a rule; `origin` names it."""

    def __init__(self, origin: str, what: str) -> None:
        super().__init__(f"{origin} {what}")
        self.origin = origin


class WrongValue(Blamed):
    """What came from outside is not of its declared type.

    `declared` is that type in the specification's words, `trace` where it comes from (equation).
    """

    def __init__(self, origin: str, declared: str, unfit: Unfit, trace: str = "") -> None:
        where = f", {trace}" if trace else ""
        what = f"gave {unfit.came}, but {declared} is declared{where}: give {unfit.wanted}"
        super().__init__(origin, what)
        self.declared = declared
        self.came = unfit.came
        self.trace = trace


def value_text(value: Any) -> str:
    """What a value is, in a few words; no code of its class is executed."""
    kind = type(value)
    if value is None or kind is bool:
        return repr(value)
    if kind is str:
        return f"the text {value[:_SHOWN]!r}"
    if kind is float or (kind is int and value.bit_length() <= 64):
        return f"the {kind.__name__} {value!r}"
    if kind is np.ndarray:
        return f"an array {value.shape} of {value.dtype}"
    if kind in (list, tuple):
        return f"a {kind.__name__} of {len(value)}"
    return f"a value of class {kind.__name__}"
