"""Snapshots of all that a run is: what disturbs it, ground truth, requirements, noise, silence."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from specc_runtime.forms import Misshapen
from specc_runtime.recording.messages import Shelved
from specc_runtime.recording.text import dumped, loaded
from specc_runtime.requirements import Requirement
from specc_runtime.savable import restored
from specc_runtime.temporal import (
    UNKNOWN,
    And,
    Atom,
    Formula,
    Historically,
    Judgement,
    Not,
    Once,
    Or,
    Throughout,
    Within,
    judged,
)

from tests.recording.runs import ROOT, messages, report_of, specc
from tests.runtime.test_disturbances import MODEL, SPEC
from tests.seeds import blocks, every

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


@pytest.mark.parametrize("seeds", blocks([0], long=3, each=1))
def test_a_disturbed_run_goes_on_as_it_did(seeds: Sequence[int], tmp_path: Path) -> None:
    (seed,) = seeds
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


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "duration_s"),
    [
        ("rovers", 6),
        pytest.param("architectures/services", 4, marks=pytest.mark.long),
        pytest.param("architectures/sense_plan_act", 6, marks=pytest.mark.long),
    ],
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
    every(3, [("", "30[N]", 1), ("", "0[N]", 0), ("the push is gone", "30[N]", 0)]),
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


@pytest.mark.long
def test_constants_of_the_recorded_run_stay_unless_set_otherwise(tmp_path: Path) -> None:
    (tmp_path / "cart.xml").write_text(MODEL)
    spec, file = tmp_path / "cart.yaml", tmp_path / "run.mcap"
    report, again = tmp_path / "a.json", tmp_path / "b.json"
    cruise = "constants: {cruise: '1[m/s]', limit: '9[m]'}\nframes:"
    spec.write_text(
        SPEC.replace("frames:", cruise)
        + "require: [{that: 'always(plant.s < limit)', because: it is asked}]\n"
    )
    given = ("--set", "limit=0.05[m]", "--duration", 2)
    assert specc("run", spec, *given, "--record", file, "--report", report).returncode == 1
    past = ("--from", f"{file}@1.5", "--duration", 2, "--report", again)
    done = specc("run", spec, *past)
    assert done.returncode == 1 and "--from" not in done.stderr
    assert report_of(again)["requirements"] == report_of(report)["requirements"]
    done = specc("run", spec, *past, "--set", "cruise=2[m/s]")
    told = "recorded run: limit=0.05[m]; for this one: limit=0.05[m], cruise=2[m/s]\n"
    assert f"--from: set for the {told}" in done.stderr
    spec.write_text(spec.read_text().replace("limit", "bound"))
    done = specc("run", spec, *past)
    assert f"specc: --from: {spec} has no limit, which the recorded run has set\n" in done.stderr
    assert done.returncode == 0


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


def _same_otherwise(one: Path, other: Path) -> bool:
    """Whether two reports tell the same but for the digest, which begins anew."""
    first, second = report_of(one), report_of(other)
    return first | {"records_sha256": "", "set": 0} == second | {"records_sha256": "", "set": 0}


@pytest.mark.long
@pytest.mark.parametrize(
    "at",
    [
        1.617,
        *(pytest.param(at, marks=pytest.mark.long) for at in (0.93, 1.62, 2.0, 3.999, 4.505)),
    ],
)
def test_a_run_that_another_one_goes_on_from_between_two_steps(at: float, tmp_path: Path) -> None:
    """Whatever is under way then is seen when it would have been: nothing differs."""
    spec, file = spec_in(tmp_path), tmp_path / "run.mcap"
    whole = ("run", spec, "--duration", 5, "--report")
    first = specc(*whole, tmp_path / "a.json", "--seed", 3, "--record", file)
    spec.write_text(f"{spec.read_text()}# the same in other words\n")
    again = tmp_path / "again.mcap"
    done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@{at}", "--record", again)
    assert done.returncode == first.returncode, done.stderr
    assert "is known of the past" not in done.stderr
    assert _same_otherwise(tmp_path / "a.json", tmp_path / "b.json")
    done = specc(*whole, tmp_path / "c.json", "--from", f"{again}@{at + 0.2}")
    assert _same_otherwise(tmp_path / "b.json", tmp_path / "c.json"), done.stderr


FORMULAS: tuple[Callable[[Callable[[], Formula]], Formula], ...] = (
    lambda a: a(),
    lambda a: Within(4, a()),
    lambda a: Or(Not(a()), Within(6, a())),
    lambda a: Once(5, a()),
    lambda a: And(Historically(3, a()), Within(2, a())),
    lambda a: Throughout(3, Once(4, a())),
)


class Limited:
    """A requirement about `x` and a limit, and the judgement of each tick."""

    x: float

    def __init__(self, make: Callable[[Callable[[], Formula]], Formula], limit: int) -> None:
        formula = make(lambda: Atom(lambda: judged(self.x < limit, self.x - limit), "x"))
        self.requirement = Requirement("x < limit", "", formula, {"x": "x"})

    def show(self, values: Mapping[str, Any]) -> None:
        """See `Show`; without a value it is unknown what holds."""
        vars(self).pop("x", None)
        vars(self).update(values)
        for atom in self.requirement.formula.atoms():
            atom.update()

    def follow(self, run: Sequence[dict[str, float]]) -> None:
        """Go on."""
        for values in run:
            self.show(values)
            self.requirement.step(values)

    def judgements(self, run: Sequence[dict[str, float]]) -> list[Judgement]:
        """Of the ticks of a whole run."""
        formula = self.requirement.formula
        found = [(self.show(values), formula.step())[1] for values in run]
        for atom in formula.atoms():
            atom.now = UNKNOWN
        found += [formula.step() for _ in range(formula.delay)]
        return [judgement for judgement in found if judgement is not None]


@pytest.mark.parametrize("seeds", blocks(range(72), long=1080, each=720))
def test_what_is_open_is_judged_as_the_other_one_says(seeds: Sequence[int]) -> None:
    for seed in seeds:
        is_judged_as_the_other_one_says(seed)


def is_judged_as_the_other_one_says(seed: int) -> None:
    """What a random requirement makes of the past of another one."""
    rng = random.Random(seed)
    run = [{"x": float(rng.randint(0, 9))} for _ in range(50)]
    at, limits = rng.randint(0, 49), rng.sample(range(2, 12), 2)
    kinds = FORMULAS[seed % 6], FORMULAS[seed // 6 % 6]
    old, new = (Limited(kind, limit) for kind, limit in zip(kinds, limits, strict=True))
    old.follow(run[:at])
    saved = loaded(dumped(old.requirement.saved(dict)))
    lacks = new.requirement.judge_anew(at, saved, dict, new.show)
    assert kinds[0] is not kinds[1] or lacks == 0
    new.follow(run[at:])
    for atom in new.requirement.formula.atoms():
        atom.now = UNKNOWN
    new.requirement.finish(0)
    then, now = (
        Limited(kind, limit).judgements(run) for kind, limit in zip(kinds, limits, strict=True)
    )
    open_from = max(0, at - old.requirement.formula.delay)
    found = then[:open_from] + now[open_from:]
    (truth, margin), highest = (min(bound) for bound in zip(*found, strict=True))
    told = new.requirement.as_data(1.0)
    verdict = "met" if truth else "unknown" if highest[0] else "violated"
    if lacks:
        assert told["verdict"] in (verdict, "unknown")
    else:
        assert told["verdict"] == verdict
        assert told["margin"] == {"met": margin, "violated": highest[1], "unknown": None}[verdict]


@pytest.mark.parametrize("is_other", [False, True])
def test_what_was_judged_stays_judged_in_runs_that_go_on_again(is_other: bool) -> None:
    run = [{"x": 10.0 if 60 < tick < 85 else 0.0} for tick in range(200)]
    old = Limited(lambda a: Throughout(2, a()), 100)
    old.follow(run[:100])
    new, again = (Limited(lambda a: Throughout(50, a()), 3) for _ in range(2))
    new.requirement.judge_anew(100, old.requirement.saved(dict), dict, new.show)
    new.follow(run[100:115])
    saved = loaded(dumped(new.requirement.saved(dict)))
    if is_other:
        again.requirement.judge_anew(115, saved, dict, again.show)
    else:
        again.requirement.restore(saved, dict)
    for each in (new, again):
        each.follow(run[115:])
        each.requirement.finish(0)
    assert new.requirement.verdict == again.requirement.verdict == "met"


@pytest.mark.parametrize("is_other", [False, True])
def test_what_was_asked_stays_asked(is_other: bool) -> None:
    for asked_at, at in ((20, 40), (60, 40), (99, 40), (40, 40)):
        now = {"holds": False}
        told = []
        for _ in range(2):
            atom = Atom(partial(lambda now: judged(**now), now), "x")
            answer = Or(Not(atom), Within(3, Not(atom)))
            told.append(Requirement("", "", answer, {}, asked=Once(2, atom)))
        first, again = told
        for tick in range(80):
            each = first if tick < at else again
            if tick == at and is_other:
                again.judge_anew(at, loaded(dumped(first.saved(dict))), dict, lambda _: None)
            elif tick == at:
                again.restore(loaded(dumped(first.saved(dict))), dict)
            now["holds"] = tick == asked_at
            for condition in each.formula.atoms():
                condition.update()
            each.step({})
        assert again.as_data(1.0)["asked"] == (asked_at < 80)


def test_of_what_is_decided_nothing_is_kept_and_nothing_missed() -> None:
    told = []
    for _ in range(2):
        atom = Atom(lambda: judged(holds=True), "x")
        told.append(Requirement("", "", Within(3, atom), {}, lasts=False))
    first, again = told
    for tick in range(9):
        for atom in first.formula.atoms():
            atom.update()
        first.step({})
        assert len(first.saved(dict)["earlier"]) == (tick + 1 if tick < 3 else 0)
    assert again.judge_anew(9, first.saved(dict), dict, lambda _: None) == 0
    again.step({})
    again.finish(0)
    assert again.verdict == "met"


@pytest.mark.long
def test_requirements_share_the_values_that_snapshots_have(tmp_path: Path) -> None:
    sizes = []
    for count in (1, 4):
        that = "".join(
            f'  - {{that: "within(30[s], a.c.n + a.c.m > {10**9 + n})", because: test}}\n'
            for n in range(count)
        )
        spec, file = tmp_path / "count.yaml", tmp_path / f"{count}.mcap"
        spec.write_text(COUNT + that)
        whole = ("run", spec, "--duration", 20, "--report")
        done = specc(*whole, tmp_path / "a.json", "--record", file)
        assert done.returncode == 0, done.stderr
        done = specc(*whole, tmp_path / "b.json", "--from", f"{file}@19")
        assert _same_otherwise(tmp_path / "a.json", tmp_path / "b.json"), done.stderr
        sizes.append(len(dumped(messages(file)["/snapshot"][-1][1]["requirements"])))
    assert sizes[1] < 2 * sizes[0]


COUNT = """specc: 1.1
system: count
agents:
  a:
    control:
      rate: 10 Hz
      y: {b: {n: real}}
      memory: {n: {type: real, init: 0}, m: {type: real, init: 0}}
      behaviours:
        count: {functions: [{n: n + 1 / 3, m: n / 7, y.b.n: n}], terminal: never}
      states: {S0: count}
      initial_state: S0
  b:
    control:
      rate: 10 Hz
      x: {a: {n: real}}
      memory: {k: {type: real, init: 0}}
      functions: {f: {k: x.a.n if present(x.a.n) else k}}
      behaviours: {keep: {functions: [f], terminal: never}}
      states: {S0: keep}
      initial_state: S0
require:
"""


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
    whole.restore(saved | {"earlier": [[10**9, {}]]}, dict)
    assert whole.saved(dict)["earlier"] == [[4, {}]]
    waiting = [[[[10**9, None]], *saved["formula"][0][1:]], *saved["formula"][1:]]
    with pytest.raises(ValueError, match="more than"):
        whole.restore(saved | {"formula": waiting}, dict)
    shelf = Shelved(most_bytes=10)
    for name in "abb":
        shelf.put(name, bytes(6))
    assert shelf.packed("", {"type": "", "digest": "b"}) == bytes(6)
    with pytest.raises(Exception, match="a value of"):
        shelf.packed("", {"type": "", "digest": "a"})
