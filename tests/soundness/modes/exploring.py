"""What exploring says of machines with modes, held against runs of their interpreter."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from fractions import Fraction
from math import floor
from random import Random

from specc.pipeline import Result
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition, Precision
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from tests.soundness.modes.hierarchical import Step, Tree, Written
from tests.soundness.modes.scripted import NAME, control_of, interpreted, script
from tests.soundness.modes.text_values import Now, parsed, worth

BUDGET = 6_000


def runs_of(tree: Tree, seed: str, count: int, periods: int) -> list[list[Step]]:
    """Runs of the interpreter until something fails."""
    scripts = (script(Random(f"{seed} {run}"), periods) for run in range(count))
    return [[s for s in interpreted(tree, each) if isinstance(s, Step)] for each in scripts]


def beyond(result: Result, runs: Sequence[Sequence[Step]]) -> tuple[list[str], int]:
    """States that runs come to and exploring does not, and how often it was complete."""
    seen = {step.state for run in runs for step in run}
    abstraction, complete, found = Abstraction(result.proofs), 0, []
    for names in abstraction.slices():
        if NAME not in names:
            continue
        place = list(names).index(NAME)
        for exact in (False, True):
            composition = Composition(names, abstraction, Precision(exact))
            graph = Graph(composition, BUDGET)
            there = {composition.state_names(c)[place] for c in graph.configurations}
            complete += graph.is_complete
            if graph.is_complete and (missed := seen - there):
                found.append(f"exact {exact}: {sorted(missed)} are never reached, it is said")
    return found, complete


def misjudged(result: Result, tree: Tree, runs: Sequence[Sequence[Step]]) -> tuple[list[str], int]:
    """Requirements that are proved and violated in a run, and how many are proved."""
    found = explore(result.proofs, BUDGET)
    wrong, proved, rate_hz = [], 0, Written(control_of(tree)).rate_hz
    for judged, written in zip(found.requirements, tree.get("require", ()), strict=True):
        if judged.verdict == "proved":
            proved += 1
            wrong += [
                f"proved {written['that']}, but {told}"
                for run in runs
                for told in violations(written["that"], run, rate_hz)
            ][:1]
    return wrong, proved


def violations(that: str, run: Sequence[Step], rate_hz: Fraction) -> Iterator[str]:
    """The ticks at which `always(p)` or `always(p implies q)` fails, whatever comes later."""
    body = that.removeprefix("always(")[:-1]
    before, _, then = body.rpartition(" implies ")
    for tick, step in enumerate(run):
        asked = not before or _holds(before, step)
        if asked and not _may_hold(then, run, tick, rate_hz):
            yield f"in {step.state} at tick {tick}"


def _may_hold(formula: str, run: Sequence[Step], tick: int, rate_hz: Fraction) -> bool:
    """Whether a formula holds at a tick, or may after the end of the run."""
    match = re.fullmatch(r"(within|once)\(([\d.]+)\[s\], (.*)\)", formula)
    if not match:
        return _holds(formula, run[tick])
    ticks = floor(Fraction(match[2]) * rate_hz)
    if match[1] == "once":
        return any(_holds(match[3], step) for step in run[max(0, tick - ticks) : tick + 1])
    window = run[tick : tick + ticks + 1]
    return len(window) <= ticks or any(_holds(match[3], step) for step in window)


def _holds(condition: str, step: Step) -> bool:
    text = condition.replace(f"state({NAME})", "state_").replace(f"{NAME}.", "")
    memory = {**dict(step.memory), "state_": step.state}
    return bool(worth(parsed(text), Now({}, (), memory, {}, 0.0, False, {}, (), 0.1)))


def with_goals(tree: Tree) -> Tree:
    """The specification with a requirement for each state, that it is never entered."""
    states = tree["agents"]["a"]["control"]["states"]
    goals = [
        {"name": f"never_{s}", "that": f"always(state({NAME}) != {s})", "because": "it is asked"}
        for s in states
    ]
    return {**tree, "require": [*goals, *tree.get("require", ())]}
