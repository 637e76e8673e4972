"""Traces of what exploring finds are recordings of the generated code, which replay."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from specc_runtime import track

from specc.cli import main
from specc.tools.explore import concrete
from tests.recording.runs import messages
from tests.seeds import every, short

CASES = sorted(Path(__file__).parent.glob("cases/*.yaml"))
BOUNDED = Path(__file__).parent / "bounded"
LOST = Path(__file__).parent / "cases/event-not-looked-at.yaml"


def explored(spec: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """What exploring says, with recordings."""
    main(["explore", str(spec), "--traces", str(out), "--format", "json"])
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def traced(spec: Path, out: Path, capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    """The findings with their recordings."""
    found: list[dict[str, Any]] = explored(spec, out, capsys)["findings"]
    return found


@pytest.mark.parametrize(
    "case", short(CASES, *range(0, len(CASES), 12)), ids=lambda case: case.stem
)
def test_traces_are_recordings_that_replay(
    case: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for finding in traced(case, tmp_path / "traces", capsys):
        recording = Path(finding["recording"])
        code = main(["replay", str(recording), "--spec", str(case), "--check"])
        replayed = capsys.readouterr().out
        # What exploring finds of a requirement, its monitor finds on the trace.
        assert ("\nviolated " in replayed) == (finding["code"] == "W1007") == bool(code)
        assert "differs" not in replayed and "cannot be compared" not in replayed
        recorded = {topic: iter(steps) for topic, steps in messages(recording).items()}
        faults = []
        for step in finding["trace"]:
            _, message = next(recorded[f"/{step['subsystem']}"])
            if "fault" in message:
                faults.append(message["fault"].partition(":")[0])
            else:
                assert (message["state"], message["row"]) == (step["to"], step["row"])
        assert faults == ["assumption does not hold"] * (finding["code"] == "W1006")
    capsys.readouterr()


def test_no_value_is_made_up_for_a_trace(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Whether a product is negative is not known to exploring; no measurement makes it so."""
    text = LOST.read_text(encoding="utf-8")
    assert "x.R.d < 1[m]" in text
    spec = tmp_path / "spec.yaml"
    spec.write_text(text.replace("x.R.d < 1[m]", "x.R.d * x.R.d < -1[m**2]"), encoding="utf-8")
    assert main(["explore", str(spec), "--traces", str(tmp_path / "traces")]) == 0
    said = capsys.readouterr().out
    assert "its trace is not recorded: at 0.1 s `panel.c` is in `watching`, not in" in said
    assert "whatever measurements were tried" in said
    assert not (tmp_path / "traces").exists()


def test_the_search_ends_after_so_many_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(concrete, "MOST_STEPS", 1000)
    (finding,) = traced(LOST, tmp_path, capsys)
    assert finding["recording"] is None
    stray = "at 0.3 s `panel.c` is in `stopped`, not in `watching`"
    assert finding["lacks"] == f"{stray}, as far as 1000 steps reach"


def test_of_what_was_sent_only_the_latest_values_are_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each is looked for among them, so that a long run with many may not keep them all."""
    text = LOST.read_text(encoding="utf-8")
    text = text.replace("near_by: bool}", 'near_by: bool, s: "real[m]"}')
    text = text.replace("False}}}", 'False}, s: {type: "real[m]", init: 0}}}')
    text = text.replace(
        "        behaviours: {look",
        "        memory: {k: {type: 'real[m]', init: 0}}\n        behaviours: {look",
    )
    text = text.replace('"x.R.d < 1[m]"', '"x.R.d < 1[m]", y.c.s: k, k: "k + 1[m]"')
    spec = tmp_path / "spec.yaml"
    spec.write_text(text, encoding="utf-8")
    sent: list[list[float]] = []
    changed = concrete._changes

    def looked_into(*given: Any) -> Any:
        sent.extend(list(values) for values in given[3].sent.values())
        return changed(*given)

    monkeypatch.setattr(concrete, "MOST_SENT", 2)
    monkeypatch.setattr(concrete, "_changes", looked_into)
    (finding,) = traced(spec, tmp_path, capsys)
    assert finding["recording"]
    assert [5.0, 4.0] in sent
    assert {len(values) for values in sent} == {2}


def test_ctrl_c_ends_the_search_and_leaves_the_findings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Also if it comes in the middle of a step, where other errors are faults of the step."""

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(track, "compute_deferred", interrupted)
    assert main(["explore", str(LOST), "--traces", str(tmp_path)]) == 130
    said = capsys.readouterr()
    assert "its trace is not recorded: interrupted" in said.out
    assert "W1005" in said.err
    assert said.err.endswith("specc: interrupted\n")


