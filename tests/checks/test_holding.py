"""Speeds and forces that a device keeps since a state does not send them: what is found, what not.

A cart is driven by a control subsystem through a virtual effector. The states of the first and what
the second does vary.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from specc.pipeline import Result, compile_spec
from tests.seeds import every

CART = """\
specc: 1.2
system: cart
agents:
  cart:
    real_effectors: {motor: {x: {v_d: "real[m/s]"}, y: {s: "real[m]", v: "real[m/s]"}}}
    virtual_effectors:
      motor:
        rate: 50 Hz
        x:
          c:
            v: {type: "real[m/s]", init: 0}
            w: {type: "real[m/s]", init: 0}
            to: {type: "real[m]", init: 0}
            on: {type: bool, init: True}
          E: {s: "real[m]", v: "real[m/s]"}
        y: {c: {s: "real[m]"}, E: {v_d: "real[m/s]"}}
EFFECTOR
    control:
      rate: 10 Hz
      x: {motor: {s: {type: "real[m]", init: 0}}}
      y: {motor: {v: "real[m/s]", w: "real[m/s]", to: "real[m]", on: bool}}
      conditions:
        terminal: {there: "x.motor.s > 1[m]", later: "elapsed > 1[s]"}
        error: {too_long: "elapsed > 3[s]"}
      functions:
        drive: {y.motor.v: "0.5[m/s]"}
        stand: {y.motor.v: 0}
        other: {y.motor.w: 0, y.motor.to: "1[m]", y.motor.on: True}
CONTROL
"""
DRIVES = """\
      behaviours:
        drive: {functions: [drive, other], terminal: there, error: too_long}
        stand: {functions: [stand], terminal: later}
        rest: {terminal: later}
        pass: {terminal: always}
      states: {driving: drive, standing: stand, aborted: rest}
      initial_state: driving
      transitions:
        - [driving, terminal, always, standing]
        - [driving, error, always, aborted]
        - [standing, terminal, always, driving]
        - [aborted, terminal, always, driving]
