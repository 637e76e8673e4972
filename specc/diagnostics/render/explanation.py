"""The entry of a code as `specc explain` prints it."""

from textwrap import fill, indent

from specc.diagnostics.code import Code
from specc.diagnostics.render.visible import visible_lines

_COLUMNS = 80
PARTS = {
    "": "",
    "yaml": "",
    "file": ", in a specification",
    "agent": ", in an agent",
    "subsystem": ", in a subsystem",
}
"""Words for the part of a file that an example is."""


def explanation(code: Code) -> str:
    """Title, reason, a failing and a passing example."""
    part = PARTS[code.within]
    return (
        f"{code.id} ({code.severity}): {code.title}\n\n"
        f"{fill(code.explanation, _COLUMNS)}\n\n"
        f"Refused{part}:\n\n{_example(code.failing)}\n\n"
        f"Accepted{part}:\n\n{_example(code.passing)}\n"
    )


def overview(codes: dict[str, Code]) -> str:
    """One line a code."""
    return "".join(f"{code.id}  {code.title}\n" for code in codes.values())


def _example(text: str) -> str:
    return indent(visible_lines(text.strip("\n")), "    ")
