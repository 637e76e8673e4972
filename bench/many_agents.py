"""How validating, building and running grow with the number of agents of one description.

The agents are the rovers of specs/parts, on rails, with a dispatcher that sends all of them.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.harness.building import SPECS
from bench.harness.processes import Command, in_turns
from bench.harness.tables import table

SPEC = """\
specc: 1.1
system: fleet
use: [parts/rover_messages.yaml]
agents:
  rovers:
    for: {{i: 1..{count}}}
    use: parts/rover.yaml
    with: {{dispatcher: dispatcher, speed: "0.2[m/s] + 0.2[m/s] * i / {count}"}}
  dispatcher:
    control:
      rate: 5 Hz
      x: {{rovers: Report}}
      y: {{rovers: Order}}
      memory: {{stage: {{type: int, init: 0}}, is_far: {{type: bool, init: False}}}}
      conditions:
        terminal: {{all_done: all(present(r.done) and r.done == stage for r in x.rovers)}}
      functions:
        order:
          y.rovers.stage: stage + 1
          y.rovers.s_d: 0[m] if is_far else 1[m]
          y.rovers.hurry: False
          stage: stage + 1
          is_far: not is_far
      behaviours:
        order: {{functions: [order], terminal: always}}
        wait: {{functions: [], terminal: all_done}}
      states: {{ordering: order, waiting: wait}}
      initial_state: ordering
      transitions:
        - [ordering, terminal, always, waiting]
        - [waiting,  terminal, always, ordering]
plant:
  model: rails.xml
  bind:
    rovers_{{i}}.E.drive.v_d: {{for: {{i: 1..{count}}}, actuators: ["drive_{{i}}"]}}
    rovers_{{i}}.E.drive.s: {{for: {{i: 1..{count}}}, joints: ["rail_{{i}}"]}}
task: {{cycle: {{of: dispatcher.c, from: waiting, to: ordering}}}}
"""
MODEL = """\
<mujoco>
  <option timestep="0.002"/>
  <default>
    <joint type="slide" axis="1 0 0" range="-0.2 1.4" damping="2"/>
    <geom type="box" size="0.08 0.06 0.04" mass="2" contype="0" conaffinity="0"/>
    <velocity kv="60"/>
  </default>
  <worldbody>{bodies}</worldbody>
  <actuator>{actuators}</actuator>
</mujoco>
"""


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--counts", type=int, nargs="*", default=[10, 25, 50, 100])
    parser.add_argument("--duration", type=float, default=60, help="of a run, simulated seconds")
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args(arguments)
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        rows = [
            _row(count, Path(scratch, str(count)), options.duration, options.repeats)
            for count in options.counts
        ]
    title = f"Wall time; CPU time of {options.duration:g} s of a run, without its start"
    head = ("rovers", "validate, s", "build, s", "modules", "run, ms", "run, ms a rover")
    print(table(title, head, rows))


def _row(count: int, directory: Path, duration_s: float, repeats: int) -> tuple[str, ...]:
    spec = put(count, directory)
    ended = ("--duration", f"{duration_s:g}")
    one_tick = ("--duration", "0.002")
    commands: dict[str, Command] = {
        "validate": lambda number: _specc("validate", spec),
        "build": lambda number: _specc("build", spec, "--out", directory / f"built_{number}"),
        "run": lambda number: _specc("run", spec, *ended, "--report", directory / "report.json"),
        "start": lambda number: _specc("run", spec, *one_tick, "--report", directory / "r.json"),
    }
    taken = in_turns(commands, repeats)
    modules = len(list((directory / "built_0").rglob("*.py")))
    validate, build = (f"{taken[name].wall_ms / 1e3:.2f}" for name in ("validate", "build"))
    run_ms = taken["run"].cpu_ms - taken["start"].cpu_ms
    return str(count), validate, build, str(modules), f"{run_ms:.0f}", f"{run_ms / count:.1f}"


def put(count: int, directory: Path) -> Path:
    """Write the specification of so many rovers, with what it uses; where it is."""
    shutil.copytree(SPECS / "parts", directory / "parts")
    names = range(1, count + 1)
    bodies = [f'<body pos="0 {0.3 * i:g} 0"><joint name="rail_{i}"/><geom/></body>' for i in names]
    actuators = [f'<velocity name="drive_{i}" joint="rail_{i}"/>' for i in names]
    model = MODEL.format(bodies="".join(bodies), actuators="".join(actuators))
    (directory / "rails.xml").write_text(model, encoding="utf-8")
    spec = directory / "fleet.yaml"
    spec.write_text(SPEC.format(count=count), encoding="utf-8")
    return spec


def _specc(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "specc", *map(str, arguments)]


if __name__ == "__main__":
    main()
