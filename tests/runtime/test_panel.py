"""The operator's panel while a system runs: what its readers see, and the same again."""

from __future__ import annotations

import json
import random
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from specc_runtime import application
from specc_runtime.companion import Companion, View
from specc_runtime.cycle import Executor
from specc_runtime.environment import open_plant
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.panel import DEAD_MAN_S, LATEST_S
from specc_runtime.processes.worker import Processes
from specc_runtime.recording.replay import replay
from specc_runtime.records import RecordDigest, StepRecord
from specc_runtime.session import Session
from specc_runtime.timing import RealTime

from specc.cli import main
from tests.recording.runs import messages, specc
from tests.runtime.apart import built
from tests.runtime.desk import ENABLE, MODE, READER, SPEC, START, STOP, N, V
from tests.runtime.test_disturbances import MODEL
from tests.seeds import blocks

Operated = Sequence[tuple[float, str, Any]]
"""When, which element, and its value."""


class HandClock:
    """A clock that goes on when it is told to, or when it is waited for."""

    def __init__(self) -> None:
        self.time_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def wait(self, duration_s: float) -> None:
        self.time_s += max(0.0, duration_s)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return built(tmp_path_factory.mktemp("desk"), SPEC)


class Run:
    """A run by a program, up to a tick."""

    def __init__(self, package: Path, *apart: str, clock: Any = None, **more: Any) -> None:
        loaded = load_system(package, package.parent.parent)
        self.system = replace(loaded, tests_all_rows=True)
        self.records: list[StepRecord] = []
        self.digest = RecordDigest()
        self._apart = Options(package, package.parent.parent, apart=apart)
        self._more = more | {"clock": clock}

    def __enter__(self) -> Run:
        self.processes = Processes()
        self.processes.begin(self.system, self._apart)
        self.processes.wait()
        self.executor = Executor(
            self.system, None, (self._observe, self.digest), processes=self.processes, **self._more
        )
        return self

    def _observe(self, record: StepRecord) -> None:
        self.records.append(record)

    def __exit__(self, *error: object) -> None:
        self.executor.close()

    def to(self, tick: int) -> Run:
        while self.executor.tick < tick and self.executor.advance():
            pass
        assert self.executor.faults == []
        return self

    def sent(self, element: str) -> list[Any]:
        """What the reader of the panel has sent, step by step."""
        self.executor.finish()
        return [dict(r.sent)[f"c_{element}"] for r in self.records if r.subsystem == READER]


def test_nobody_operates_and_elements_have_their_initial_values(package: Path) -> None:
    with Run(package) as run:
        run.to(50)
        assert open_plant(run.system) is None
        assert run.executor.panel.operations == []
        assert set(run.sent("pressed")) == {0}
        assert set(run.sent("mode")) == {"manual"}
        assert set(run.sent("held")) == {False}


@pytest.mark.parametrize("apart", [(), (READER,)])
@pytest.mark.parametrize("seeds", blocks([0], also=range(1, 3), long=6, each=3))
def test_presses_between_two_samples_are_one(
    package: Path, seeds: Sequence[int], apart: tuple[str, ...]
) -> None:
    for seed in seeds:
        press_at_random(package, random.Random(seed), apart)


def press_at_random(package: Path, random_: random.Random, apart: tuple[str, ...]) -> None:
    presses = [random_.choice((0, 0, 1, 2, 5)) for _ in range(60)]
    with Run(package, *apart) as run:
        for tick, times in enumerate(presses):
            for _ in range(times):
                run.executor.operate(START, True)
            run.to(tick + 1)
        run.to(len(presses) + 2)
        seen = run.sent("seen")
    assert seen[1 : len(presses) + 1] == [times > 0 for times in presses]
    assert not any(seen[len(presses) + 1 :])


