"""Texts of a kilobyte that double are counted before anything is made of them, or refused.

The campaign looks at what commands take of the machine. Nothing here rests on how fast it is: the
short forms look at what was refused, and at what is open at once.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.harness.doubling import doubled
from bench.harness.lists import MAIN, MODEL, put
from bench.harness.spent import spent
from bench.harness.strangers import SECRET, STRANGERS
from specc.cli.main import main
from specc.limits import ALLOWED, one_run
from specc.model.expr import Logic, MemoryRef
from specc.model.types import Bool
from specc.proof.formula import Flag
from specc.proof.translate import Translator
from tests.seeds import SOAK, short

COSTLY = (5, 11, 48, 82)
"""Seeds of texts that took 3 to 14 CPU seconds before what is written out was weighed."""
MOST_MB = 300


@pytest.mark.parametrize("seed", short(COSTLY, 2))
def test_what_is_said_of_many_in_lets_of_lets_is_refused_at_its_place(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    files, command = doubled(seed)
    put(files, tmp_path)
    assert main([command[0], MAIN, *command[1:]]) == 1
    told = capsys.readouterr().err
    assert told.count("written out, all of this together has more than 60,000 parts") == 1
    assert f"--> {MAIN}:" in told.partition("error[E0017]")[2]


def test_conditions_are_not_translated_when_steps_are_used_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Nothing is known of them then; nobody has made their parts."""
    monkeypatch.setitem(ALLOWED, "proof", 10)
    named = tuple(MemoryRef(f"b{i}", type=Bool()) for i in range(200))
    some = Logic("or", named, type=Bool())
    with one_run():
        translator = Translator({}, {})
        assert len(translator.formula(some).parts) == 200
        asked = translator.formula(Logic("and", (some, *named[:2]), type=Bool()))
        assert asked.atom is not None and isinstance(asked.atom.variable, Flag)
    with one_run():
        monkeypatch.setitem(ALLOWED, "proof", 1_000)
        translator = Translator({}, {})
        assert len(translator.formula(Logic("and", (some, named[0]), type=Bool())).parts) == 2


@pytest.mark.parametrize("kind", STRANGERS)
def test_what_strangers_write_is_refused_with_a_reason(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    refused = 0
    for seed in range(8):
        folder = tmp_path / str(seed)
        folder.mkdir()
        for name, data in STRANGERS[kind](seed).items():
            (folder / name).write_bytes(data)
        monkeypatch.chdir(folder)
        refused += main(["validate", MAIN])
        assert "Traceback" not in (said := capsys.readouterr().err)
        assert "a fault of specc itself" not in said
    assert refused


# The campaign: `make soak OF=tests/checks/test_doubling.py`, with -s for what commands took.


def campaign(count: int, each: int) -> list[object]:
    """Blocks of seeds."""
    return [pytest.param(range(n, n + each), marks=SOAK) for n in range(0, count, each)]


def is_modest(command: list[str], folder: Path, about: str) -> None:
    """Whether a command ends as commands do, and within its memory; what it took is printed."""
    took = spent(command, folder)
    print(f"{about}: {command[0]} {took.code}, {took.cpu_s:.1f} CPU s, {took.memory_mb:.0f} MB")
    assert took.code in (0, 1, 2), took.text[-2000:]
    assert took.memory_mb < MOST_MB, about


@pytest.mark.parametrize("seeds", campaign(500, 50))
def test_texts_that_double(seeds: range, tmp_path: Path) -> None:
    for seed in seeds:
        folder = tmp_path / str(seed)
        folder.mkdir()
        files, command = doubled(seed)
        put(files, folder)
        is_modest([command[0], MAIN, *command[1:]], folder, f"text {seed}")


@pytest.mark.parametrize("seeds", campaign(100, 50))
def test_hostile_settings(seeds: range, tmp_path: Path) -> None:
    for seed in seeds:
        folder = tmp_path / str(seed)
        folder.mkdir()
        for name, data in STRANGERS["settings"](seed).items():
            (folder / name).write_bytes(data)
        is_modest(["validate", MAIN], folder, f"settings {seed}")


@pytest.mark.parametrize("seeds", campaign(60, 20))
def test_hostile_models(seeds: range, tmp_path: Path) -> None:
    """Nothing that a model names beyond its folder, or that MuJoCo does not open, is copied."""
    for seed in seeds:
        folder = tmp_path / str(seed) / "models"
        folder.mkdir(parents=True)
        for secret in (folder / "secret", folder.parent / "secret"):
            secret.write_bytes(SECRET)
        (folder / "link").symlink_to("../secret")
        for name, data in STRANGERS["model"](seed).items():
            (folder / name).write_bytes(data)
        cell = folder.parent / "cell"
        is_modest(["validate", MAIN], folder, f"model {seed}")
        took = spent(["init", str(cell), "--model", MODEL], folder)
        assert took.code in (0, 2), took.text[-2000:]
        copies = [path.read_bytes() for path in cell.rglob("*") if path.is_file()]
        assert not any(SECRET in copy for copy in copies)


def test_calls_count_what_is_written_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A large argument that stands often, and a large behaviour that many states call."""
    monkeypatch.chdir(tmp_path)
    many = {name: f"max({', '.join([name] * 2000)})" for name in "abn"}
    function = f'{{signature: "(a: int)", n: "{many["a"]}"}}'
    behaviour = f'{{signature: "(b: int)", functions: ["f({many["b"]})"], terminal: never}}'
    states = [f'S0: "go({many["n"]})"', *(f"S{i}: go({i})" for i in range(1, 40))]
    for used in (states[:1], ["S0: go(0)", *states[1:]]):
        text = (
            "specc: 1\nsystem: large\nagents:\n  a:\n    control:\n      rate: 10 Hz\n"
            "      memory: {n: {type: int, init: 0}}\n"
            f"      functions: {{f: {function}}}\n      behaviours: {{go: {behaviour}}}\n"
            f"      states: {{{', '.join(used)}}}\n      initial_state: S0\n"
        )
        (tmp_path / MAIN).write_text(text, encoding="utf-8")
        assert main(["validate", MAIN]) == 1
        told = capsys.readouterr().err
        assert told.count("written out, all of this together has more than 60,000 parts") == 1
