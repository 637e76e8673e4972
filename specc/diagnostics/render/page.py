"""All codes as a page of Markdown: docs/diagnostics.md is what `specc explain --page` prints."""

from textwrap import fill

from specc.diagnostics.code import Code
from specc.diagnostics.render.explanation import PARTS
from specc.diagnostics.render.visible import visible_lines

_COLUMNS = 100
_HEAD = """\
# Diagnostics

<!-- Printed by `specc explain --page`; the texts are those of specc/diagnostics/codes. -->

Every finding has a code. Codes with E are errors: nothing is generated from a specification that
has one. Codes with W are warnings, which `# specc: ignore[CODE] reason`, `[tool.specc]` in
pyproject.toml and the command line can hold back or make errors (see ci.md).

Codes with O are open points: what is not there yet. But for O0205 they fail nothing but `--strict`;
`specc build` and `specc run` refuse those without which they cannot do their work.

Every example below is tested. One that does not begin with `specc: 1` is part of a file and says of
which part: the rest is `tests/diagnostics/host.yaml`. Lines that begin with `$` are commands.
"""


def page(codes: dict[str, Code]) -> str:
    """The page, with a table of contents and one section a code."""
    contents = "".join(
        f"- [{code.id}](#{code.id.lower()}) {code.title}\n" for code in codes.values()
    )
    return f"{_HEAD}\n{contents}" + "".join(_section(code) for code in codes.values())


def _section(code: Code) -> str:
    part = PARTS[code.within]
    title = code.title[:1].upper() + code.title[1:]
    text = f"**{title}** ({code.severity}). {code.explanation}"
    return (
        f"\n## {code.id}\n\n{fill(text, _COLUMNS)}\n\n"
        f"Refused{part}:\n\n{_example(code.failing, code)}\n"
        f"Accepted{part}:\n\n{_example(code.passing, code)}"
    )


def _example(text: str, code: Code) -> str:
    language = "console" if code.is_session else "yaml"
    return f"```{language}\n{visible_lines(text.strip(chr(10)))}\n```\n"