"""
COPIES = "        through: {y.E.v_d: x.c.v, y.c.s: x.E.s}\n"


def checked(folder: Path, effector: str = COPIES, control: str = DRIVES) -> Result:
    path = folder / "cart.yaml"
    text = CART.replace("EFFECTOR\n", effector).replace("CONTROL\n", control)
    path.write_text(text, encoding="utf-8")
    result = compile_spec(str(path))
    assert result.ok, [d.message for d in result.diagnostics]
    return result


def held(result: Result) -> list[str]:
    """The states that do not send what a device keeps."""
    found = [d.primary.route[-1] for d in result.diagnostics if d.code == "W0420"]
    return [str(name) for name in found]


def sends(value: str, more: str = "") -> str:
    """A virtual effector with one state."""
    return f"{more}        through: {{y.E.v_d: {value!r}, y.c.s: x.E.s}}\n".replace("'", '"')


def machine(follow: str, states: str, more: str = "") -> str:
    """A virtual effector that stands, or follows."""
    return f"""\
        memory: {{since: {{type: "real[s]", init: 0}}, v: {{type: "real[m/s]", init: 0}}}}
        conditions:
          terminal:
            called: fresh(x.c.v)
            switched: fresh(x.c.on)
            late: elapsed > 0.5[s]
            quiet: not fresh(x.c.v)
            old: age(x.c.v) > 0.3[s]
          error: {{fast: "x.E.v > 1[m/s]", counted: "since > 0.3[s]"}}
        functions:
          sense: {{y.c.s: x.E.s}}
          stand: {{y.E.v_d: 0}}
          count: {{since: 0 if fresh(x.c.v) else since + period}}
          follow: {{{follow}}}
        behaviours:
          stand: {{functions: [stand, sense], terminal: called}}
          follow: {{functions: [follow, sense, count], {states}}}
        states: {{standing: stand, following: follow}}
        initial_state: standing
        transitions:
          - [standing, terminal, always, following]
{more}"""


TERMINAL = "          - [following, terminal, always, standing]\n"
ERROR = "          - [following, error, always, standing]\n"
RAMP = '        memory: {v_p: {type: "real[m/s]", init: 0}}\n'
KEPT = [
    (COPIES, "a copy"),
    (sends("clamp(-2 * x.c.v, -1[m/s], 1[m/s])"), "arithmetic with constants"),
    (sends("x.c.v + x.c.w"), "a sum of two speeds"),
    (sends("x.c.v if x.c.on else 0"), "a switch that is not sent either"),
    (sends("x.c.v if present(x.c.v) else 0"), "whether it has ever come"),
    (sends("2 * x.c.v - x.E.v"), "a loop over the measured speed"),
    (sends("d", '        let: {d: "-x.c.v"}\n'), "a let"),
    (
        RAMP + "        through: {v_p: 'v_p + clamp(x.c.v - v_p, -0.1[m/s], 0.1[m/s])', "
        "y.E.v_d: v_p, y.c.s: x.E.s}\n",
        "a ramp in memory",
    ),
    (
        RAMP + "        through: {v_p: x.c.v if fresh(x.c.v) else v_p, y.E.v_d: v_p, "
        "y.c.s: x.E.s}\n",
        "memory that keeps what came",
    ),
    (machine("y.E.v_d: x.c.v", "terminal: never"), "a state that never ends"),
    (machine("y.E.v_d: x.c.v", "terminal: switched", TERMINAL), "a state that waits for more"),
    (machine("y.E.v_d: x.c.v", "terminal: never, error: fast", ERROR), "an accident"),
]


def remembers(value: str) -> str:
    """A virtual effector that sends what it remembered."""
    through = "        through: {v_p: " + value + ", y.E.v_d: v_p, y.c.s: x.E.s}\n"
    return RAMP + through


ENDS = [
    (sends("x.c.v if fresh(x.c.v) else 0"), "fresh"),
    (remembers("x.c.v if fresh(x.c.v) else 0"), "memory that begins anew"),
    (remembers("x.c.v if fresh(x.c.v) else 0.9 * v_p"), "memory that decays"),
    (remembers("'x.c.v if fresh(x.c.v) else max(v_p - 0.01[m/s], 0)'"), "a ramp down in memory"),
    (sends("x.c.v if age(x.c.v) < 0.3[s] else 0"), "age"),
    (sends("clamp(2[1/s] * (x.c.to - x.E.s), -x.c.v, x.c.v)"), "a largest speed on a way"),
    (sends("x.c.v if x.E.s < 2[m] else 0"), "an end of the way"),
    (machine("y.E.v_d: x.c.v", "terminal: late", TERMINAL), "time"),
    (machine("y.E.v_d: x.c.v", "terminal: quiet", TERMINAL), "nothing that comes"),
    (machine("y.E.v_d: x.c.v", "terminal: old", TERMINAL), "age in a condition"),
    (machine("y.E.v_d: x.c.v", "terminal: never, error: counted", ERROR), "counted periods"),
    (machine("y.E.v_d: 'x.c.v if since < 0.3[s] else 0'", "terminal: never"), "counted in a value"),
    (machine("y.E.v_d: 'x.c.v if elapsed < 1[s] else 0'", "terminal: never"), "elapsed"),
]


@pytest.mark.parametrize(("effector", "what"), KEPT, ids=[what for _, what in KEPT])
def test_what_an_effector_sends_on_stays(effector: str, what: str, tmp_path: Path) -> None:
    assert held(checked(tmp_path, effector)) == ["aborted"]


@pytest.mark.parametrize(("effector", "what"), every(3, ENDS), ids=[what for _, what in ENDS])
def test_an_effector_that_ends_it_by_itself_is_not_found(
    effector: str, what: str, tmp_path: Path
) -> None:
    assert held(checked(tmp_path, effector)) == []


def control(states: str, ways: str, initial: str = "driving") -> str:
    """A machine of some states that drive and others that send nothing of it."""
    return f"""\
      behaviours:
        drive: {{functions: [drive, other], terminal: there, error: too_long}}
        stand: {{functions: [stand], terminal: later}}
        rest: {{terminal: later}}
        pass: {{terminal: always}}
        halt: {{functions: [{{y.motor.on: False}}], terminal: always}}
        turn: {{functions: [{{y.motor.w: "0.1[m/s]"}}], terminal: later}}
      states: {{{states}}}
      initial_state: {initial}
      transitions: [{ways}]
