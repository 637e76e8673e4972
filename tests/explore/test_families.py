"""Symmetry changes no finding: families of copies, and of agents that are nearly copies."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from specc.pipeline import Result, compile_spec
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.composition import Composition
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph
from specc.tools.explore.symmetry import Symmetry
from tests.explore.families import family
from tests.seeds import blocks
from tests.soundness.running import compiled

CASES = Path(__file__).parent / "symmetry"
COPY = re.compile(r"\b(w|low|high)(_\d)?\b")
BUDGET = 60_000
Found = set[tuple[object, ...]]


def found(result: Result) -> Found | None:
    """The findings and verdicts, whichever copy they are about; None at the bound.

    A finding is what it is about, how sure it is and when. Of equally easy traces to it, as to a
    value that two states of the reader miss, any one is shown: its states are not compared. Nor is
    advice on a value (W1008) that a copy is said to lose (W1005): one trace shows one copy.
    """
    assert result.system is not None, result.diagnostics
    explored = explore(result.proofs, BUDGET)
    counted = all(each.counts_time or not each.is_timed for each in explored.slices)
    if explored.is_incomplete or (explored.findings and not counted):
        return None
    about: Found = set()
    for each in explored.findings:
        verdict = each.is_confirmed, each.trace.is_decided, each.trace.time_s
        about.add((COPY.sub("copy", repr(each.identity)), *verdict))
    errors = {message for message, *_ in about}
    about = {each for each in about if _error_of_advice(str(each[0])) not in errors}
    for name, axiom, verdict in explored.assumptions:
        about.add((COPY.sub("copy", name), axiom.that, verdict))
    return about


def _error_of_advice(about: str) -> str:
    """What W1005 is about where it is said of the same input as this W1008; "" of all others."""
    return about.replace("W1008", "W1005")[:-1] + ", None)" if "W1008" in about else ""


def differences(result: Result, backwards: Result, patch: pytest.MonkeyPatch) -> list[Found] | None:
    """Findings that depend on symmetry, or on the order of the agents; None at the bound."""
    with patch.context() as without:
        without.setattr(Symmetry, "copies", lambda _: [])
        expected = found(result)
    others = [found(result), found(backwards)]
    if expected is None or None in others:
        return None
    return [each ^ expected for each in others if each is not None and each != expected]


@pytest.mark.parametrize(
    "seeds",
    blocks(
        range(3),
        also=[*range(3, 12), 230991069, 138870755, 67373121, 11158625, 71275884],
        long=8,
        each=8,
    ),
)
def test_families_have_the_same_findings_without_symmetry_and_in_another_order(
    seeds: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compared = 0
    for seed in seeds:
        one, other = (compiled(family(seed, backwards=b), tmp_path) for b in (False, True))
        assert one.ok, [d for d in one.diagnostics if d.severity == "error"]
        different = differences(one, other, monkeypatch)
        assert not different
        compared += different is not None
    assert seeds.are_fresh or compared > len(seeds) / 2


@pytest.mark.parametrize("seeds", blocks([4], also=[*range(4), *range(5, 40)], long=8, each=8))
def test_families_with_modes_have_the_same_findings_without_symmetry(
    seeds: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compared = 0
    for seed in seeds:
        trees = (family(seed, backwards=b, with_modes=True) for b in (False, True))
        one, other = (compiled(tree, tmp_path) for tree in trees)
        if one.ok:
            different = differences(one, other, monkeypatch)
            assert not different
            compared += different is not None
    assert seeds.are_fresh or compared > len(seeds) / 2


@pytest.mark.long
def test_families_have_copies_and_others(tmp_path: Path) -> None:
    """With all agents copies, with one that is none, with findings of several kinds."""
    sizes, codes = set[tuple[int, int]](), set[str]()
    for seed in range(24):
        result = compiled(family(seed), tmp_path)
        abstraction = Abstraction(result.proofs)
        names = max(abstraction.slices(), key=len)
        agents = len({name.split(".")[0] for name in abstraction.machines} - {"hub"})
        copies = Symmetry(names, abstraction).copies()
        sizes |= {(agents, len(each.machines)) for each in copies} or {(agents, 1)}
        codes |= set(re.findall(r"W\d{4}", repr(found(result) or ())))
    assert {(2, 1), (2, 2), (3, 2), (3, 3)} <= sizes
    assert {"W1001", "W1005", "W1006"} <= codes


@pytest.mark.parametrize("case", sorted(CASES.glob("*.yaml")), ids=lambda case: case.stem)
def test_agents_that_measure_differently_are_no_copies(
    case: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = compile_spec(str(case))
    assert differences(result, result, monkeypatch) == []


def test_steps_read_nothing_but_the_cone(tmp_path: Path) -> None:
    """Machines with equal cones take equal steps, since a walker steps without its subsystem."""
    for seed in range(4):
        result = compiled(family(seed), tmp_path)
        abstraction = Abstraction(result.proofs)
        names = max(abstraction.slices(), key=len)
        expected = Graph(Composition(names, abstraction), BUDGET)
        composition = Composition(names, abstraction)
        for walker in composition.walkers:
            walker.subsystem = None  # type: ignore[assignment]  # a step that reads it fails
        graph = Graph(composition, BUDGET)
        assert graph.configurations == expected.configurations
        assert graph.edges == expected.edges
