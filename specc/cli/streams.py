"""Standard output and error, the formats of what is printed, and the exit codes of reports.

Files and specifications are strangers' texts, and nearly every output has parts of them. It goes
through `print_output` or `print_message`, which let through no character that controls a terminal
and no line that a CI runner would take for a command.
"""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, TextIO

from specc.diagnostics.report import Report, report, resolve
from specc.diagnostics.visible import OutputFormat, sanitize, visible
from specc.source import COMMAND_LINE

if TYPE_CHECKING:
    from specc.pipeline import Result

_REPORTS: tuple[OutputFormat, ...] = ("text", "json", "sarif", "github", "junit")
FORMATS: dict[str, tuple[str, ...]] = {
    "validate": _REPORTS,
    "build": _REPORTS,
    "status": ("text", "json"),
    "ages": ("text", "json"),
    "explore": ("text", "json"),
    "diff": ("text", "markdown", "json"),
    "coverage": _REPORTS,
    "plot": ("svg", "png", "pdf", "csv"),
}
"""What each command can print or write, by default the first; `specc graph` has its own table."""
USAGE_ERROR = 2
"""Exit code for wrong usage, and for a file that cannot be read or written."""
_USUAL_WIDTH = 120


def prepare() -> None:
    """Make the standard streams accept any character, and replace those that are closed.

    What is written to a closed standard output is an error when it is flushed, as it is with other
    commands; nobody would read a message about a closed standard error.
    """
    # In this order, so that each stand-in gets the number of the stream that it stands for.
    if sys.stdin is None:
        sys.stdin = open(os.devnull, encoding="utf-8")  # noqa: SIM115 - stays open to the end
    if sys.stdout is None:
        descriptor = os.open(os.devnull, os.O_RDONLY)
        sys.stdout = open(descriptor, "w", encoding="utf-8")  # noqa: SIM115 - stays open
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: SIM115 - stays open
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")


def discard_buffer(stream: TextIO) -> None:
    """Discard what a stream still holds: Python flushes it once more at exit."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def print_output(text: str, form: OutputFormat = "text", *, to: TextIO | None = None) -> None:
    """Print to standard output, or to another stream."""
    (to or sys.stdout).write(sanitize(text, form))


def print_message(message: str) -> None:
    """Print a message to standard error, if it takes one."""
    try:
        sys.stderr.write(sanitize(f"{message}\n"))
        sys.stderr.flush()
    except OSError:
        discard_buffer(sys.stderr)


def update_status_line(message: str) -> None:
    """Put a line in the place of the last one on the terminal behind standard error."""
    with contextlib.suppress(OSError):
        sys.stderr.write(f"\r\x1b[2K{sanitize(message)}")
        sys.stderr.flush()


def format_table(rows: Sequence[Sequence[str]]) -> str:
    """Rows as lines, their cells below each other."""
    shown = [[visible(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    lines = ("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in shown)
    return "".join(f"{line.rstrip()}\n" for line in lines)


def as_json(version: int, system: str, **parts: Any) -> str:
    """What is known of a system as an indented JSON text."""
    import json  # most commands print no JSON

    return json.dumps({"version": version, "system": system, **parts}, indent=2) + "\n"


def print_report(found: Report, form: OutputFormat = "text") -> int:
    """Print a report; its exit code.

    JSON and other formats for programs go to standard output, text to standard error, as wide as
    the terminal takes it, and in colour unless NO_COLOR says no (no-color.org).
    """
    from specc.diagnostics import formats, text  # commands without findings print no report

    if render := formats.RENDERERS.get(form):
        print_output(render(found), form)
        return exit_code(found)
    is_plain = os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb"
    colour = sys.stderr.isatty() and not is_plain
    try:
        columns = os.get_terminal_size(sys.stderr.fileno()).columns or _USUAL_WIDTH
    except (OSError, ValueError):
        columns = _USUAL_WIDTH
    shown = text.render(found, colour, columns)
    if colour:
        sys.stderr.write(shown)  # its parts are harmless; nobody but a person reads a terminal
    else:
        print_output(shown, to=sys.stderr)
    return exit_code(found)


def print_findings(result: Result, path: str, form: OutputFormat = "text") -> int:
    """Print what was found in the specification at a path; its exit code."""
    return print_report(report(resolve(result.diagnostics, result.sources), [path]), form)


# Open, but possibly a typo: a reference to what is not there.
DANGLING = frozenset(("O0205",))
# Not faults of a specification: a file that gives no text or takes none.
_UNREADABLE = frozenset(("E0001", "E0004", "E0005", "E0090", "E0091"))


def exit_code(found: Report) -> int:
    """What a report stands for: 0 clean, 1 errors, 2 wrong usage or an unreadable file."""
    diagnostics = [finding.diagnostic for finding in found.findings]
    for each in diagnostics:
        is_argument = each.primary.file in COMMAND_LINE and each.severity != "warning"
        if is_argument or each.code in _UNREADABLE:
            return USAGE_ERROR
    is_dangling = any(one.code in DANGLING for one in diagnostics)
    return 1 if is_dangling or found.count("error") else 0
