"""What is known of a kind of finding, whatever file it turns up in."""

from dataclasses import dataclass

from specc.diagnostics.diagnostic import Severity, severity_of


@dataclass(frozen=True, slots=True)
class Code:
    """An entry of the registry.

    `title` names what is wrong; `explanation` says what it means and why it is refused; `failing`
    and `passing` are the smallest examples of a file that has it and of the same file mended.
    """

    id: str
    title: str
    explanation: str
    failing: str
    passing: str

    @property
    def severity(self) -> Severity:
        """Whether a specification is refused because of it."""
        return severity_of(self.id)
