"""Constants in generated code have the values that the specification gives them."""

from __future__ import annotations

from pathlib import Path
from random import Random

import pytest
from specc_runtime.cycle import Executor
from specc_runtime.loading import load_system

from specc import output
from specc.pipeline import build

AGENTS = """\
agents:
  a:
    control:
      rate: 10 Hz
      x: {{b: {{go: bool}}}}
      y: {{b: {{n: int}}}}
      memory: {{{memory}}}
      conditions: {{terminal: {{low: "{last} < {first}", high: "{first} < {last}"}}}}
      functions: {{tell: {{y.b.n: 1}}, keep: {{{kept}}}}}
      behaviours:
        keep: {{functions: [keep, tell], terminal: low}}
        wait: {{functions: [tell], terminal: high}}
      states: {{S0: keep, S1: wait}}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
  b:
    control:
      rate: 10 Hz
      x: {{a: {{n: int}}}}
      y: {{a: {{go: bool}}}}
      functions: {{tell: {{y.a.go: True}}}}
      behaviours: {{tell: {{functions: [tell], terminal: never}}}}
      states: {{S0: tell}}
      initial_state: S0
"""


@pytest.mark.parametrize("seed", range(6))
def test_constants_of_constants(seed: int, tmp_path: Path) -> None:
    rng = Random(seed)
    texts, values = ["2", "3.0"], [2.0, 3.0]
    for _ in range(8):
        i, j, op = rng.randrange(len(texts)), rng.randrange(len(texts)), rng.choice("+-*")
        texts.append(f"c{i} {op} c{j}")
        values.append(
            {"+": float.__add__, "-": float.__sub__, "*": float.__mul__}[op](values[i], values[j])
        )
    names = [f"c{i}" for i in range(len(texts))]
    used = rng.sample(names, len(names))  # in an order that is not that of their definitions
    spec = tmp_path / "chain.yaml"
    spec.write_text(
        "specc: 1\nsystem: chain\nconstants:\n"
        + "".join(f'  {n}: "{text}"\n' for n, text in zip(names, texts, strict=True))
        + AGENTS.format(
            memory=", ".join(f"m{n}: {{type: real, init: 0}}" for n in used),
            kept=", ".join(f"m{n}: {n}" for n in used),
            first=used[0],
            last=used[1],
        )
    )
    built = build(str(spec))
    assert built.files, built.result.diagnostics
    output.write(tmp_path / "chain", built.files)
    system = load_system(tmp_path / "chain", tmp_path)
    executor = Executor(system, inline=True)
    executor.advance()
    executor.finish()
    memory = system.scheduled("a.c").subsystem.memory
    assert {n: getattr(memory, f"m{n}") for n in names} == dict(zip(names, values, strict=True))
