"""Constants that change while a run goes on: when, within which range, and the same again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from specc_runtime import application
from specc_runtime.companion import Companion, View
from specc_runtime.session import Session
from specc_runtime.system import LiveConstant

from tests.recording.runs import messages, report_of, specc
from tests.runtime.apart import Run, built
from tests.runtime.test_disturbances import MODEL, SPEC
from tests.seeds import every

CONSTANTS = """constants:
  v: {is: "1[m/s]", range: [0, 2], live: true}
  far: {is: "3 * v * 1[s]"}
  most: {is: 3, range: [1, 5], live: true}
agents:
"""
LIVE = (
    SPEC.replace("agents:\n", CONSTANTS)
    .replace('go: {y.wheels.v_d: "1[m/s]"}', "go: {y.wheels.v_d: v}")
    .replace('"x.wheels.s > 3[m]"', "x.wheels.s > far")
    .replace("unheard + 1}", "(unheard + 1 if unheard < most else 0)}")
)
REQUIRE = """require:
  - that: >-
      always(present(cart.E.wheels.v_d) implies
      cart.E.wheels.v_d <= 1[m/s] or once(0.3[s], v > 1[m/s]))
    because: of the test
"""
Changes = Sequence[tuple[float, str, float]]
"""When, which constant, and its value."""


def spec_in(folder: Path, *happens: str) -> Path:
    """The specification, with things that happen."""
    (folder / "cart.xml").write_text(MODEL)
    disturb = "".join(f"    - {{{each}, because: of the test}}\n" for each in happens)
    spec = folder / "cart.yaml"
    spec.write_text(f"{LIVE}  disturb:\n{disturb}{REQUIRE}" if happens else f"{LIVE}{REQUIRE}")
    return spec


def ran(spec: Path, *options: object, code: int = 0) -> dict[str, Any]:
    """The report of three seconds."""
    report = spec.with_name("report.json")
    found = specc("run", spec, "--duration", 3, "--report", report, *options)
    assert found.returncode == code, found.stdout + found.stderr
    return report_of(report)


class Operator:
    """Somebody who changes constants at some times."""

    period_s = 0.02

    def __init__(self, session: Session, changes: Changes) -> None:
        self._session, self._changes = session, changes

    def tick(self, view: View) -> None:
        """See `Companion`."""
        for time_s, name, value in self._changes:
            if abs(view.time_s - time_s) < 1e-6:
                self._session.set_constant(name, value)

    def close(self) -> None:
        """See `Companion`."""


def operate(patch: pytest.MonkeyPatch, changes: Changes) -> None:
    """Have a program make changes in all runs; those at time 0 before they begin."""

    class Operated(Session):
        def run(self, companions: Sequence[Companion] = ()) -> None:
            for time_s, name, value in changes:
                if not time_s:
                    self.set_constant(name, value)
            super().run([*companions, Operator(self, changes)])

    patch.setattr(application, "Session", Operated)


@pytest.mark.parametrize("value", every(4, [0.0, 0.3, 1.7, 2.0]))
def test_a_change_at_the_start_is_a_value_that_is_set(value: float, tmp_path: Path) -> None:
    adjusted = ran(spec_in(tmp_path, f'at: "0[s]", adjust: {{v: "{value}[m/s]", most: 4}}'))
    given = ran(spec_in(tmp_path), "--set", f"v={value}", "--set", "most=4")
    assert adjusted["records_sha256"] == given["records_sha256"]
    assert [each["tick"] for each in adjusted["changes"]] == [0, 0]
    assert "changes" not in given


def test_a_program_changes_what_a_disturbance_adjusts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    happens = 'at: "0.5[s]", adjust: {v: "0.4[m/s]"}', 'at: "1.3[s]", adjust: {v: "1.5[m/s]"}'
    adjusted = ran(spec_in(tmp_path, *happens))
    plain = ran(spec_in(tmp_path))
    operate(monkeypatch, [(0.5, "v", 0.4), (1.3, "v", 1.5)])
    operated = ran(spec_in(tmp_path))
    assert operated["records_sha256"] == adjusted["records_sha256"] != plain["records_sha256"]
    assert operated["changes"] == [
        {"tick": 25, "constant": "v", "value": 0.4, "by": "program", "time_s": 0.5},
        {"tick": 65, "constant": "v", "value": 1.5, "by": "program", "time_s": 1.3},
    ]
    assert [each["by"] for each in adjusted["changes"]] == ["task", "task"]
    assert [each["verdict"] for each in operated["requirements"]] == ["met"]


def test_threads_see_a_change_as_if_there_were_none(tmp_path: Path) -> None:
    spec = spec_in(tmp_path, 'at: "0.34[s]", every: "0.26[s]", adjust: {v: ["0[m/s]", "2[m/s]"]}')
    assert len(ran(spec)["changes"]) > 8
    assert ran(spec)["records_sha256"] == ran(spec, "--inline")["records_sha256"]


@pytest.mark.parametrize("at", every(3, [0.9, 1.26, 2.4]))
def test_a_run_with_changes_is_replayed_and_goes_on(
    at: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spec, file = spec_in(tmp_path, 'at: "0.7[s]", adjust: {most: 2}'), tmp_path / "run.mcap"
    operate(monkeypatch, [(0, "v", 0.5), (0.8, "v", 1.2), (1.2, "v", 0.1), (1.9, "most", 5)])
    whole = ran(spec, "--record", file)
    assert len(whole["changes"]) == 5
    recorded = [data for _, data in messages(file)["/constants"]]
    assert recorded == [
        {name: change[name] for name in ("tick", "constant", "value", "by")}
        for change in whole["changes"]
    ]
    replayed = specc("replay", file, "--spec", spec, "--check")
    assert replayed.returncode == 0, replayed.stdout
    # What the program did until then is done again; it does the rest itself.
    rest = [(0.8, "v", 1.2), (1.2, "v", 0.1), (1.9, "most", 5.0)]
    operate(monkeypatch, [(t, n, int(v) if n == "most" else v) for t, n, v in rest if t >= at])
    again = ran(spec, "--from", f"{file}@{at}")
    assert again["records_sha256"] == whole["records_sha256"]
    assert again["changes"] == whole["changes"]


def test_a_recording_tells_what_a_constant_was(tmp_path: Path) -> None:
    spec, file = spec_in(tmp_path, 'at: "0.5[s]", adjust: {v: "0.4[m/s]"}'), tmp_path / "run.mcap"
    ran(spec, "--record", file)
    for at, far in ((0.3, 3), (1.0, 1.2)):
        found = specc("why", f"{file}@{at}", "cart.c", "--spec", spec)
        assert f"needs > {far} m (far)" in found.stdout, found.stdout


@pytest.mark.parametrize(
    ("name", "value", "why"),
    every(
        3,
        [
            ("v", 2.1, "v is not 2.1 m/s: its range is 0 to 2 m/s"),
            ("v", -0.1, "v is not -0.1 m/s: its range is 0 to 2 m/s"),
            ("v", float("nan"), "v is not nan m/s: its range is 0 to 2 m/s"),
            ("v", "fast", "v is a number, and not 'fast'"),
            ("v", True, "v is a number, and not True"),
            ("most", 2.0, "most is a whole number, and not 2.0"),
            ("most", 6, "most is not 6: its range is 1 to 5"),
            ("far", 2.0, "far is no constant that may change; there are: v, most"),
        ],
    ),
)
def test_a_wrong_change_is_refused(
    name: str, value: Any, why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[str] = []

    class Operated(Session):
        def run(self, companions: Sequence[Companion] = ()) -> None:
            with pytest.raises(ValueError) as refused:
                self.set_constant(name, value)
            found.append(str(refused.value))
            super().run(companions)

    monkeypatch.setattr(application, "Session", Operated)
    assert "changes" not in ran(spec_in(tmp_path))
    assert found == [why]


def test_a_number_becomes_one_of_the_type_of_the_constant() -> None:
    assert repr(LiveConstant("v", 1.0, 0.0, 2.0).checked(1)) == "1.0"
    assert repr(LiveConstant("n", 1, 0, 2).checked(2)) == "2"


def test_a_value_that_is_set_is_within_the_range(tmp_path: Path) -> None:
    found = specc("run", spec_in(tmp_path), "--set", "v=2.5")
    assert found.returncode == 2
    assert "E0343]: `v` is 2.5[m/s], outside of its range, 0[m/s] to 2[m/s]" in found.stderr


ALONE = """\
specc: 1.2
system: alone
constants:
  v: {is: 1, range: [0, 100], live: true}
  w: {is: "0.5[m]", range: [0, 2], live: true}