def test_values_of_devices_that_only_operators_look_into(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = LOST.read_text(encoding="utf-8")
    text = text.replace("system: demo", "system: demo\ntypes: {Cloud: {opaque: true}}")
    text = text.replace('eye: {y: {d: "real[m]"}}', 'eye: {y: {d: "real[m]", cloud: Cloud}}')
    text = text.replace('x: {R: {d: "real[m]"}}', 'x: {R: {d: "real[m]", cloud: Cloud}}')
    text = text.replace("panel.R.eye.d: {}", "panel.R.eye.d: {}, panel.R.eye.cloud: {}")
    spec = tmp_path / "spec.yaml"
    spec.write_text(text, encoding="utf-8")
    (finding,) = traced(spec, tmp_path, capsys)
    assert finding["recording"] is None
    assert finding["lacks"] == "a device reports a Cloud, which only operators look into"


def test_a_place_where_nothing_can_be_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert main(["explore", str(LOST), "--traces", str(tmp_path / "file")]) == 2
    assert f"cannot write to {tmp_path / 'file'}: file exists" in capsys.readouterr().err


NAMED = """\
specc: 1.1
system: named
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {größe: "real[m]", b_c: "real[m]"}, b_b: {c: "real[m]"}}
      functions: {f: {y.b.größe: "1[m]", y.b.b_c: "1[m]", y.b_b.c: "1[m]"}}
      behaviours: {w: {functions: [f], terminal: never}}
      states: {S0: w}
      initial_state: S0
  b:
    control:
      rate: 10 Hz
      x: {a: {größe: {type: "real[m]", init: "0[m]"}, b_c: {type: "real[m]", init: "0[m]"}}}
      conditions: {terminal: {t: "x.a.größe > 2[m] or x.a.b_c > 2[m]"}}
      behaviours: {w: {terminal: t}, r: {terminal: never}}
      states: {S0: w, S1: r}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
  b_b:
    control:
      rate: 10 Hz
      x: {a: {c: {type: "real[m]", init: "0[m]"}}}
      memory: {k: {type: "real[m]", init: "0[m]"}}
      behaviours: {w: {functions: [{k: x.a.c}], terminal: never}}
      states: {S0: w}
      initial_state: S0
"""


def test_what_is_sent_has_other_names_in_the_code(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Letters that other spellings stand for, and names that are one when they are joined."""
    (tmp_path / "spec.yaml").write_text(NAMED, encoding="utf-8")
    (finding,) = traced(tmp_path / "spec.yaml", tmp_path / "traces", capsys)
    assert finding["code"] == "W1001"
    assert Path(finding["recording"]).is_file()


@pytest.mark.parametrize("case", every(3, ["too_tight", "stretched", "stop_button"]))
def test_a_violation_that_rests_on_conditions_is_a_run_that_replays(
    case: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = BOUNDED / f"{case}.yaml"
    (required,) = explored(spec, tmp_path / "traces", capsys)["requirements"]
    assert bool(required["rests_on"]) == (case != "stop_button")
    assert required["lacks"] == ""
    assert main(["replay", required["recording"], "--spec", str(spec), "--check"]) == 1
    assert "\nviolated always" in capsys.readouterr().out


def test_a_violation_that_no_run_shows_is_told_with_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exploring does not know that (t - 1)**2 is never less than zero."""
    text = (BOUNDED / "too_tight.yaml").read_text(encoding="utf-8")
    spec = tmp_path / "spec.yaml"
    never = "x.probe.t * x.probe.t > 2[K] * x.probe.t - 2[K**2] or elapsed"
    spec.write_text(text.replace("x.probe.t > 450[K] or elapsed", never), encoding="utf-8")
    (required,) = explored(spec, tmp_path / "traces", capsys)["requirements"]
    assert (required["verdict"], required["recording"]) == ("open", None)
    assert required["lacks"].endswith("whatever measurements were tried")
    assert not (tmp_path / "traces").exists()
