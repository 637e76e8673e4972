"""What makes a graph large is named, and may be forgotten."""

import json
from collections import Counter
from pathlib import Path
from random import Random

import pytest

from specc.cli import main
from specc.pipeline import compile_spec
from specc.tools.explore.abstraction import Abstraction
from specc.tools.explore.blame import size_factors
from specc.tools.explore.composition import Composition
from specc.tools.explore.explorer import explore
from specc.tools.explore.graph import Graph, watcher
from tests.explore.against_enumeration import disagreements
from tests.explore.simulation import made_graphs
from tests.explore.small_systems import small_system
from tests.explore.test_enumeration import BUDGETS, left
from tests.seeds import Seeds, blocks
from tests.soundness.running import compiled

RETRIES = Path(__file__).parent / "bounded/retries.yaml"
COUNTERS = """\
specc: 1.2
system: demo
plant: {python: "world:World", bind: {a.R.d.m: {}}}
require: [{name: below, that: always(a.c.many < 13), because: twelve are there}]
agents:
  a:
    real_receptors: {d: {y: {m: real}}}
    virtual_receptors: {d: {rate: 10 Hz, through: identity}}
    control:
      rate: 10 Hz
      x: {d: {m: {type: real, init: 0}}}
      memory: {many: {type: int, init: 0}, few: {type: int, init: 0}}
      conditions:
        initial: {odd: few == 1 and many == 3}
        terminal: {high: x.d.m > 1, low: x.d.m < 0}
      behaviours:
        up: {functions: [{many: many + 1 if many < 12 else 0}], terminal: high}
        down: {functions: [{few: few + 1 if few < 3 else 0}], terminal: low}
        stop: {terminal: never}
      states: {rising: up, falling: down, stopped: stop}
      initial_state: rising
      transitions:
        - [rising, terminal, always, falling]
        - [falling, terminal, odd, stopped]
        - [falling, terminal, otherwise, rising]
"""


@pytest.fixture
def counters(tmp_path: Path) -> str:
    spec = tmp_path / "counters.yaml"
    spec.write_text(COUNTERS, encoding="utf-8")
    return str(spec)


def graph_of(spec: str, budget: int) -> Graph:
    result = compile_spec(spec)
    assert result.ok
    abstraction = Abstraction(result.proofs)
    return Graph(Composition(("a.c",), abstraction), budget)


def test_the_factors_are_those_of_the_configurations_without_a_value(counters: str) -> None:
    many, few = size_factors(graph_of(counters, 100_000))
    assert [many.name, few.name] == ["a.c.many", "a.c.few"]
    assert many.kind == few.kind == "memory"
    assert 8 < many.factor <= 13
    assert 3 < few.factor <= 4


def test_nothing_is_named_where_every_value_matters_little(counters: str) -> None:
    assert size_factors(graph_of(counters, 1)) == ()


def test_the_bound_says_what_makes_the_graph_large(
    counters: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explore", counters, "--budget", "120"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("a.c: ended at the bound after ")
    assert lines[1].startswith("  large because of `a.c.")
    assert lines[1].endswith(" times as many states)")
    assert any(line.startswith("  --forget a.c.") for line in lines)
    assert "not looked at: `below`; findings above hold" in lines
    assert main(["explore", counters, "--budget", "120", "--format", "json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["slices"]
    named = {each["name"]: each for each in found["large_because_of"]}
    assert named.keys() <= {"a.c.many", "a.c.few"}
    assert all(each["kind"] == "memory" and each["factor"] >= 1.5 for each in named.values())
    assert named
    assert main(["explore", counters]) == 0
    assert "large because of" not in capsys.readouterr().out


def test_forgetting_makes_the_graph_smaller_and_is_said(
    counters: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explore", counters, "--format", "json"]) == 0
    before = json.loads(capsys.readouterr().out)
    command = ["explore", counters, "--forget", "a.c.many", "--forget", "a.c.few"]
    assert main([*command, "--format", "json"]) == 0
    after = json.loads(capsys.readouterr().out)
    assert before["forgotten"] == []
    assert after["forgotten"] == ["a.c.many", "a.c.few"]
    assert 5 * after["slices"][0]["states"] < before["slices"][0]["states"]
    assert main(command) == 0
    words = "; nothing was known of `a.c.many` and `a.c.few`, so warnings may be false\n"
    assert capsys.readouterr().out.endswith(words)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("a.c.mani", "did you mean a.c.many"),
        ("few", "did you mean a.c.few"),
        ("zzzzzz.q", "there is a.c.many, a.c.few"),
    ],
)
def test_an_unknown_name_is_refused(
    name: str, hint: str, counters: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["explore", counters, "--forget", name]) == 2
    assert f"--forget {name}: no memory is called so; {hint}" in capsys.readouterr().err


def test_what_rests_on_forgotten_memory_is_not_proved_any_more() -> None:
    result = compile_spec(str(RETRIES))
    (before,) = explore(result.proofs, 100_000).requirements
    (after,) = explore(result.proofs, 100_000, ["plug.c.attempts"]).requirements
    assert before.verdict == "proved"
    assert after.verdict not in {"proved", "violated"}


@pytest.mark.parametrize("seeds", blocks(range(1), also=range(1, 3), long=4, each=1))
def test_what_is_said_without_a_memory_is_what_small_systems_do(
    seeds: Seeds, tmp_path: Path
) -> None:
    for seed in seeds:
        system = small_system(Random(seed))
        result = compiled(system.tree, tmp_path)
        assert result.system is not None
        there = system.enumerated(result)
        names = [f"{s.qualified_name}.{x.name}" for s in result.system.subsystems for x in s.memory]
        for name in names:
            with made_graphs() as graphs:
                said = explore(result.proofs, BUDGETS[seed % len(BUDGETS)], [name])
            assert not [*disagreements(said, there, system.formulas, Counter())], (seed, name)
            assert not left(there, graphs, Counter()), (seed, name)


def test_the_search_can_be_watched(counters: str) -> None:
    seen: list[tuple[int, int]] = []
    token = watcher.set(lambda g: seen.append((len(g.edges), len(g.configurations))))
    graph_of(counters, 100_000)
    watcher.reset(token)
    assert seen[0] == (0, 1)
    assert seen == sorted(seen)