agents:
  a:
    control:
      rate: 50 Hz
      x: {b: {s: {type: "real[m]", init: 0}}}
      y: {b: {n: int}}
      memory: {n: {type: int, init: v}}
      functions: {count: {n: n + v, y.b.n: n}}
      behaviours: {count: {functions: [count], terminal: never}}
      states: {S0: count}
      initial_state: S0
  b:
    control:
      rate: 10 Hz
      x: {a: {n: {type: int, init: 0}}}
      y: {a: {s: "real[m]"}}
      memory: {s: {type: "real[m]", init: w}}
      functions: {add: {s: "s + w * (1 + v) + x.a.n * 0.001[m]", y.a.s: s}}
      behaviours: {add: {functions: [add], terminal: never}}
      states: {S0: add}
      initial_state: S0
"""


@pytest.mark.long
def test_a_process_sees_a_change_as_all_others_do(tmp_path: Path) -> None:
    package, digests = built(tmp_path, ALONE), set()
    for apart in ((), ("b.c",), ("a.c", "b.c")):
        with Run(package, *apart) as run:
            run.executor.set_constant("v", 7)
            for tick in range(0, 200, 13):
                run.to(tick)
                run.executor.set_constant("v", tick % 11)
                run.executor.set_constant("w", tick / 100)
            run.to(250)
            assert run.faults == []
            assert run.records[-1].sent
            digests.add(run.digest.hexdigest())
    assert len(digests) == 1