"""


def rows(*ways: str) -> str:
    """Rows from `a b`, or `a error b` after an error."""
    made = []
    for way in ways:
        source, *cause, target = way.split()
        made.append(f"[{source}, {cause[0] if cause else 'terminal'}, always, {target}]")
    return ", ".join(made)


CIRCLE = rows("driving a", "driving error a", "a b", "b driving")
FOUND = [
    ("driving: drive, a: rest, b: stand", CIRCLE, ["a"]),
    ("driving: drive, a: pass, b: rest", CIRCLE, ["b"]),
    ("driving: drive, a: pass, b: pass", CIRCLE, []),
    ("driving: drive, a: stand, b: rest", CIRCLE, []),
    ("driving: drive, a: turn, b: rest", CIRCLE, ["a", "b"]),
    ("driving: drive, a: {behaviour: turn, holds: [y.motor.v]}, b: rest", CIRCLE, ["b"]),
    (
        "driving: drive, a: pass, b: pass",
        CIRCLE.replace("b, terminal, always, driving", "b, terminal, always, a"),
        ["a", "b"],
    ),
    (
        "driving: drive, a: stand, b: rest",
        CIRCLE.replace("driving, error, always, a", "driving, error, always, b"),
        ["b"],
    ),
]


@pytest.mark.parametrize("number", range(len(FOUND)))
def test_states_in_which_it_stays(number: int, tmp_path: Path) -> None:
    states, way, expected = FOUND[number]
    assert held(checked(tmp_path, control=control(states, way))) == expected


def test_what_is_only_ever_zero_moves_nothing(tmp_path: Path) -> None:
    text = control("driving: drive, a: rest, b: stand", CIRCLE)
    for value, expected in (("0", []), ("0[m/s] * 2", []), ("x.motor.s / 9[s]", ["a"])):
        drive = text.replace("[drive, other]", f'[{{y.motor.v: "{value}"}}, other]')
        assert held(checked(tmp_path, control=drive)) == expected, value


def test_nothing_has_been_sent_before_the_first_command(tmp_path: Path) -> None:
    way = rows("a driving", "driving b", "driving error b", "b b")
    text = control("a: rest, driving: drive, b: stand", way, initial="a")
    assert held(checked(tmp_path, control=text)) == []


def test_another_element_ends_it(tmp_path: Path) -> None:
    """What a silent state sends beside, or one on the way to it, may stop the effector."""
    switched = sends("x.c.v if x.c.on else 0")
    stopping = machine("y.E.v_d: x.c.v", "terminal: switched", TERMINAL)
    ways = [
        ("driving: drive, a: halt, b: rest", CIRCLE, [], ["b"]),
        ("driving: drive, a: rest, b: halt", CIRCLE, ["a"], ["a"]),
        (
            "driving: drive, a: halt, b: rest",
            CIRCLE.replace("error, always, a", "error, always, b"),
            ["b"],
            ["b"],
        ),
    ]
    for states, way, stopped, copied in ways:
        text = control(states, way)
        assert held(checked(tmp_path, switched, text)) == stopped, states
        assert held(checked(tmp_path, stopping, text)) == stopped, states
        assert held(checked(tmp_path, control=text)) == copied, states


def test_an_effector_that_is_silent_itself(tmp_path: Path) -> None:
    silent = machine("y.E.v_d: x.c.v", "terminal: late", TERMINAL)
    silent = silent.replace("functions: [stand, sense]", "functions: [sense]")
    assert held(checked(tmp_path, silent)) == ["standing"]


TYPES = """\
types:
  Twist: {fields: {v: "real[m/s]", w: "real[rad/s]", brake: bool}, python: "cart.moves:Twist"}
  Move: {fields: {to: "real[m]", v: "real[m/s]"}, python: "cart.moves:Move"}
frames: {E: cart}
operators:
  PLAN: {signature: "(s: real[m]) -> TYPE", python: "cart.moves:plan"}
"""
UNITS = [
    *(("real[m/s]", True), ("real[rad/s]", True), ("real[N]", True), ("real[N*m]", True)),
    *(("real[A]", True), ("vector[3, A]", True), ("twist[E]", True), ("wrench[E]", True)),
    *(("partial[wrench[E]]", True), ("optional[real[N]]", True), ("Twist", True)),
    *(("real[m]", False), ("real[rad]", False), ("real", False), ("bool", False)),
    *(("pose[E, E]", False), ("Move", False), ("list[real[m/s]]", False), ("real[V]", False)),
]


@pytest.mark.parametrize(("of", "expected"), every(3, UNITS), ids=[of for of, _ in UNITS])
def test_units_decide(of: str, expected: bool, tmp_path: Path) -> None:
    text = CART.replace("EFFECTOR\n", COPIES).replace("CONTROL\n", DRIVES)
    text = text.replace('v_d: "real[m/s]"', f'v_d: "{of}"').replace(
        "agents:\n", f"{TYPES}agents:\n"
    )
    text = text.replace("TYPE", of).replace('v: {type: "real[m/s]", init: 0}', f'v: "{of}"')
    text = text.replace('motor: {v: "real[m/s]", w', f'motor: {{v: "{of}", w')
    text = text.replace('"0.5[m/s]"', "PLAN(x.motor.s)").replace(
        "y.motor.v: 0}", "y.motor.v: PLAN(x.motor.s)}"
    )
    text = text.replace(
        "through: {y.E.v_d: x.c.v,", "through: {y.E.v_d: x.c.v if present(x.c.v) else PLAN(x.E.s),"
    )
    path = tmp_path / "cart.yaml"
    path.write_text(text, encoding="utf-8")
    result = compile_spec(str(path))
    assert result.ok, [d.message for d in result.diagnostics]
    assert held(result) == ["aborted"] * expected
