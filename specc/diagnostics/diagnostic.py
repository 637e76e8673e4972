"""A finding as a value: what is wrong, where, and a way out; no lines, columns or colours."""

from dataclasses import dataclass
from typing import Literal

from specc.source import Place

Severity = Literal["error", "warning"]


@dataclass(frozen=True, slots=True)
class Related:
    """A second place that a finding speaks of, with a few words on its part in it."""

    place: Place
    message: str


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """A finding; `code` is an entry of the registry and `label` stands at the caret."""

    code: str
    message: str
    primary: Place
    label: str = ""
    related: tuple[Related, ...] = ()
    help: str = ""

    @property
    def severity(self) -> Severity:
        """Whether the specification is refused because of this."""
        return severity_of(self.code)


def severity_of(code: str) -> Severity:
    """Severity that the first letter of a code stands for: E is an error, W a warning."""
    return "warning" if code.startswith("W") else "error"
