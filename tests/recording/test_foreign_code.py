"""A recording never decides which code runs: what it names in Python is refused, by its name."""

from __future__ import annotations

import json
import re
from argparse import Namespace
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest
from specc_runtime.recording.snapshots import last_before

from specc import pipeline
from specc.cli.main import main
from specc.cli.recordings import recorded_package
from specc.lower.code import named_code
from specc.schema import files
from specc.schema.keys import PythonPath, SpecModel
from tests.recording.forged import forged
from tests.seeds import short

pytestmark = pytest.mark.no_replay
MODEL = """<mujoco><worldbody><body><joint name="j" type="slide"/><geom size="1" mass="1"/></body>
</worldbody><actuator><motor name="m" joint="j"/></actuator></mujoco>"""
CELL = """specc: 1
system: cell
title: A cell
types:
  Grip: {fields: {width: real}, python: "own:Grip"}
  Cloud: {opaque: true, python: "own:Cloud", codec: {encode: "own:packed", decode: "own:unpacked"}}
operators:
  UP: {signature: "(g: Grip, c: Cloud) -> real", python: "own:up"}
  EMPTY: {signature: "() -> Cloud", python: "own:empty"}
  GRIP: {signature: "() -> Grip", python: "own:grip"}
agents:
  a:
    real_effectors:
      m: {x: {f: "real[N]"}, y: {p: "real[m]"}}
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {c: {f: {type: "real[N]", init: 0}}, E: {p: "real[m]"}}
        y: {c: {p: "real[m]"}, E: {f: "real[N]"}}
        behaviours: {go: {functions: [{y.E.f: x.c.f, y.c.p: x.E.p}], terminal: never}}
        states: {S0: go}
        initial_state: S0
    control:
      rate: 10 Hz
      x: {m: {p: "real[m]"}}
      y: {m: {f: "real[N]"}}
      memory: {c: {type: Cloud, init: EMPTY()}, g: {type: Grip, init: GRIP()}}
      conditions: {terminal: {far: "x.m.p > 1[m]"}}
      behaviours: {go: {functions: [{y.m.f: "UP(g, c) * 1[N]", c: c, g: g}], terminal: far}}
      states: {going: go, gone: go}
      initial_state: going
      transitions: [[going, terminal, always, gone], [gone, terminal, always, going]]
plant:
  model: model.xml
  bind:
    a.E.m.f: {actuators: [m], through: "own:given"}
    a.E.m.p: {joints: [j], through: "own:taken"}
  observe:
    at: {type: "real[m]", joints: [j], through: "own:seen"}
task:
  cycle: {of: a.c, from: going, to: gone}
  scene: "own:Scene"
  judge: "own:Judge"
"""
BEHIND = re.search(r"  model: model.xml\n.*?(?=task:)", CELL, re.DOTALL)
assert BEHIND is not None
PLACES = {
    "operator UP": ('"own:up"', '"{}"'),
    "operator EVIL": (
        "operators:",
        'operators:\n  EVIL: {{signature: "() -> real", python: "{}"}}',
    ),
    "type Grip": ('"own:Grip"', '"{}"'),
    "type Cloud": ('"own:Cloud"', '"{}"'),
    "type Evil": ("types:", 'types:\n  Evil: {{fields: {{g: Grip, n: int}}, python: "{}"}}'),
    "codec Cloud.encode": ('"own:packed"', '"{}"'),
    "codec Cloud.decode": ('"own:unpacked"', '"{}"'),
    "through a.E.m.f": ('"own:given"', '"{}"'),
    "through a.E.m.p": ('"own:taken"', '"{}"'),
    "through plant.at": ('"own:seen"', '"{}"'),
    "plant": (BEHIND.group(), '  python: "{}"\n'),
    "scene": ('"own:Scene"', '"{}"'),
    "judge": ('"own:Judge"', '"{}"'),
}
"""Where a specification names Python: what to replace in it, and by what."""
NAMES = [
    "typing:get_type_hints",
    "dataclasses:_create_fn",
    "enum:Enum",
    "math:sqrt",
    "collections.abc:Callable",
    "os.path:join",
    "os:system",
    "subprocess:run",
    "builtins:exec",
    "importlib:import_module",
    "pickle:loads",
    "ctypes:CDLL",
    "numpy:load",
    "specc_runtime:forms",
    "specc_runtime.builtins:moved",
    "specc_runtime.contracts:operator",
    "specc_runtime.loading:made",
    "specc.cli.main:main",
    "evil:run",
    "own:other",
    "own:decoy",
]
"""In modules of the language, of the runtime, beside the specification; the last one it names."""
ODD_SPELLINGS = [
    *("\u043ewn:up", "\uff4fwn:up", "own:\uff55p", "own:up ", " own:up", "own: up", "own:up:"),
    *("./own:up", "../own:up", "/own:up", "own/up:up", "own:up.__globals__", "own", ":up", "own:"),
    *("own;import evil:up", "own:up\\nimport evil", "own as x:up", "class:up", "1own:up"),
]
KNOWN = "  DECOY: {signature: '(x: int) -> int', python: 'own:decoy'}\n"


