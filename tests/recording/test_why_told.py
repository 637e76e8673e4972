"""What `specc why` says, and refuses: words, exit codes, files of strangers."""

from __future__ import annotations

import json
import shlex
import shutil
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer
from specc_runtime.recording.index import Index
from specc_runtime.recording.moment import violations

from specc.cli.main import main
from specc.model import expr as m
from specc.model.types import Bool, Pose, Real, Vector
from specc.pipeline import compile_spec
from specc.tools.why import Moment, NotKnown, Reasons, value_of
from tests.commands import modules_of, specc
from tests.recording.runs import CONVEYOR, ROOT
from tests.recording.test_damage import _damaged_at
from tests.seeds import every

KEPT = Path(__file__).with_name("conveyor_gate.mcap")
pytestmark = pytest.mark.no_replay("forged or damaged")


def _why(moment: object, *more: object, file: Path = KEPT, spec: object = CONVEYOR) -> Any:
    return specc("why", f"{file}@{moment}", *more, "--spec", spec)


def test_a_state_and_what_is_missing_for_its_end() -> None:
    done = _why(3.1, "gate.c")
    assert done.returncode == 0 and not done.stderr
    place = "specs/conveyor_gate.yaml"
    assert done.stdout.replace(str(CONVEYOR), place) == (
        "gate.c at 3.1 s (stamp 62): in passing since 2.7 s, for 0.4 s\n"
        f"  by opening terminal always -> passing  ({place}:127)\n"
        "  conditions of passing:\n"
        "    error never: False\n"
        f"    terminal parcel_gone: False  ({place}:108)\n"
        "      elapsed = 0.4 s, needs > 2.5 s: 2.1 s too little\n"
        "      not asked, for what stands before it decided: not x.eye.parcel,"
        " which would be true\n"
        "      read x.eye.parcel = False\n"
        "    rows of terminal: not asked, for terminal did not occur: always -> closing\n"
        "  sent y.belt.go = 0.5 rad/s\n"
        "  sent y.barrier.a_d = 1.4 rad\n"
        "  last transitions:\n"
        "        1.5 s  closed terminal always -> halting\n"
        "       2.25 s  halting terminal always -> opening\n"
        "        2.7 s  opening terminal always -> passing\n"
    )


def test_a_step_with_a_transition_and_the_first_one() -> None:
    told = _why(1.5, "gate.c").stdout
    assert "in halting since 1.5 s, entered in this step\n" in told
    assert "  conditions of closed:\n    error never: False\n    terminal parcel_came: True" in told
    assert "    row closed terminal always -> halting: True\n" in told
    assert "  conditions of halting: asked first in the next step\n" in told
    assert "its first period, in which no condition is asked\n" in _why(0, "gate.c").stdout


def test_how_near_it_was() -> None:
    far = "is not near 0[rad/s]: apart by 0.5 rad/s, limit 0.02 rad/s, 0.48 rad/s too much\n"
    assert f"      x.belt.v = 0.500296 rad/s {far}" in _why(1.6, "gate.c").stdout
    near = "x.belt.v = 0.0133039 rad/s is near 0[rad/s]: apart by 0.0133 rad/s, limit 0.02 rad/s\n"
    assert f"      {near}" in _why(2.25, "gate.c").stdout


