"""Snapshots of all that a run is: what disturbs it, ground truth, requirements, noise, silence."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from specc_runtime.forms import Misshapen
from specc_runtime.recording.messages import Shelved
from specc_runtime.requirements import Requirement
from specc_runtime.savable import restored
from specc_runtime.temporal import And, Atom, Within, judged

from tests.recording.runs import ROOT, messages, report_of, specc
from tests.runtime.test_disturbances import MODEL, SPEC

HAPPENS = (
    'because: a push, at: ["0.4[s]", "1.6[s]"], lasts: "0.9[s]", push: {cart: ["30[N]", 0, 0]}',
    'because: a block, when: "plant.s > 0.2[m]", lasts: "0.7[s]", block: [cart]',
    'because: silence, at: "1.3[s]", lasts: "1.1[s]", silent: [cart.E.wheels.s]',
    'because: the box jumps, at: ["0.5[s]", "2.5[s]"], shift: {box.x: "0.3[m]"}',
)
REQUIRED = (
    "always(plant.s < 2.5[m])",
    "always(plant.box.x > 0.1[m] implies within(1.5[s], state(cart.c) == stopping))",
    "within(3[s], plant.s > 1[m])",
    "always(since(plant.s >= 0[m], state(cart.c) == going))",
    "always(once(0.8[s], cart.E.wheels.v_d > 0.5[m/s]))",
)


def spec_in(folder: Path) -> Path:
    """A specification with all of these."""
    (folder / "cart.xml").write_text(MODEL)
    disturb = "".join(f"    - {{{each}}}\n" for each in HAPPENS)
    require = "".join(f'  - {{that: "{that}", because: test}}\n' for that in REQUIRED)
    spec = folder / "cart.yaml"
    spec.write_text(f"{SPEC}  disturb:\n{disturb}require:\n{require}")
    return spec


@pytest.mark.parametrize("seed", range(4))
def test_a_disturbed_run_goes_on_as_it_did(seed: int, tmp_path: Path) -> None:
    spec, file = spec_in(tmp_path), tmp_path / "run.mcap"
    whole = ("run", spec, "--duration", 5, "--report")
    first = specc(*whole, tmp_path / "a.json", "--seed", seed, "--record", file)
    assert first.returncode in (0, 1) and not report_of(tmp_path / "a.json")["faults"]
    told = report_of(tmp_path / "a.json")
    assert len([each for each in told["disturbances"] if each["began_s"]]) >= 3
    for at in random.Random(seed).sample(range(100, 499), 3):
        done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@{at / 100}")
        assert done.returncode == first.returncode, done.stderr
        assert report_of(tmp_path / "b.json") == told
    replayed = specc("replay", file, "--spec", spec)
    assert replayed.returncode == first.returncode, replayed.stdout + replayed.stderr
    for each in told["requirements"]:
        assert f"{each['verdict']} {each['that']}" in replayed.stdout


@pytest.mark.parametrize(
    ("name", "duration_s"),
    [("rovers", 6), ("architectures/services", 4), ("architectures/sense_plan_act", 6)],
)
def test_other_systems_go_on_as_they_did(name: str, duration_s: int, tmp_path: Path) -> None:
    spec, file = ROOT / "specs" / f"{name}.yaml", tmp_path / "run.mcap"
    whole = ("run", spec, "--duration", duration_s, "--report")
    first = specc(*whole, tmp_path / "a.json", "--seed", 7, "--record", file)
    assert any("tick" in data for _, data in messages(file)["/snapshot"])
    at = random.Random(name).uniform(duration_s / 2, duration_s - 0.1)
    done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@{at}")
    assert done.returncode == first.returncode, done.stderr
    assert report_of(tmp_path / "b.json") == report_of(tmp_path / "a.json")
    assert "--from" not in done.stderr


def test_another_specification_keeps_the_scene_and_what_happened(tmp_path: Path) -> None:
    """Disturbances are the same that do the same, whatever their place; what is not is told."""
    spec, file = spec_in(tmp_path), tmp_path / "run.mcap"
    text = spec.read_text()
    spec.write_text(text.replace("  disturb:", "  scene: {box.z: '1[m]'}\n  disturb:"))
    specc("run", spec, "--duration", 3, "--record", file, "--report", tmp_path / "a.json")
    first = report_of(tmp_path / "a.json")
    moved = "".join(f"    - {{{each}}}\n" for each in (*HAPPENS[1:3], HAPPENS[0]))
    new = "    - {because: new, at: '9[s]', block: [box]}\n"
    happens = f"  scene: {{box.z: '2[m]'}}\n  disturb:\n{new}{moved}require:"
    spec.write_text(
        text.replace(text[text.index("  disturb:") : text.index("require:") + 8], happens)
    )
    done = specc(
        "run", spec, "--duration", 3, "--from", f"{file}@2.9", "--report", tmp_path / "b.json"
    )
    told = report_of(tmp_path / "b.json")
    assert told["scene"] == first["scene"] == {"box.z": 1.0}
    assert "the scene is that of the recorded run" in done.stderr
    assert "nothing is known of the disturbance: block box" in done.stderr
    assert "there is no such disturbance, which began in the past: shift box.x" in done.stderr
    began = {each["because"]: each["began_s"] for each in first["disturbances"]}
    assert [each["began_s"] for each in told["disturbances"]] == [
        None,
        *(began[each] for each in ("a block", "silence", "a push")),
    ]


@pytest.mark.parametrize(
    ("changed", "setting", "code"),
    [("", "30[N]", 1), ("", "0[N]", 0), ("the push is gone", "30[N]", 0)],
)
def test_a_push_under_way_is_that_of_the_new_specification(
    changed: str, setting: str, code: int, tmp_path: Path
) -> None:
    (tmp_path / "cart.xml").write_text(MODEL)
    spec, file = tmp_path / "cart.yaml", tmp_path / "run.mcap"
    push = "{because: a push, at: '0.5[s]', lasts: '3[s]', push: {cart: [force, 0, 0]}}"
    required = "require: [{that: 'always(plant.s < 2.95[m])', because: test}]\n"
    calm = SPEC.replace("frames:", "constants: {force: '30[N]'}\nframes:") + required
    spec.write_text(calm.replace("require:", f"  disturb: [{push}]\nrequire:"))
    assert specc("run", spec, "--duration", 2, "--record", file).returncode == 0
    if changed:
        spec.write_text(calm)
    more = ("--from", f"{file}@1.5", "--set", f"force={setting}")
    done = specc("run", spec, "--duration", 2.2, *more)
    assert done.returncode == code, done.stderr


RECEPTORS = """    real_receptors: {odo: {y: {d: "real[m]"}}}
    virtual_receptors:
      fast: {uses: [odo], rate: 50 Hz, x: {odo: {d: "real[m]"}}, y: {c: {d: "real[m]"}},
        behaviours: {tell: {functions: [{y.c.d: x.odo.d}], terminal: never}},
        states: {S0: tell}, initial_state: S0}
      slow: {uses: [odo], rate: 10 Hz, x: {odo: {d: "real[m]"}}, y: {c: {d: "real[m]", new: bool}},
        behaviours: {tell: {functions: [{y.c.d: x.odo.d, y.c.new: fresh(x.odo.d)}],
          terminal: never}},
        states: {S0: tell}, initial_state: S0}
