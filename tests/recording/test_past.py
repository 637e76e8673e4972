"""Runs go on from any moment of a recording, bit for bit as the recorded run did."""

from __future__ import annotations

import json
import os
import random
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.recording.runs import CONVEYOR, ROOT, begun, messages, report_of, specc
from tests.seeds import blocks, every, short

FLAGSHIP = ROOT / "specs" / "irp_picking.yaml"
WHOLE = ("run", CONVEYOR, "--duration", 10)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a run: `run.mcap` and `run.json`."""
    folder = tmp_path_factory.mktemp("past")
    told = ("--seed", 5, "--report", folder / "run.json")
    done = specc(*WHOLE, *told, "--record", folder / "run.mcap")
    assert done.returncode == 0
    return folder


@pytest.mark.parametrize("seeds", blocks([0], also=[1], long=8, each=10))
def test_a_run_goes_on_as_it_did(seeds: Sequence[int], recorded: Path, tmp_path: Path) -> None:
    for seed in seeds:
        moment = random.Random(seed).uniform(0.01, 9.9)
        report = tmp_path / "run.json"
        done = specc(*WHOLE, "--from", f"{recorded}/run.mcap@{moment}", "--report", report)
        assert done.returncode == 0, done.stderr
        assert report_of(report) == report_of(recorded / "run.json"), seed
        assert "--from" not in done.stderr


@pytest.mark.long
@pytest.mark.parametrize("at", [0.91, 1.05])
def test_the_flagship_goes_on_with_images_and_worker_threads(at: float, tmp_path: Path) -> None:
    whole = ("run", FLAGSHIP, "--duration", at + 0.2, "--report")
    file = tmp_path / "run.mcap"
    first = specc(*whole, tmp_path / "a.json", "--record", file, "--seed", 2)
    assert first.returncode == 0, first.stderr
    done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@{at}")
    assert done.returncode == 0, done.stderr
    assert report_of(tmp_path / "a.json") == report_of(tmp_path / "b.json")
    assert "--from" not in done.stderr


@pytest.mark.no_replay("replayed here")
def test_a_continued_run_is_recorded_and_replays(recorded: Path, tmp_path: Path) -> None:
    file, report = tmp_path / "b.mcap", tmp_path / "c.json"
    more = ("--from", f"{recorded}/run.mcap@6.5", "--record-exact", "--record", file)
    assert specc(*WHOLE, *more).returncode == 0
    replayed = specc("replay", file, "--spec", CONVEYOR, "--check")
    assert replayed.returncode == 0 and "belt.c: 80 steps are the same" in replayed.stdout
    done = specc(*WHOLE, "--from", f"{file}@9.5", "--report", report)
    assert done.returncode == 0, done.stderr
    assert report_of(report) == report_of(recorded / "run.json")


@pytest.mark.no_replay("replayed here")
def test_a_run_that_was_repeated_from_its_start_replays(recorded: Path, tmp_path: Path) -> None:
    file = tmp_path / "b.mcap"
    told = ("run", CONVEYOR, "--duration", 2, "--from", f"{recorded}/run.mcap@0.5")
    assert specc(*told, "--record-exact", "--record", file).returncode == 0
    replayed = specc("replay", file, "--spec", CONVEYOR, "--check")
    assert replayed.returncode == 0 and "belt.c: 40 steps are the same" in replayed.stdout


TALK = """agents:
  talker:
    control:
      rate: 10 Hz
      y: {hearer: {n: int}}
      behaviours: {tell: {functions: [{y.hearer.n: 1}], terminal: never}}
      states: {S0: tell}
      initial_state: S0
  hearer:
    control:
      rate: 10 Hz
      x: {talker: {n: int}}
      memory: {n: {type: int, init: 0}}
      behaviours: {hear: {functions: [{n: n + 1 if fresh(x.talker.n) else n}], terminal: never}}
      states: {S0: hear}
      initial_state: S0
