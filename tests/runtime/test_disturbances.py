"""What happens to the plant while a run goes on: when, how long, and the same again by the seed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from specc.cli import main
from tests.seeds import every

MODEL = """
<mujoco>
  <option gravity="0 0 -9.81" timestep="0.01"/>
  <worldbody>
    <geom type="plane" size="2 2 0.1"/>
    <body name="cart" pos="0 0 0.5"><joint name="cart" type="slide" axis="1 0 0" damping="1"/>
      <geom size="0.1" mass="1" contype="0" conaffinity="0"/></body>
    <body name="box" pos="0 1 0.1"><freejoint name="box"/>
      <geom type="box" size="0.1 0.1 0.1"/></body>
  </worldbody>
  <actuator><velocity name="wheels" joint="cart" kv="50"/></actuator>
  <sensor><framepos name="box_at" objtype="body" objname="box"/>
    <framexaxis name="box_x" objtype="body" objname="box"/></sensor>
</mujoco>
"""
SPEC = """
specc: 1.1
system: cart
frames: {W: world}
agents:
  cart:
    real_effectors: {wheels: {x: {v_d: "real[m/s]"}, y: {s: "real[m]"}}}
    virtual_effectors:
      wheels:
        rate: 50 Hz
        x: {c: {v_d: {type: "real[m/s]", init: 0}}, E: {s: "real[m]"}}
        y: {E: {v_d: "real[m/s]"}, c: {s: "real[m]", heard: bool}}
        functions: {drive: {y.E.v_d: x.c.v_d, y.c.s: x.E.s, y.c.heard: fresh(x.E.s)}}
        behaviours: {drive: {functions: [drive], terminal: never}}
        states: {S0: drive}
        initial_state: S0
    control:
      rate: 10 Hz
      x: {wheels: {s: {type: "real[m]", init: 0}, heard: {type: bool, init: True}}}
      memory: {unheard: {type: int, init: 0}}
      y: {wheels: {v_d: "real[m/s]"}}
      functions:
        go: {y.wheels.v_d: "1[m/s]"}
        stop: {y.wheels.v_d: 0}
        count: {unheard: unheard if x.wheels.heard else unheard + 1}
      behaviours:
        go: {functions: [go, count], terminal: {when: "x.wheels.s > 3[m]"}}
        stop: {functions: [stop, count], terminal: {when: "elapsed > 1[s]"}}
      states: {going: go, stopping: stop}
      initial_state: going
      transitions: [[going, terminal, always, stopping], [stopping, terminal, always, going]]
plant:
  model: cart.xml
  bind:
    cart.E.wheels.v_d: {actuators: [wheels]}
    cart.E.wheels.s: {joints: [cart], sporadic: true}
  observe:
    s: {type: "real[m]", joints: [cart]}
    box: {type: "point[W]", sensors: [box_at]}
    box_x: {type: "vector[3]", sensors: [box_x]}
task:
  cycle: {of: cart.c, from: going, to: stopping}
