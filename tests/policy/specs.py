"""A specification with two warnings, and a place for comments about them."""

from pathlib import Path

SPEC = """\
specc: 1
system: demo
agents:
  a:
    control:
      rate: 10 Hz
      y: {m: {d: real}}
      memory: {spare: {type: int, init: 0}}%s
      let: {other: 1}%s
      functions: {send: {y.m.d: 1}}
      behaviours: {work: {functions: [send], terminal: never}}
      states: {S0: work}
      initial_state: S0
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {c: {d: real}}
        conditions: {terminal: {commanded: fresh(x.c.d)}}
        behaviours: {idle: {terminal: commanded}}
        states: {S0: idle}
        initial_state: S0
        transitions: [[S0, terminal, always, S0]]
"""


def write(path: Path, memory: str = "", let: str = "") -> Path:
    """The specification with texts behind its `memory:` and its `let:`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(SPEC % (memory, let))
    return path
