"""Copies of an agent in one order: fewer configurations, and the same is found of them."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from specc.pipeline import Result, compile_spec
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.bottom_components import terminal_components
from specc.tools.explore.composition import Composition
from specc.tools.explore.explorer import explore
from specc.tools.explore.findings import findings
from specc.tools.explore.graph import Graph
from specc.tools.explore.trace import easiest_trace

ROOT = Path(__file__).parents[2]
CASES = Path(__file__).parent / "cases"
ROVERS = (ROOT / "specs/rovers.yaml").read_text(encoding="utf-8")
COPY = re.compile(r"(rovers|workers)_\d")
ONE_AT_A_TIME = """
specc: 1.1
system: demo
plant: {python: "world:World", bind: {"workers_{i}.R.eye.d": {for: {i: 1..3}}}}
agents:
  workers:
    for: {i: 1..3}
    control:
      rate: 10 Hz
      x:
        boss: {free: {type: bool, init: False}, crowded: {type: bool, init: False}}
        eye: {near_by: {type: bool, init: False}}
      y: {boss: {busy: bool}}
      conditions:
        initial: {crowded: x.boss.crowded}
        terminal: {called: x.eye.near_by and x.boss.free, told: "elapsed >= 0.5[s]"}
      behaviours:
        rest: {functions: [{y.boss.busy: False}], terminal: called}
        ask: {functions: [{y.boss.busy: True}], terminal: told}
        enter: {functions: [{y.boss.busy: True}], terminal: always}
      states: {resting: rest, asking: ask, inside: enter}
      initial_state: resting
      transitions:
        - [resting, terminal, always, asking]
        - [asking, terminal, crowded, resting]
        - [asking, terminal, otherwise, inside]
        - [inside, terminal, always, resting]
    real_receptors: {eye: {y: {d: "real[m]"}}}
    virtual_receptors:
      eye:
        rate: 10 Hz
        x: {R: {d: "real[m]"}}
        y: {c: {near_by: bool}}
        behaviours: {look: {functions: [{y.c.near_by: "x.R.d < 1[m]"}], terminal: never}}
        states: {S0: look}
        initial_state: S0
  boss:
    control:
      rate: 10 Hz
      x: {workers: {busy: {type: bool, init: True}}}
      y: {workers: {free: bool, crowded: bool}}
      let:
        free: all(not w.busy for w in x.workers)
        crowded: >-
          (x.workers_1.busy and x.workers_2.busy) or (x.workers_1.busy and x.workers_3.busy)
          or (x.workers_2.busy and x.workers_3.busy)
      behaviours:
        watch:
          functions:
            - {"y.workers_{i}.free": {for: {i: 1..3}, is: free}}
            - {"y.workers_{i}.crowded": {for: {i: 1..3}, is: crowded}}
          terminal: never
      states: {S0: watch}
      initial_state: S0
