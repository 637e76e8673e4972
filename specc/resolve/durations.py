"""Lengths of time in the texts of a specification."""

from __future__ import annotations

import re
from fractions import Fraction

from specc.model.units import UnitError, parse_unit
from specc.resolve.context import Findings, Where

# A Fraction of `1e999999999` is computed digit by digit.
_DURATION = re.compile(r"\s*(\d{1,12}(?:\.\d{1,12})?)\s+([a-z]+)\s*", re.ASCII)


def duration_of(text: str, where: Where, findings: Findings) -> Fraction | None:
    """Seconds from `20 ms` or `0.5 s`; None after reporting."""
    found = _DURATION.fullmatch(text)
    if found:
        number, unit_text = found.groups()
        try:
            unit = parse_unit(unit_text)
        except UnitError:
            unit = None
        if unit and unit.same_kind(parse_unit("s")) and Fraction(number) > 0:
            return Fraction(number) * Fraction(unit.scale).limit_denominator(10**9)
    findings.report(
        "E0107",
        f"`{text}` is not a length of time",
        where.place,
        help="write it with its unit, e.g. `20 ms` or `0.5 s`",
    )
    return None
