"""What a step of generated code costs beside hand-written Python for the same tables.

Both go through the same inputs, and first it is checked that they give the same rows, states,
outputs and memory. The flagship's inputs are those of a run; with operators that do nothing, and
for the small machines, they are random.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bench.handwritten import irp_c, irp_g, irp_k, irp_m, small
from bench.harness.building import FLAGSHIP, fresh, generate, module_of
from bench.harness.lockstep import check_same
from bench.harness.recording import record
from bench.harness.rivals import Cost, Rival, copied, costs
from bench.harness.stubs import random_inputs, stubbed
from bench.harness.synthetic import ring
from bench.harness.tables import table

TWO_MACHINES = Path(__file__).parent / "specs" / "two_machines.yaml"
WRITTEN: dict[str, Callable[[dict[str, str]], Any]] = {
    "irp.c": irp_c.Picking,
    "irp.g": irp_g.Gripper,
    "irp.k": irp_k.ObjectRecognition,
    "irp.m": irp_m.Manipulator,
}
SMALL: dict[str, dict[str, Callable[[], Any]]] = {
    "robot.arm": {
        "one chain of ifs": small.ArmIf,
        "method per state": small.ArmMethod,
        "and per behaviour": small.ArmBehaviours,
    },
    "robot.c": {
        "one chain of ifs": small.ControlIf,
        "method per state": small.ControlMethod,
        "and per behaviour": small.ControlBehaviours,
    },
}
SEED = 1
SWITCHING = {"busy": 0.2, "quiet": 0.003}
"""How likely each event is at a step of a small machine."""

Pair = tuple[Rival, Rival]


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables."""
    options = _parser().parse_args(arguments)
    with TemporaryDirectory(prefix="specc-bench-") as scratch:
        directory = Path(scratch)
        package = generate(FLAGSHIP, directory)
        print(with_operators(package, options.duration, options.budget))
        print(without_operators(package, options.steps, options.budget))
        print(small_machines(generate(TWO_MACHINES, directory), options.steps, options.budget))
        print(growth(directory, options.states, 4 * options.steps, options.budget))


def with_operators(package: Path, duration_s: float | None, budget_s: float) -> str:
    """The flagship's subsystems on the inputs of a run."""
    recorded = record(FLAGSHIP, duration_s)
    rows = []
    for name, inputs in sorted(recorded.items()):
        pair = _pair(package, name, inputs)
        states = _checked(pair)
        rows.append(_row(name, states, len(inputs), costs(pair, budget_s), 1e-3, 1))
    head = ("subsystem", "states", "steps", "by hand, us", "generated, us", "ratio (quartiles)")
    return table("Flagship, steps without work cycle and plant, inputs of a run", head, rows)


def without_operators(package: Path, steps: int, budget_s: float) -> str:
    """The flagship's subsystems with operators that do nothing: what the machine itself costs."""
    rows = []
    rng = random.Random(SEED)
    for name, written in sorted(WRITTEN.items()):
        generated = type(fresh(package, FLAGSHIP.parent, name))
        modules = module_of(generated), sys.modules[written.__module__]
        inputs = random_inputs(modules[0].Inputs, steps, rng)
        with stubbed(*modules):
            pair = _pair(package, name, inputs)
            states = _checked(pair)
            rows.append(_row(name, states, steps, costs(pair, budget_s), 1, 0))
    head = ("subsystem", "states", "steps", "by hand, ns", "generated, ns", "ratio (quartiles)")
    title = "Flagship, steps without work cycle, random inputs, operators that do nothing"
    return table(title, head, rows)


def small_machines(package: Path, steps: int, budget_s: float) -> str:
    """Machines of Boolean conditions and constants, against three styles of writing by hand."""
    rows = []
    for name, styles in SMALL.items():
        generated = fresh(package, TWO_MACHINES.parent, name)
        for pace, eager in SWITCHING.items():
            inputs = random_inputs(type(generated.x), steps, random.Random(SEED), eager)
            rivals = [_rival(style, make, inputs) for style, make in styles.items()]
            rival = _rival("generated", partial(fresh, package, TWO_MACHINES.parent, name), inputs)
            for other in rivals:
                _checked((other, rival))
            found = costs((*rivals, rival), budget_s)
            rows += [
                (f"{name}, {pace}", c.name, f"{c.step_ns:.0f}", _quotient(found, c)) for c in found
            ]
    head = ("machine", "written as", "step, ns", "generated costs times")
    return table("Small machines, steps without work cycle, random inputs", head, rows)


def growth(directory: Path, sizes: Sequence[int], steps: int, budget_s: float) -> str:
    """Generated machines with more and more states."""
    rivals = []
    for size in sizes:
        spec = directory / f"ring_{size}.yaml"
        spec.write_text(ring(size), encoding="utf-8")
        package = generate(spec, directory)
        kind = type(fresh(package, directory, "ring.motor").x)
        inputs = random_inputs(kind, steps, random.Random(SEED), SWITCHING["busy"])
        rivals.append(_rival(str(size), partial(fresh, package, directory, "ring.motor"), inputs))
    rows = [(c.name, f"{c.step_ns:.0f}", str(c)) for c in costs(rivals, budget_s)]
    title = "Growth of steps with the number of states, without work cycle, random inputs"
    return table(title, ("states", "step, ns", "ratio (quartiles)"), rows)


def _pair(package: Path, name: str, inputs: Sequence[Any]) -> Pair:
    """Hand-written and generated subsystem of the flagship, each with inputs of its own."""
    base = FLAGSHIP.parent
    written = WRITTEN[name]
    files = {"irp6": str(base / "plants" / "irp6_picking.xml"), "objects": str(base / "objects")}
    return (
        _rival("by hand", partial(written, files), inputs),
        _rival("generated", partial(fresh, package, base, name), inputs),
    )


def _rival(name: str, make: Callable[[], Any], inputs: Sequence[Any]) -> Rival:
    """Buffers made one after the other lie together in memory; every rival has such ones."""
    kind = type(make().x)
    return Rival(name, make, [copied(kind, buffer) for buffer in inputs])


def _checked(pair: Pair) -> int:
    """Number of states that both visit. Raises `Different`."""
    written, generated = pair
    machines = written.make(), generated.make()
    inputs = zip(written.inputs, generated.inputs, strict=True)
    return check_same(*machines, inputs, machines[1].sends)


def _row(
    name: str, states: int, steps: int, found: list[Cost], scale: float, digits: int
) -> tuple[str, ...]:
    times = [f"{scale * cost.step_ns:.{digits}f}" for cost in found]
    return (name, str(states), str(steps), *times, str(found[1]))


def _quotient(found: list[Cost], cost: Cost) -> str:
    return "" if cost is found[-1] else f"{found[-1].step_ns / cost.step_ns:.2f}"


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    add = parser.add_argument
    add("--duration", type=float, help="simulated seconds of the run, by default one pick")
    add("--steps", type=int, default=5000, help="random inputs")
    add("--states", type=int, nargs="+", default=[10, 100, 1000], help="of the growing machine")
    add("--budget", type=float, default=4.0, help="seconds for each comparison")
    return parser


if __name__ == "__main__":
    main()
