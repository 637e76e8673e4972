"""What is known about a kind of finding: its page in `codes/`, one Markdown file per code."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from textwrap import fill, indent
from typing import Literal

from specc.diagnostics.diagnostic import Severity, severity_of
from specc.diagnostics.visible import visible_lines

PAGES = Path(__file__).with_name("codes")

_FORMER = {
    "E0001": "E0002 E0003",
    "E0022": "E0007",
    "E0017": "E0016",
    "E0009": "E0010 E0015",
    "E0013": "E0008 E0012 E0014",
    "E0104": "E0106 E0107",
    "E0201": "E0202 E0203 E0204 E0209 E0210 E0212 E0214 E0215 E0216 E0217 E0218 E0220 E0223 "
    "E0236 E0320",
    "E0206": "E0207",
    "E0221": "E0231 E0232",
    "E0230": "E0235",
    "E0303": "E0222",
    "E0306": "E0307",
    "E0315": "E0314",
    "E0415": "E0416",
    "E0502": "E0503",
    "E0505": "E0506 E0509 E0510 E0512",
    "E0521": "E0522 E0523",
    "E0801": "E0802",
    "E0803": "E0804 E0805 E0806 E0807 E0808 E0809",
    "E0903": "E0902 E0904",
    "O0201": "O0206",
    "O0202": "O0203 O0204",
}  # fmt: skip
MERGED = {former: code for code, every in _FORMER.items() for former in every.split()}
"""Former codes -> the code that each is part of now; settings and `specc explain` accept them."""

_COLUMNS = 80
_PAGE = (
    r"# (?P<id>[EWO]\d{4}): (?P<title>.+)\n\n(?P<explanation>(?:.+\n)+)\n"
    r"Refused(?: in (?P<within>.+))?:\n\n```\w+\n(?P<failing>(?:.*\n)+?)```\n\n"
    r"Accepted(?: in (?P=within))?:\n\n```\w+\n(?P<passing>(?:.*\n)+?)```\n"
)


@dataclass(frozen=True, slots=True)
class Code:
    """A page.

    `title` names what is wrong; `explanation` says what it means and why it is refused; `failing`
    and `passing` are the smallest examples of a file that has it and of the same file mended, and
    `within` says which part of a file they are.
    """

    id: str
    title: str
    explanation: str
    failing: str
    passing: str
    within: Literal["", "any YAML file", "a specification", "an agent", "a subsystem"] = ""
    """What the examples are.

    Nothing: a whole specification, or commands after a `$`. Otherwise any YAML file, or keys of a
    specification, of an agent, or of a subsystem that has all that the example does not show.
    """

    @property
    def severity(self) -> Severity:
        """Whether a specification is refused because of it."""
        return severity_of(self.id)

    @property
    def is_session(self) -> bool:
        """Whether the examples are commands, not files."""
        return self.failing.startswith("$")


@cache
def all_codes() -> dict[str, Code]:
    """Every code by its id, in the order of ids.

    Raises:
        ValueError: a page does not have the form of a page, or the name of its code.
    """
    codes = {}
    for path in sorted(PAGES.glob("*.md")):
        found = re.fullmatch(_PAGE, path.read_text(encoding="utf-8"))
        if found is None or found["id"] != path.stem:
            raise ValueError(f"{path.name} is not the page of a code")
        explanation = " ".join(found["explanation"].split())
        values = {**found.groupdict(default=""), "explanation": explanation}
        codes[path.stem] = Code(**values)  # type: ignore[arg-type]  # a page says which
    return codes


def explanation(code: Code) -> str:
    """A page as `specc explain` prints it: title, reason, a refused and an accepted example."""
    part = f" in {code.within}" if code.within else ""
    failing, passing = (
        indent(visible_lines(text.strip("\n")), "    ") for text in (code.failing, code.passing)
    )
    return (
        f"{code.id} ({code.severity}): {code.title}\n\n"
        f"{fill(code.explanation, _COLUMNS)}\n\n"
        f"Refused{part}:\n\n{failing}\n\n"
        f"Accepted{part}:\n\n{passing}\n"
    )


def overview(codes: dict[str, Code]) -> str:
    """One line a code."""
    return "".join(f"{code.id}  {code.title}\n" for code in codes.values())
