"""What the expressions of one file may name: frames, types, constants, files and operators."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from specc.diagnostics import Related
from specc.expr import TypeNames
from specc.model.system import Constant, Operator, Outside
from specc.model.trace import Trace
from specc.model.types import Frame, Type
from specc.resolve.context import Findings
from specc.source import Place

MakeType = Callable[[tuple[Frame, ...]], Type]


@dataclass(slots=True)
class Definitions:
    """Names in force in one file. `frames` maps a name to the frame that it stands for."""

    frames: dict[str, Frame] = field(default_factory=dict)
    frame_titles: dict[Frame, str] = field(default_factory=dict)
    types: dict[str, MakeType] = field(default_factory=dict)
    type_traces: dict[str, Trace] = field(default_factory=dict)
    constants: dict[str, Constant] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    operators: dict[str, Operator] = field(default_factory=dict)
    places: dict[str, Place] = field(default_factory=dict)
    """Kind and name (`type Mode`) -> where it is defined."""
    broken: set[str] = field(default_factory=set)
    """Names whose own definition has an error."""
    given: dict[str, Constant] | None = None
    """The parameters of a described file with their values; None for any other file."""

    @property
    def local(self) -> dict[str, Constant]:
        """Constants that subsystems know by their values only, since they are no system's."""
        if self.given is None:
            return {}
        return {name: c for name, c in self.constants.items() if name not in self.given}

    def names(self, *, variables: bool = False) -> TypeNames:
        """What type texts may name; with `variables`, undeclared frames are variables."""
        return TypeNames(frames=self.frames, types=self.types, variables_allowed=variables)

    def outside(self) -> tuple[Outside, ...]:
        """Constants and files, also those with an error in their definition."""
        found = []
        for label, place in self.places.items():
            kind, name = label.split(" ", 1)
            if kind == "constant":
                found.append(Outside("constant", name, place))
            elif kind == "file":
                found.append(Outside("file", name, place))
        return tuple(found)

    def claim(self, kind: str, name: str, place: Place, findings: Findings) -> bool:
        """Whether `name` is free; reports a second definition with the place of the first."""
        first = self.places.setdefault(f"{kind} {name}", place)
        if first == place:
            return True
        related = (Related(first, "first defined here"),)
        message, help_text = f"{kind} `{name}` is defined twice", "delete or rename one of the two"
        findings.report("E0205", message, place, related=related, help=help_text)
        return False

    def absorb(self, other: Definitions, findings: Findings) -> None:
        """Take in the definitions of a file that this one uses."""
        self.broken |= other.broken
        for label, place in other.places.items():
            kind, name = label.split(" ", 1)
            if self.claim(kind, name, place, findings):
                self._copy(kind, name, other)

    def _copy(self, kind: str, name: str, other: Definitions) -> None:
        match kind:
            case "frame":
                self.frames[name] = other.frames[name]
                self.frame_titles |= other.frame_titles
            case "type":
                self._copy_type(name, other)
            case "constant":
                _move(name, other.constants, self.constants)
            case "file":
                _move(name, other.files, self.files)
            case "operator":
                _move(name, other.operators, self.operators)

    def _copy_type(self, name: str, other: Definitions) -> None:
        _move(name, other.types, self.types)
        _move(name, other.type_traces, self.type_traces)


def _move(name: str, source: dict[str, Any], target: dict[str, Any]) -> None:
    if name in source:
        target[name] = source[name]
