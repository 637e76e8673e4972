"""A report as JUnit XML, for services that show test results: one test case a file."""

from collections.abc import Iterable
from xml.sax.saxutils import escape, quoteattr

from specc.diagnostics.diagnostic import Severity
from specc.diagnostics.render.visible import visible, visible_lines
from specc.diagnostics.report import Finding, Report
from specc.reachable import grouped

_SEVERITIES: tuple[Severity, ...] = ("error", "warning", "open")


def render(report: Report) -> str:
    """A suite with a case for every file that was checked or has a finding."""
    files = dict.fromkeys([*report.checked, *(item.primary.span.file for item in report.findings)])
    by_file = grouped((item.primary.span.file, item) for item in report.shown)
    cases = "".join(_case(file, by_file.get(file, [])) for file in files)
    failed = len({item.primary.span.file for item in _of(report.findings, "error")})
    if report.not_shown:
        cases += f"<system-out>{report.not_shown} more findings are not shown</system-out>\n"
    counts = f'tests="{len(files)}" failures="{failed}" errors="0"'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<testsuites {counts}>\n<testsuite name="specc" {counts}>\n'
        f"{cases}</testsuite>\n</testsuites>\n"
    )


def _case(file: str, findings: list[Finding]) -> str:
    head = f'<testcase classname="specc" name={quoteattr(visible(file))}'
    errors, warnings, points = (_of(findings, severity) for severity in _SEVERITIES)
    body = ""
    if errors:
        message = quoteattr(visible(errors[0].diagnostic.message))
        body += f"<failure type={quoteattr(errors[0].diagnostic.code)} message={message}>"
        body += f"{_lines(errors)}</failure>\n"
    if warnings or points:
        body += f"<system-out>{_lines([*warnings, *points])}</system-out>\n"
    return f"{head}>\n{body}</testcase>\n" if body else f"{head}/>\n"


def _of(findings: Iterable[Finding], severity: Severity) -> list[Finding]:
    return [item for item in findings if item.diagnostic.severity == severity]


def _lines(findings: list[Finding]) -> str:
    lines = []
    for item in findings:
        found, span = item.diagnostic, item.primary.span
        lines.append(f"{span.file}:{span.line}:{span.col}: {found.code}: {found.message}")
        lines += [f"  {line}" for remark in found.remarks for line in remark.splitlines()]
    return escape(visible_lines("\n".join(lines)))