"""


@pytest.mark.no_replay("replayed here")
@pytest.mark.parametrize(
    ("old", "new", "words"),
    short(
        [
            ("agents:\n", TALK, "belt.c: 40 steps are the same"),
            ("running", "going", "belt.c differs first at 5 s (stamp 100), in running: state\n"),
        ],
        0,
    ),
)
def test_a_continued_run_is_replayed_with_another_specification(
    old: str, new: str, words: str, recorded: Path, tmp_path: Path
) -> None:
    (tmp_path / "plants").symlink_to(CONVEYOR.parent / "plants")
    (tmp_path / "pyproject.toml").write_text(f"[tool.specc]\nallow = ['{CONVEYOR.parent}']\n")
    spec, file = tmp_path / "conveyor_gate.yaml", tmp_path / "b.mcap"
    spec.write_text(CONVEYOR.read_text().replace(old, new))
    told = ("run", CONVEYOR, "--duration", 7, "--from", f"{recorded}/run.mcap@5")
    assert specc(*told, "--record-exact", "--record", file).returncode == 0
    replayed = specc("replay", file, "--spec", spec)
    assert replayed.returncode in (0, 1) and words in replayed.stdout, replayed.stderr


@pytest.mark.long
@pytest.mark.no_replay("replayed here")
def test_changed_constants_hold_from_there_on(recorded: Path, tmp_path: Path) -> None:
    more = ("--from", f"{recorded}/run.mcap@6.41", "--record", tmp_path / "b.mcap")
    done = specc(*WHOLE, *more, "--set", "cruise=0.4[rad/s]")
    assert done.returncode == 0
    told = "--from: set for the recorded run: no constants; for this one: cruise=0.4[rad/s]\n"
    assert told in done.stderr
    assert "--from: the specification goes on from" not in done.stderr
    before, after = messages(recorded / "run.mcap"), messages(tmp_path / "b.mcap")
    parted = []
    for topic, steps in before.items():
        other = {data["time"]: data for _, data in after[topic] if "stamp" in data}
        told = [data for _, data in steps if "stamp" in data and data["time"] in other]
        parted += [data["time"] for data in told if data != other[data["time"]]]
    assert 6.41 <= min(parted) <= 6.5
    replayed = specc("replay", tmp_path / "b.mcap", "--spec", CONVEYOR)
    assert replayed.returncode == 0 and "belt.c: 71 steps are the same" in replayed.stdout


@pytest.mark.long
@pytest.mark.parametrize("patience", short(["1[s]", "4[s]"], 1))
def test_requirements_over_other_spans_go_on(patience: str, recorded: Path, tmp_path: Path) -> None:
    for past in (("--seed", 5), ("--from", f"{recorded}/run.mcap@6")):
        done = specc(*WHOLE, *past, "--set", f"patience={patience}", "--report", tmp_path / "r")
        told = report_of(tmp_path / "r")["requirements"]
        assert {each["verdict"] for each in told} == {"met"}, past
    assert "is known of the past" not in done.stderr


def test_what_cannot_be_carried_over_is_told(recorded: Path, tmp_path: Path) -> None:
    text = CONVEYOR.read_text()
    spec = tmp_path / "conveyor_gate.yaml"
    (tmp_path / "plants").symlink_to(CONVEYOR.parent / "plants")
    (tmp_path / "pyproject.toml").write_text(f"[tool.specc]\nallow = ['{CONVEYOR.parent}']\n")
    spec.write_text(text.replace("v_p", "v_last"))
    moment = ("--duration", 8, "--from", f"{recorded}/run.mcap@7")
    done = specc("run", spec, *moment)
    assert done.returncode == 0, done.stderr
    assert "--from: belt.drive: there is no memory v_p\n" in done.stderr
    assert "--from: belt.drive: memory v_last is as at the beginning: there was none" in done.stderr
    spec.write_text(text.replace("running", "going"))
    done = specc("run", spec, "--duration", 8, "--from", f"{recorded}/run.mcap@5")
    assert done.returncode == 2
    assert "belt.c was in running, which is no state of it" in done.stderr


@pytest.mark.parametrize(
    ("moment", "words"),
    [
        ("{}/run.mcap", "is not FILE.mcap@SECONDS"),
        ("{}/run.mcap@x", "is not a positive number of seconds"),
        ("{}/run.mcap@99", "ends at 10 s, before 99 s"),
        ("{}/none.mcap@1", "No such file"),
        ("{}/run.json@1", "is no MCAP file"),
    ],
)
def test_misuse(moment: str, words: str, recorded: Path) -> None:
    done = specc(*WHOLE, "--from", moment.format(recorded))
    assert done.returncode == 2
    assert words in done.stderr and "Traceback" not in done.stderr


def test_a_recording_of_another_system(recorded: Path) -> None:
    done = specc("run", ROOT / "specs" / "rovers.yaml", "--from", f"{recorded}/run.mcap@1")
    assert done.returncode == 2
    assert "is of another system: it has no step of rovers" in done.stderr


@pytest.mark.parametrize("seed", [0, 5])
def test_a_run_that_goes_on_has_the_seed_of_the_recorded_one(seed: int, recorded: Path) -> None:
    done = specc(*WHOLE, "--from", f"{recorded}/run.mcap@3", "--seed", seed)
    assert done.returncode == 2 and "--seed: not allowed with argument --from" in done.stderr


def test_a_recording_is_not_written_over_while_it_is_read(recorded: Path) -> None:
    file = recorded / "run.mcap"
    size = file.stat().st_size
    done = specc(*WHOLE, "--from", f"{file}@3", "--record", file)
    assert done.returncode == 2 and "the run goes on from it" in done.stderr
    assert file.stat().st_size == size


@pytest.mark.long
def test_a_run_that_was_killed_goes_on_from_its_last_snapshot(tmp_path: Path) -> None:
    cut, mended = tmp_path / "cut.mcap", tmp_path / "mended.mcap"
    process = begun("run", CONVEYOR, "--duration", 1e6, "--seed", 5, "--record", cut)
    while not (cut.exists() and cut.stat().st_size > 40_000) and process.poll() is None:
        time.sleep(0.05)
    process.kill()
    process.communicate(timeout=60)
    assert specc("recover", cut, "--out", mended).returncode == 0
    last_s = max(data["time"] for _, data in messages(mended)["/belt.drive"])
    reports = [tmp_path / f"{name}.json" for name in ("whole", "cut", "mended")]
    whole = ("run", CONVEYOR, "--duration", last_s + 1, "--report")
    assert specc(*whole, reports[0], "--seed", 5).returncode == 0
    for file, report in zip((cut, mended), reports[1:], strict=True):
        done = specc(*whole, report, "--from", f"{file}@{last_s}")
        assert done.returncode == 0, done.stderr
        assert report_of(report) == report_of(reports[0])


def test_a_recording_without_snapshots_is_repeated_from_its_start(tmp_path: Path) -> None:
    report = tmp_path / "run.json"
    kept = Path(__file__).with_name("conveyor_gate.mcap")
    done = specc("run", CONVEYOR, "--duration", 6, "--from", f"{kept}@5", "--report", report)
    assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_what_is_recorded_names_no_code_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "plants").symlink_to(CONVEYOR.parent / "plants")
    (tmp_path / "pyproject.toml").write_text(f"[tool.specc]\nallow = ['{CONVEYOR.parent}']\n")
    spec, file = tmp_path / "conveyor_gate.yaml", tmp_path / "run.mcap"
    named = "operators: {UP: {signature: '(x: real) -> real', python: 'own:up'}}"
    (tmp_path / "own.py").write_text("def up(x): return x\n")
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    text = CONVEYOR.read_text().replace("agents:", f"{named}\nagents:", 1)
    spec.write_text(text.replace("y.gate.v: x.drive.v", "y.gate.v: UP(1) * x.drive.v"))
    first = specc("run", spec, "--duration", 3, "--record", file, env=env)
    assert first.returncode == 0, first.stderr
    done = specc("run", CONVEYOR, "--duration", 3, "--from", f"{file}@2.5", env=env)
    assert done.returncode == 0, done.stderr
    assert "cannot be run: it names own:up as operator UP (x: real, -> real); " in done.stderr
    assert "--from: the specification goes on from 2 s" in done.stderr


@pytest.mark.long
@pytest.mark.no_replay("replayed here")
def test_a_fault_is_met_again(tmp_path: Path) -> None:
    (tmp_path / "plants").symlink_to(CONVEYOR.parent / "plants")
    (tmp_path / "pyproject.toml").write_text(f"[tool.specc]\nallow = ['{CONVEYOR.parent}']\n")
    spec = tmp_path / "conveyor_gate.yaml"
    divides = "y.gate.v: '1 / (2[s] - elapsed) / 1[1/s] * x.drive.v'"
    spec.write_text(CONVEYOR.read_text().replace("y.gate.v: x.drive.v", divides))
    file = tmp_path / "run.mcap"
    first = specc("run", spec, "--duration", 9, "--record-exact", "--record", file)
    assert first.returncode == 1 and "fault" in first.stdout
    faults = [data["fault"] for _, data in messages(file)["/belt.c"] if "fault" in data]
    assert len(faults) == 1
    assert specc("replay", file, "--spec", spec, "--check").returncode == 0
    report = tmp_path / "again.json"
    again = specc("run", spec, "--duration", 9, "--from", f"{file}@1.5", "--report", report)
    assert again.returncode == 1
    assert [fault["message"] for fault in json.loads(report.read_text())["faults"]] == faults


EYES = """specc: 1.1
system: bot
agents:
  bot:
    real_receptors: {eye: {y: {I: "image[2, 3, 3]"}}}
    virtual_receptors:
      eye:
        rate: 20 Hz
        x: {R: {I: "image[2, 3, 3]"}}
        y: {c: {I: "image[2, 3, 3]"}}
        behaviours: {see: {functions: [{y.c.I: x.R.I}], terminal: never}}
        states: {S0: see}
        initial_state: S0
    control:
      rate: 10 Hz
      x: {eye: {I: "image[2, 3, 3]"}}
      memory: {n: {type: int, init: 0}}
      behaviours: {look: {functions: [{n: n + 1 if fresh(x.eye.I) else n}], terminal: never}}
      states: {S0: look}
      initial_state: S0
