"""A report for people: code, place, the line with a caret, related places and a way out."""

from collections.abc import Callable, Iterator
from functools import partial

from specc.diagnostics.phrases import counted
from specc.diagnostics.render.excerpt import MAX_COLUMNS, excerpt
from specc.diagnostics.render.visible import visible
from specc.diagnostics.report import Finding, RenderedLocation, Report

_NARROWEST = 20
_RESET = "\x1b[0m"
_COLOURS = {
    "error": "\x1b[1;31m",
    "warning": "\x1b[1;33m",
    "open": "\x1b[1;36m",
    "note": "\x1b[1;34m",
    "bold": "\x1b[1m",
}


def render(report: Report, colour: bool = False, columns: int = 2 * MAX_COLUMNS) -> str:
    """What is wrong, what is not there yet, and a summary.

    ANSI colours only if `colour`; lines of files are cut to fit a terminal of `columns`.
    """
    paint: Paint = _coloured if colour else lambda _, text: text
    # Open points stand behind all that is wrong.
    told = sorted(report.shown, key=lambda finding: finding.diagnostic.severity == "open")
    blocks = ["\n".join(_finding(finding, paint, columns)) for finding in told]
    return "\n\n".join([*blocks, _summary(report)]) + "\n"


Paint = Callable[[str, str], str]
"""Gives a text the colour of a style."""


def _coloured(style: str, text: str) -> str:
    return f"{_COLOURS[style]}{text}{_RESET}" if text else text


def _finding(finding: Finding, paint: Paint, columns: int) -> Iterator[str]:
    found = finding.diagnostic
    numbers = [spot.span.line for spot in (finding.primary, *finding.related)]
    margin = len(str(max(numbers)))
    head = paint(found.severity, f"{found.severity}[{found.code}]")
    yield f"{head}{paint('bold', f': {visible(found.message)}')}"
    paint_spot = partial(_spot, margin=margin, room=columns - margin - len(" | "), paint=paint)
    yield from paint_spot(finding.primary, "-->", "^", found.severity)
    for spot in finding.related:
        yield from paint_spot(spot, ":::", "-", "note")
    if found.example:
        yield f"{' ' * margin} {paint('note', '=')} for example: {visible(found.example)}"
    if found.help:
        first, *more = found.help.split("\n")
        yield f"{' ' * margin} {paint('note', '=')} help: {visible(first)}"
        yield from (f"{' ' * margin}         {visible(line)}" for line in more)


def _spot(
    spot: RenderedLocation,
    arrow: str,
    mark: str,
    style: str,
    *,
    margin: int,
    room: int,
    paint: Paint,
) -> Iterator[str]:
    span = spot.span
    place = f"{visible(span.file)}:{span.line}:{span.col}"
    yield f"{' ' * margin}{paint('note', arrow)} {place}"
    if not spot.line.strip():
        if spot.message:
            yield f"{' ' * margin} {paint('note', '|')} {visible(spot.message)}"
        return
    shown = excerpt(spot.line, span, max(_NARROWEST, min(room, MAX_COLUMNS)))
    bar = paint("note", "|")
    yield f"{' ' * margin} {bar}"
    yield f"{paint('note', str(span.line).rjust(margin))} {bar} {shown.text}"
    underline = f"{mark * shown.length} {visible(spot.message)}".rstrip()
    yield f"{' ' * margin} {bar} {' ' * shown.indent}{paint(style, underline)}"


def _summary(report: Report) -> str:
    errors, warnings = report.count("error"), report.count("warning")
    checked = counted(len(report.checked), "file")
    counts = [counted(errors, "error"), counted(warnings, "warning")]
    if points := report.count("open"):
        counts.append(counted(points, "open point"))
    if report.ignored:
        counts.append(f"{report.ignored} ignored")
    shown = f"; {len(report.shown)} of them are shown" if report.not_shown else ""
    return f"{checked} checked: {', '.join(counts)}{shown}"
