"""What is known of a kind of finding, whatever file it turns up in."""

from dataclasses import dataclass
from typing import Literal

from specc.diagnostics.diagnostic import Severity, severity_of

Within = Literal["", "yaml", "file", "agent", "subsystem"]
"""What an example is.

Nothing: a whole specification, or commands after a `$`. "yaml": any YAML file. The others: keys of
a specification, of an agent, or of a subsystem that has all that the example does not show.
"""


@dataclass(frozen=True, slots=True)
class Code:
    """An entry of the registry.

    `title` names what is wrong; `explanation` says what it means and why it is refused; `failing`
    and `passing` are the smallest examples of a file that has it and of the same file mended, and
    `within` says which part of a file they are.
    """

    id: str
    title: str
    explanation: str
    failing: str
    passing: str
    within: Within = ""

    @property
    def severity(self) -> Severity:
        """Whether a specification is refused because of it."""
        return severity_of(self.id)

    @property
    def is_session(self) -> bool:
        """Whether the examples are commands, not files."""
        return self.failing.startswith("$")
