"""What checking costs where machines wait for each other and keep what may be None."""

import sys
from pathlib import Path
from types import FrameType

from specc import pipeline

_MACHINES = """specc: 1
system: effort
title: Two machines of one size
agents:
  agent:
    control:
      title: Commands
      rate: 100 Hz
      x: {{worker: {{done: int}}}}
      y: {{worker: {{go: int}}}}
      memory: {{last: {{type: "optional[int]", init: None}}, sum: {{type: int, init: 0}}}}
      conditions: {{terminal: {{came: fresh(x.worker.done)}}}}
      functions: {{order: {{y.worker.go: sum, sum: last + 1}}, keep: {{last: sum}}}}
      behaviours:
        begin: {{functions: [keep], terminal: always}}
        work: {{functions: [order], terminal: came}}
      states: {{{states}, S0: begin}}
      initial_state: S0
      transitions:
{rows}
    virtual_effectors:
      worker:
        title: Worker
        rate: 100 Hz
        uses: []
        x: {{c: {{go: int}}}}
        y: {{c: {{done: int}}}}
        conditions: {{terminal: {{told: fresh(x.c.go)}}}}
        functions: {{answer: {{y.c.done: x.c.go}}}}
        behaviours: {{wait: {{terminal: told}}, answer: {{functions: [answer], terminal: told}}}}
        states: {{S0: wait, {answers}}}
        initial_state: S0
        transitions:
{rows}
"""


def _machines(states: int) -> str:
    """Rings of states, declared against the way they are entered."""
    names = [f"S{number}" for number in range(states)]
    pairs = list(zip(names, [*names[1:], names[0]], strict=True))[::-1]
    return _MACHINES.format(
        states=", ".join(f"{name}: work" for name in names[:0:-1]),
        answers=", ".join(f"{name}: answer" for name in names[:0:-1]),
        rows="\n".join(f"        - [{a}, terminal, always, {b}]" for a, b in pairs),
    )


def _calls(path: Path, states: int) -> int:
    path.write_text(_machines(states), encoding="utf-8")
    count = 0

    def counting(_frame: FrameType, event: str, _arg: object) -> None:
        nonlocal count
        count += event == "call"

    before = sys.getprofile()
    sys.setprofile(counting)
    try:
        result = pipeline.compile_spec(str(path))
    finally:
        sys.setprofile(before)
    assert not result.diagnostics
    return count


def test_in_proportion_to_states(tmp_path: Path) -> None:
    """Twice as many states cost about twice as many calls more."""
    path = tmp_path / "effort.yaml"
    _calls(path, 2)  # imports what it takes
    few, more, many = (_calls(path, states) for states in (20, 40, 80))
    assert many - more < 2.2 * (more - few)
