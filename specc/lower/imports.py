"""What a generated module imports, collected while it is lowered; the formatter sorts it."""

from __future__ import annotations

from specc.lower.names import Names


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


class Functions:
    """Imports functions of operators and bindings, `module:name`; two of one name get two names."""

    def __init__(self, imports: Imports, names: Names) -> None:
        self._imports = imports
        self._names = names
        self._known: dict[tuple[str, str], str] = {}

    def use(self, python: str) -> str:
        """What stands for the function here; a method keeps the path below its class."""
        module, _, attribute = python.partition(":")
        first, dot, rest = attribute.partition(".")
        if (module, first) not in self._known:
            alias = self._imports.add(module, first, self._names.new(first))
            self._known[module, first] = alias
        return self._known[module, first] + dot + rest
