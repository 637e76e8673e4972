"""What is said about a text that is no unit, and which unit was surely meant."""

from __future__ import annotations

from specc.diagnostics.nearest import nearest, surely_meant
from specc.expr.errors import ExprError, one_of
from specc.model.units import UNITS, UnitError

_LONG_ENOUGH = 3
_WRITTEN_OUT = {
    "sec": "s",
    "second": "s",
    "meter": "m",
    "metre": "m",
    "degree": "deg",
    "radian": "rad",
    "newton": "N",
    "hertz": "Hz",
    "rpm": "turn/min",
}


def unit_error(error: UnitError, end: int, example: str) -> ExprError:
    """The finding about a unit, whose last character stands before `end` if it does not say."""
    word = error.name.casefold()
    meant = _WRITTEN_OUT.get(word) or _WRITTEN_OUT.get(word.removesuffix("s"))
    close = [meant] if meant else nearest(error.name, UNITS) if error.name else []
    help = f"did you mean {one_of(close)}?" if close else f"for example {example}"
    end = end if error.end is None else error.end
    found = ExprError(error.message, error.start, end, help, "E0304")
    found.repair = _surely_meant(error.name)
    return found


def _surely_meant(name: str) -> str:
    """The only unit that a name can be a slip of without another prefix: `mm` is no slip of `m`."""
    same = [unit for unit in UNITS if unit.casefold() == name.casefold()]
    if same:
        # `MN` is a million newtons, not a thousandth of one.
        mega = name.startswith("M") and same[0].startswith("m") and len(name) > 1
        return same[0] if len(same) == 1 and not mega else ""
    return surely_meant(name, [u for u in UNITS if u[:1] == name[:1]], _LONG_ENOUGH)
