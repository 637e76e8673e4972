"""Types and operators that imported subsystems need, and the Python modules behind them."""

from __future__ import annotations

from dataclasses import dataclass, field

from specc.importers.names import Names
from specc.importers.yaml import Data

PARTS = "_parts"
"""The module with the predicates and components of subsystem `a` is `a_parts`."""


@dataclass(slots=True)
class Library:
    """Types and operators of all subsystems, as data of the YAML."""

    types: dict[str, Data] = field(default_factory=dict)
    operators: dict[str, Data] = field(default_factory=dict)
    modules: dict[str, None] = field(default_factory=dict)
    """Python modules that the user provides, in order of appearance."""
    names: Names = field(default_factory=Names)

    def message(self, type: str) -> str:
        """The name of a message type of ROS, which is opaque."""
        name = self.names.of(type)
        if name not in self.types:
            self.types[name] = {"opaque": True, "python": self._python(type), "title": type}
        return name

    def empty(self, type: str) -> str:
        """The expression of an empty message, which stands before the first one."""
        name = self.names.of(f"empty {self.names.of(type)}")
        self.operators[name] = {
            "signature": f"() -> {self.message(type)}",
            "python": self._python(type),
            "title": "an empty message",
        }
        return f"{name}()"

    def _python(self, type: str) -> str:
        package, _, message = type.partition("::")
        self.modules[f"{package}.msg"] = None
        return f"{package}.msg:{message}"

    def opaque(self, name: str, module: str, title: str) -> str:
        """A type that only operators look into; its name."""
        own = self.names.of(f"{module.removesuffix(PARTS)} {name}")
        self.modules[module] = None
        self.types[own] = {"opaque": True, "python": f"{module}:{name}", "title": title}
        return own

    def operator(self, name: str, module: str, signature: str, title: str) -> str:
        """An operator; its name."""
        own = self.names.of(f"{module.removesuffix(PARTS)} {name}")
        python = f"{module}:{name}"
        self.operators[own] = {"signature": signature, "python": python, "title": title}
        return own
