"""`specc diff`: its arguments, and comparing two specifications."""

from __future__ import annotations

import argparse
import os
import sys
from importlib import import_module
from typing import Any

DIFF_FORMATS = ("text", "markdown", "json")


def add_diff(commands: Any) -> None:
    """Add the command to the parser's subcommands."""
    parser = commands.add_parser("diff", help="say what changed in what a specification means")
    parser.add_argument("old", metavar="OLD")
    parser.add_argument("new", metavar="NEW")
    parser.add_argument("--format", choices=DIFF_FORMATS, default="text")


def run_diff(options: argparse.Namespace) -> int:
    """Print how two specifications differ; 0 if they mean the same, 1 if not, 2 if unreadable."""
    from specc import pipeline
    from specc.diagnostics.render import text
    from specc.diagnostics.report import report, resolve
    from specc.difference import compare

    results = [pipeline.read_spec(path) for path in (options.old, options.new)]
    if any(not result.ok for result in results):
        findings = [f for r in results for f in resolve(r.diagnostics, r.sources)]
        colour = sys.stderr.isatty() and "NO_COLOR" not in os.environ
        paths = [options.old, options.new]
        sys.stderr.write(text.render(report(findings, paths), colour=colour))
        return 2
    old, new = (result.system for result in results)
    assert old is not None and new is not None  # no errors, so both have a meaning
    comparison = compare(old, new)
    renderer = import_module(f"specc.difference.render.{options.format}")
    sys.stdout.write(renderer.render(comparison, options.old, options.new))
    return 1 if comparison.differences else 0