"""


def ran(
    folder: Path,
    disturb: str,
    *required: str,
    seed: int = 1,
    code: int = 0,
    spec: str = SPEC,
) -> dict[str, Any]:
    """The report of two seconds."""
    (folder / "cart.xml").write_text(MODEL)
    path, report = folder / "cart.yaml", folder / "report.json"
    require = "".join(f'  - {{that: "{that}", because: of the test}}\n' for that in required)
    disturb = disturb.replace("}\n", ", because: of the test}\n")
    happens = f"    - {{{disturb}, because: of the test}}\n"
    path.write_text(f"{spec}  disturb:\n{happens}require:\n{require or '  []'}\n")
    options = ["--duration", "2", "--seed", str(seed), "--report", str(report)]
    assert main(["run", str(path), *options]) == code
    return dict(json.loads(report.read_text()))


DOES = ("move", "shift")
FAR = "within(1.9[s], plant.s > 1.8[m])"


@pytest.mark.parametrize(
    ("disturb", "required"),
    every(
        2,
        [
            ("at: '1[s]', move: {cart: '-3[m]'}", "within(1.1[s], plant.s < -2.9[m])"),
            ("at: '1[s]', shift: {cart: '-3[m]'}", "within(1.1[s], plant.s < -1.9[m])"),
            ("at: '1[s]', shift: {box.y: '0.4[m]'}", "within(1.9[s], plant.box.y > 1.39[m])"),
            (
                "at: '0.1[s]', move: {box.yaw: '90[deg]'}}\n"
                "    - {at: '1[s]', move: {box.yaw: '90[deg]'}",
                "within(1.9[s], historically(0.5[s], plant.box_x.y > 0.9))",
            ),
            ("at: '1[s]', push: {box: [0, 0, '200[N]']}", "within(1.9[s], plant.box.z > 0.3[m])"),
            ("at: '1[s]', block: [cart]", "always(plant.s < 1.1[m])"),
            (
                "at: '1[s]', lasts: '0.5[s]', block: [cart]",
                "within(1.9[s], plant.s > 1.2[m]) and throughout(1.9[s], plant.s < 1.5[m])",
            ),
            (
                "at: '1[s]', lasts: '0.5[s]', silent: [cart.E.wheels.s]",
                "within(1.9[s], cart.c.unheard >= 4)",
            ),
        ],
    ),
)
def test_it_happens(tmp_path: Path, disturb: str, required: str) -> None:
    assert ran(tmp_path, disturb, required)["disturbances"][-1]["began_s"] == 1.0
    late = disturb.replace("at: '1[s]'", "at: '9[s]'").replace("at: '0.1[s]'", "at: '9[s]'")
    (found, *_) = ran(tmp_path, late, required, code=1)["disturbances"]
    assert found["began_s"] is None


def test_what_happened_is_told_in_the_order_of_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    push = "push: {box: [0, 0, '1[N]']}"
    ran(tmp_path, f"at: '9[s]', {push}}}\n    - {{at: '1[s]', {push}}}\n"
        f"    - {{at: '0.5[s]', {push}")  # fmt: skip
    lines = capsys.readouterr().out.splitlines()
    told = [line.split(":")[0] for line in lines if "happened" in line]
    assert told == ["happened at 0.500 s", "happened at 1.000 s", "never happened"]


def test_what_is_over_is_over(tmp_path: Path) -> None:
    silence = "at: '0.5[s]', lasts: '0.5[s]', silent: [cart.E.wheels.s]"
    ran(
        tmp_path,
        silence,
        "within(1.9[s], historically(0.5[s], cart.c.x.wheels.heard) and plant.s > 1.5[m])",
    )


@pytest.mark.parametrize(
    ("does", "required"),
    [
        ("block: [cart]", "always(plant.s < 0.6[m])"),
        ("push: {box: [0, 0, '200[N]']}", "within(1.9[s], plant.box.z > 3[m])"),
        ("silent: [cart.E.wheels.s]", "within(1.9[s], cart.c.unheard >= 10)"),
    ],
)
def test_what_ends_leaves_the_same_of_others(tmp_path: Path, does: str, required: str) -> None:
    long = f"at: '0.5[s]', {does}}}\n    - {{"
    ran(tmp_path, f"{long}at: '0.6[s]', lasts: '0.1[s]', {does}", required)
    ran(tmp_path, f"at: '0.5[s]', lasts: '0.2[s]', {does}", required, code=1)


def test_a_condition_is_waited_for(tmp_path: Path) -> None:
    (found,) = ran(tmp_path, "when: 'plant.s > 1.2[m]', move: {cart: 0}")["disturbances"]
    assert 1.1 < found["began_s"] < 1.5
    (found,) = ran(tmp_path, "at: '1.5[s]', when: 'plant.s > 1.2[m]', move: {cart: 0}")[
        "disturbances"
    ]
    assert found["began_s"] == pytest.approx(1.5)
    (found,) = ran(tmp_path, "when: 'plant.s > 10[m]', move: {cart: 0}")["disturbances"]
    assert found["began_s"] is None


def test_a_state_can_be_waited_for(tmp_path: Path) -> None:
    when = (
        "when: 'once(0.2[s], state(cart.c) == going) and plant.s > 0.5[m]', shift: {cart: '4[m]'}"
    )
    (found,) = ran(tmp_path, when, "within(1[s], state(cart.c) == stopping)")["disturbances"]
    assert 0.5 < found["began_s"] < 0.8


SLOW = """  slow:
    control:
      rate: 0.5 Hz
      x: {cart: {n: {type: int, init: 0}}}
      behaviours: {idle: {terminal: never}}
      states: {S0: idle}
      initial_state: S0
