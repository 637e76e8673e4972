"""`specc fmt`: the canonical layout of files, written, compared or shown as a difference."""

from __future__ import annotations

import difflib
from argparse import Namespace
from collections.abc import Iterator

from specc.cli import streams
from specc.cli.rewrite import refusal, rewrite
from specc.cli.targets import targets
from specc.diagnostics.report import Finding, resolve, shown_path
from specc.policy import reach_of
from specc.read import read_file, specification
from specc.source import Sources


def run(options: Namespace) -> tuple[list[Finding], list[str], bool]:
    """Format files: findings about those that cannot be, the others, and whether any differs."""
    meant = targets(options.files)
    findings = resolve(meant.faults, Sources())
    changed, readable, files = [], 0, [*meant.systems, *meant.parts]
    for path in files:
        reach = reach_of(path)
        if not reach.holds(path):
            findings += resolve([reach.link_out(path)], Sources())
            continue
        document = specification(read_file(path))
        if not document.ok:
            findings += resolve(document.diagnostics, Sources([document.source]))
            continue
        readable += 1
        old = document.source.text
        new = _formatted(old)
        if new == old:
            continue
        changed.append(path)
        if options.diff:
            streams.show("".join(_difference(path, old, new)))
        if not (options.check or options.diff):
            try:
                rewrite(path, new)
            except OSError as error:
                findings += resolve([refusal(error)], Sources())
    if readable:
        _summarise(changed, readable, options.check or options.diff)
    return findings, files, bool(changed)


def _formatted(text: str) -> str:
    from specc.fmt import formatted

    return formatted(text)


def _difference(path: str, old: str, new: str) -> Iterator[str]:
    name = shown_path(path)
    before, after = old.splitlines(keepends=True), new.splitlines(keepends=True)
    for line in difflib.unified_diff(before, after, f"{name} (now)", f"{name} (formatted)"):
        yield line if line.endswith("\n") else f"{line}\n"


def _summarise(changed: list[str], files: int, only_looked: bool) -> None:
    what = "would be formatted" if only_looked else "formatted"
    for path in changed:
        streams.say(f"{what}: {shown_path(path)}")
    same = files - len(changed)
    streams.say(f"{len(changed)} of {files} {what}, {same} left as they are")
