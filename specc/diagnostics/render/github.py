"""A report as workflow commands of GitHub Actions, which show as annotations in a pull request."""

from specc.diagnostics.render.visible import visible, visible_lines
from specc.diagnostics.report import Finding, RenderedLocation, Report

_LEVELS = {"error": "error", "warning": "warning", "open": "notice"}
_DATA = str.maketrans({"%": "%25", "\r": "%0D", "\n": "%0A"})
_PROPERTY = {**_DATA, **str.maketrans({":": "%3A", ",": "%2C"})}


def render(report: Report) -> str:
    """One command a line for each finding."""
    commands = [_command(finding) for finding in report.shown]
    if report.not_shown:
        commands.append(f"::notice title=specc::{report.not_shown} more findings are not shown")
    return "".join(f"{command}\n" for command in commands)


def _place(spot: RenderedLocation) -> str:
    return f"{visible(spot.span.file)}:{spot.span.line}"


def _command(finding: Finding) -> str:
    found, span = finding.diagnostic, finding.primary.span
    properties = {"file": span.file, "line": span.line, "endLine": span.end_line, "col": span.col}
    # Annotations of several lines take no columns.
    if span.line == span.end_line:
        properties["endColumn"] = span.end_col
    else:
        del properties["col"]
    properties["title"] = f"specc {found.code}"
    pairs = ",".join(
        f"{key}={visible(str(value)).translate(_PROPERTY)}" for key, value in properties.items()
    )
    lines = [found.message, *(f"{_place(spot)}: {spot.message}" for spot in finding.related)]
    text = "\n".join([*lines, *found.remarks])
    return f"::{_LEVELS[found.severity]} {pairs}::{visible_lines(text).translate(_DATA)}"
