"""What is proved of a constant that may change holds for all values of its range, and no others."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

import pytest

from specc.pipeline import compile_spec
from specc.source import real_path
from tests.seeds import blocks

SPEC = """\
specc: 1.2
system: demo
constants:
  v: {{is: {value}, range: [{low}, {high}], live: true}}
  w: {derived}
agents:
  a:
    control:
      rate: 10 Hz
      y: {{b: {{v: real}}}}
      functions: {{go: {{y.b.v: v}}}}
      behaviours: {{go: {{functions: [go], terminal: always}}}}
      states: {{S0: go, S1: go}}
      initial_state: S0
      conditions: {{initial: {{{conditions}}}}}
      transitions:
{rows}
        - [S1, terminal, always, S0]
  b:
    control:
      rate: 10 Hz
      x: {{a: {{v: {{type: real, init: 0}}}}}}
      memory: {{s: {{type: real, init: 0}}}}
      functions: {{move: {{s: s + x.a.v}}}}
      behaviours: {{move: {{functions: [move], terminal: never}}}}
      states: {{S0: move}}
      initial_state: S0
"""
DERIVED: dict[str, Callable[[float], float]] = {"v": lambda v: v, "2 * v": lambda v: 2 * v}
SIGNS: dict[str, Callable[[float, float], bool]] = {
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
}
HALVES = [n / 2 for n in range(-1, 8)]
Row = tuple[str, str, float]


def found(low: float, high: float, derived: str, rows: Sequence[Row]) -> set[str]:
    """The codes of what is found about the rows."""
    text = SPEC.format(
        value=random.Random(len(rows)).choice([low, high]),
        low=low,
        high=high,
        derived=derived,
        conditions=", ".join(f'c{n}: "{" ".join(map(str, row))}"' for n, row in enumerate(rows)),
        rows="\n".join(f"        - [S0, terminal, c{n}, S1]" for n in range(len(rows))),
    )
    result = compile_spec("demo.yaml", texts={real_path("demo.yaml"): text})
    return {each.code for each in result.diagnostics}


@pytest.mark.parametrize("seeds", blocks([0], also=range(1, 4), long=80, each=20))
def test_rows_are_proved_for_all_values_of_the_range(seeds: Sequence[int]) -> None:
    for seed in seeds:
        for part in range(12):
            rng = random.Random(f"{seed} {part}")
            low, high = sorted(rng.sample([n / 4 for n in range(13)], 2))
            derived = rng.choice(list(DERIVED))
            rows = [
                (rng.choice("vw"), rng.choice(list(SIGNS)), rng.choice(HALVES))
                for _ in range(rng.randint(1, 3))
            ]
            counts = set()
            for n in range(round(low * 64), round(high * 64) + 1):
                values = {"v": n / 64, "w": DERIVED[derived](n / 64)}
                counts.add(sum(SIGNS[sign](values[name], limit) for name, sign, limit in rows))
            codes = found(low, high, derived, rows)
            case = f"{low} to {high}, w: {derived}: {rows}: {codes}"
            assert "O0205" not in codes
            for code, is_so in (("E0601", 0 in counts), ("E0602", max(counts) > 1)):
                # Where `v` and `w` depend on each other, a search may find one of the two only.
                is_open = {"E0601", "E0602", "W0606"} & codes
                assert is_so if code in codes else not is_so or is_open, case
