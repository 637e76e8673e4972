"""A constant names only constants above it, whatever is written: what looks through them ends."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

from specc.model.expr import ConstantRef, walk
from specc.model.system import System
from specc.pipeline import compile_spec
from tests.seeds import short

PART = """specc: 1
parameters: {a: real}
constants: {b: 2 * a, c: b + a}
subsystem:
  rate: 10 Hz
  y: {other: {n: real}}
  functions: {send: {y.other.n: a + b + c}}
  behaviours: {send: {functions: [send], terminal: never}}
  states: {S0: send}
  initial_state: S0
"""
SYSTEM = """specc: 1
system: demo
constants: {%s}
agents:
  one:
    control: {use: part.yaml, with: {a: %s}}
  other:
    control: {rate: 10 Hz, x: {one: {n: {type: real, init: 0}}}}
"""
VALUES = ("1.0", "a", "b", "c", "a + b")


def ordered(system: System) -> bool:
    """Whether every constant names only earlier ones."""
    known: set[str] = set()
    for constant in system.constants:
        named = {part.name for part in walk(constant.value) if isinstance(part, ConstantRef)}
        if not named <= known:
            return False
        known.add(constant.name)
    return True


@pytest.mark.long
@pytest.mark.parametrize("given", short(["a", "b", "c", "a * c"], 3))
def test_no_constant_refers_to_itself(given: str, tmp_path: Path) -> None:
    (tmp_path / "part.yaml").write_text(PART)
    spec = tmp_path / "demo.yaml"
    clean = 0
    for values in product(VALUES, repeat=3):
        constants = "a: {}, b: {}, c: {}".format(*values)
        spec.write_text(SYSTEM % (constants, given))
        result = compile_spec(str(spec))
        assert result.system is None or ordered(result.system)
        forward = any(set(value) & set("abc"[i:]) for i, value in enumerate(values))
        names = {finding.code for finding in result.diagnostics} & {
            "O0205",
            "E0201",
            "E0221",
            "E0230",
        }
        assert bool(names) == forward
        clean += not forward
    assert clean == 1 * 2 * 4