"""


def test_a_held_sample_still_reaches_a_slower_reader(tmp_path: Path) -> None:
    (tmp_path / "cart.xml").write_text(MODEL)
    spec, file = tmp_path / "cart.yaml", tmp_path / "run.mcap"
    text = SPEC.replace("    control:", f"{RECEPTORS}    control:")
    heard = 'x: {fast: {d: "real[m]"}, slow: {d: "real[m]", new: bool}, wheels: {s:'
    text = text.replace(
        'x: {wheels: {s: {type: "real[m]", init: 0}, heard',
        f'{heard} {{type: "real[m]", init: 0}}, heard',
    )
    text = text.replace("  bind:", "  bind:\n    cart.R.odo.d: {joints: [cart], sporadic: true}")
    silence = "{because: silence, at: '0.95[s]', lasts: '3[s]', silent: [cart.R.odo.d]}"
    spec.write_text(f"{text}  disturb: [{silence}]\n")
    whole = ("run", spec, "--duration", 2, "--report")
    first = specc(*whole, tmp_path / "a.json", "--seed", 1, "--record", file)
    assert first.returncode == 0, first.stderr
    done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@1.5")
    assert done.returncode == 0, done.stderr
    assert report_of(tmp_path / "b.json") == report_of(tmp_path / "a.json")


def test_a_device_that_is_not_due_has_its_last_sample(tmp_path: Path) -> None:
    (tmp_path / "cart.xml").write_text(MODEL)
    spec, file = tmp_path / "cart.yaml", tmp_path / "run.mcap"
    spec.write_text(SPEC.replace("sporadic: true", "rate: 50 Hz"))
    assert specc("run", spec, "--duration", 2, "--record", file).returncode == 0
    spec.write_text(SPEC.replace("sporadic: true", "rate: 5 Hz"))
    done = specc("run", spec, "--duration", 2, "--from", f"{file}@1.5")
    assert done.returncode == 0, done.stdout + done.stderr


def test_who_fails_at_what_he_saved_is_named() -> None:
    class Forgetful:
        def restore(self, saved: object) -> None:
            raise RuntimeError(f"no {saved}")

    with pytest.raises(Misshapen, match="the judge raised RuntimeError: no 3"):
        restored("the judge", Forgetful(), 3)


def test_no_more_is_taken_from_a_file_than_is_ever_remembered() -> None:
    atom = Atom(lambda: judged(holds=True), "x")
    whole = Requirement("", "", And(atom, Within(3, atom)), {})
    for _ in range(10):
        whole.step({})
    saved = whole.saved(dict)
    whole.restore(saved, dict)
    with pytest.raises(ValueError, match="more than"):
        whole.restore(saved | {"earlier": [[10**9, {}]]}, dict)
    waiting = [[[[10**9, None]], *saved["formula"][0][1:]], *saved["formula"][1:]]
    with pytest.raises(ValueError, match="more than"):
        whole.restore(saved | {"formula": waiting}, dict)
    shelf = Shelved(most_bytes=10)
    for name in "abb":
        shelf.put(name, bytes(6))
    assert shelf.packed("", {"type": "", "digest": "b"}) == bytes(6)
    with pytest.raises(Exception, match="a value of"):
        shelf.packed("", {"type": "", "digest": "a"})