plant: {python: "eyes:World", bind: {bot.R.eye.I: {}}}
"""
WORLD = """import numpy as np
class World:
    def reset(self, seed): self.time_s = 0.0
    def actuate(self, name, value): pass
    def sample(self, name): return np.full((2, 3, 3), int(20 * self.time_s), np.uint8)
    def advance(self, duration_s): self.time_s += duration_s
    def close(self): pass
"""


def test_a_run_with_images_in_buffers_is_repeated(tmp_path: Path) -> None:
    (tmp_path / "eyes.py").write_text(WORLD)
    (tmp_path / "bot.yaml").write_text(EYES)
    told = ("run", tmp_path / "bot.yaml", "--duration", 2, "--report")
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    file = tmp_path / "run.mcap"
    first = specc(*told, tmp_path / "a.json", "--record-exact", "--record", file, env=env)
    assert first.returncode == 0, first.stderr
    done = specc(*told, tmp_path / "b.json", "--from", f"{file}@1.5", env=env)
    assert done.returncode == 0, done.stdout + done.stderr
    why = "the run is repeated from its start: eye.I of bot.c, an image"
    assert f"--from: {why}" in done.stderr
    assert report_of(tmp_path / "a.json") == report_of(tmp_path / "b.json")


SELDOM = """
    def sample(self, name):
        return NO_SAMPLE if self.time_s else Deferred(lambda: np.zeros((2, 3, 3), np.uint8))