class Cell:
    """A specification of one's own, and what becomes of a recorded one."""

    def __init__(self, folder: Path) -> None:
        self.text = CELL.replace("agents:", f"{KNOWN}agents:", 1)
        (folder / "cell.yaml").write_text(self.text)
        (folder / "model.xml").write_text(MODEL)
        for module in ("own", "evil"):
            (folder / f"{module}.py").write_text("open('marker', 'w')\n")
        self.built = pipeline.build("cell.yaml")
        assert self.built.files, self.built.result.diagnostics

    def package(
        self, texts: Mapping[str, str], values: Mapping[str, str] | None = None
    ) -> Path | None:
        """Where the code of a recorded specification is, if it may run."""
        file = forged(Path("run.mcap"), texts, values=values)
        options = Namespace(resume=(file, 1.0), spec="cell.yaml", set={})
        return recorded_package(options, self.built, Path("scratch"))


@pytest.fixture
def cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Cell:
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    return Cell(tmp_path)


def _naming(text: str, part: str, name: str) -> str:
    """The specification with that Python in that place."""
    old, new = PLACES[part]
    if part == "type Evil":  # what is not used is no part of the system
        more = "memory: {e: {type: 'optional[Evil]', init: None}, "
        text = text.replace("memory: {", more).replace("[{y.m.f", "[{e: e, y.m.f")
    return text.replace(old, new.format(name))


