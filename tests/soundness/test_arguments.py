"""A specification with arguments does what the one does in which they are written out by hand."""

from __future__ import annotations

import copy
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from random import Random

import pytest

from tests.seeds import Seeds, blocks
from tests.soundness.agreement import differences
from tests.soundness.interpreter import Interpreter
from tests.soundness.law import marks_of
from tests.soundness.operators import PLAIN
from tests.soundness.running import (
    Script,
    ScriptedPlant,
    built,
    compiled,
    executed,
    only_about_machines,
)
from tests.soundness.specifications import Tree, specification, text_of
from tests.soundness.values import NASTY

TICKS = 40
RUNS_AT_LEAST = 2


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("arguments")


def two_of(tree: Tree, rng: Random) -> tuple[Tree, Tree]:
    """The specification, and with parameters in place of what functions and conditions say.

    In both, some values stand behind a guard as well.
    """
    for part in _subsystems(tree):
        for name, targets in part["functions"].items():
            for key in targets if name != "probe" else ():
                # `kept` is a list that has items.
                if rng.randrange(3) == 0 and key in part["memory"] and key != "kept":
                    targets[key] = f"({targets[key]}) if entered else {key}"
    found = copy.deepcopy(tree)
    for part in _subsystems(found):
        _Lifting(part, found.get("interfaces", {}), rng).lift()
    return tree, found


def _subsystems(tree: Tree) -> Iterator[Tree]:
    for agent in tree["agents"].values():
        yield agent["control"]
        for kind in ("effector", "receptor"):
            yield from agent.get(f"virtual_{kind}s", {}).values()


class _Lifting:
    """Gives the behaviours and functions of one subsystem parameters."""

    def __init__(self, part: Tree, interfaces: Tree, rng: Random) -> None:
        self.part, self.rng = part, rng
        self.types = {name: item["type"] for name, item in part.get("memory", {}).items()}
        for peer, elements in part.get("y", {}).items():
            named = interfaces[elements] if isinstance(elements, str) else elements
            for name, item in named.items():
                type_ = item["type"] if isinstance(item, dict) else item
                self.types[f"y.{peer}.{name}"] = type_

    def lift(self) -> None:
        states = self.part["states"]
        used = {name: self.part["behaviours"][name] for name in states.values()}
        calls = {name: self._behaviour(behaviour) for name, behaviour in used.items()}
        for state, name in states.items():
            if calls[name]:
                shuffled = self.rng.sample(calls[name], len(calls[name]))
                by_name = ", ".join(f"{p}: {text}" for p, text in shuffled)
                by_place = ", ".join(text for _, text in calls[name])
                states[state] = f"{name}({self.rng.choice((by_name, by_place))})"

    def _behaviour(self, behaviour: Tree) -> list[tuple[str, str]]:
        """Lift what a behaviour computes; returns its parameters and their arguments."""
        given: list[tuple[str, str]] = []
        signature: list[str] = []

        def passed(type_: str, text: str) -> str:
            """The text, or a parameter of the behaviour that stands for it."""
            if self.rng.randrange(3) == 0:
                return text
            name = f"p{len(given)}"
            given.append((name, text))
            signature.append(f"{name}: {type_}")
            return name

        behaviour["functions"] = [self._function(name, passed) for name in behaviour["functions"]]
        for cause in ("terminal", "error"):
            if isinstance(behaviour[cause], dict):
                behaviour[cause] = {"when": passed("bool", behaviour[cause]["when"])}
        if given:
            behaviour["signature"] = f"({', '.join(signature)})"
        return given

    def _function(self, name: str, passed: Callable[[str, str], str]) -> str | Tree:
        """A call of a function with parameters, or the function in place."""
        targets = self.part["functions"][name]
        if name == "probe":
            return name
        if self.rng.randrange(2):
            return {
                key: _lifted(text, partial(passed, self.types[key]))
                for key, text in targets.items()
            }
        given: list[tuple[str, str]] = []

        def own(type_: str, text: str) -> str:
            given.append((type_, text))
            return f"q{len(given) - 1}"

        lifted = {key: _lifted(t, partial(own, self.types[key])) for key, t in targets.items()}
        parameters = ", ".join(f"q{i}: {type_}" for i, (type_, _) in enumerate(given))
        self.part["functions"][name] = {"signature": f"({parameters})", **lifted}
        return f"{name}({', '.join(passed(type_, text) for type_, text in given)})"


_GUARDED = re.compile(r"\((.*)\) if entered else (\w+)")


def _lifted(text: str, passed: Callable[[str], str]) -> str:
    """A parameter for the text, or for what stands behind its guard."""
    guarded = _GUARDED.fullmatch(text)
    return f"({passed(guarded[1])}) if entered else {guarded[2]}" if guarded else passed(text)


def unlike(tree: Tree, folder: Path, seed: int) -> Iterator[str]:
    """Where the two specifications differ: in errors, in what is proved, in runs."""
    result, other = (compiled(one, folder) for one in two_of(tree, Random(f"arguments {seed}")))
    if not only_about_machines(result):
        assert not other.ok
        return
    # A parameter may be None or empty if its type says so, whatever the argument is.
    errors = [
        sorted({d.code for d in r.diagnostics if d.code[0] == "E"} - {"E0705"})
        for r in (result, other)
    ]
    if errors[0] != errors[1]:
        yield f"errors {errors}: {[str(d) for d in other.diagnostics][:3]}"
    if not other.ok or result.system is None or other.system is None:
        return
    for owner in other.system.subsystems:
        for state in owner.states:
            for cause in ("terminal", "error"):
                asked = owner.qualified_name, state.name, cause
                if result.proofs.is_proved(*asked) != other.proofs.is_proved(*asked):
                    yield f"only one of the two is proved: {asked}"
    yield "run"
    script = Script(result.system, str(seed), marks_of(result.system), NASTY)
    expected = Interpreter(result.system, PLAIN, script.measure).run(TICKS)
    for proofs in (None, other.proofs):
        with built(other.system, proofs) as made:
            found = executed(made, ScriptedPlant(script) if made.plant else None, TICKS)
        yield from differences(expected, found, tolerance=1e-12)


@pytest.mark.parametrize("seeds", blocks(range(200, 206), also=range(206, 220), long=8, each=15))
def test_arguments_are_what_is_written_out(seeds: Seeds, folder: Path) -> None:
    ran = 0
    for seed in seeds:
        tree = specification(Random(seed))
        found = list(unlike(tree, folder, seed))
        ran += "run" in found
        wrong = [one for one in found if one != "run"]
        assert not wrong, text_of(tree)
    assert ran >= RUNS_AT_LEAST or seeds.are_fresh