"""


UNSAVED = """
    def close(self): print(f"closed at {self.time_s:.1f}", file=sys.stderr)
    def restore(self, saved): raise ValueError
"""


@pytest.mark.parametrize(
    "more",
    every(
        3,
        [
            "",
            f"{UNSAVED}    def saved(self): return {{1}}",
            f"{UNSAVED}    def saved(self): return 1 / 0",
        ],
    ),
)
def test_another_specification_sees_the_last_image_of_a_camera(more: str, tmp_path: Path) -> None:
    sample = "import sys\nfrom specc_runtime.plant import NO_SAMPLE, Deferred\n"
    (tmp_path / "eyes.py").write_text(sample + WORLD + SELDOM + more)
    text = EYES.replace("{bot.R.eye.I: {}}", "{bot.R.eye.I: {sporadic: true}}")
    spec, file = tmp_path / "bot.yaml", tmp_path / "run.mcap"
    spec.write_text(text)
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    first = specc("run", spec, "--duration", 2, "--record", file, env=env)
    assert first.returncode == 0, first.stderr
    spec.write_text(text.replace("n + 1", "n + 2"))
    done = specc("run", spec, "--duration", 2, "--from", f"{file}@1.5", env=env)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stderr.count("closed at") == done.stderr.count("closed at 2.0") == bool(more)


KEPT = """
    def saved(self): return self.time_s
    def restore(self, saved): self.time_s = saved
    def close(self): raise RuntimeError("stuck")