plant:
"""


def test_what_waits_for_something_slow_delays_nothing_else(tmp_path: Path) -> None:
    """What a subsystem of 0.5 Hz does is known 2 s later."""
    spec = (
        SPEC.replace("plant:\n", SLOW)
        .replace(
            'y: {wheels: {v_d: "real[m/s]"}}', 'y: {wheels: {v_d: "real[m/s]"}, slow: {n: int}}'
        )
        .replace("        go: {y.wheels", "        tell: {y.slow.n: 1}\n        go: {y.wheels")
        .replace("count]", "count, tell]")
    )
    of_the_cart = "when: 'plant.s > 0.5[m]', move: {cart: 0}"
    of_slow = "when: 'state(slow.c) == S0 and plant.s > 0.5[m]', move: {cart: 0}"
    both = f"{of_the_cart}}}\n    - {{{of_slow}"
    (alone,) = ran(tmp_path, of_the_cart, spec=spec)["disturbances"]
    found, late = ran(tmp_path, both, spec=spec)["disturbances"]
    assert found["began_s"] == alone["began_s"] < 1
    assert late["began_s"] is None


def test_numbers_follow_from_the_seed(tmp_path: Path) -> None:
    drawn = "at: ['0.5[s]', '1.5[s]'], move: {cart: {one_of: ['-1[m]', '-2[m]']}}"
    reports = [ran(tmp_path, drawn, seed=seed) for seed in (1, 1, 2, 3)]
    began = [report["disturbances"][0]["began_s"] for report in reports]
    assert began[0] == began[1]
    assert reports[0]["records_sha256"] == reports[1]["records_sha256"]
    assert len(set(began)) == 3
    assert all(0.5 <= each <= 1.51 for each in began)


def test_numbers_do_not_depend_on_what_else_happens(tmp_path: Path) -> None:
    """Nor on the order; and how far a joint is moved says nothing of where another is put."""
    move, shift = (f"at: ['0.5[s]', '1.5[s]'], {does}: {{box.x: [0, '1[m]']}}" for does in DOES)
    once = "push: {box: [0, 0, ['1[N]', '2[N]']]}, at: ['0.5[s]', '1.5[s]']"

    def began(*disturbances: str) -> list[float]:
        found = ran(tmp_path, "}\n    - {".join(disturbances))["disturbances"]
        return [each["began_s"] for each in found]

    alone = [*began(move), *began(shift), *began(once)]
    assert len(set(alone)) == 3
    assert began(once, move, shift) == [alone[2], *alone[:2]]
    twice = began(move, move)
    assert twice[0] == alone[0] != twice[1]


def test_a_run_goes_on_through_it(tmp_path: Path) -> None:
    """A run that goes on from a recording has the same disturbances, before and after."""
    disturb = "at: ['0.5[s]', '1.5[s]'], move: {cart: '-1[m]'}"
    whole = ran(tmp_path, disturb)
    spec, record, report = (str(tmp_path / name) for name in ("cart.yaml", "a.mcap", "b.json"))
    common = ["run", spec, "--duration", "2"]
    assert main([*common, "--seed", "1", "--record", record, "--record-exact"]) == 0
    assert main([*common, "--from", f"{record}@1.7", "--report", report]) == 0
    again = json.loads(Path(report).read_text())
    assert again["records_sha256"] == whole["records_sha256"]
    assert again["disturbances"] == whole["disturbances"]
