"""Ages of a run: those of the interpreter, and never greater than what `specc ages` lists."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from pathlib import Path
from random import Random

import pytest

from specc.analysis import Facts
from specc.analysis.ages import Trail
from specc.analysis.dataflow import Node
from specc.pipeline import Result
from tests.seeds import Seeds, blocks
from tests.soundness.ages import AgedInterpreter, Met
from tests.soundness.agreement import differences
from tests.soundness.interpreter import Run
from tests.soundness.law import marks_of
from tests.soundness.operators import PLAIN
from tests.soundness.running import Script, ScriptedPlant, built, compiled, executed
from tests.soundness.specifications import Tree, specification

TICKS = 60


@pytest.mark.parametrize("seeds", blocks([1], also=range(9), long=60, each=20))
def test_ages_are_those_of_the_interpreter_and_as_listed_at_most(
    seeds: Seeds, tmp_path: Path
) -> None:
    tally: Counter[str] = Counter()
    for seed in seeds:
        tree = specification(Random(f"ages {seed}"), careless=0, trusting=0, ages=True)
        ages_are_as_listed_at_most(tree, f"ages {seed}", tmp_path, tally)
        ages_are_as_listed_at_most(net(Random(seed)), f"net {seed}", tmp_path, tally)
    assert tally["compared"]
    assert tally["limited"]


def ages_are_as_listed_at_most(tree: Tree, seed: str, folder: Path, tally: Counter[str]) -> None:
    result = compiled(tree, folder)
    if not result.ok or result.system is None:
        return
    tally["accepted"] += 1
    facts: Facts = result.proofs
    listed = limits(facts)
    met = run_twice(result, seed)
    for (reader, key), age in met.items():
        node = Node(reader, *key)
        if node in listed:
            is_read = facts.ages.sources.only_on_arrival(node)
            tally["compared"] += 1
            assert (age.fresh if is_read else age.ever) <= listed[node], (seed, str(node))
    limited = compiled(with_limits(tree, listed), folder)
    assert not any(d.code == "E0410" for d in limited.diagnostics)
    if limited.ok:
        tally["limited"] += 1
        run_twice(limited, seed)


PERIODS_MS = (10, 20, 30, 40, 50)
RAW = {"joints": ["j"], "through": "tests.soundness.operators:raw"}


def net(rng: Random) -> Tree:
    """Agents that pass on what they and others measure, in loops as well, in two states each."""
    names = [f"a{i}" for i in range(rng.randrange(2, 5))]
    wires = {(a, b) for a in names for b in names if a != b and rng.randrange(100) < 55}
    agents, bind = {}, {}
    for name in names:
        sources = [a for a, b in sorted(wires) if b == name]
        measures = not sources or rng.randrange(3) > 0
        peers = [*sources, *(["k"] if measures else [])]
        control = machine(rng, peers, [b for a, b in sorted(wires) if a == name])
        agents[name] = {"control": control}
        if measures:
            receptor = machine(rng, ["R"], ["c"]) | {"uses": ["k"], "x": {"R": {"v": "int"}}}
            agents[name] |= {
                "real_receptors": {"k": {"y": {"v": "int"}}},
                "virtual_receptors": {"k": receptor},
            }
            period = int(receptor["rate"].split()[0])
            kind: Tree = rng.choice(({}, {}, {"rate": f"{2 * period} ms"}, {"sporadic": True}))
            bind[f"{name}.R.k.v"] = RAW | kind
    head = {"specc": 1.2, "system": "net", "agents": agents}
    return head | {"plant": {"model": "plant.xml", "bind": bind}}


def machine(rng: Random, peers: list[str], readers: list[str]) -> Tree:
    def sent() -> str:
        some = rng.sample(peers, rng.randrange(1, len(peers) + 1))
        return f"min({' + '.join(['1', *map(term, some)])}, 99)"

    def term(peer: str) -> str:
        read = f"x.{peer}.v"
        fresh, late = f"fresh({read})", f"not fresh({read}) or late"
        return rng.choice(
            (read, read, f"({read} if {fresh} else m)", f"(m if {late} else {read})", "both")
        )

    probe = {"aged": f"[{', '.join(f'age(x.{p}.v)' for p in peers)}]", "m": "min(m + 1, 9)"}
    functions = {"probe": probe}
    for state in ("f", "g"):
        told = [b for b in readers if state == "f" or rng.randrange(4)]
        functions[state] = {f"y.{b}.v": sent() for b in told} or {"n": "n + 1"}
    first, last = (f"x.{rng.choice(peers)}.v" for _ in "ab")
    return {
        "rate": f"{rng.choice(PERIODS_MS)} ms",
        "x": {peer: {"v": {"type": "int", "init": 0}} for peer in peers},
        **({"y": {b: {"v": "int"} for b in readers}} if readers else {}),
        "memory": {
            "m": {"type": "int", "init": 0},
            "n": {"type": "int", "init": 0},
            "aged": {"type": f"vector[{len(peers)}, s]", "init": str([0] * len(peers))},
        },
        "let": {"late": f"{first} > 2", "both": f"({last} if fresh({last}) and not late else 0)"},
        "functions": functions,
        "behaviours": {s: {"functions": ["probe", s], "terminal": "always"} for s in ("f", "g")},
        "states": {"S0": "f", "S1": "g"},
        "initial_state": "S0",
        "transitions": [["S0", "terminal", "always", "S1"], ["S1", "terminal", "always", "S0"]],
    }


def limits(facts: Facts) -> dict[Node, Fraction]:
    """The ages that `specc ages` lists."""
    oldest = {node: facts.ages.oldest(node) for node, _ in facts.received()}
    return {node: trail.age_s for node, trail in oldest.items() if isinstance(trail, Trail)}


def run_twice(result: Result, seed: str) -> dict[tuple[str, tuple[str, str]], Met]:
    """Run generated code and the interpreter, which have to agree; the ages that were met."""
    system, facts = result.system, result.proofs
    assert system is not None
    entered = {m.subsystem.qualified_name: frozenset(m.reached) for m in facts.machines}
    script = Script(system, seed, marks_of(system))
    interpreter = AgedInterpreter(system, PLAIN, script.measure, entered)
    expected = interpreter.run(TICKS)
    with built(system, result.proofs, facts.ages) as made:
        found: Run = executed(made, ScriptedPlant(script) if made.plant else None, TICKS)
    assert differences(expected, found, tolerance=1e-12) == []
    return interpreter.met


def with_limits(tree: Tree, listed: dict[Node, Fraction]) -> Tree:
    """The specification with the listed ages as limits, where an element has no interface."""
    for agent, parts in tree["agents"].items():
        every = {"c": parts["control"], **parts.get("virtual_effectors", {})}
        for name, part in (every | parts.get("virtual_receptors", {})).items():
            for peer, elements in part.get("x", {}).items():
                for element in elements if isinstance(elements, dict) else ():
                    age = listed.get(Node(f"{agent}.{name}", peer, element))
                    if age:
                        said = elements[element]
                        said = said if isinstance(said, dict) else {"type": said}
                        elements[element] = said | {"max_age": f"{float(age * 1000)} ms"}
    return tree