@pytest.mark.parametrize("seeds", blocks(range(2), also=range(2, 5), long=20, each=10))
def test_presses_are_read_once_in_real_time_whatever_is_late(
    package: Path, seeds: Sequence[int]
) -> None:
    """The reader is late, on time, or so late that the next step is left out."""
    for seed in seeds:
        press_in_real_time(package, random.Random(seed))


def press_in_real_time(package: Path, random_: random.Random) -> None:
    clock, presses = HandClock(), 0
    with Run(package, clock=clock, timing=RealTime(clock)) as run:
        for _ in range(200):
            if not run.executor.panel.values[START] and random_.random() < 0.4:
                for _ in range(random_.randint(1, 3)):
                    run.executor.operate(START, True)
                presses += 1
                run.executor.advance()
                continue
            clock.wait(random_.choice((0.0, 0.0, 0.005, 0.015, 0.019, 0.05, 0.3)))
            run.executor.advance()
        for _ in range(3):
            run.executor.advance()
        assert run.executor.faults == []
        assert sum(run.sent("seen")) == presses


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [
        (V, 0.3, f"{V} is not 0.3 m/s: its range is 0 to 0.2 m/s"),
        (V, float("nan"), f"{V} is not nan m/s: its range is 0 to 0.2 m/s"),
        (V, 10**400, f"{V} is not inf m/s: its range is 0 to 0.2 m/s"),
        (V, "fast", f"{V} is a number, and not 'fast'"),
        (V, True, f"{V} is a number, and not True"),
        (N, 1.0, f"{N} is a whole number, and not 1.0"),
        (N, 11, f"{N} is not 11: its range is 0 to 10"),
        (MODE, "fast", f"{MODE} is not 'fast': it is one of manual, auto"),
        (MODE, 1, f"{MODE} is not 1: it is one of manual, auto"),
        (STOP, 1, f"{STOP} is true or false, and not 1"),
        (START, False, f"{START} is a button that can only be pressed: true"),
        ("desk.R.buttons.go", True, "desk.R.buttons.go is no element of the panel; there are: "),
    ],
)
def test_a_wrong_operation_is_refused(package: Path, name: str, value: Any, why: str) -> None:
    with Run(package) as run:
        with pytest.raises(ValueError) as refused:
            run.executor.operate(name, value)
        assert str(refused.value).startswith(why)
        assert run.to(3).executor.panel.operations == []


def test_only_what_is_held_gives_signs_of_life(package: Path) -> None:
    with Run(package) as run:
        panel = run.executor.panel
        for call in (lambda name: panel.hold(name, 0.0), panel.release):
            with pytest.raises(ValueError, match="is no button that is held"):
                call(START)
        with pytest.raises(ValueError, match="has to be held"):
            panel.operate(ENABLE, True, "page")


@pytest.mark.parametrize("seeds", blocks([0], also=range(1, 3), long=9, each=3))
def test_a_button_is_held_until_the_signs_of_life_are_too_old(
    package: Path, seeds: Sequence[int]
) -> None:
    for seed in seeds:
        hold_at_random(package, random.Random(seed))


def hold_at_random(package: Path, random_: random.Random) -> None:
    """A model of the law beside the panel: held, since when, and whether it has to be let go."""
    clock, expected = HandClock(), []
    held, lapsed, sign_s = False, False, 0.0
    with Run(package, clock=clock, inline=True) as run:
        panel = run.executor.panel
        for tick in range(300):
            clock.wait(random_.choice((0.0, 0.01, 0.05, 0.05, 0.19, 0.21)))
            does = random_.choice(("hold",) * 6 + ("release", ""))
            waited_s = random_.choice((0.0, 0.1, LATEST_S - 0.01, LATEST_S + 0.01, 3.0))
            if does == "release":
                panel.release(ENABLE)
                held = lapsed = False
            elif does == "hold":
                panel.hold(ENABLE, clock.time_s - waited_s)
                if waited_s <= LATEST_S and not lapsed:
                    held, sign_s = True, clock.time_s
            clock.wait(random_.choice((0.0, 0.1, 0.21)))
            if held and clock.time_s - sign_s > DEAD_MAN_S:
                held, lapsed = False, True
            expected.append(held)
            run.to(tick + 1)
        operations = panel.operations
        assert run.sent("held") == expected
        assert {each.by for each in operations} == {"page"}


