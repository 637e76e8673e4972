"""A desk whose operator has a panel with an element of every kind, and nothing else."""

from __future__ import annotations

from pathlib import Path

from tests.runtime.apart import built

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
"""
R = "desk.R.buttons"
START, ENABLE, STOP, V, MODE, N = (
    f"{R}.{element}" for element in ("start", "enable", "stop", "v", "mode", "n")
)
READER = "desk.buttons"
ELEMENTS = {
    START: 'kind="button", key="s", title="Start"',
    ENABLE: 'kind="button", hold=True',
    STOP: 'kind="switch"',
    V: 'kind="slider", initial=0.1, least=0.0, greatest=0.2, unit="m/s"',
    MODE: 'kind="choice", initial="manual", choices=("manual", "auto")',
    N: 'kind="number", initial=1, least=0, greatest=10',
}


def desk(folder: Path, *, held: bool = True) -> Path:
    """The generated package; without `held` the button to hold is one that is pressed."""
    package = built(folder, SPEC)
    module = package / "system.py"
    text = module.read_text()
    for name, element in ELEMENTS.items():
        line = f"SensorBinding('{name}', "
        assert line in text, text
        more = element if held else element.replace("hold=True", "hold=False")
        text = text.replace(line, f'{line}panel=PanelElement("{name}", {more}), ')
    first = "from specc_runtime.plants.binding import SensorBinding\n"
    assert first in text, text
    module.write_text(text.replace(first, f"from specc_runtime.panel import PanelElement\n{first}"))
    return package
