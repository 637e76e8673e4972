"""`specc validate --fix`: makes the repairs that findings carry, file by file."""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Callable, Iterable

from specc.cli.rewrite import rewrite
from specc.diagnostics.report import Finding, Repair
from specc.read import read_text
from specc.repair import repaired

ROUNDS = 10
"""A repair can bring up what another one hid; more rounds than this would be a circle."""
_MARK = "\ufeff"


def mend(findings: Iterable[Finding]) -> bool:
    """Make the repairs of findings in their files and say which; whether any was made.

    Raises:
        OSError: a file cannot be written; those before it are mended.
    """
    by_file: dict[str, dict[Repair, Finding]] = {}
    for finding in findings:
        if finding.repair is not None:
            wanted = by_file.setdefault(finding.repair.file, {})
            wanted.setdefault(finding.repair, finding)
    made = [_mend(path, wanted) for path, wanted in by_file.items()]
    return any(made)


def _mend(path: str, wanted: dict[Repair, Finding]) -> bool:
    with open(path, encoding="utf-8", newline="") as file:
        text = file.read()
    mark = _MARK if text.startswith(_MARK) else ""
    result = repaired(text.removeprefix(_MARK), wanted, _accepts(path))
    if result.made:
        rewrite(path, mark + result.text)
    for repair in result.made:
        finding = wanted[repair]
        place = f"{path}:{finding.primary.span.line}"
        print(f"mended {place}: {finding.diagnostic.code}: {repair.title}", file=sys.stderr)
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