def test_a_line_for_each_subsystem() -> None:
    assert _why(1.6).stdout == (
        "belt.c        holding  since 1.55 s  running terminal hold_asked -> holding\n"
        "belt.drive    S0       since 0 s\n"
        "gate.c        halting  since 1.5 s   closed terminal always -> halting\n"
        "gate.barrier  S0       since 0 s\n"
        "gate.eye      S0       since 0 s\n"
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (f"{KEPT}", "is not FILE.mcap@SECONDS"),
        (f"{KEPT}@-1", "'-1' is not a number of seconds from 0"),
        (f"{KEPT}@soon", "'soon' is not a number of seconds"),
        (f"{KEPT}@7 --spec {CONVEYOR}", "ends at 6 s, before 7 s"),
        (f"none.mcap@1 --spec {CONVEYOR}", "cannot read none.mcap"),
        (f"{CONVEYOR}@1 --spec {CONVEYOR}", "is no MCAP file"),
        (f"{KEPT}@1 gate.d --spec {CONVEYOR}", "no subsystem gate.d; there are belt.c, belt.drive"),
        (f"{KEPT}@1", f"name it: specc why {KEPT}@1 --spec=specs/conveyor_gate.yaml"),
        (f"{KEPT}@7.0000001 --spec {CONVEYOR}", "ends at 6 s, before 7.0000001 s"),
        (f"{KEPT}@1.2345678", f"name it: specc why {KEPT}@1.2345678 --spec"),
        (f"{KEPT}@1 gate.c", f"specc why {KEPT}@1 gate.c --spec=specs/conveyor_gate.yaml"),
        (f"{KEPT}@1 --spec none.yaml", "no such file"),
    ],
)
def test_what_cannot_be_told(arguments: str, words: str) -> None:
    done = specc("why", *arguments.split())
    assert done.returncode == 2 and words in done.stderr.replace("\n", " "), done.stderr
    assert not done.stdout


def test_another_specification_is_noticed(tmp_path: Path) -> None:
    spec = _changed(tmp_path, ("elapsed > 2.5[s]", "elapsed > 0.1[s]"))
    done = _why(3.1, "gate.c", spec=spec)
    assert done.stderr == f"specc: {spec} is not as it was recorded\n"
    assert "terminal parcel_gone: False" in done.stdout
    assert "says True of what was recorded: it, or an operator, is" in done.stdout


def test_a_run_that_went_on_knows_of_the_time_before(tmp_path: Path) -> None:
    file = tmp_path / "run.mcap"
    specc("run", CONVEYOR, "--from", f"{KEPT}@3.2", "--duration", 3.2, "--record", file)
    told = _why(3.05, "gate.c", file=file).stdout
    assert "in passing since 2.7 s, for 0.35 s\n" in told and "elapsed = 0.35 s," in told
    assert "  the steps before stamp 60 are not in the file\n" in told
    assert "begins at 3 s, after 2 s" in _why(2, "gate.c", file=file).stderr


