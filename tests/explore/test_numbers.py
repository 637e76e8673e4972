"""No number and no state that a run has is excluded: what exploring proves leaves room for it.

The systems compute with all functions of numbers, on measurements, memory and what others send:
integers beyond floats beside reals, signed zeros, vectors of both, angles, and time in states.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from importlib import import_module
from pathlib import Path
from random import Random
from typing import Any

import pytest

from specc.model.system import System
from specc.model.types import Bool, Int
from specc.tools.explore.explorer import explore
from tests.seeds import Seeds, blocks
from tests.soundness.interpreter import Run
from tests.soundness.law import marks_of
from tests.soundness.running import Script, ScriptedPlant, built, compiled, executed
from tests.soundness.values import NASTY

Tree = dict[str, Any]
TYPES = {
    "int": "int", "real": "real", "angle": "real[rad]", "pair": "vector[2]",
    "wholes": "vector[2, int]",
}  # fmt: skip
LITERALS = {
    "int": ("0", "1", "3", "-2", "9007199254740993"),
    "real": ("0.0", "-0.0", "0.1", "0.5", "-1.0", "2.5", "1e16"),
    "angle": ("pi", "-pi", "0.1[rad]", "7[rad]"),
    "pair": ("[0, 0]", "[0.1, -3]"),
    "wholes": ("[0, 1]", "[9007199254740993, -2]"),
    "time": ("0.3[s]", "0.1[s] + 0.2[s]", "2 * period"),
}
BOUNDED = (
    "clamp({real}, -1, 1)", "clamp({real}, -0.1, 0.1 + 0.2)", "min(max({real}, -1), {real})",
    "sin({angle})", "cos({angle})", "{angle} / 1[rad]", "sign({real})",
)  # fmt: skip
PHRASES = {
    "int": (
        "{int} + 1", "{int} - {int}", "2 * {int}", "-{int}", "abs({int})", "floor({real})",
        "round({real})", "sign({real})", "clamp({int}, -3, {int})", "min({int}, 9)",
        "floor({int} / 3)", "{wholes}[1]", "{int} if {test} else {int}", "clamp({int} + 1, 0, 5)",
    ),
    "real": (
        *BOUNDED, *BOUNDED, "{real} + 0.1", "{real} - {real}", "0.5 * {real}", "-{real}",
        "abs({real})", "hypot({real}, {real})", "norm({pair})", "sqrt(abs({real}))", "{pair}[0]",
        "{int} / 3", "{real} / 3", "{real} if {test} else {real}", "{int} + 0.0",
        "max({real}, {int})", "clamp({real}, -1, 1) ** 3", "elapsed / period",
    ),
    "angle": (
        "wrap_angle({angle})", "wrap_angle({angle} + pi / 2)", "atan2({real}, {real})", "-{angle}",
        "clamp({real}, -4, 4) * 1[rad]", "clamp({angle}, -pi, pi)",
        "atan2({int} if {test} else {real}, -1)",
    ),
    "pair": ("[{real}, {real}]", "{pair} + [{real}, 0.1]", "0.5 * {pair}", "-{pair}"),
    "wholes": ("[{int}, {int}]", "[{int}, 3]"),
    "test": (
        "{real} < {real}", "{real} >= {real}", "{int} == {int}", "{int} > {int}",
        "{angle} < {angle}", "elapsed >= {time}", "elapsed > {time}", "entered",
        "({real} if elapsed > {time} else 0.5) > {real}", "near({real}, {real}, 0.1)",
    ),
}  # fmt: skip
"""What phrases of a sort are made of; those in braces are written out in brackets."""
TICKS, RUNS, BUDGET = 60, 2, 2_000


def phrase(rng: Random, sort: str, names: dict[str, list[str]], depth: int) -> str:
    """An expression over some names by their sort."""
    made = rng.choice((*names.get(sort, ()), *names.get(sort, ()), *LITERALS.get(sort, ("True",))))
    if sort in PHRASES and (sort == "test" or (depth > 0 and rng.randrange(4))):
        made = rng.choice(PHRASES[sort])
    return re.sub(r"{(\w+)}", lambda part: f"({phrase(rng, part[1], names, depth - 1)})", made)


def control(rng: Random, peer: str, *, sees: bool) -> Tree:
    """A machine of two states with memory, and a let, of some sorts; it sends some to its peer."""
    names: dict[str, list[str]] = {sort: [sort, f"x.{peer}.{sort}"] for sort in TYPES}
    names["real"] += ["x.eye.d", "x.eye.d"] if sees else []
    every = {sort: {"type": of, "init": rng.choice(LITERALS[sort])} for sort, of in TYPES.items()}
    let = rng.choice([*TYPES])
    lets = {"let_": {"type": TYPES[let], "is": phrase(rng, let, names, 2)}}
    names[let] += ["let_", "let_"]
    behaviours: Tree = {}
    for state in ("S0", "S1"):
        targets = [*TYPES, *(f"y.{peer}.{sort}" for sort in TYPES)]
        written = {
            target: phrase(rng, target.split(".")[-1], names, 2)
            for target in rng.sample(targets, rng.randrange(3, 9))
        }
        behaviours[state] = {
            "functions": [written],
            "terminal": {"when": phrase(rng, "test", names, 1)},
        }
    return {
        "rate": f"{rng.choice((10, 20))} Hz",
        "x": {peer: every} | ({"eye": {"d": {"type": "real", "init": "0"}}} if sees else {}),
        "y": {peer: dict(TYPES)},
        "memory": every,
        "let": lets,
        "behaviours": behaviours,
        "states": {"S0": "S0", "S1": "S1"},
        "initial_state": "S0",
        "transitions": [["S0", "terminal", "always", "S1"], ["S1", "terminal", "always", "S0"]],
    }


def computing(rng: Random) -> Tree:
    """A system of two agents that compute, of which one sees something."""
    eye = {"rate": "10 Hz", "through": {"y.c.d": rng.choice(("x.R.d", "clamp(x.R.d, -1, 1)"))}}
    eye |= {"x": {"R": {"d": "real"}}, "y": {"c": {"d": "real"}}}
    sees = {"real_receptors": {"eye": {"y": {"d": "real"}}}, "virtual_receptors": {"eye": eye}}
    return {
        "specc": 1.2,
        "system": "computing",
        "agents": {
            "a": {"control": control(rng, "b", sees=True), **sees},
            "b": {"control": control(rng, "a", sees=False)},
        },
        "plant": {"python": "world:World", "bind": {"a.R.eye.d": {}}},
    }


def had(system: System, seed: int) -> Iterator[Run]:
    """Runs of the generated code, with unpleasant measurements."""
    for number in range(RUNS):
        script = Script(system, f"{seed}.{number}", marks_of(system), NASTY)
        with built(system, None) as made:
            yield executed(made, ScriptedPlant(script), TICKS)


def excluding(system: System, runs: Sequence[Run]) -> Iterator[str]:
    """Requirements that a run violates: each excludes a state, or the extremes of a number."""
    for subsystem in (s for s in system.subsystems if s.qualified_name.endswith(".c")):
        name = subsystem.qualified_name
        steps = [step for run in runs for step in run.steps[name][:-1]]
        yield from (f"state({name}) != {state}" for state in sorted({s.state for s in steps}))
        numbers: dict[str, list[float]] = {}
        for step in steps:
            sent = [(f"{name}.y.{text.replace('_', '.')}", value) for text, value in step.sent]
            for text, value in [*((f"{name}.{of}", v) for of, v in step.memory), *sent]:
                if isinstance(value, tuple):
                    for index, part in enumerate(value):
                        numbers.setdefault(f"{text}[{index}]", []).append(part)
                else:
                    numbers.setdefault(text, []).append(value)
        for text, values in sorted(numbers.items()):
            unit = "[rad]" if text.endswith("angle") else ""
            there = f"present({text.partition('[')[0]}) implies " if ".y." in text else ""
            yield f"{there}{text} > {min(values)!r}{unit}"
            yield f"{there}{text} < {max(values)!r}{unit}"


def denied(seeds: Sequence[int], folder: Path) -> tuple[list[str], Counter[str]]:
    """What is proved and not so; and how often each verdict was given."""
    wrong, said = list[str](), Counter[str]()
    for seed in seeds:
        tree = computing(Random(seed))
        result = compiled(tree, folder)
        if result.system is None or not result.ok:
            continue
        asked = [*excluding(result.system, [*had(result.system, seed)])]
        tree["require"] = [{"that": f"always({each})", "because": "it is not"} for each in asked]
        found = explore(compiled(tree, folder).proofs, BUDGET).requirements
        assert len(found) == len(asked)
        said.update(each.verdict for each in found)
        wrong += [f"{seed}: {each.requirement.that}" for each in found if each.verdict == "proved"]
    return wrong, said


@pytest.mark.parametrize("seeds", blocks((16,), also=(53,), long=8, each=60))
def test_what_runs_have_is_not_excluded(seeds: Seeds, tmp_path: Path) -> None:
    wrong, said = denied(seeds, tmp_path)
    assert wrong == []
    assert said["violated"] > said["not explored"] or seeds.are_fresh


@pytest.mark.long
def test_a_range_that_rounds_what_is_whole_is_noticed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    module = import_module("specc.lang.evaluate")  # whose function has its name
    monkeypatch.setattr(module, "_keeps_integers", lambda expr: isinstance(expr.type, Bool | Int))
    assert denied((16, 53), tmp_path)[0]
