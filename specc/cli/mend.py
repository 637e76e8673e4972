"""`specc validate --fix`: makes the repairs that findings carry, file by file."""

from __future__ import annotations

import os
import shlex
import tomllib
from collections.abc import Callable, Iterable, Sequence

from specc.cli import streams
from specc.cli.rewrite import rewrite
from specc.cli.targets import is_named
from specc.diagnostics.report import Finding, Repair
from specc.read import read_text
from specc.repair import repaired

ROUNDS = 10
"""A repair can bring up what another one hid; more rounds than this would be a circle."""
_MARK = "\ufeff"


def mend(findings: Iterable[Finding], arguments: Sequence[str]) -> bool:
    """Make the repairs of findings in files that arguments name, and say which; whether any was.

    Raises:
        OSError: a file cannot be written; those before it are mended.
    """
    found = by_file(findings)
    made = [_mend(path, wanted) for path, wanted in found.items() if is_named(path, arguments)]
    return any(made)


def report_left(findings: Iterable[Finding], arguments: Sequence[str]) -> None:
    """Say which files could be mended but were not named, and how to have them mended."""
    for path, wanted in by_file(findings).items():
        if is_named(path, arguments):
            continue
        repairs = "1 repair" if len(wanted) == 1 else f"{len(wanted)} repairs"
        name = (os.path.dirname(path) or ".") if path.endswith(".toml") else path
        command = shlex.join(["specc", "validate", "--fix", *arguments, name])
        streams.say(f"not mended, since it was not named: {path} ({repairs}); `{command}`")


def by_file(findings: Iterable[Finding]) -> dict[str, dict[Repair, Finding]]:
    """Repairs that findings carry, each once, by the file that they change."""
    found: dict[str, dict[Repair, Finding]] = {}
    seen: dict[object, str] = {}
    for finding in findings:
        if (repair := finding.repair) is None:
            continue
        # A file that was read under two names is still one file.
        real = os.path.realpath(repair.file)
        path = seen.setdefault(real, repair.file)
        edits = real, tuple((change.start, change.end, change.text) for change in repair.changes)
        if edits not in seen:
            seen[edits] = path
            found.setdefault(path, {})[repair] = finding
    return found


def _mend(path: str, wanted: dict[Repair, Finding]) -> bool:
    with open(path, encoding="utf-8", newline="") as file:
        text = file.read()
    mark = _MARK if text.startswith(_MARK) else ""
    result = repaired(text.removeprefix(_MARK), wanted, _accepts(path))
    if result.made:
        rewrite(path, mark + result.text)
    for repair in result.made:
        line = repair.changes[0].span.line
        code = wanted[repair].diagnostic.code
        streams.say(f"mended {path}:{line}: {code}: {repair.title}")
    return bool(result.made)


def _accepts(path: str) -> Callable[[str], bool]:
    return _is_toml if path.endswith(".toml") else _is_yaml


def _is_yaml(text: str) -> bool:
    return read_text("mended", text).ok


def _is_toml(text: str) -> bool:
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    return True