class Operator:
    """Somebody who operates the panel at some times, or holds a button of it."""

    period_s = 0.02

    def __init__(self, session: Session, operations: Operated) -> None:
        self._session, self._operations = session, operations

    def tick(self, view: View) -> None:
        """See `Companion`."""
        for time_s, name, value in self._operations:
            if abs(view.time_s - time_s) < 1e-6:
                operate(self._session, name, value)

    def close(self) -> None:
        """See `Companion`."""


def operate(session: Session, name: str, value: Any) -> None:
    """As a program does, or as a page if it is `hold` or `release`."""
    if value == "hold":
        session.panel.hold(name, time.perf_counter())
    elif value == "release":
        session.panel.release(name)
    else:
        session.operate(name, value)


def ran(
    package: Path, patch: pytest.MonkeyPatch, operations: Operated, **options: Any
) -> dict[str, Any]:
    """The report of a run of three seconds in which somebody operates; at 0 before it begins."""

    class OperatedSession(Session):
        def run(self, companions: Sequence[Companion] = ()) -> None:
            for time_s, name, value in operations:
                if not time_s:
                    operate(self, name, value)
            super().run([*companions, Operator(self, operations)])

    patch.setattr(application, "Session", OperatedSession)
    report = package.with_name("report.json")
    texts = {"apart.yaml": SPEC}
    chosen = {"duration_s": 3.0, "quiet": True, "report": report, "texts": texts, **options}
    assert application.execute(Options(package, package.parent.parent, **chosen)) == 0
    return dict(json.loads(report.read_text()))


ALL: Operated = [
    (0, V, 0.05),
    (0, START, True),
    (0.3, ENABLE, True),
    (0.5, MODE, "auto"),
    (0.5, START, True),
    (0.5, START, True),
    (1.22, N, 3),
    (1.4, STOP, True),
    (1.6, STOP, False),
    (2.3, ENABLE, False),
    (2.5, MODE, "manual"),
]


