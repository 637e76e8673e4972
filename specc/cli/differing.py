"""`specc diff`: its arguments, and comparing two specifications."""

from __future__ import annotations

import argparse
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from specc.diagnostics import Diagnostic

DIFF_FORMATS = ("text", "markdown", "json")


def add_diff(commands: Any) -> None:
    """Add the command to the parser's subcommands."""
    parser = commands.add_parser("diff", help="say what changed in what a specification means")
    parser.add_argument("old", metavar="OLD")
    parser.add_argument("new", metavar="NEW")
    parser.add_argument("--format", choices=DIFF_FORMATS, default="text")


def run_diff(options: argparse.Namespace) -> int:
    """Print how two specifications differ; 0 if they mean the same, 1 if not or with errors."""
    from specc import pipeline
    from specc.cli import streams
    from specc.cli.streams import tell
    from specc.diagnostics.report import report, resolve
    from specc.tools.diff import compare

    results = [pipeline.read_spec(path) for path in (options.old, options.new)]
    findings = [f for r in results for f in resolve(r.diagnostics, r.sources)]
    wrong = [finding for finding in findings if _hides_meaning(finding.diagnostic)]
    old, new = (result.system for result in results)
    if wrong or old is None or new is None:
        return tell(report(wrong, [options.old, options.new]))
    comparison = compare(old, new)
    render = getattr(import_module("specc.tools.diff.render"), f"as_{options.format}")
    streams.show(render(comparison, options.old, options.new), options.format)
    return 1 if comparison.differences else 0


def _hides_meaning(diagnostic: Diagnostic) -> bool:
    """Whether what is found leaves open what the specification means: a name may be a slip."""
    return diagnostic.severity == "error" or diagnostic.code == "O0205"