"""


def test_a_plant_that_cannot_be_closed_on_the_way_is_a_fault(tmp_path: Path) -> None:
    (tmp_path / "eyes.py").write_text(WORLD)
    spec, file, report = (tmp_path / name for name in ("bot.yaml", "run.mcap", "a.json"))
    spec.write_text(EYES)
    env = {**os.environ, "PYTHONPATH": str(tmp_path)}
    assert specc("run", spec, "--duration", 2, "--record", file, env=env).returncode == 0
    (tmp_path / "eyes.py").write_text(WORLD + KEPT)
    spec.write_text(EYES.replace("n + 1", "n + 2"))
    told = ("run", spec, "--duration", 2, "--report", report)
    done = specc(*told, "--from", f"{file}@1.5", env=env)
    assert done.returncode == 1 and "Traceback" not in done.stderr, done.stderr
    assert [fault["fault"] for fault in report_of(report)["faults"]] == ["PlantFailed"] * 2


LANES = """specc: 1.1
system: lanes
constants: {wide: "2[m]"}
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {v: "vector[2, m]"}}
      memory: {aside: {type: "real[m]", init: wide}}
      conditions: {terminal: {after: "elapsed > 1.5[s]"}}
      functions: {one: {y.b.v: "[0, 1[m]]"}, two: {y.b.v: "[0[m], aside]"}}
      behaviours:
        one: {functions: [one], terminal: after}
        two: {functions: [two], terminal: after}
      states: {A: one, B: two}
      initial_state: A
      transitions: [[A, terminal, always, B], [B, terminal, always, A]]
  b:
    control:
      rate: 10 Hz
      x: {a: {v: {type: "vector[2, m]", init: "[0[m], 0[m]]"}}}
      memory: {d: {type: "real[m]", init: 0}}
      functions: {l: {d: norm(x.a.v)}}
      behaviours: {l: {functions: [l], terminal: never}}
      states: {S: l}
      initial_state: S
"""


def passages(file: Path, subsystem: str) -> list[tuple[float, str]]:
    """When rows were taken, and which."""
    told = [data for _, data in messages(file)[f"/{subsystem}"]]
    return [(round(data["time"], 9), data["transition"]) for data in told if data["transition"]]


def test_memory_with_another_name_of_which_arrays_are_made(tmp_path: Path) -> None:
    spec, file, again = (tmp_path / name for name in ("lanes.yaml", "a.mcap", "b.mcap"))
    spec.write_text(LANES, encoding="utf-8")
    assert specc("run", spec, "--duration", 4, "--record", file).returncode == 0
    assumed = '      assume: [{that: "beside > 0[m]", because: test}]\n'
    text = LANES.replace("aside", "beside").replace("      trans", f"{assumed}      trans")
    spec.write_text(text, encoding="utf-8")
    told = ("run", spec, "--duration", 4, "--record", again)
    done = specc(*told, "--from", f"{file}@2.5")
    assert done.returncode == 0, done.stderr
    assert "a.c: memory beside is as at the beginning: there was none" in done.stderr
    assert messages(again)["/a.c"][-1][1]["memory"] == {"beside": 2.0}
    assert specc("replay", again, "--spec", spec).returncode == 0


STAYS = """specc: 1.1
system: stays
agents:
  a:
    control:
      rate: 10 Hz
      x: {b: {n: {type: int, init: 0}}}
      y: {b: {n: int}}
      conditions: {terminal: {after: "elapsed > 1[s]", told: "x.b.n > 30"}}
      functions: {f: {y.b.n: 1}}
      behaviours:
        one: {functions: [f], terminal: after}
        two: {functions: [f], terminal: told}
      states: {A: one, B: two}
      initial_state: A
      transitions: [[A, terminal, always, B], [B, terminal, always, A]]
  b:
    control:
      rate: 10 Hz
      x: {a: {n: {type: int, init: 0}}}
      y: {a: {n: int}}
      memory: {k: {type: int, init: 0}}
      functions: {l: {k: k + x.a.n, y.a.n: k}}
      behaviours: {l: {functions: [l], terminal: never}}
      states: {S: l}
      initial_state: S
