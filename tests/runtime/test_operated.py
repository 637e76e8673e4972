"""What disturbances do at the operator's panel is what the receptors of a run report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from tests.recording.runs import messages, report_of, specc
from tests.runtime.test_disturbances import MODEL
from tests.runtime.test_disturbances import SPEC as CART
from tests.seeds import every

SPEC = """\
specc: 1.3
system: desk
types: {Mode: "enum[manual, automatic, off]"}
constants: {fast: "200[mm/s]"}
agents:
  desk:
    real_receptors:
      panel: {y: {start: bool, enable: bool, stop: bool, v: "real[m/s]", mode: Mode, n: int}}
    virtual_receptors: {panel: {rate: 10 Hz, through: identity}}
    control:
      rate: 10 Hz
      x: {panel: {start: bool, enable: bool, stop: bool, v: "real[m/s]", mode: Mode, n: int}}
      conditions:
        terminal:
          goes: present(x.panel.start) and x.panel.start and x.panel.mode == manual
          halts: "not x.panel.enable or x.panel.stop or x.panel.v > 0.1[m/s] or x.panel.n > 2"
      behaviours: {wait: {terminal: goes}, go: {terminal: halts}}
      states: {S0: wait, S1: go}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
plant:
  bind:
    desk.R.panel.start: {panel: button}
    desk.R.panel.enable: {panel: button, hold: true}
    desk.R.panel.stop: {panel: switch}
    desk.R.panel.v: {panel: slider, range: ["0[m/s]", fast], init: "50[mm/s]"}
    desk.R.panel.mode: {panel: choice, init: manual}
    desk.R.panel.n: {panel: number, range: [0, 3], init: 1}
task:
  cycle: {of: desk.c, from: S1, to: S0}
