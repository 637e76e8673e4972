"""What unknown values lie within decides conditions and requirements, as far as it goes."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.commands import specc

SPEC = """\
specc: 1.2
system: bounded
constants: {{fast: "1[m/s]"}}
agents:
  a:
    real_effectors:
      m: {{x: {{u: "real[m/s]", w: "vector[2, m/s]"}}, y: {{v: "real[m/s]"}}}}
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {{E: {{v: {{type: "real[m/s]", init: 0}}}}, c: {{go: bool}}}}
        y: {{E: {{u: "real[m/s]", w: "vector[2, m/s]"}}, c: {{speed: "real[m/s]"}}}}
        memory: {{kept: {{type: "real[m/s]", init: 0}}, total: {{type: "real[m/s]", init: 0}}}}
        conditions: {{terminal: {{asked: fresh(x.c.go)}}}}
        functions:
          drive:
            y.E.u: "clamp(x.E.v + fast, -fast, fast)"
            y.E.w: "[clamp(x.E.v, -fast, fast), 0.5 * kept]"
            y.c.speed: "max(abs(kept), abs(x.E.v) + 2[m/s])"
            kept: "clamp(kept + x.E.v, -fast, fast)"
            total: total + x.E.v
          rest: {{y.E.u: "0[m/s]", y.c.speed: "3[m/s]"}}
        behaviours:
          work: {{functions: [drive], terminal: asked}}
          stop: {{functions: [rest], terminal: asked}}
        states: {{go: work, end: stop}}
        initial_state: end
        transitions: [[go, terminal, always, end], [end, terminal, always, go]]
    control:
      rate: 10 Hz
      x: {{m: {{speed: {{type: "real[m/s]", init: "2[m/s]"}}}}}}
      y: {{m: {{go: bool}}}}
      memory: {{n: {{type: int, init: 0}}}}
      conditions: {{terminal: {{slow: "{slow}"}}}}
      functions:
        count: {{n: "n + 1 if n < 5 else 0", y.m.go: n == 3}}
        tell: {{y.m.go: "n == 3"}}
      behaviours:
        work: {{functions: [count], terminal: slow}}
        tell: {{functions: [tell], terminal: never}}
      states: {{S0: work, S1: tell}}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
require:
  - {{that: "always({that})", because: it is tried}}
"""
VERDICTS = {
    "present(a.E.m.u) implies a.E.m.u <= fast": "proved",
    "not present(a.E.m.u) or abs(a.E.m.u) < 1.5[m/s]": "proved",
    "present(a.E.m.u) implies a.E.m.u <= 0.5[m/s]": "not decided",
    "present(a.E.m.w) implies a.E.m.w[0] <= fast and abs(a.E.m.w[1]) <= fast": "proved",
    "present(a.E.m.w) implies a.E.m.w[1] <= 0.4[m/s]": "not decided",
    "a.m.kept + 1[m/s] <= 2 * fast": "proved",
    "a.m.total < 100[m/s]": "not decided",
    "a.E.m.u <= fast": "not decided, since `a.E.m.u` is absent at some time: "
    "write `present(a.E.m.u) implies ...`",
}


def explored(folder: Path, that: str, slow: str = "x.m.speed > 1e6[m/s]") -> str:
    (folder / "bounded.yaml").write_text(SPEC.format(that=that, slow=slow), "utf-8")
    done = specc("explore", folder / "bounded.yaml")
    return str(done.stdout + done.stderr)


@pytest.mark.parametrize("that", VERDICTS)
def test_a_requirement_is_decided_where_all_values_in_its_bounds_say_the_same(
    that: str, tmp_path: Path
) -> None:
    (told,) = (
        line for line in explored(tmp_path, that).splitlines() if line.startswith("requirement")
    )
    assert told.partition("`: ")[2].startswith(VERDICTS[that])


def test_a_wait_for_what_no_measurement_makes_true_is_found(tmp_path: Path) -> None:
    assert "W1004" not in explored(tmp_path, "a.m.kept <= fast", "x.m.speed > 5[m/s]")
    assert "`a.c` can never leave `S0`" in explored(
        tmp_path, "a.m.kept <= fast", "x.m.speed < 2[m/s]"
    )
