"""The operator's panel: what its elements are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PanelKind = Literal["button", "switch", "slider", "choice", "number"]


@dataclass(frozen=True, slots=True)
class PanelElement:
    """One element of the panel, as its specification declares it; numbers are in SI units.

    Attributes:
        name: of the binding, e.g. "desk.R.buttons.start".
        kind: what the operator sees.
        initial: the value until the operator changes it: a bool of a button or a switch, the name
            of a member of a choice, a number of a slider, and of a number, an int if it is whole.
        least: the least value of a slider or a number.
        greatest: the greatest value of a slider or a number.
        choices: the names of the members of a choice.
        hold: whether a button is true while it is held, and not once after it was pressed.
        key: the key of a terminal that operates it; empty if none is given.
        unit: of a slider or a number, e.g. "m/s"; empty if it has none.
        title: the words of the specification for the element; empty if there are none.
    """

    name: str
    kind: PanelKind
    initial: bool | float | str = False
    least: float | None = None
    greatest: float | None = None
    choices: tuple[str, ...] = ()
    hold: bool = False
    key: str = ""
    unit: str = ""
    title: str = ""