"""
Samples = dict[str, list[Any]]


def ran(folder: Path, happens: Sequence[str], *options: object) -> tuple[Samples, dict[str, Any]]:
    """What the receptor got of each element in three seconds, and the report."""
    listed = "".join(f"    - {{{each}, because: of the test}}\n" for each in happens)
    spec, record, report = (folder / f"desk.{end}" for end in ("yaml", "mcap", "json"))
    spec.write_text(f"{SPEC}  disturb:\n{listed}" if happens else SPEC)
    record.unlink(missing_ok=True)
    kept = "--record", record, "--report", report
    found = specc("run", spec, "--duration", 3, *kept, *options)
    assert found.returncode == 0, found.stderr
    steps = [data["x"]["R"] for _, data in messages(record)["/desk.panel"]]
    return {name: [step[name] for step in steps] for name in steps[0]}, report_of(report)


def true_at(samples: Sequence[Any]) -> list[int]:
    return [stamp for stamp, value in enumerate(samples) if value]


def test_without_an_operator_all_is_as_declared(tmp_path: Path) -> None:
    samples, report = ran(tmp_path, ())
    first = {"start": False, "enable": False, "stop": False, "v": 0.05, "mode": "manual", "n": 1}
    assert samples == {name: [value] * 30 for name, value in first.items()}
    assert "panel" not in report


@pytest.mark.parametrize(
    ("happens", "element", "stamps"),
    every(
        3,
        [
            ('at: "1[s]", press: [desk.R.panel.start]', "start", [10]),
            ('at: "1.01[s]", press: [desk.R.panel.start]', "start", [11]),
            ('at: "1[s]", every: "0.5[s]", press: [desk.R.panel.start]', "start", [10, 15, 20, 25]),
            (
                'at: "1[s]", lasts: "0.5[s]", press: [desk.R.panel.enable]',
                "enable",
                [*range(10, 15)],
            ),
            ('at: "2[s]", press: [desk.R.panel.enable]', "enable", [*range(20, 30)]),
            (
                'at: "1[s]", every: "1[s]", lasts: "0.2[s]", press: [desk.R.panel.enable]',
                "enable",
                [10, 11, 20, 21],
            ),
            ('at: "1.5[s]", turn: {desk.R.panel.stop: true}', "stop", [*range(15, 30)]),
            (
                'when: "state(desk.c) == S1", lasts: "0.3[s]", press: [desk.R.panel.enable]',
                "enable",
                [],
            ),
        ],
    ),
)
def test_buttons_and_switches_are_true_when_they_are_operated(
    happens: str, element: str, stamps: list[int], tmp_path: Path
) -> None:
    samples, _ = ran(tmp_path, (happens,))
    assert true_at(samples[element]) == stamps
    others = {name for name, values in samples.items() if len({*values}) > 1}
    assert others == ({element} if stamps else set())


def test_both_kinds_of_buttons_are_pressed_at_once(tmp_path: Path) -> None:
    press = 'at: "1[s]", lasts: "0.5[s]", press: [desk.R.panel.start, desk.R.panel.enable]'
    samples, _ = ran(tmp_path, (press,))
    assert true_at(samples["start"]) == [10]
    assert true_at(samples["enable"]) == [*range(10, 15)]


def test_what_is_turned_stays_so(tmp_path: Path) -> None:
    first = 'at: "1[s]", turn: {desk.R.panel.v: fast, desk.R.panel.mode: automatic}'
    second = (
        'at: "2[s]", turn: {desk.R.panel.v: "0[m/s]", desk.R.panel.mode: off, desk.R.panel.n: 3}'
    )
    samples, report = ran(tmp_path, (first, second))
    assert samples["v"] == [0.05] * 10 + [0.2] * 10 + [0.0] * 10
    assert samples["mode"] == ["manual"] * 10 + ["automatic"] * 10 + ["off"] * 10
    assert samples["n"] == [1] * 20 + [3] * 10
    assert [each["by"] for each in report["panel"]] == ["task"] * 5


@pytest.mark.long
def test_values_are_drawn_from_the_seed(tmp_path: Path) -> None:
    turn = (
        'at: "1[s]", turn: {desk.R.panel.v: ["0.1[m/s]", fast], desk.R.panel.n: {one_of: [0, 2]}, '
        "desk.R.panel.mode: {one_of: [automatic, off]}, desk.R.panel.stop: {one_of: [true, false]}}"
    )
    last, digests = [], set()
    for seed in range(6):
        samples, report = ran(tmp_path, (turn,), "--seed", seed)
        again = ran(tmp_path, (turn,), "--seed", seed)[1]
        assert again["records_sha256"] == report["records_sha256"]
        digests.add(report["records_sha256"])
        last.append({name: values[-1] for name, values in samples.items()})
    assert len(digests) == 6
    assert all(0.1 <= each["v"] <= 0.2 for each in last)
    for name, values in {"n": {0, 2}, "mode": {"automatic", "off"}, "stop": {True, False}}.items():
        assert {each[name] for each in last} == values


DESK = """\
    real_receptors: {desk: {y: {slow: bool}}}
    virtual_receptors: {desk: {rate: 10 Hz, through: identity}}
    control:
"""
BESIDE = (
    CART.replace("    control:\n", DESK)
    .replace(
        "x: {wheels: {s: {type", "x: {desk: {slow: {type: bool, init: False}}, wheels: {s: {type"
    )
    .replace(
        'go: {y.wheels.v_d: "1[m/s]"}', 'go: {y.wheels.v_d: "(0.5 if x.desk.slow else 1) * 1[m/s]"}'
    )
    .replace("  bind:\n", "  bind:\n    cart.R.desk.slow: {panel: switch}\n")
)
DISTURB = '  disturb: [{at: "1[s]", turn: {cart.R.desk.slow: true}, because: of the test}]\n'
SLOW = "require: [{that: 'always(plant.s < 2.2[m])', because: of the test}]\n"


@pytest.mark.parametrize(("happens", "code"), [("", 1), (DISTURB, 0)])
def test_a_panel_stands_beside_a_model(happens: str, code: int, tmp_path: Path) -> None:
    (tmp_path / "cart.xml").write_text(MODEL)
    spec = tmp_path / "cart.yaml"
    spec.write_text(BESIDE + happens + SLOW)
    found = specc("run", spec, "--duration", 3)
    assert found.returncode == code, found.stderr
