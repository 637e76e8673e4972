"""Where in the paper (or any other document) a part of a specification comes from."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Trace:
    """Equation numbers, tables and figures; empty where a part has none."""

    eq: tuple[int, ...] = ()
    table: tuple[int, ...] = ()
    fig: tuple[int, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.eq or self.table or self.fig)

    def __str__(self) -> str:
        """`eq. 5`, `eqs 76, 77; Table 11`, or the empty text."""
        parts = (
            _numbered("eq.", "eqs", self.eq),
            _numbered("Table", "Tables", self.table),
            _numbered("Fig.", "Figs", self.fig),
        )
        return "; ".join(p for p in parts if p)


def _numbered(one: str, many: str, numbers: tuple[int, ...]) -> str:
    if not numbers:
        return ""
    return f"{one if len(numbers) == 1 else many} {', '.join(map(str, numbers))}"
