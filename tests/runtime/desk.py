"""A desk whose operator has a panel with an element of every kind, and nothing else."""

from __future__ import annotations

SPEC = """\
specc: 1.3
system: desk
types: {Mode: "enum[manual, auto]"}
agents:
  desk:
    real_receptors:
      buttons: {y: {start: bool, enable: bool, stop: bool, v: "real[m/s]", mode: Mode, n: int}}
    virtual_receptors:
      buttons:
        rate: 50 Hz
        x: {R: {start: bool, enable: bool, stop: bool, v: "real[m/s]", mode: Mode, n: int}}
        y: {c: {pressed: int, held: bool, far: "real[m]", mode: Mode, seen: bool}}
        memory:
          pressed: {type: int, init: 0}
          far: {type: "real[m]", init: 0}
          seen: {type: bool, init: False}
        functions:
          count:
            pressed: "pressed + (1 if x.R.start else 0)"
            far: "far + x.R.v * 0.02[s] * x.R.n if x.R.enable and not x.R.stop else far"
            seen: x.R.start
            y.c.pressed: pressed
            y.c.held: x.R.enable
            y.c.far: far
            y.c.mode: x.R.mode
            y.c.seen: seen
        behaviours: {count: {functions: [count], terminal: never}}
        states: {S0: count}
        initial_state: S0
    control:
      rate: 10 Hz
      x:
        buttons:
          pressed: {type: int, init: 0}
          held: {type: bool, init: False}
          far: {type: "real[m]", init: 0}
          mode: {type: Mode, init: manual}
          seen: {type: bool, init: False}
      memory: {most: {type: "real[m]", init: 0}}
      functions: {keep: {most: "x.buttons.far if x.buttons.mode == auto else most"}}
      behaviours:
        work: {functions: [keep], terminal: {when: x.buttons.held}}
        run: {functions: [keep], terminal: {when: not x.buttons.held}}
      states: {idle: work, moving: run}
      initial_state: idle
      transitions: [[idle, terminal, always, moving], [moving, terminal, always, idle]]
plant:
  bind:
    desk.R.buttons.start: {panel: button, key: s}
    desk.R.buttons.enable: {panel: button, hold: true}
    desk.R.buttons.stop: {panel: switch}
    desk.R.buttons.v: {panel: slider, range: ["0[m/s]", "0.2[m/s]"], init: "0.1[m/s]"}
    desk.R.buttons.mode: {panel: choice, init: manual}
    desk.R.buttons.n: {panel: number, range: [0, 10], init: 1}
"""
PRESSED = SPEC.replace(", hold: true", "")
"""Without a button that is held."""
R = "desk.R.buttons"
START, ENABLE, STOP, V, MODE, N = (
    f"{R}.{element}" for element in ("start", "enable", "stop", "v", "mode", "n")
)
READER = "desk.buttons"
