"""A plant in Python behind the devices: what it gives and takes, and what is wrong with one."""

from __future__ import annotations

import json
import sys
from importlib import import_module
from pathlib import Path

import pytest
from specc_runtime.cycle import Executor
from specc_runtime.loading import load_system
from specc_runtime.main import main as runtime

from specc.cli import main

SPEC = """\
specc: 1
system: cart
agents:
  cart:
    real_effectors: {wheel: {x: {v_d: "real[m/s]"}, y: {s: "real[m]"}}}
    virtual_effectors:
      wheel:
        rate: 100 Hz
        x: {E: {s: "real[m]"}}
        y: {c: {s: "real[m]"}, E: {v_d: "real[m/s]"}}
        functions: {drive: {y.E.v_d: "0.5[m/s]", y.c.s: x.E.s}}
        behaviours: {drive: {functions: [drive], terminal: never}}
        states: {S0: drive}
        initial_state: S0
    control:
      rate: 10 Hz
      x: {wheel: {s: {type: "real[m]", init: 0}}}
      conditions: {terminal: {far: "x.wheel.s > 0.2[m]"}}
      behaviours: {wait: {terminal: far}, rest: {terminal: never}}
      states: {S0: wait, S1: rest}
      initial_state: S0
      transitions: [[S0, terminal, always, S1]]
plant:
  python: "own_cart:Cart"
  bind:
    cart.E.wheel.v_d: {}
    cart.E.wheel.s: {}
task: {cycle: {of: cart.c, from: S0, to: S1}}
"""
CART = """\
class Cart:
    def reset(self, seed):
        self.s, self.v = 0.0, 0.0

    def sample(self, name):
        assert name == "cart.E.wheel.s"
        return self.s

    def actuate(self, name, value):
        assert name == "cart.E.wheel.v_d"
        self.v = value

    def advance(self, duration_s):
        self.s += self.v * duration_s

    def close(self):
        print("closed")
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory, which Python imports from, with the cart and its specification."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    for module in ("own_cart", "cart", "cart.system"):
        monkeypatch.delitem(sys.modules, module, raising=False)
    (tmp_path / "own_cart.py").write_text(CART, encoding="utf-8")
    (tmp_path / "cart.yaml").write_text(SPEC, encoding="utf-8")
    return tmp_path


def run(*arguments: str) -> int:
    return main(["run", "cart.yaml", *arguments])


def test_a_plant_in_python_is_driven_and_sensed(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["validate", "cart.yaml"]) == 0
    assert run("--report", "run.json") == 0
    report = json.loads((folder / "run.json").read_text())
    assert report["faults"] == []
    # 0.2 m at 0.5 m/s from the second period on, seen one period of each subsystem later.
    assert report["cycles"][0]["simulated_s"] == pytest.approx(0.6, abs=0.05)
    assert capsys.readouterr().out.startswith("closed\n")


def test_a_system_built_without_a_plant_knows_its_devices_and_takes_one_later(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "cart.yaml").write_text(SPEC[: SPEC.index("plant:")], encoding="utf-8")
    assert main(["build", "cart.yaml", "--out", "."]) == 0
    assert runtime(["cart", "--duration", "1"]) == 2
    assert "no plant behind cart.E.wheel.v_d, cart.E.wheel.s" in capsys.readouterr().err
    system = load_system(folder / "cart", folder)
    plant = import_module("own_cart").Cart()
    plant.reset(0)
    executor = Executor(system, plant)
    while executor.time_s < 1.0 and executor.advance():
        pass
    executor.finish()
    assert executor.faults == []
    assert system.scheduled("cart.c").subsystem.state == "S1"
    with pytest.raises(ValueError, match=r"has no method `sample\(name\)`"):
        Executor(load_system(folder / "cart", folder), object())


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("def close", "def shut", "the plant 'own_cart:Cart' has no method `close()`"),
        (
            "def sample(self, name)",
            "def sample(self, name, time_s)",
            "has a `sample` that is called with (name), but takes (name, time_s)",
        ),
        (
            'def close(self):\n        print("closed")',
            "close = 3",
            "has a `close` that is not a method",
        ),
        ("def reset", "async def reset", "has a `reset` that is `async` or yields"),
        ('print("closed")', "yield", "has a `close` that is `async` or yields"),
        (
            "    def reset",
            "    def __init__(self, port):\n        self.port = port\n\n    def reset",
            "the plant 'own_cart:Cart' is called with (), but takes (port)",
        ),
        ("class Cart:", "class Wagon:", "cannot load the plant 'own_cart:Cart'"),
        ("class Cart:", "Cart = 3\nclass Wagon:", "cannot be called"),
    ],
)
def test_what_is_wrong_with_a_plant_is_told_before_the_run(
    old: str, new: str, words: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert CART.count(old) >= 1
    (folder / "own_cart.py").write_text(CART.replace(old, new), encoding="utf-8")
    assert run() == 2
    assert words in capsys.readouterr().err


def test_a_plant_that_cannot_be_made_is_a_fault(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    raises = "    def __init__(self):\n        raise OSError('no such port')\n\n    def reset"
    (folder / "own_cart.py").write_text(CART.replace("    def reset", raises), encoding="utf-8")
    assert run() == 1
    told = capsys.readouterr()
    assert "OSError: no such port" in told.out + told.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ("--video", "run.mp4"),
            "the plant has no method `picture(camera, width, height)`",
        ),
        (("--viewer",), "--viewer: the plant has no method `open_viewer()`"),
    ],
)
def test_a_plant_that_cannot_be_looked_at(
    arguments: tuple[str, ...], words: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*arguments) == 2
    assert words in capsys.readouterr().err


def test_a_plant_that_draws_itself_is_filmed(folder: Path) -> None:
    picture = (
        "def picture(self, camera, width, height):\n        return zeros((height, width, 3), 'u1')"
    )
    text = f"from numpy import zeros\n\n{CART}\n    {picture}\n"
    (folder / "own_cart.py").write_text(text, encoding="utf-8")
    assert run("--video", "run.mp4") == 0
    assert (folder / "run.mp4").stat().st_size > 0


def test_inherited_methods_of_the_protocol_do_nothing_and_do_not_count(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lazy = "from specc_runtime.plant import Plant\n\nclass Cart(Plant):\n    pass\n"
    (folder / "own_cart.py").write_text(lazy, encoding="utf-8")
    assert run() == 2
    said = capsys.readouterr().err
    assert all(f"`{name}" in said for name in ("reset", "sample", "actuate", "advance", "close"))


@pytest.mark.parametrize(
    ("role", "text", "words"),
    [
        ("scene", "class Thing:\n    pass", "has no method `place(plant, rng)`"),
        (
            "scene",
            "class Thing:\n    def place(self, plant): pass",
            "is called with (plant, rng), but takes (plant)",
        ),
        ("judge", "class Thing:\n    criterion = 'c'", "is called with (plant), but takes ()"),
        (
            "judge",
            "class Thing:\n    def __init__(self, plant): pass",
            "has no `criterion`; has no method `observe()`",
        ),
    ],
)
def test_what_is_wrong_with_a_scene_or_a_judge_is_told_before_the_run(
    role: str, text: str, words: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (folder / "own_cart.py").write_text(f"{CART}\n\n{text}\n", encoding="utf-8")
    task = f'task: {{{role}: "own_cart:Thing", cycle:'
    (folder / "cart.yaml").write_text(SPEC.replace("task: {cycle:", task), encoding="utf-8")
    assert run() == 2
    said = capsys.readouterr().err
    assert f"the {role} 'own_cart:Thing'" in said
    assert words in said