@pytest.mark.parametrize("every", short([5, 1], 0))
def test_what_a_recording_names_has_to_stand_in_the_specification(
    every: int, cell: Cell, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each of these objects in each of these places, or `every` so many in turn."""
    assert all(cell.text.count(old) == 1 for old, _ in PLACES.values())
    tried = [*product(PLACES, NAMES)][::every]
    for part, name in tried:
        assert cell.package({"cell.yaml": _naming(cell.text, part, name)}) is None
        told = capsys.readouterr().err
        assert f"cannot be run: it names {name} as {part}" in told, (part, name, told)
        assert "cell.yaml does not" in told
    assert len(PLACES) * len(NAMES) > 200
    assert [{*each} for each in zip(*tried, strict=True)] == [{*PLACES}, {*NAMES}]
    assert not Path("marker").exists() and not Path("scratch").exists()


@pytest.mark.parametrize("every", short([4, 1], 0))
def test_what_is_known_is_foreign_in_every_other_role(
    every: int, cell: Cell, capsys: pytest.CaptureFixture[str]
) -> None:
    known = sorted({old.strip('"') for old, _ in PLACES.values() if old.startswith('"own:')})
    pairs = [(p, name) for p, name in product(PLACES, known) if name != PLACES[p][0].strip('"')]
    for part, name in pairs[::every]:
        assert cell.package({"cell.yaml": _naming(cell.text, part, name)}) is None
        told = capsys.readouterr().err
        is_named = f"{name} as {part}" in told or "cell.yaml" in told
        assert "cannot be run: " in told and is_named, (part, name, told)
    assert {part for part, _ in pairs[::every]} == {*PLACES}


def test_odd_spellings_are_no_names(cell: Cell, capsys: pytest.CaptureFixture[str]) -> None:
    for name in ODD_SPELLINGS:
        for part in ("operator UP", "codec Cloud.decode", "through plant.at", "judge"):
            assert cell.package({"cell.yaml": _naming(cell.text, part, name)}) is None
            told = capsys.readouterr().err
            assert "cannot be run: it has errors: `" in told, (part, name, told)


def test_the_same_python_under_another_name_or_signature_is_foreign(
    cell: Cell, capsys: pytest.CaptureFixture[str]
) -> None:
    for old, new, words in [
        ("GRIP: {sig", "GRAB: {sig", "own:grip as operator GRAB (-> Grip)"),
        ("(g: Grip, c: Cloud) -> real", "(g: Grip, c: Grip) -> real", "UP (g: Grip, c: Grip,"),
        ("(g: Grip, c: Cloud) -> real", "(h: Grip, c: Cloud) -> real", "UP (h: Grip"),
        (
            "(g: Grip, c: Cloud) -> real",
            "(g: Grip, c: Cloud) -> int",
            "UP (g: Grip, c: Cloud, -> int)",
        ),
        ("fields: {width: real}", "fields: {width: 'real[m]'}", "as type Grip (width: real[m])"),
        ("own:packed", "own:unpacked", "own:unpacked as codec Cloud.encode"),
        ('at: {type: "real[m]"', "at: {type: int", "own:seen as through plant.at (-> int)"),
        (', python: "own:Cloud"', "", "own:up as operator UP (g: Grip, c: Cloud, -> real) with an"),
    ]:
        text = cell.text.replace(old, new).replace(
            "GRIP()", "GRAB()" if "GRAB" in new else "GRIP()"
        )
        text = text.replace("UP(g, c) * 1[N]", "0[N]") if "UP" in words or "[m]" in new else text
        assert cell.package({"cell.yaml": text}) is None
        told = capsys.readouterr().err
        assert "cannot be run: it names " in told and words in told, told


def test_what_is_missing_in_a_recorded_specification_is_told(
    cell: Cell, capsys: pytest.CaptureFixture[str]
) -> None:
    """Open points, too: names that nothing declares, Python that does not know a type."""
    for old, new, words in [
        ("UP(g, c) * 1[N]", "evil", "`evil`"),
        ("UP(g, c) * 1[N]", "own.up", "`own`"),
        ("UP(g, c) * 1[N]", "eval('1')", "`eval`"),
        (', python: "own:Grip"', "", "`Grip`"),
    ]:
        assert cell.package({"cell.yaml": cell.text.replace(old, new)}) is None
        told = capsys.readouterr().err
        assert "cannot be run: it has errors: " in told and words in told, told


def test_what_names_no_other_python_is_run(cell: Cell) -> None:
    """Other titles, constants, functions and numbers; files that are not there any more."""
    other = cell.text.replace("A cell", "Another cell").replace("UP(g, c) * 1", "UP(g, c) * 2")
    assert cell.package({"cell.yaml": other}) == Path("scratch/cell")
    fewer = cell.text.replace(KNOWN, "").replace(', through: "own:seen"', "")
    assert cell.package({"cell.yaml": fewer}) is not None


def test_files_that_a_recording_brings_name_nothing_else_either(
    cell: Cell, capsys: pytest.CaptureFixture[str]
) -> None:
    operator = "operators: {EVIL: {signature: '() -> real', python: 'os:system'}}\n"
    for file, text in {
        "lib.yaml": f"specc: 1\n{operator}",
        "deep/../lib.yaml": f"specc: 1\n{operator}",
    }.items():
        used = cell.text.replace("types:", "use: [lib.yaml]\ntypes:", 1)
        assert cell.package({"cell.yaml": used, file: text}) is None
        told = capsys.readouterr().err
        assert "names os:system as operator EVIL (-> real)" in told, told


def test_files_outside_are_not_reached(
    cell: Cell, capsys: pytest.CaptureFixture[str], tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Neither by their names nor through links; `..` in names of attachments means nothing."""
    outside = tmp_path_factory.mktemp("outside") / "secret.yaml"
    outside.write_text("specc: 1\nconstants: {secret: 1}\n")
    Path("link.yaml").symlink_to(outside)
    for name in (str(outside), "/".join([".."] * 8 + ["etc", "passwd"]), "link.yaml"):
        for old, new in (
            ("types:", f"use: [{name}]\ntypes:"),
            ("types:", f"files: {{f: {name}}}\ntypes:"),
            ("model.xml", name),
        ):
            text = cell.text.replace(old, new, 1)
            assert cell.package({"cell.yaml": text, f"../{name}": "specc: 1\n"}) is None
            told = capsys.readouterr().err
            assert "cannot be run: it has errors" in told and "constants" not in told


def test_values_that_were_set_are_values(cell: Cell, capsys: pytest.CaptureFixture[str]) -> None:
    with_constant = cell.text.replace("types:", "constants: {k: 1}\ntypes:", 1)
    for value in (
        "__import__('os').system('touch marker')",
        "EVIL()",
        "(lambda: 1)()",
        "1; import os",
        '1\nimport os\nos.system("touch marker")',
        "().__class__",
        "1" * 5000,
    ):
        assert cell.package({"cell.yaml": with_constant}, {"k": value}) is None
        assert "cannot be run: it has errors" in capsys.readouterr().err
    assert not Path("marker").exists()


def test_every_key_that_takes_python_is_known() -> None:
    """A key that is added to the language, and is not looked at, is a hole."""

    def keys() -> Iterator[str]:
        for kind in vars(files).values():
            if isinstance(kind, type) and issubclass(kind, SpecModel):
                for name, hint in get_type_hints(kind, include_extras=True).items():
                    if PythonPath in (hint, *get_args(hint)):
                        yield f"{kind.__name__}.{name}"

    assert set(keys()) == {
        "BindingDef.through",
        "CodecDef.decode",
        "CodecDef.encode",
        "ObservedDef.through",
        "OperatorDef.python",
        "PlantDef.python",
        "ReadingDef.through",
        "SceneDef.scene_class",
        "TaskDef.judge",
        "TypeDef.python",
    }
    system: Any = pipeline.compile_spec("specs/irp_picking.yaml").system
    every = {each.python for each in named_code(system)}
    text = Path("specs/irp_picking.yaml").read_text()
    assert set(re.findall(r"[\w.]*specc_runtime[\w.]*:\w+", text)) <= every


TALK = """specc: 1
system: talk
agents:
  talker:
    control:
      rate: 10 Hz
      y: {hearer: {n: int}}
      memory: {m: {type: int, init: 1}}
      behaviours: {tell: {functions: [{y.hearer.n: m, m: m}], terminal: never}}
      states: {telling: tell}
      initial_state: telling
  hearer:
    control:
      rate: 10 Hz
      x: {talker: {n: {type: int, init: 0}}}
      memory: {m: {type: int, init: 0}}
      behaviours: {hear: {functions: [{m: x.talker.n + m}], terminal: never}}
      states: {hearing: hear}
      initial_state: hearing
"""
CREATE = """types: {F: {opaque: true}}
operators:
  RUN: {signature: "(n: text, a: list[text], b: list[text]) -> F", python: "dataclasses:_create_fn"}
constants:
  f: RUN("f", ["a=__import__('os').system('touch marker')"], ["pass"])
agents:"""
EVAL = """operators: {{RUN: {{signature: "(t: text) -> int", python: "{}"}}}}
constants:
  f: RUN("__import__('os').system('touch marker')")
agents:"""


def test_no_command_of_a_recording_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The whole command; the first of these once ran."""
    monkeypatch.chdir(tmp_path)
    Path("talk.yaml").write_text(TALK)
    attacks = [CREATE, *(EVAL.format(n) for n in ("builtins:eval", "os:system", "evil:run"))]
    Path("evil.py").write_text("open('marker', 'w')\n")
    monkeypatch.syspath_prepend(tmp_path)
    for attack in attacks:
        text = TALK.replace("agents:", attack, 1).replace("init: 1}", "init: f}")
        if "F:" in text:
            text = text.replace("{type: int, init: f}", "{type: F, init: f}").replace(
                "n: m, m", "n: 1, m"
            )
        file = forged(Path("run.mcap"), {"talk.yaml": text})
        assert main(["run", "talk.yaml", "--duration", "2", "--from", f"{file}@1"]) == 2
        told = capsys.readouterr().err
        assert "the recorded specification cannot be run: it names " in told
        assert not Path("marker").exists()


MAPS = (
    TALK.replace("system: talk", "system: maps")
    .replace("m: {type: int, init: 1}", "m: {type: Map, init: DRAW()}")
    .replace("n: m, m: m", "n: 1, m: MOVED(m)")
    .replace(
        "agents:",
        """types:
  Map: {opaque: true, python: "maps:Map", codec: {encode: "maps:told", decode: "maps:read"}}
operators:
  DRAW: {signature: "() -> Map", python: "maps:draw"}
  MOVED: {signature: "(m: Map) -> Map", python: "maps:moved"}
agents:""",
    )
)
OWN = """class Map: pass
def draw(): return Map()
def moved(m): return m
def told(drawn): return b"map"
def read(data):
    assert data == b"map"
    return Map()
"""
PICKLED = "Y29zCnN5c3RlbQooUyd0b3VjaCBtYXJrZXInCnRSLg=="
"""`os.system("touch marker")`, to whoever unpickles it."""


def test_values_name_no_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A snapshot has values; what they are is what the specification says."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    Path("maps.py").write_text(OWN)
    Path("maps.yaml").write_text(MAPS)
    assert main(["run", "maps.yaml", "--duration=2", "--record=a.mcap"]) == 0
    saved = last_before(Path("a.mcap"), 1.5).saved
    run = ["run", "maps.yaml", "--duration=2", "--from=b.mcap@1.5"]
    for value, code in (
        (saved["subsystems"]["talker.c"]["memory"]["m"], 0),
        ({"type": "os:system", "bytes": PICKLED}, None),
        ({"type": "maps:own", "bytes": "bWFw"}, 0),
        ({"type": "Map", "bytes": "bWFw", "python": "os:system"}, 0),
        ({"kept": 0}, None),
        ({"kept": "os:system"}, None),
        ({"py/object": "os.system", "py/reduce": ["os.system", "touch marker"]}, None),
        ({"type": "Map", "arrays": [{"dtype": "O", "shape": [1], "bytes": PICKLED}]}, None),
        ({"type": "Map", "arrays": [{"dtype": "<f8", "shape": [-1, 1 << 62], "bytes": ""}]}, None),
        ({"type": "Map", "digest": "../../own"}, None),
        ("__import__('os').system('touch marker')", None),
        ("!!python/object/apply:os.system ['touch marker']", None),
    ):
        told = json.loads(json.dumps(saved))
        told["subsystems"]["talker.c"]["memory"]["m"] = value
        forged(Path("b.mcap"), {"maps.yaml": MAPS}, snapshot=told)
        found = main(run)
        err = capsys.readouterr().err
        assert found == 0 and ("memory m is as at the beginning: " in err) == (code is None), err
    for name in ("os:system", "__class__", "going\x1b[2J", "../../x", "a" * 100_000):
        told = saved | {
            "subsystems": {"talker.c": saved["subsystems"]["talker.c"] | {"state": name}}
        }
        forged(Path("b.mcap"), {"maps.yaml": MAPS}, snapshot=told)
        assert main(run) == 2
        err = capsys.readouterr().err
        assert "talker.c was in " in err and "\x1b" not in err and len(err) < 20_000
    assert not Path("marker").exists()
