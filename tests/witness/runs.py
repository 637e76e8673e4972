"""Writing scenarios with the command, and running them as pytest would."""

from __future__ import annotations

import importlib.util
import itertools
import re
import shutil
from pathlib import Path
from unittest import SkipTest

from specc.cli import main
from specc.diagnostics import Diagnostic

ROOT = Path(__file__).resolve().parents[2]
CASES = ROOT / "tests" / "cases"
ADDED = re.compile(r"the row `\[(\w+), (\w+), (\w+), \.\.\.\]`")
ASKED = re.compile(r'give (this row|the other row) the condition "(.*)" instead of `(\w+)`')
_serial = itertools.count()


def written(spec: Path, out: Path, *options: str) -> list[Path]:
    """The scenarios that the command writes for a specification."""
    shutil.rmtree(out, ignore_errors=True)
    main(["witness", str(spec), "--out", str(out), *options])
    return sorted(out.glob("test_*.py"))


def run(scenario: Path, tmp_path: Path) -> Exception | None:
    """What the test in a scenario raises; None if it passes."""
    number = next(_serial)
    spec = importlib.util.spec_from_file_location(f"scenario_{number}", scenario)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    (test,) = (value for name, value in vars(module).items() if name.startswith("test_"))
    scratch = tmp_path / f"scratch_{number}"
    scratch.mkdir()
    try:
        test(scratch)
    except SkipTest:
        raise
    except Exception as error:  # noqa: BLE001 - which one it is, is what is tested
        return error
    return None


def others_of(finding: Diagnostic) -> list[str]:
    """The states that a finding about rows is about beside the first."""
    said = (r for r in finding.related if r.message.startswith("ended by"))
    return [str(related.place.route[-1]) for related in said]


def states_of(finding: Diagnostic) -> int:
    """How many states a finding about rows is about."""
    return 1 + len(others_of(finding))


def mended(text: str, finding: Diagnostic) -> str:
    """The text of a case with the suggested repair of its finding."""
    lines = text.splitlines()
    indent = " " * (len(lines[-1]) - len(lines[-1].lstrip()))
    if found := ADDED.search(finding.help):
        state, cause, name = found.groups()
        for lacking in (state, *others_of(finding)):
            lines.append(f"{indent}- [{lacking}, {cause}, {name}, {lacking}]")
    elif asked_instead := ASKED.search(finding.help):
        which, asked, name = asked_instead.groups()
        rows = [i for i, line in enumerate(lines) if f", {name}, " in line]
        row = rows[-1] if which == "this row" else rows[0]
        for each in rows if others_of(finding) else [row]:
            lines[each] = lines[each].replace(f", {name}, ", ", mended, ")
        lines.insert(lines.index("          initial:") + 1, f'            mended: "{asked}"')
    elif finding.help.startswith("delete one of the two rows"):
        first = max(i for i, line in enumerate(lines) if line.endswith(" transitions:")) + 1
        rows = [i for i, line in enumerate(lines) if i >= first and "- [" in line]
        del lines[rows[int(finding.primary.route[-1])]]
    elif found := re.search(r"add a row, e\.g\. `\[(\w+), (.*)\]`", finding.help):
        for lacking in (found[1], *others_of(finding)):
            lines.append(f"{indent}- [{lacking}, {found[2]}]")
    return "\n".join(lines) + "\n"
