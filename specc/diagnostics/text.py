"""A report for people: code, place, the line with a caret, related places and a way out."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import accumulate

from specc.diagnostics.phrases import counted
from specc.diagnostics.report import Finding, RenderedLocation, Report
from specc.diagnostics.visible import visible, width
from specc.source import Span

MAX_COLUMNS = 100
_NARROWEST = 20
_RESET = "\x1b[0m"
_COLOURS = {
    "error": "\x1b[1;31m",
    "warning": "\x1b[1;33m",
    "open": "\x1b[1;36m",
    "note": "\x1b[1;34m",
    "bold": "\x1b[1m",
}
Paint = Callable[[str, str], str]
"""Gives a text the colour of a style."""


def render(report: Report, colour: bool = False, columns: int = 2 * MAX_COLUMNS) -> str:
    """Format the findings, open points last, and a summary.

    ANSI colours only if `colour`; lines of files are cut to fit a terminal of `columns`.
    """

    def paint(style: str, text: str) -> str:
        return f"{_COLOURS[style]}{text}{_RESET}" if colour and text else text

    # Open points stand behind all that is wrong.
    ordered = sorted(report.shown, key=lambda finding: finding.diagnostic.severity == "open")
    blocks = ["\n".join(_finding(finding, paint, columns)) for finding in ordered]
    return "\n\n".join([*blocks, _summary(report)]) + "\n"


def _finding(finding: Finding, paint: Paint, columns: int) -> Iterator[str]:
    diagnostic = finding.diagnostic
    numbers = [location.span.line for location in (finding.primary, *finding.related)]
    margin = len(str(max(numbers)))
    indent, equals = " " * margin, paint("note", "=")
    room = max(_NARROWEST, min(columns - margin - len(" | "), MAX_COLUMNS))
    head = paint(diagnostic.severity, f"{diagnostic.severity}[{diagnostic.code}]")
    yield f"{head}{paint('bold', f': {visible(diagnostic.message)}')}"
    yield from _location(finding.primary, "-->", "^", diagnostic.severity, margin, room, paint)
    for location in finding.related:
        yield from _location(location, ":::", "-", "note", margin, room, paint)
    if diagnostic.example:
        yield f"{indent} {equals} for example: {visible(diagnostic.example)}"
    if diagnostic.help:
        first, *more = diagnostic.help.split("\n")
        yield f"{indent} {equals} help: {visible(first)}"
        yield from (f"{indent}         {visible(line)}" for line in more)


def _location(
    location: RenderedLocation,
    arrow: str,
    mark: str,
    style: str,
    margin: int,
    room: int,
    paint: Paint,
) -> Iterator[str]:
    span, indent, bar = location.span, " " * margin, paint("note", "|")
    yield f"{indent}{paint('note', arrow)} {visible(span.file)}:{span.line}:{span.col}"
    if not location.line.strip():
        if location.message:
            yield f"{indent} {bar} {visible(location.message)}"
        return
    shown = excerpt(location.line, span, room)
    yield f"{indent} {bar}"
    yield f"{paint('note', str(span.line).rjust(margin))} {bar} {shown.text}"
    underline = f"{mark * shown.length} {visible(location.message)}".rstrip()
    yield f"{indent} {bar} {' ' * shown.indent}{paint(style, underline)}"


def _summary(report: Report) -> str:
    counts = [counted(report.count("error"), "error"), counted(report.count("warning"), "warning")]
    if points := report.count("open"):
        counts.append(counted(points, "open point"))
    if report.ignored:
        counts.append(f"{report.ignored} ignored")
    shown = f"; {len(report.shown)} of them are shown" if report.not_shown else ""
    return f"{counted(len(report.checked), 'file')} checked: {', '.join(counts)}{shown}"


# The line of a file around a place, cut to a readable width, and the columns to underline.


_CUT = "..."
# What lies further from the start of a span cannot be shown; a file may be one line of megabytes.
_NEAR = 4 * MAX_COLUMNS


@dataclass(frozen=True, slots=True)
class Excerpt:
    """Text of a line as shown, and where and how far to underline it, in terminal columns."""

    text: str
    indent: int
    length: int


def excerpt(line: str, span: Span, columns: int = MAX_COLUMNS) -> Excerpt:
    """The part of `line`, the first line of `span`, that has the start of the span in it.

    It takes at most as many terminal columns.
    """
    start = min(span.col - 1, len(line))
    end = span.end_col - 1 if span.end_line == span.line else len(line.rstrip())
    end = min(max(end, start), len(line))
    before = visible(line[max(start - _NEAR, 0) : start])
    marked = visible(line[start : min(end, start + _NEAR)])
    rest = visible(line[end : end + _NEAR])
    if width(before) + width(marked) + width(rest) > columns:
        if width(marked) > columns // 2:
            marked, rest = _head(marked, columns // 2), ""
        room = columns - width(marked) - min(width(rest), columns // 4)
        before = _head(before[::-1], room)[::-1]
        rest = _head(rest, columns - width(before) - width(marked))
    return Excerpt(before + marked + rest, width(before), max(width(marked), 1))


def _head(text: str, columns: int) -> str:
    """A text, or as much of its beginning as fits, with a mark of the cut."""
    if width(text) <= columns:
        return text
    fitting = sum(used <= columns - len(_CUT) for used in accumulate(map(width, text)))
    return text[:fitting] + _CUT
