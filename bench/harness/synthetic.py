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


_MODES = "abcdefgh"
_MACHINE_HEAD = """\
specc: 1
system: machine_{n}
title: A machine of {n} states with {rows} rows each
types: {{Mode: "enum[{modes}]"}}

agents:
  agent:
    control:
      title: Commands
      rate: 100 Hz
      y: {{worker: {{mode: Mode, go: int}}}}
      functions: {{order: {{y.worker.mode: a, y.worker.go: 1}}}}
      behaviours: {{order: {{functions: [order], terminal: never}}}}
      states: {{S0: order}}
      initial_state: S0
    virtual_effectors:
      worker:
        title: Worker
        rate: 100 Hz
        uses: []
        x: {{c: {{mode: {{type: Mode, init: a}}, go: int}}}}
"""


def machine(n: int, rows: int) -> str:
    """A system whose `agent.worker` has n states, each with as many rows, two or an even number.

    The modes and whether a command came choose the row; each state has its own behaviour.
    """
    half = rows // 2
    modes = _MODES[: max(half, 2)]
    initial = {}
    for k in range(half):
        among = f"x.c.mode == {modes[k]}" if k < half - 1 else _rest(modes[k:])
        when = f" and {among}" if half > 1 else ""
        initial[f"go_{k}"] = f"fresh(x.c.go){when}"
        initial[f"stay_{k}"] = f"not fresh(x.c.go){when}"
    ask = "x.c.mode == a" if half < 2 else ""
    lines = ["        conditions:", "          initial:"]
    lines += [f'            {name}: "{text}"' for name, text in initial.items()]
    terminal = f"elapsed > 0.1[s]{' or ' + ask if ask else ''}"
    lines.append(f'          terminal: {{ended: "{terminal}"}}')
    lines.append("        behaviours:")
    lines += [f"          b{i}: {{terminal: ended}}" for i in range(n)]
    lines.append("        states:")
    lines += [f"          S{i}: b{i}" for i in range(n)]
    lines += ["        initial_state: S0", "        transitions:"]
    for i in range(n):
        for step, name in enumerate(initial):
            lines.append(f"          - [S{i}, terminal, {name}, S{(i + step + 1) % n}]")
    return _MACHINE_HEAD.format(n=n, rows=rows, modes=", ".join(modes)) + "\n".join(lines) + "\n"


def _rest(modes: str) -> str:
    return f"x.c.mode in {{{', '.join(modes)}}}"
