"""Misuse of the command: clear words, the right exit code, never a traceback."""

import json
import os
from dataclasses import dataclass
from pathlib import Path

import pytest

from specc.cli import main
from tests import commands
from tests.seeds import every

ROOT = Path(__file__).parents[2]
SPEC = (ROOT / "specs/conveyor_gate.yaml").read_text(encoding="utf-8")
MODEL = (ROOT / "specs/plants/conveyor_gate.xml").read_text(encoding="utf-8")

REFUSED, UNUSABLE = 1, 2
"""Exit codes: the specification or the run is wrong; usage is, or a file cannot be used."""

OPERATORS = """\
number = 3
def raises(v): raise ValueError("the belt is upside down")
def two(a, b): return a
def leaves(v): raise SystemExit(3)
"""


def with_operator(python: str) -> str:
    """The specification with an operator that the belt calls in every period."""
    signature = "(v: real[rad/s]) -> real[rad/s]"
    operators = f'operators:\n  OP: {{signature: "{signature}", python: "{python}"}}\n\nagents:'
    return edit(edit(SPEC, "agents:", operators), "y.c.v: x.E.v_m", "y.c.v: OP(x.E.v_m)")


def edit(text: str, old: str, new: str) -> str:
    """The text with the first occurrence of `old` replaced; there must be one."""
    assert old in text, old
    return text.replace(old, new, 1)