"""


@pytest.mark.parametrize(
    ("old", "new", "at", "passage"),
    [
        ("x.b.n > 30", "elapsed > 1.5[s]", 2.1, (2.7, "B terminal always -> A")),
        (
            "rate: 10 Hz\n      x: {b",
            "rate: 20 Hz\n      x: {b",
            0.7,
            (1.05, "A terminal always -> B"),
        ),
    ],
)
def test_how_long_a_state_has_lasted_is_known_to_another_specification(
    old: str, new: str, at: float, passage: tuple[float, str], tmp_path: Path
) -> None:
    """Although nothing asked for the time in it, and whatever the rate is."""
    spec, file, again = (tmp_path / name for name in ("stays.yaml", "a.mcap", "b.mcap"))
    spec.write_text(STAYS)
    assert specc("run", spec, "--duration", 3, "--record", file).returncode == 0
    assert passages(file, "a.c") == [(1.1, "A terminal always -> B")]
    spec.write_text(STAYS.replace(old, new))
    done = specc("run", spec, "--duration", 3, "--record", again, "--from", f"{file}@{at}")
    assert done.returncode == 0, done.stderr
    assert passages(again, "a.c")[0] == passage


def test_who_is_new_and_has_made_no_step_yet_is_in_snapshots(tmp_path: Path) -> None:
    spec, file, again = (tmp_path / name for name in ("stays.yaml", "a.mcap", "b.mcap"))
    spec.write_text(STAYS)
    assert specc("run", spec, "--duration", 4, "--record", file).returncode == 0
    new = STAYS.replace("y: {a: {n: int}}", "y: {a: {n: int}, c: {n: int}}")
    new = new.replace("y.a.n: k}", "y.a.n: k, y.c.n: k}")
    late = """  c:
    control:
      rate: 1 Hz
      x: {b: {n: {type: int, init: 0}}}
      memory: {k: {type: int, init: 7}}
      functions: {l: {k: k + x.b.n}}
      behaviours: {l: {functions: [l], terminal: never}}
      states: {S: l}
      initial_state: S
"""
    spec.write_text(new + late)
    whole = ("run", spec, "--duration", 6, "--report")
    done = specc(*whole, tmp_path / "a.json", "--from", f"{file}@2.1", "--record", again)
    assert done.returncode == 0, done.stderr
    assert "c.c: is at its beginning: it was not recorded" in done.stderr
    done = specc(*whole, tmp_path / "b.json", "--from", f"{again}@2.5")
    assert done.returncode == 0 and "--from" not in done.stderr, done.stderr
    assert report_of(tmp_path / "a.json") == report_of(tmp_path / "b.json")
    assert "c.c: 3 steps are the same" in specc("replay", again, "--spec", spec).stdout


@pytest.mark.parametrize("at", [0.5, 2.5])
def test_what_is_put_together_once_is_there_in_runs_that_go_on(at: float, tmp_path: Path) -> None:
    spec, file = tmp_path / "lanes.yaml", tmp_path / "run.mcap"
    spec.write_text(LANES, encoding="utf-8")
    whole = ("run", spec, "--duration", 6, "--report")
    assert specc(*whole, tmp_path / "a.json", "--record", file).returncode == 0
    done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@{at}")
    assert done.returncode == 0, done.stderr
    assert report_of(tmp_path / "a.json") == report_of(tmp_path / "b.json")
