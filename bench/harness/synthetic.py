"""Specifications of any size, as YAML text."""

from __future__ import annotations

_HEAD = """\
specc: 1
system: ring_{n}
title: A ring of {n} states

agents:
  ring:
    real_effectors:
      motor: {{x: {{code: int}}, y: {{go: bool, fault: bool}}}}
    virtual_effectors:
      motor:
        title: Ring
        rate: 500 Hz
        x: {{E: {{go: bool, fault: bool}}}}
        y: {{c: {{state: int}}, E: {{code: int}}}}
        conditions:
          terminal: {{ended: {{when: x.E.go}}}}
          error: {{failed: {{when: x.E.fault and not x.E.go}}}}
"""
_TAIL = """\
    control:
      title: Watch
      rate: 500 Hz
      x: {motor: {state: {type: int, init: 0}}}
      memory: {last: {type: int, init: 0}}
      functions: {watch: {last: x.motor.state}}
      behaviours: {watch: {functions: [watch], terminal: never}}
      states: {S0: watch}
      initial_state: S0
"""


def ring(n: int) -> str:
    """A system whose virtual effector `ring.motor` goes round through n states.

    Each state has its own behaviour, which writes the state's number; an error leads back to S0.
    """
    parts = {
        "functions": [f"f{i}: {{y.E.code: {i}, y.c.state: {i}}}" for i in range(n)],
        "behaviours": [
            f"b{i}: {{functions: [f{i}], terminal: ended, error: failed}}" for i in range(n)
        ],
        "states": [f"S{i}: b{i}" for i in range(n)],
        "initial_state: S0": [],
        "transitions": [
            row
            for i in range(n)
            for row in (
                f"- [S{i}, terminal, always, S{(i + 1) % n}]",
                f"- [S{i}, error, always, S0]",
            )
        ],
    }
    lines = []
    for key, items in parts.items():
        lines.append(f"        {key}" if not items else f"        {key}:")
        lines += [f"          {item}" for item in items]
    return _HEAD.format(n=n) + "\n".join(lines) + "\n" + _TAIL