def bomb() -> str:
    lines = ["specc: 1", "a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 12)]
    return "\n".join(lines)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A working folder with the conveyor, its model and operators of a careless user."""
    (tmp_path / "plants").mkdir()
    (tmp_path / "plants/conveyor_gate.xml").write_text(MODEL, encoding="utf-8")
    (tmp_path / "gate.yaml").write_text(SPEC, encoding="utf-8")
    (tmp_path / "careless.py").write_text(OPERATORS, encoding="utf-8")
    (tmp_path / "unfinished.py").write_text("def f(:\n", encoding="utf-8")
    (tmp_path / "failing.py").write_text("\nratio = 1 / 0\n", encoding="utf-8")
    (tmp_path / "a_file").write_text("", encoding="utf-8")
    (tmp_path / "a_folder.yaml").mkdir()
    os.mkfifo(tmp_path / "pipe")
    return tmp_path


def specc(folder: Path, *arguments: str) -> tuple[int, str]:
    """Exit code of the command in a folder, and all that it printed, on one line."""
    done = commands.specc(
        *arguments, cwd=folder, env={**os.environ, "PYTHONPATH": str(folder)}, together=True
    )
    return done.returncode, " ".join(done.stdout.split())


def assert_said(outcome: tuple[int, str], code: int, words: tuple[str, ...]) -> None:
    found, printed = outcome
    assert "Traceback" not in printed
    assert "a fault of specc itself" not in printed
    assert [word for word in words if word not in printed] == [], printed
    assert found == code, printed


@dataclass(frozen=True, slots=True)
class Misuse:
    """A text in place of the specification, the exit code of `validate`, and essential words."""

    text: str | bytes
    code: int
    words: tuple[str, ...]


TEXTS = {
    "empty": Misuse("", REFUSED, ("E0022", "start with `specc: 1`")),
    "no specification": Misuse("- specc\n", REFUSED, ("E0022", "has `specc: 1`")),
    "no mapping": Misuse("[{specc: 1}]\n", REFUSED, ("E0103", "expected a mapping, found a list")),
    "bytes": Misuse(bytes(range(256)), REFUSED, ("E0022", "has `specc: 1`")),
    "other bytes": Misuse(b"specc: 1\n\xff", UNUSABLE, ("E0005", "not UTF-8")),
    "tab": Misuse(edit(SPEC, "  cruise", "\tcruise"), REFUSED, ("E0009", ":8:1", "tab", "spaces")),
    "wrong type": Misuse(
        edit(SPEC, "kind: CET", "kind: [C]"), REFUSED, ("E0103", "expected text, found a list")
    ),
    "rate without unit": Misuse(
        edit(SPEC, "rate: 100 Hz", "rate: 100"), REFUSED, ("E0104", "`100`", "`100 Hz`")
    ),
    "rate beyond reason": Misuse(
        edit(SPEC, "rate: 100 Hz", "rate: 1e999999999 Hz"), REFUSED, ("E0104", "`1e999999999 Hz`")
    ),
    "unknown key": Misuse(
        edit(SPEC, "initial_state: S0", "initial_stat: S0"),
        REFUSED,
        ("E0101", "initial_stat", "did you mean `initial_state`"),
    ),
    "unknown name": Misuse(
        edit(SPEC, "y.E.v_s: v_n", "y.E.v_s: v_m"), REFUSED, ("E0201", "name `v_m`", "x.E.v_m")
    ),
    "unknown element": Misuse(
        edit(SPEC, "y.drive.v_d: x.gate.go", "y.drive.v_d: x.gate.goo"),
        REFUSED,
        ("E0201", "no `goo`", "did you mean `go`"),
    ),
    "cyclic let": Misuse(
        edit(SPEC, 'let: {v_n: "v_p +', 'let: {a: v_n, v_n: "a +'),
        REFUSED,
        ("E0206", "is defined by itself", "`a`", "`v_n`", "memory"),
    ),
    "operator path": Misuse(
        with_operator("not a path"), REFUSED, ("E0104", "`not a path`", "package.module:name")
    ),
    "actuator": Misuse(
        edit(SPEC, "[belt_drive]", "[belt_drve]"),
        REFUSED,
        ("E0502", "no actuator `belt_drve`", "did you mean `belt_drive`"),
    ),
    "no model file": Misuse(
        edit(SPEC, "plants/conveyor_gate.xml", "plants/none.xml"),
        REFUSED,
        ("E0501", "none.xml", "no such file"),
    ),
    "model is a folder": Misuse(
        edit(SPEC, "plants/conveyor_gate.xml", "plants"), REFUSED, ("E0501", "is a directory")
    ),
    "model is a pipe": Misuse(
        edit(SPEC, "plants/conveyor_gate.xml", "pipe"), REFUSED, ("E0501", "not a regular file")
    ),
    "model has no file name": Misuse(
        edit(SPEC, "plants/conveyor_gate.xml", '"a\\0.xml"'), REFUSED, ("E0501", "not the name")
    ),
    "used file missing": Misuse(
        edit(SPEC, "system:", "use: [lib/none.yaml]\nsystem:"),
        UNUSABLE,
        ("E0001", "no such file", "lib/none.yaml", "gate.yaml:4:7"),
    ),
    "deep": Misuse(
        "specc: 1\nagents: " + "{a: " * 300 + "1" + "}" * 300, REFUSED, ("E0017", "64 levels")
    ),
    "very deep": Misuse("specc: " + "[" * 200_000, REFUSED, ("E0017", "64 levels")),
    "deep expression": Misuse(
        edit(SPEC, "fresh(x.gate.go),", f'"{"(" * 500}fresh(x.gate.go){")" * 500}",'),
        REFUSED,
        ("E0303", "64 deep", "let"),
    ),
    "long expression": Misuse(
        edit(SPEC, '"0.5[rad/s]"', '"0.5[rad/s]' + " + 0.5[rad/s]" * 5000 + '"'),
        REFUSED,
        ("E0303", "10000", "let"),
    ),
    "long signature": Misuse(
        edit(with_operator("p:op"), "(v: real[rad/s])", f"({'v: real, ' * 2000}v: real)"),
        REFUSED,
        ("E0306", "10000"),
    ),
    "many assumptions": Misuse(
        "specc: 1\nsystem: s\nagents: {a: {control: {assume: [" + "{that: a}, " * 401 + "]}}}\n",
        REFUSED,
        ("E0104", "400 items"),
    ),
    "alias bomb": Misuse(bomb(), REFUSED, ("E0017", "too many values", "100000")),
    "many values": Misuse(
        "specc: 1\nconstants: {a: [" + "1, " * 120_000 + "1]}\n",
        REFUSED,
        ("E0017", "too many values"),
    ),
    "huge": Misuse("specc: 1\n" + "# nothing\n" * 300_000, UNUSABLE, ("E0004", "2 MB")),
}


@pytest.mark.parametrize("name", every(2, [*TEXTS]))
def test_text_that_is_no_specification(name: str, folder: Path) -> None:
    case = TEXTS[name]
    text = case.text if isinstance(case.text, bytes) else case.text.encode()
    (folder / "gate.yaml").write_bytes(text)
    assert_said(specc(folder, "validate", "gate.yaml"), case.code, (*case.words, "gate.yaml"))


@pytest.mark.parametrize("what", ["build", "run"])
def test_specification_with_errors_is_neither_built_nor_run(what: str, folder: Path) -> None:
    (folder / "gate.yaml").write_text(edit(SPEC, "y.E.v_s: v_n", "y.E.v_s: v_m"), encoding="utf-8")
    assert_said(specc(folder, what, "gate.yaml"), REFUSED, ("E0201", "gate.yaml:35:", "1 error"))
    assert not (folder / "generated").exists()


@pytest.mark.parametrize(
    ("model", "words"),
    every(
        2,
        [
            (MODEL[:900], ("bad.xml is not XML", "line 15")),
            ("", ("bad.xml is not XML",)),
            ("<robot name='urdf'/>", ("bad.xml is URDF", "`From URDF`")),
            ("<sdf/>", ("<mujoco>",)),
            ("<mujoco/>", ("no actuator `belt_drive`", "it has no actuators")),
            (
                edit(MODEL, '"belt_drive" joint', '"belt_drives" joint'),
                ("did you mean `belt_drives`",),
            ),
        ],
    ),
    ids=["cut off", "empty", "urdf", "another format", "bare", "renamed"],
)
def test_model_that_does_not_serve(model: str, words: tuple[str, ...], folder: Path) -> None:
    (folder / "bad.xml").write_text(model, encoding="utf-8")
    (folder / "gate.yaml").write_text(
        edit(SPEC, "plants/conveyor_gate.xml", "bad.xml"), encoding="utf-8"
    )
    assert_said(specc(folder, "run", "gate.yaml"), REFUSED, ("gate.yaml", *words))


def test_model_that_only_the_simulator_refuses(folder: Path) -> None:
    (folder / "plants/conveyor_gate.xml").write_text(
        edit(MODEL, 'type="cylinder" size="0.12', 'type="cilinder" size="0.12'), encoding="utf-8"
    )
    words = ("plants/conveyor_gate.xml", "cilinder", "line 25")
    assert_said(specc(folder, "run", "gate.yaml"), UNUSABLE, words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("validate none.yaml", ("no such file", "none.yaml", "check the path")),
        ("build none.yaml", ("no such file", "none.yaml")),
        ("run none.yaml", ("no such file", "none.yaml")),
        ("validate plants", ("directory has no specification", "plants", "specc: 1")),
        ("build a_folder.yaml", ("this is a directory",)),
        ("run a_folder.yaml", ("this is a directory",)),
        ("validate pipe", ("pipe", "E0001")),
        ("validate no*.yaml", ("no specification matches", "no*.yaml")),
        ("build gate.yaml --out a_file", ("cannot be written", "a_file", "--out")),
        ("build gate.yaml --out a_file/below", ("cannot be written", "not a directory")),
        ("run gate.yaml --report none/r.json", ("cannot write none/r.json", "no folder none")),
        ("run gate.yaml --report plants", ("cannot write plants", "folder")),
        ("run gate.yaml --report pipe", ("cannot write pipe", "no ordinary file")),
        ("run gate.yaml --video none/v.mp4", ("cannot write none/v.mp4", "no folder none")),
        ("run gate.yaml --video v.avi", ("v.avi", "end in .mp4")),
        ("run gate.yaml --cycles 0", ("--cycles", "at least 1")),
        ("run gate.yaml --cycles some", ("--cycles", "'some' is not a whole number")),
        ("run gate.yaml --seed x", ("--seed", "'x' is not a whole number")),
        ("run gate.yaml --seed -1", ("--seed", "'-1' is not a whole number, 0 or more")),
        ("run gate.yaml --renderer y", ("--renderer", "'y'", "raycast")),
        ("run gate.yaml --duration -1", ("--duration", "positive number of seconds")),
        ("run gate.yaml --duration inf", ("--duration", "positive number of seconds")),
        ("run gate.yaml --fast", ("usage: specc run", "unrecognized arguments: --fast")),
        ("run gate.yaml --cyles=2", ("usage: specc run", "did you mean --cycles?")),
        ("sweep gate.yaml --shceduler a", ("usage: specc sweep", "did you mean --scheduler?")),
        ("status gate.yaml another.yaml", ("usage: specc status", "arguments: another.yaml")),
        ("run", ("required: SPEC",)),
        ("--versoin", ("usage: specc", "did you mean --version?")),
        ("runn gate.yaml", ("no command 'runn'", "did you mean run?")),
        ("zzz gate.yaml", ("no command 'zzz'", "specc --help")),
        ("import fabrik a.xml", ("usage: specc import", "did you mean fabric?")),
        ("completion tsch", ("'tsch'", "bash", "zsh", "fish")),
        ("validate gate.yaml --format xml", ("'xml'", "sarif")),
        ("explain E9999", ("no code is called `E9999`",)),
    ],
)
def test_arguments_that_cannot_be_followed(
    arguments: str, words: tuple[str, ...], folder: Path
) -> None:
    assert_said(specc(folder, *arguments.split()), UNUSABLE, words)
    assert (folder / "pipe").is_fifo()
    assert not (folder / "generated").exists()


def test_dashes_do_not_make_options_alike(folder: Path) -> None:
    _, said = specc(folder, "run", "gate.yaml", "--quiet")
    assert "unrecognized arguments: --quiet" in said and "did you mean" not in said


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is forbidden to root")
def test_folders_and_files_without_permission(folder: Path) -> None:
    (folder / "plants").chmod(0o500)
    outcome = specc(folder, "build", "gate.yaml", "--out", "plants/new")
    assert_said(outcome, UNUSABLE, ("cannot be written", "permission denied"))
    outcome = specc(folder, "run", "gate.yaml", "--report", "plants/r.json")
    assert_said(outcome, UNUSABLE, ("cannot write plants/r.json", "permission denied"))
    (folder / "gate.yaml").chmod(0)
    outcome = specc(folder, "validate", "gate.yaml")
    assert_said(outcome, UNUSABLE, ("E0001", "permission denied"))


@pytest.mark.parametrize(
    ("python", "code", "words"),
    every(
        2,
        [
            ("no_such.module:f", UNUSABLE, ("no module no_such", "PYTHONPATH")),
            ("careless:missing", UNUSABLE, ("cannot import name 'missing' from 'careless'",)),
            ("unfinished:f", UNUSABLE, ("invalid syntax (unfinished.py, line 1)",)),
            ("failing:f", UNUSABLE, ("ZeroDivisionError", "(failing.py, line 2)")),
            ("careless:number", REFUSED, ("belt.drive S0", "'int' object is not callable")),
            ("careless:two", REFUSED, ("belt.drive S0", "two() missing 1 required")),
            (
                "careless:raises",
                REFUSED,
                ("at 0.000 s, belt.drive S0", "the belt is upside down", "raises (careless.py:2)"),
            ),
            ("careless:leaves", REFUSED, ("belt.drive S0", "SystemExit: 3")),
        ],
    ),
)
def test_operator_that_does_not_serve(
    python: str, code: int, words: tuple[str, ...], folder: Path
) -> None:
    (folder / "gate.yaml").write_text(with_operator(python), encoding="utf-8")
    assert_said(specc(folder, "run", "gate.yaml", "--duration", "0.1"), code, words)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("of: gate.c", "of: gate.d", ("O0205", "gate.d", "gate.c")),
        ("from: closing", "from: closed_", ("E0201", "closed_")),
    ],
)
def test_task_about_nothing(old: str, new: str, words: tuple[str, ...], folder: Path) -> None:
    (folder / "gate.yaml").write_text(edit(SPEC, old, new), encoding="utf-8")
    assert_said(specc(folder, "run", "gate.yaml"), REFUSED, words)


@pytest.mark.parametrize("part", ["scene", "judge"])
def test_task_with_a_class_that_is_not_there(part: str, folder: Path) -> None:
    text = edit(
        SPEC, "  cycle: {of: gate.c", f'  {part}: "careless:Missing"\n  cycle: {{of: gate.c'
    )
    (folder / "gate.yaml").write_text(text, encoding="utf-8")
    words = (f"cannot load the {part} 'careless:Missing'", "no attribute 'Missing'")
    assert_said(specc(folder, "run", "gate.yaml"), UNUSABLE, words)


def test_specification_without_a_plant_or_a_task(folder: Path) -> None:
    (folder / "gate.yaml").write_text(SPEC[: SPEC.index("\ntask:")], encoding="utf-8")
    words = ("O0503", "there is no task", "--duration")
    assert_said(specc(folder, "run", "gate.yaml", "--cycles", "1"), 1, words)
    (folder / "gate.yaml").write_text(SPEC[: SPEC.index("\nplant:")], encoding="utf-8")
    words = ("O0501", "no plant", "belt.E.drive", "`plant:`")
    assert_said(specc(folder, "run", "gate.yaml", "--duration", "0.1"), 1, words)


@pytest.mark.parametrize("text", ["specc: 1\nsystem: x\nwrong: 1\n", "- [", None])
def test_a_refused_specification_is_json_where_json_is_wanted(
    text: str | None, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    spec = tmp_path / "a.yaml"
    if text is not None:
        spec.write_text(text)
    code = main(["validate", str(spec), "--format", "json"])
    expected = json.loads(capsys.readouterr().out)
    assert code and expected["diagnostics"]
    for command in ("explore", "status", "ages", "diff"):
        files = [str(spec)] * (2 if command == "diff" else 1)
        assert main([command, *files, "--format", "json"]) == code, command
        out, err = capsys.readouterr()
        assert json.loads(out)["diagnostics"][:1] == expected["diagnostics"][:1], command
        assert err == ""
