"""Texts of specifications and models never steer a terminal or a runner of workflows.

Every text of a small system is made hostile in turn, and every command prints what it has to say.
"""

import copy
import json
import re
import unicodedata
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bench.harness.lists import MAIN, MODEL, Spec, small, written
from specc import pipeline
from specc.cli.main import main
from tests.house.tree import modules

HOSTILE = "\x1b[31m\r\n::error::own\n ::stop-commands::own ##[error]own\u202e\x9b\u2028\u200b"
COMMANDS = (
    *(["validate", f"--format={form}"] for form in ("text", "json", "sarif", "github", "junit")),
    ["status"],
    ["status", "--format=json"],
    ["ages"],
    ["ages", "--format=json"],
    *(["graph", f"--of={kind}", "--format=dot"] for kind in ("structure", "frames", "states")),
    ["witness", "--out=scenarios"],
    ["fmt", "--diff"],
)
EVERY = (*COMMANDS, *(["diff", f"--format={f}", "old.yaml"] for f in ("text", "markdown", "json")))
IMPORTS = {
    "chart.scxml": '<scxml initial="a"><state id="a{0}"><transition event="b{0}" cond="c{0}" '
    'target="a{0}"/></state><parallel id="p{0}"/><state id="p{0}"/><{1}/></scxml>',
    "agent.xml": '<subsystem_definition><buffers_in><buffer alias="{0}" type="{0}"/></buffers_in>'
    '<{1}/><predicates><predicate name="{0}"/></predicates></subsystem_definition>',
}


def spec() -> Spec:
    """A small system with a part of every kind."""
    system = small()
    agent = system["agents"]["a"]
    effector = agent["virtual_effectors"]["m"]
    system["title"] = "a system"
    system["frames"] = {"F": "a frame"}
    system["types"] = {"Mode": "enum[u, v]", "R": {"fields": {"a": "int"}}}
    system["constants"] = {"gain": {"is": "1", "title": "a constant"}}
    system["operators"] = {"OP": {"signature": "(a: int) -> int", "python": "p:op"}}
    effector["title"] = "an effector"
    effector["let"]["l"] = "gain + x.c.go"
    effector["conditions"]["initial"] = {"up": "x.c.go > 1", "down": "x.c.go < 1"}
    effector["behaviours"]["pass"]["terminal"] = "always"
    effector["transitions"] = [["S0", "terminal", "up", "S0"], ["S0", "terminal", "down", "S0"]]
    effector["assume"] = [{"that": "x.E.s > 0", "because": "so it is"}]
    bind = {"a.E.m.u": {"actuators": ["m"]}, "a.E.m.s": {"sensors": ["s"], "noise": "1"}}
    system["plant"] = {"model": MODEL, "bind": bind}
    return system


def hostile(part: Any) -> Iterator[Any]:
    """The part with each of its keys and texts made hostile in turn."""
    if isinstance(part, str):
        yield part + HOSTILE
    elif isinstance(part, list):
        for index, item in enumerate(part):
            for changed in hostile(item):
                yield [*part[:index], changed, *part[index + 1 :]]
    elif isinstance(part, dict):
        for key, value in part.items():
            yield {(k + HOSTILE if k == key else k): v for k, v in part.items()}
            for changed in hostile(value):
                yield part | {key: changed}


SPECS = [*hostile(spec())]
FEW, SOME = 24, 3


def assert_harmless(text: str, form: str = "") -> None:
    """No hidden character, and no command but those of the format itself."""
    hidden = [c for c in text if c != "\n" and unicodedata.category(c) in ("Cc", "Cf", "Zl", "Zp")]
    assert hidden == []
    assert "##[" not in text
    # The mark `::: ` of a second place is no command, as there is no name behind two colons.
    lines = [line for line in text.split("\n") if re.match(r"\s*::(?!: )", line)]
    own = re.compile(r"::(?:error|warning|notice) file=[^:]*::") if form == "github" else None
    assert [line for line in lines if own is None or not own.match(line)] == []


def check(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    main(arguments)
    printed = capsys.readouterr()
    form = next((a.partition("=")[2] for a in arguments if a.startswith("--format=")), "")
    assert_harmless(printed.out, form)
    assert_harmless(printed.err)
    if form in ("json", "sarif") and printed.out:
        json.loads(printed.out)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "old.yaml").write_text(written(spec()))
    (tmp_path / MODEL).write_text("<mujoco/>")
    return tmp_path


@pytest.mark.parametrize(
    ("every", "share"), [(SOME, FEW), pytest.param(1, 1, marks=pytest.mark.long)]
)
def test_commands_print_no_text_raw(
    every: int,
    share: int,
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each text is compiled once; commands, or a share of them in turn, get what came of it."""
    compiled, old = pipeline.compile_spec, pipeline.read_spec("old.yaml")
    for number, system in enumerate(SPECS[::every]):
        (folder / MAIN).write_text(written(system))
        result = compiled(MAIN)
        for name in ("check_spec", "compile_spec"):
            monkeypatch.setattr(pipeline, name, lambda _path, result=result: result)
        read = {"old.yaml": old, MAIN: result}
        monkeypatch.setattr(pipeline, "read_spec", read.__getitem__)
        for arguments in EVERY[number % share :: share]:
            check([*arguments, MAIN], capsys)


@pytest.mark.parametrize("form", ["text", "json", "github", "junit"])
def test_names_of_files_models_and_comments(
    form: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = f"{HOSTILE.replace('/', '')}.yaml"
    system = copy.deepcopy(spec())
    (folder / name).write_text("specc: 1\nwrong: 1\n")
    system["use"] = [name]
    comment = "# specc: ignore[W9\u202e] ::error::own\n::error::own: 1\n"
    (folder / MAIN).write_text(written(system) + comment)
    (folder / MODEL).write_text('<mujoco><include file="::error::\u202e"/></mujoco>')
    check(["validate", f"--format={form}", MAIN, name], capsys)
    (folder / MAIN).write_text("specc: 1\n::error::own: 1\n  ::error::own\n")
    check(["validate", f"--format={form}", MAIN], capsys)
    check(["fmt", "--diff", MAIN], capsys)


@pytest.mark.parametrize("name", IMPORTS)
def test_importers_print_no_text_raw(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kind = "scxml" if name.endswith("scxml") else "fabric"
    for text in ("&#13;&#10;::error::own ##[error]own\u202e\u200b", "\u202e\n::error::own"):
        (folder / name).write_text(IMPORTS[name].format(text, "tag\u202e"))
        check(["import", kind, name], capsys)
        (folder / name).write_text(IMPORTS[name].format(text, "tag"))
        check(["import", kind, name], capsys)


def test_commands_print_through_one_door() -> None:
    # The program of a page's server is beside the commands: it prints its address, and refusals.
    own = ("specc.cli.streams", "specc.lang.show", "specc.tools.page.live")
    around = {
        f"{module.name}: {found[0]}"
        for module in modules(".", "specc")
        if module.name not in own
        for found in re.finditer(
            r"\bprint\(|sys\.std(?:out|err)\.write", module.path.read_text(encoding="utf-8")
        )
    }
    assert around == set()