"""
Reached = set[tuple[int, tuple[str, ...]]]


def composed(result: Result, *, symmetric: bool) -> tuple[Graph, Abstraction]:
    """The largest slice."""
    abstraction = Abstraction(result.proofs)
    names = max(abstraction.slices(), key=len)
    composition = Composition(names, abstraction, symmetric=symmetric)
    return Graph(composition, 300_000), abstraction


def reached(graph: Graph) -> Reached:
    """States whatever copy is in which."""
    composition = graph.composition
    places = [COPY.sub("copy", name) for name in composition.names]
    return {
        (c.phase, tuple(sorted(map("{} {}".format, places, composition.state_names(c)))))
        for c in graph.configurations
    }


def found(graph: Graph, abstraction: Abstraction, result: Result) -> set[str]:
    assert result.system is not None
    told = findings(graph, abstraction, result.system).values()
    return {COPY.sub("copy", f"{f.code} {f.message} {f.trace.time_s}") for f in told}


def compiled(text: str, folder: Path) -> Result:
    folder.mkdir(exist_ok=True)
    for used in ("parts", "plants"):
        shutil.copytree(ROOT / "specs" / used, folder / used)
    (folder / "spec.yaml").write_text(text, encoding="utf-8")
    return compile_spec(str(folder / "spec.yaml"))


@pytest.mark.parametrize("faulty", [pytest.param(False, marks=pytest.mark.long), True])
def test_rovers(faulty: bool, tmp_path: Path) -> None:
    """With the same result; the faulty dispatcher waits for a number that never comes."""
    text = ROVERS.replace("1..4", "1..3")
    if faulty:
        text = text.replace("r.done == stage for r", "r.done == stage + 1 for r")
        assert "stage + 1 for r" in text
    result = compiled(text, tmp_path)
    one, abstraction = composed(result, symmetric=True)
    all_, _ = composed(result, symmetric=False)
    assert one.is_complete
    assert all_.is_complete
    assert 2 * len(one.configurations) < len(all_.configurations)
    assert reached(one) == reached(all_)
    assert found(one, abstraction, result) == found(all_, abstraction, result)
    assert bool(found(one, abstraction, result)) == faulty
    if not faulty:  # all stay in one set, in which each does what the others do
        ((mine,), (full,)) = (
            terminal_components(one, abstraction),
            terminal_components(all_, abstraction),
        )
        assert (mine.states, mine.rows, mine.sent) == (full.states, full.rows, full.sent)


def test_copies_that_take_turns(tmp_path: Path) -> None:
    """Of each order one way is known, on which one of them enters; so does any other."""
    result = compiled(ONE_AT_A_TIME, tmp_path)
    (one, abstraction), (all_, _) = (composed(result, symmetric=s) for s in (True, False))
    assert len(one.configurations) < len(all_.configurations)
    assert reached(one) == reached(all_)
    ((mine,), (full,)) = (
        terminal_components(one, abstraction),
        terminal_components(all_, abstraction),
    )
    assert (mine.states, mine.rows, mine.sent) == (full.states, full.rows, full.sent)
    (copies,) = one.composition.copies
    machines = {copy[0] for copy in copies.machines}
    became = {frame[min(machines)] for frame in mine._exchanges(mine._frames())}
    assert became == machines


def test_a_trace_over_further_edges_follows_copies_that_change_places(tmp_path: Path) -> None:
    """It is the same wherever its easiest path is cut in two."""
    graph, _ = composed(compiled(ONE_AT_A_TIME, tmp_path), symmetric=True)
    exchanging = 0
    for number in range(0, len(graph.configurations), 7):
        path, whole = graph.easiest_path(number), easiest_trace(graph, number).steps
        for cut, (here, _) in enumerate(path):
            rest = [edge for _, edge in path[cut:]]
            assert easiest_trace(graph, here, *rest).steps == whole
            exchanging += any(edge.permutation for edge in rest[:-1])
    assert exchanging


def test_slices_of_copies_are_explored_once(tmp_path: Path) -> None:
    text = (CASES / "wait-copies.yaml").read_text(encoding="utf-8")
    text = text.replace("rest: {terminal: known}", "rest: {terminal: always}")
    found = explore(compiled(text, tmp_path).proofs, 10_000)
    (explored,) = found.slices
    assert explored.names == ("boss.c", "workers_1.c")
    assert explored.equal_machines == ("workers_2.c", "workers_3.c")
    assert found.without_decisions == ("workers_1.eye", "workers_2.eye", "workers_3.eye")
    assert [finding.code for finding in found.findings] == ["W1003"]


def test_one_of_several_copies_waits(tmp_path: Path) -> None:
    """Also where the others go on and are exchanged meanwhile."""
    text = (CASES / "wait-copies.yaml").read_text(encoding="utf-8")
    result = compiled(text, tmp_path)
    one, abstraction = composed(result, symmetric=True)
    all_, _ = composed(result, symmetric=False)
    assert len(one.configurations) < len(all_.configurations)
    assert reached(one) == reached(all_)
    told = found(one, abstraction, result)
    assert told == found(all_, abstraction, result)
    assert any("W1003" in each for each in told)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("known: all(present(w.state) for w in x.workers)", "known: present(x.workers_1.state)"),
        ('is: "True"', 'is: "i == 2"'),
    ],
)
def test_agents_that_are_not_treated_alike_are_no_copies(
    old: str, new: str, tmp_path: Path
) -> None:
    text = (CASES / "wait-copies.yaml").read_text(encoding="utf-8")
    assert old in text
    same, _ = composed(compiled(text, tmp_path / "same"), symmetric=True)
    assert [len(copies.machines) for copies in same.composition.copies] == [3]
    text = text.replace("{ordered: fresh(x.boss.order)", "{ordered: x.boss.order").replace(
        "order: bool", "order: {type: bool, init: False}"
    )
    other, _ = composed(compiled(text.replace(old, new, 1), tmp_path / "other"), symmetric=True)
    assert [len(copies.machines) for copies in other.composition.copies] in ([], [2])