def test_a_run_that_is_operated_is_recorded_and_replayed(
    package: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "run.mcap"
    plain = ran(package, monkeypatch, [])
    report = ran(package, monkeypatch, ALL, record=file)
    assert "panel" not in plain
    assert report["records_sha256"] != plain["records_sha256"]
    operated = [(each["time_s"], each["element"], each["value"]) for each in report["panel"]]
    assert operated == list(ALL)
    assert {each["by"] for each in report["panel"]} == {"program"}
    recorded = [data for _, data in messages(file)["/panel"]]
    assert recorded == [
        {name: each[name] for name in ("tick", "element", "value", "by")}
        for each in report["panel"]
    ]
    outcomes, _ = replay(package, package.parent.parent, file)
    assert {one.subsystem: one.steps for one in outcomes} == {READER: 150, "desk.c": 30}
    assert not any(one.difference or one.unknown for one in outcomes)


@pytest.mark.parametrize("seeds", blocks([0], also=range(1, 4), long=24, each=6))
def test_a_run_that_goes_on_repeats_what_was_operated(
    package: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, seeds: Sequence[int]
) -> None:
    for seed in seeds:
        go_on_at_random(package, monkeypatch, tmp_path / f"{seed}.mcap", random.Random(seed))


VALUES: dict[str, Sequence[Any]] = {
    START: (True,),
    ENABLE: (True, False),
    STOP: (True, False),
    V: (0.0, 0.1, 0.2),
    MODE: ("manual", "auto"),
    N: (0, 1, 10),
}


def go_on_at_random(
    package: Path, patch: pytest.MonkeyPatch, file: Path, random_: random.Random
) -> None:
    times = sorted(random_.randrange(150) / 50 for _ in range(25))
    names = [random_.choice(list(VALUES)) for _ in times]
    operations = [
        (at, name, random_.choice(VALUES[name])) for at, name in zip(times, names, strict=True)
    ]
    whole = ran(package, patch, operations, record=file)
    at = random_.randrange(10, 149) / 50
    rest = [each for each in operations if each[0] >= at]
    again = ran(package, patch, rest, resume=(file, at))
    assert again["records_sha256"] == whole["records_sha256"], at
    assert again["panel"] == whole["panel"], at


def test_nobody_holds_a_button_of_a_run_that_goes_on(
    package: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The page is gone that held it, and until then the run is the same."""
    file = tmp_path / "run.mcap"
    signs = [(0.3 + n / 50, ENABLE, "hold") for n in range(100)]
    held = ran(package, monkeypatch, [*signs, (2.3, ENABLE, "release")], record=file)
    assert [(each["time_s"], each["value"]) for each in held["panel"]] == [
        (0.3, True),
        (2.3, False),
    ]
    gone = ran(package, monkeypatch, [], resume=(file, 1.5))
    assert [(each["time_s"], each["value"]) for each in gone["panel"]] == [
        (0.3, True),
        (1.5, False),
    ]
    alike = ran(package, monkeypatch, [*signs[:60], (1.5, ENABLE, "release")])
    assert gone["records_sha256"] == alike["records_sha256"]


def times_of(report: dict[str, Any]) -> list[tuple[float, Any]]:
    """When a button was held, and when not any more."""
    return [(each["time_s"], each["value"]) for each in report["panel"]]


TASK = """\
task:
  cycle: {of: desk.c, from: moving, to: idle}
  disturb:
    - {at: "0[s]", turn: {desk.R.buttons.v: "0.05[m/s]"}, because: of the test}
    - {at: "0[s]", press: [desk.R.buttons.start], because: of the test}
    - {at: "0.3[s]", lasts: "2[s]", press: [desk.R.buttons.enable], because: of the test}
    - {at: "0.5[s]", turn: {desk.R.buttons.mode: auto}, because: of the test}
    - {at: "0.5[s]", press: [desk.R.buttons.start], because: of the test}
    - {at: "1.22[s]", turn: {desk.R.buttons.n: 3}, because: of the test}
    - {at: "1.4[s]", turn: {desk.R.buttons.stop: true}, because: of the test}
    - {at: "1.6[s]", turn: {desk.R.buttons.stop: false}, because: of the test}
    - {at: "2.5[s]", turn: {desk.R.buttons.mode: manual}, because: of the test}
"""


def test_a_task_operates_as_a_program_does(
    package: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    spec, file, report = (tmp_path / name for name in ("desk.yaml", "run.mcap", "report.json"))
    spec.write_text(SPEC + TASK)
    operated = ran(package, monkeypatch, ALL)
    monkeypatch.undo()
    for more in (["--record", str(file)], ["--from", f"{file}@1.5"]):
        options = ["--duration", "3", "--report", str(report)]
        assert main(["run", str(spec), *options, *more]) == 0
        data = json.loads(report.read_text())
        assert data["records_sha256"] == operated["records_sha256"]
        assert {each["by"] for each in data["panel"]} == {"task"}
        assert len(data["panel"]) == 10
    assert main(["replay", str(file), "--spec", str(spec), "--check"]) == 0


def test_another_specification_goes_on_with_what_was_operated(
    package: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The recorded one repeats the operations until then, and the other one does not."""
    spec, file, report = (tmp_path / name for name in ("apart.yaml", "run.mcap", "report.json"))
    whole = ran(package, monkeypatch, ALL, record=file)
    monkeypatch.undo()
    spec.write_text(SPEC.replace("else most", "else 2 * most"))
    options = ["--duration", "3", "--report", str(report), "--from", f"{file}@1.5"]
    assert main(["run", str(spec), *options]) == 0
    past = [each for each in whole["panel"] if each["time_s"] < 1.5]
    assert json.loads(report.read_text())["panel"] == past


CART = """\
specc: 1.3
system: cart
agents:
  cart:
    real_effectors: {wheels: {x: {v_d: "real[m/s]"}, y: {s: "real[m]"}}}
    real_receptors: {desk: {y: {v: "real[m/s]", go: bool}}}
    virtual_effectors:
      wheels:
        rate: 50 Hz
        x: {c: {v_d: {type: "real[m/s]", init: 0}}, E: {s: "real[m]"}}
        y: {E: {v_d: "real[m/s]"}, c: {s: "real[m]"}}
        functions: {drive: {y.E.v_d: x.c.v_d, y.c.s: x.E.s}}
        behaviours: {drive: {functions: [drive], terminal: never}}
        states: {S0: drive}
        initial_state: S0
    virtual_receptors: {desk: {rate: 20 Hz, through: identity}}
    control:
      rate: 20 Hz
      x: {wheels: {s: "real[m]"}, desk: {v: "real[m/s]", go: bool}}
      y: {wheels: {v_d: "real[m/s]"}}
      functions:
        go: {y.wheels.v_d: "x.desk.v if present(x.desk.v) else 0[m/s]"}
        rest: {y.wheels.v_d: 0}
      behaviours:
        rest: {functions: [rest], terminal: {when: present(x.desk.go) and x.desk.go}}
        go: {functions: [go], terminal: {when: "present(x.wheels.s) and x.wheels.s > 9[m]"}}
      states: {resting: rest, going: go}
      initial_state: resting
      transitions: [[resting, terminal, always, going], [going, terminal, always, resting]]
plant:
  PLANT
  bind:
    cart.E.wheels.v_d: {ACTUATOR}
    cart.E.wheels.s: {SENSOR}
    cart.R.desk.v: {panel: slider, range: ["0[m/s]", "1[m/s]"], init: "0[m/s]"}
    cart.R.desk.go: {panel: button}
task:
  cycle: {of: cart.c, from: going, to: resting}
  disturb:
    - {at: "0.2[s]", turn: {cart.R.desk.v: "0.5[m/s]"}, because: of the test}
    - {at: "0.4[s]", press: [cart.R.desk.go], because: of the test}
require:
  - {that: "throughout(0.4[s], state(cart.c) == resting)", because: nobody has pressed}
  - {that: "within(0.8[s], present(cart.E.wheels.v_d) and cart.E.wheels.v_d > 0.4[m/s])",
     because: the operator says so}
"""
DRIVER = """\
class Cart:
    def reset(self, seed):
        self.s = 0.0

    def sample(self, name):
        assert name == "cart.E.wheels.s", name
        return self.s

    def actuate(self, name, value):
        self.v = value

    def advance(self, duration_s):
        self.s += 0.0

    def close(self):
        pass
"""


@pytest.mark.parametrize(
    ("is_python", "options"),
    [
        (False, []),
        (True, []),
        pytest.param(False, ["--real-time"], marks=pytest.mark.long),
        pytest.param(True, ["--real-time"], marks=pytest.mark.long),
    ],
)
def test_a_panel_is_beside_a_model_or_a_plant_in_python(
    tmp_path: Path, is_python: bool, options: Sequence[str]
) -> None:
    """In real time that one is in the device host."""
    plant = ("model: cart.xml", "actuators: [wheels]", "joints: [cart]")
    text = CART
    words = ('python: "panel_driver:Cart"', "", "") if is_python else plant
    for name, word in zip(("PLANT", "ACTUATOR", "SENSOR"), words, strict=True):
        text = text.replace(name, word)
    (tmp_path / "cart.xml").write_text(MODEL)
    (tmp_path / "panel_driver.py").write_text(DRIVER)
    (tmp_path / "cart.yaml").write_text(text)
    found = specc("run", tmp_path / "cart.yaml", "--duration", "1.2", *options)
    assert found.returncode == 0, found.stdout + found.stderr
