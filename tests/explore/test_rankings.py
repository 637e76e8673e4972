"""Counters bound how long machines stay somewhere only if nothing there sets them back."""

from __future__ import annotations

from itertools import product
from math import inf
from pathlib import Path
from random import Random
from typing import Any

import pytest

from specc.pipeline import compile_spec
from specc.tools.explore.explorer import explore
from specc.tools.explore.ranking import Moves, longest_stays
from specc.tools.explore.regions import Region
from specc.tools.explore.transitions import Transition
from tests.seeds import Seeds, blocks

SYSTEM = """\
specc: 1.1
system: nested
agents:
  a:
    control:
      rate: 10 Hz
      x: {{b: {{k: {{type: int, init: 0}}}}}}
      y: {{b: {{done: bool}}}}
      memory: {{n: {{type: {type}, init: 0}}, c: {{type: int, init: 2}}}}
      conditions:
        initial: {{full: c >= 20, less: c < 20}}
        error: {{much: "n > {start} + 20 or n == {start} - 64"}}
      functions:
        again: {{n: {start}, c: c + 1}}
        reset: {{n: "n + {step}", c: {reset}}}
        count: {{n: "n + {step}"}}
        tell: {{y.b.done: True}}
      behaviours:
        again: {{functions: [again], terminal: always}}
        reset: {{functions: [reset], terminal: always}}
        count: {{functions: [count], terminal: always, error: much}}
        done: {{functions: [tell], terminal: never}}
      states: {{A: again, R: reset, C: count, D: done}}
      initial_state: A
      transitions:
        - [A, terminal, full, D]
        - [A, terminal, less, R]
        - [R, terminal, always, C]
        - [C, terminal, always, {after}]
        - [C, error, always, D]
  b:
    control:
      rate: 10 Hz
      x: {{a: {{done: bool}}}}
      y: {{a: {{k: int}}}}
      conditions: {{terminal: {{came: fresh(x.a.done)}}}}
      functions: {{f: {{y.a.k: 1}}}}
      behaviours: {{wait: {{terminal: came}}, end: {{functions: [f], terminal: never}}}}
      states: {{W: wait, E: end}}
      initial_state: W
      transitions: [[W, terminal, always, E]]
require:
  - that: always(state(a.c) == R implies within(600[s], state(a.c) == D))
    because: it counts
"""


@pytest.mark.parametrize(
    ("holds", "values"),
    [
        (True, {"reset": "c"}),  # each round of `n` counts `c`
        (False, {"reset": "1"}),  # a round of `n` sets `c` back
        (True, {"after": "R"}),
        (False, {"after": "R", "type": "real", "start": "1e17", "step": "0.5"}),  # rounds it away
    ],
)
def test_a_counter_ends_a_stay_unless_it_is_set_back(
    holds: bool, values: dict[str, str], tmp_path: Path
) -> None:
    path = tmp_path / "nested.yaml"
    path.write_text(
        SYSTEM.format(
            **{"type": "int", "start": "1", "step": "1", "reset": "1", "after": "A"} | values
        )
    )
    (judged,) = explore(compile_spec(str(path)).proofs, 20_000).requirements
    assert (judged.verdict == "proved") == holds


def test_a_counter_ends_a_stay_on_a_graph_of_its_own(tmp_path: Path) -> None:
    """The requirement reads `p`, which no condition of a machine reads."""
    eye = "real_receptors: {eye: {y: {far: bool}}}"
    virtual = "virtual_receptors: {eye: {rate: 10 Hz, through: identity}}"
    text = SYSTEM.format(type="int", start="1", step="1", reset="c", after="R")
    text = text.replace("  a:\n    control", f"  a:\n    {eye}\n    {virtual}\n    control", 1)
    text = text.replace("x: {b: {k", "x: {eye: {far: {type: bool, init: False}}, b: {k", 1)
    text = text.replace("done: True", "done: True, p: 1")  # `p` is only of the requirement
    text = text.replace("memory: {", "memory: {p: {type: int, init: 0}, ")
    asked = "always(state(a.c) == R implies within(600[s], a.c.p == 1))"
    text += f"  - that: {asked}\n    because: it counts\n"
    path = tmp_path / "driven.yaml"
    path.write_text(text)
    judged = explore(compile_spec(str(path)).proofs, 20_000).requirements
    assert [each.verdict for each in judged] == ["proved", "proved"]


N, MOST = 2, 3
"""Counters, and the greatest value of each."""
State = tuple[int, tuple[int, ...]]


def random_graph(rng: Random) -> dict[int, list[tuple[int, tuple[int | None, ...]]]]:
    """Nodes with edges to others, each with what it adds to counters; None sets to any value."""
    nodes = range(rng.randrange(2, 6))
    return {
        node: [
            (rng.choice(nodes), tuple(rng.choice((0, 0, 0, 1, 1, 2, -1, None)) for _ in range(N)))
            for _ in range(rng.randrange(3))
        ]
        for node in nodes
    }


def longest(
    graph: dict[int, list[tuple[int, tuple[int | None, ...]]]], ticks: dict[int, int], start: State
) -> float:
    """The longest run from a state, by following all of them."""
    known: dict[State, float] = {}

    def follow(state: State) -> float:
        if state not in known:
            known[state] = inf  # what leads back to it has no end
            node, values = state
            after = [
                follow((target, reached))
                for target, added in graph[node]
                for reached in product(
                    *(
                        range(MOST + 1) if add is None else [value + add]
                        for value, add in zip(values, added, strict=True)
                    )
                )
                if all(0 <= value <= MOST for value in reached)
            ]
            known[state] = ticks[node] + max(after, default=0)
        return known[state]

    return follow(start)


@pytest.mark.parametrize("seeds", blocks(range(60), long=1000, each=500))
def test_no_run_stays_longer_than_is_said(seeds: Seeds) -> None:
    bounded = 0
    for seed in seeds:
        rng = Random(seed)
        graph = random_graph(rng)
        ticks = {node: rng.randrange(1, 4) for node in graph}

        def following(node: int, graph: Any = graph) -> list[tuple[int, Moves]]:
            """A change to any value counts as 0, and one by 0 is none."""
            return [
                (target, ((0, Transition("", "", -1, (), counts=counts)),))
                for target, added in graph[node]
                for counts in [
                    tuple((f"c{i}", float(add or 0)) for i, add in enumerate(added) if add != 0)
                ]
            ]

        stays = longest_stays(graph, following, ticks.__getitem__, lambda *_: Region(0, MOST))
        bounded += len(stays)
        for node, stay in stays.items():
            values = product(range(MOST + 1), repeat=N)
            assert max(longest(graph, ticks, (node, each)) for each in values) <= stay, seed
    assert bounded > len(list(seeds))


def test_nested_loops_are_looked_at_once_each() -> None:
    """To try 60 counters in every order would take for ever; that many bound nothing."""
    loops = 60

    def following(node: int) -> list[tuple[int, Moves]]:
        counts = ((f"c{node}", 1.0),)
        again = 0, ((0, Transition("", "", -1, (), counts=counts)),)
        inner = node + 1, ((0, Transition("", "", -1, ())),)
        return [again, *([inner] if node + 1 < loops else [])]

    region = Region(0, 20)
    assert longest_stays([0], following, lambda _: 1, lambda *_: region) == {}
    loops = 5
    assert len(longest_stays([0], following, lambda _: 1, lambda *_: region)) == loops
