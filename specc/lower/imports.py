"""What a generated module imports, collected while it is lowered; the formatter sorts it."""

from __future__ import annotations


class Imports:
    """Names from modules, in order of their first use."""

    def __init__(self) -> None:
        self._lines: dict[str, None] = {}

    def add(self, module: str, name: str, alias: str = "") -> str:
        """Import `name`; the name it has here."""
        alias = alias or name
        renamed = f" as {alias}" if alias != name else ""
        self._lines[f"from {module} import {name}{renamed}"] = None
        return alias

    @property
    def lines(self) -> tuple[str, ...]:
        """Import statements."""
        return tuple(self._lines)
