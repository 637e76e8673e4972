"""Through which functions one condition passes from YAML to code.

The condition is `stuck: elapsed > patience` of `specs/conveyor_gate.yaml`. A profiler watches the
build in this process. A function of specc counts if, when it returns, one of its arguments or
local variables, `self` excepted, is the condition: its text, its syntax tree, the typed
expression, or an object that has one of these as its `when`, `node`, `that`, `value` or `test`,
as a condition of the model or a term. Items of lists, tuples and dictionaries do not count: such
a function handles many parts at once. Lambdas and comprehensions count as the function around
them.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections import defaultdict
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

from bench.harness.tables import table
from specc.model.expr import Clock, Compare, ConstantRef
from specc.pipeline import build

ROOT = Path(__file__).resolve().parents[1]
SPEC = ROOT / "specs" / "conveyor_gate.yaml"
TEXT = "elapsed > patience"
ON_THE_WAY = ("read", "schema", "resolve", "lang", "model", "lower", "emit")
"""Packages that hand the condition on; analyses, proofs and checks only ask about it."""


def is_condition(value: Any) -> bool:
    """Whether a value is the condition, or one thing around it."""
    return _is_it(value) or any(
        _is_it(getattr(value, name, None)) for name in ("when", "node", "that", "value", "test")
    )


def _is_it(value: Any) -> bool:
    match value:
        case str():
            return value.strip() == TEXT
        case ast.Compare(left=ast.Name(id="elapsed"), comparators=[ast.Name(id="patience")]):
            return True
        case Compare(op=">", left=Clock(name="elapsed"), right=ConstantRef(name="patience")):
            return True
    return False


class Watch:
    """Notes the functions of specc that return with the condition among their variables."""

    def __init__(self) -> None:
        self.functions: dict[str, set[str]] = defaultdict(set)
        self._files: dict[CodeType, str] = {}

    def __call__(self, frame: FrameType, event: str, _: object) -> None:
        """A profiler, as `sys.setprofile` takes it."""
        if event != "return":
            return
        code = frame.f_code
        if code not in self._files:
            path = Path(code.co_filename)
            inside = path.is_relative_to(ROOT / "specc")
            self._files[code] = path.relative_to(ROOT).as_posix() if inside else ""
        file, name = self._files[code], code.co_qualname.split(".<locals>")[0]
        if not file or name in self.functions[file]:
            return
        if any(is_condition(v) for key, v in frame.f_locals.items() if key not in ("self", "cls")):
            self.functions[file].add(name)


def main() -> None:
    """Print the functions by file, and how many there are."""
    argparse.ArgumentParser(description=__doc__, prog="python -m bench.one_condition").parse_args()
    watch = Watch()
    sys.setprofile(watch)
    try:
        build(str(SPEC))
    finally:
        sys.setprofile(None)
    rows = [
        [file, str(len(names)), ", ".join(sorted(names))]
        for file, names in sorted(watch.functions.items())
        if names
    ]
    ways = {
        "from YAML to code": [row for row in rows if row[0].split("/")[1] in ON_THE_WAY],
        "all, with analyses and checks": list(rows),
    }
    for name, some in ways.items():
        rows.append([name, str(sum(int(row[1]) for row in some)), f"in {len(some)} files"])
    print(table("Functions that one condition passes through", ["file", "n", "functions"], rows))


if __name__ == "__main__":
    main()