def test_damaged_and_cut_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "damaged.mcap"
    _damaged_at(2.3, file)
    assert main(["why", f"{file}@2.8", "gate.c", "--spec", str(CONVEYOR)]) == 3
    out, err = capsys.readouterr()
    assert "damaged parts left out: 1" in err and "are not in the file" in out
    assert main(["why", f"{file}@3.1", "gate.c", "--spec", str(CONVEYOR)]) == 3
    out, _ = capsys.readouterr()
    assert "in passing since 2.7 s, for 0.4 s\n" in out and "elapsed = 0.4 s" in out
    data = KEPT.read_bytes()
    file.write_bytes(data[: len(data) * 2 // 3])
    assert main(["why", f"{file}@1.5", "gate.c", "--spec", str(CONVEYOR)]) == 3
    assert "it was cut after " in capsys.readouterr().err


def _changed(folder: Path, *changes: tuple[str, str]) -> Path:
    text = CONVEYOR.read_text(encoding="utf-8")
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    folder.mkdir(exist_ok=True)
    shutil.copytree(ROOT / "specs" / "plants", folder / "plants")
    spec = folder / "gate.yaml"
    spec.write_text(text, encoding="utf-8")
    return spec


@pytest.mark.long
def test_reasons_that_double_are_told_once(tmp_path: Path) -> None:
    """Names that name one another often, quantifiers in one another: as much of it as is read."""
    letters = "abcdefghij"
    lets = ["w0: x.eye.parcel"]
    lets += [f"w{i}: {' or '.join([f'w{i - 1}'] * 9)}" for i in range(1, 10)]
    some = "any(" * 10 + f"{' + '.join(letters)} < 0"
    some += "".join(f" for {letter} in [0, 1, 2, 3, 4, 5, 6, 7])" for letter in letters)
    for when, words in [("w9", "w3: False, as above"), (some, " or more")]:
        changes = [
            ("elapsed > 2.5[s] and not x.eye.parcel", f"x.eye.parcel or {when}"),
            ("y: {belt: {go", f"let: {{{', '.join(lets)}}}\n      y: {{belt: {{go"),
        ]
        done = _why(3.1, "gate.c", spec=_changed(tmp_path / words[:2].strip(), *changes))
        assert done.returncode == 0 and words in done.stdout, done.stdout
        assert len(done.stdout.splitlines()) < 60


@pytest.mark.long
@pytest.mark.parametrize(
    ("change", "command", "told"),
    every(
        2,
        [
            (
                ("v_m < 0.1[rad/s])", "v_m < 0.001[rad/s])"),
                "specc why {file}@2.25 --spec {spec}",
                "gate.c        opening  since 2.25 s  halting terminal always -> opening",
            ),
            (
                ("hold: 2 * patience}", "hold: 2 * patience / (0 if x.eye.parcel else 1)}"),
                "specc why {file}@1.5 gate.c --spec {spec}",
                "fault in this step: ZeroDivisionError",
            ),
        ],
    ),
)
def test_runs_that_go_wrong_name_the_command(
    change: tuple[str, str], command: str, told: str, tmp_path: Path
) -> None:
    spec, file = _changed(tmp_path, change), tmp_path / "run.mcap"
    done = specc("run", spec, "--duration", 2.5, "--record", file)
    (line,) = (line for line in done.stderr.splitlines() if line.startswith("why: "))
    assert line == f"why: {command.format(file=file, spec=spec)}"
    asked = specc(*shlex.split(line.removeprefix("why: specc ")))
    assert asked.returncode == 0 and told in asked.stdout, asked.stdout
    quiet = specc("run", spec, "--duration", 2.5)
    assert "why: " not in quiet.stderr


HALTING = "always(state(gate.c) == halting implies within(patience, state(gate.c) == opening))"


MOVING = "always(state(gate.c) == opening implies belt.E.drive.v_m < 0.1[rad/s])"


@pytest.mark.parametrize(
    ("old", "new", "told"),
    every(
        3,
        [
            (
                'patience: {is: "3[s]"',
                'patience: {is: "0.5[s]"',
                [
                    f"violated at 1.5 s: {HALTING}  (gate.yaml:148)",
                    "  because: a parcel in the beam is let through soon",
                    "  at 1.5 s: state(gate.c) == halting held",
                    "  state(gate.c) == opening had to hold by 2 s, 0.5 s later, and did not",
                    "  at 1.5 s: state(gate.c) = halting",
                    "  at 2 s: state(gate.c) = halting",
                ],
            ),
            (
                HALTING,
                "always(state(gate.c) == halting implies throughout(1[s], belt.drive.v_p > 0))",
                [
                    "  at 1.5 s: state(gate.c) == halting held",
                    "  belt.drive.v_p > 0 had to hold until 2.5 s, for 1 s, "
                    "and did not all the time",
                    "  at 1.5 s: state(gate.c) = halting",
                    "  at 1.5 s: belt.drive.v_p = 0.5 rad/s",
                    "  at 2.5 s: state(gate.c) = opening",
                    "  at 2.5 s: belt.drive.v_p = 0 rad/s",
                ],
            ),
            (
                MOVING,
                "always(state(gate.c) != opening)",
                [
                    "violated at 2.25 s: always(state(gate.c) != opening)  (gate.yaml:146)",
                    "  because: the barrier moves up only beside a belt that stands",
                    "  at 2.25 s: state(gate.c) != opening did not hold",
                    "  at 2.25 s: state(gate.c) = opening",
                ],
            ),
        ],
    ),
)
def test_a_violated_requirement_is_explained(
    old: str, new: str, told: list[str], tmp_path: Path
) -> None:
    spec, file = _changed(tmp_path, (old, new)), tmp_path / "run.mcap"
    specc("run", spec, "--duration", 4, "--record", file)
    done = specc("why", f"{file}@2.6", "--spec", spec)
    lines = done.stdout.replace(f"{tmp_path}/", "").splitlines()
    assert done.returncode == 0 and lines[5:][-len(told) :] == told, done.stdout
    before = specc("why", f"{file}@1.4", "--spec", spec)
    assert "violated" not in before.stdout
    other = _changed(
        tmp_path / "other",
        (HALTING, "always(belt.c.x.drive.v < 9[rad/s])"),
        (MOVING, "always(belt.c.x.drive.v < 8[rad/s])"),
    )
    lines = specc("why", f"{file}@2.6", "--spec", other).stdout.splitlines()
    assert lines[5].startswith("violated at ")
    assert lines[6] == f"  {other} has no such requirement"


@pytest.mark.parametrize(
    "report",
    [
        "{",
        "[]",
        '{"requirements": 1}',
        '{"requirements": [1]}',
        '{"requirements": [{"verdict": "violated"}]}',
        '{"requirements": [{"verdict": "violated", "that": 1, "time_s": "x"}]}',
        '{"requirements": [{"verdict": "violated", "that": "x", "time_s": -1}]}',
        '{"requirements": [{"verdict": "violated", "that": "x", "time_s": 1e308}]}',
    ],
)
def test_verdicts_of_strangers(report: str, tmp_path: Path) -> None:
    file = tmp_path / "forged.mcap"
    with file.open("wb") as opened:
        (writer := Writer(opened)).start()
        writer.add_metadata("report", {"report": report})
        writer.finish()
    assert violations(Index(file), 5.0) == []


_STEP = {
    "stamp": 1, "time": 0.05, "before": "passing", "state": "passing", "cause": "", "row": -1,
    "transition": "", "conditions": {}, "x": {}, "fresh": {}, "y": {}, "memory": {},
}  # fmt: skip


@pytest.mark.parametrize(
    "odd",
    every(
        3,
        [
            {"x": {"eye": {"parcel": "\x1b[31m"}}, "y": {"belt": {"go": ["a"]}}},
            {"x": {"eye": 1}, "y": 7, "memory": 8},
            {"x": {"eye": {"parcel": [[[]]] * 999}}, "before": "\x1b[2Jno", "state": "n" * 99999},
            {"row": "x", "transition": "::error::\n" * 999, "state": "\x1b]0;"},
            {"cause": [1], "row": None, "before": None},
            {"stamp": 2**70, "time": 1e308},
            {"fault": {"a": "\x1b[31m"}, "conditions": {"parcel_gone": 3}},
            {"y": {"belt": {"go": 1e999, "hold": {}}, "barrier": None}},
        ],
    ),
)
def test_messages_of_strangers(odd: dict[str, Any], tmp_path: Path) -> None:
    file = tmp_path / "odd.mcap"
    with file.open("wb") as opened:
        writer = Writer(opened)
        writer.start()
        writer.add_metadata("specc", {"format": "1", "set": "{}", "spec": "", "exact": "false"})
        schema = writer.register_schema("specc.Step.gate.c", "jsonschema", b"{}")
        channel = writer.register_channel("/gate.c", "json", schema)
        for i in range(2):
            step = {**_STEP, "stamp": i, **odd}
            writer.add_message(channel, i * 10**7, json.dumps(step).encode(), 0)
        writer.finish()
    for more in ((), ("gate.c",)):
        done = _why(0.01, *more, file=file)
        assert done.returncode in (0, 2), done.stderr
        said = done.stdout + done.stderr
        assert "\x1b" not in said and "\n::" not in said and len(said) < 5000
        assert "fault of specc" not in said


def test_single_precision_is_no_truth() -> None:
    """What is nearer to a limit than memory is exact is not known, whatever it looks like."""
    system = compile_spec(str(ROOT / "specs" / "irp_picking.yaml")).system
    assert system is not None
    subsystem = next(s for s in system.subsystems if s.qualified_name == "irp.c")
    memory = next(item for item in subsystem.memory if isinstance(item.type, Pose))
    pose = [1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
    near = m.Builtin(
        "norm",
        (m.Builtin("position", (m.MemoryRef(memory.name, type=memory.type),),
                   type=Vector(3, Real())),),
        type=Real(),
    )  # fmt: skip
    for limit, known in ((0.5, None), (0.5 + 1e-9, None), (0.5001, True), (0.4999, False)):
        expr = m.Compare("<", near, m.Number(limit, type=Real()), type=Bool())
        for is_exact in (False, True):
            moment = Moment(
                system, subsystem, _STEP, {memory.name: pose}, 0.1, is_exact=is_exact, array=list
            )
            exactly = limit > 0.5
            assert moment.truth(expr) is (exactly if is_exact else known)
    said = Reasons(Moment(system, subsystem, _STEP, None, None, is_exact=True, array=list))
    lost = f"memory {memory.name} is not recorded"
    assert said.lines(expr) == [
        f"norm(position({memory.name})) < 0.4999 is not known: {lost}",
        f"read {memory.name} = not known ({lost})",
    ]
    with pytest.raises(NotKnown, match="is no pose"):
        value_of(memory.type, pose[1:])


ASKING = """specc: 1.1
system: asking
operators: {{ready: {{signature: "(d: real) -> bool", python: "asked_by_why:ready"}}}}
agents:
  a:
    control:
      rate: 10 Hz
      memory: {{d: {{type: real, init: 0.5}}}}
      conditions: {{terminal: {{told: "(ready(d) and d > 1) or (ready(d) and d > 2)"}}}}
      behaviours: {{wait: {{functions: [{{d: d + 1}}], terminal: told}}}}
      states: {{S0: wait}}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
"""


@pytest.mark.parametrize(("gives", "truth"), [("d < 1", False), ("'no'", None), ("1", None)])
def test_an_operator_is_asked_once_and_gives_what_its_type_says(
    gives: str, truth: bool | None, tmp_path: Path
) -> None:
    asked = f"calls = []\ndef ready(d):\n    calls.append(d)\n    return {gives}\n"
    (tmp_path / "asked_by_why.py").write_text(asked, encoding="utf-8")
    (tmp_path / "spec.yaml").write_text(ASKING.format(), encoding="utf-8")
    with modules_of(tmp_path):
        system = compile_spec(str(tmp_path / "spec.yaml")).system
        assert system is not None
        (subsystem,) = system.subsystems
        when = subsystem.state("S0").behaviour.terminal.when
        memory = {"d": 0.5}
        moment = Moment(system, subsystem, _STEP, memory, 0.1, is_exact=True, array=list)
        assert moment.truth(when) is truth
        Reasons(moment).lines(when)
        import asked_by_why  # type: ignore[import-not-found]  # a module of this test

        assert set(asked_by_why.calls) == {0.5} and (truth is None or len(asked_by_why.calls) == 1)


READING = """specc: 1.1
system: reading
files: {limit: limit.txt}
operators: {read: {signature: "(path: file) -> real", python: "read_by_why:read"}}
agents:
  a:
    real_receptors: {eye: {y: {d: real}}}
    virtual_receptors:
      eye:
        rate: 10 Hz
        x: {R: {d: real}}
        conditions: {terminal: {far: x.R.d > read(limit)}}
        behaviours: {wait: {terminal: far}}
        states: {S0: wait}
        initial_state: S0
        transitions: [[S0, terminal, always, S0]]
"""


def test_files_are_those_beside_the_specification(tmp_path: Path) -> None:
    """Wherever the command is typed."""
    (tmp_path / "read_by_why.py").write_text(
        "def read(path):\n    return float(open(path).read())\n"
    )
    (tmp_path / "limit.txt").write_text("2.5")
    (tmp_path / "spec.yaml").write_text(READING)
    with modules_of(tmp_path):
        system = compile_spec(str(tmp_path / "spec.yaml")).system
        assert system is not None
        (subsystem,) = system.subsystems
        when = subsystem.state("S0").behaviour.terminal.when
        step = {**_STEP, "x": {"R": {"d": 3.0}}}
        moment = Moment(
            system, subsystem, step, {}, 0.1, is_exact=True, array=list, folder=str(tmp_path)
        )
        assert moment.truth(when) is True
