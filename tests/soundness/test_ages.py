"""Ages of a run: those of the interpreter, and never greater than what `specc ages` lists."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from random import Random
from typing import Any

import pytest
from specc_runtime.cycle import Executor
from specc_runtime.plant import NO_SAMPLE
from specc_runtime.records import StepRecord

from specc.analysis import Facts
from specc.analysis.dataflow import AgeChain, InputNode
from specc.pipeline import Result
from tests.runtime.driven import Driven, DrivenClock
from tests.seeds import Seeds, blocks
from tests.soundness.ages import AgedInterpreter, Element, Met, Origin
from tests.soundness.agreement import differences
from tests.soundness.evaluator import Key
from tests.soundness.interpreter import Run
from tests.soundness.law import marks_of
from tests.soundness.operators import PLAIN
from tests.soundness.running import Script, ScriptedPlant, built, compiled, executed
from tests.soundness.specifications import Tree, specification
from tests.soundness.test_real_time import Plant

TICKS = 60


@pytest.mark.parametrize("seeds", blocks([1], also=range(9), long=3, each=20))
def test_ages_are_those_of_the_interpreter_and_as_listed_at_most(
    seeds: Seeds, tmp_path: Path
) -> None:
    tally: Counter[str] = Counter()
    for seed in seeds:
        tree = specification(Random(f"ages {seed}"), careless=0, trusting=0, ages=True)
        ages_are_as_listed_at_most(tree, f"ages {seed}", tmp_path, tally)
        ages_are_as_listed_at_most(net(Random(seed)), f"net {seed}", tmp_path, tally)
    assert (tally["compared"] and tally["limited"]) or seeds.are_fresh


def ages_are_as_listed_at_most(tree: Tree, seed: str, folder: Path, tally: Counter[str]) -> None:
    result = compiled(tree, folder)
    if not result.ok or result.system is None:
        return
    tally["accepted"] += 1
    facts: Facts = result.proofs
    listed = limits(facts)
    met = run_twice(result, seed)
    for (reader, key), age in met.items():
        node = InputNode(reader, *key)
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
    """Agents that pass on what they and others measure or count, in loops too, in two states."""
    names = [f"a{i}" for i in range(rng.randrange(2, 5))]
    wires = {(a, b) for a in names for b in names if a != b and rng.randrange(100) < 55}
    agents, bind = {}, {}
    for name in names:
        sources = [a for a, b in sorted(wires) if b == name]
        is_alone = not any(name in wire for wire in wires)
        measures = is_alone or rng.randrange(3) > 0
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
        some = rng.sample(peers, rng.randrange(1, len(peers) + 1)) if peers else []
        return f"min({' + '.join(['1', *map(term, some)])}, 99)"

    def term(peer: str) -> str:
        read = f"x.{peer}.v"
        fresh, old = f"fresh({read})", f"not fresh({read}) or odd"
        return rng.choice(
            (read, read, f"({read} if {fresh} else m)", f"(m if {old} else {read})", "both")
        )

    late = " + ".join(f"{1000**i} * late(x.{p}.v)" for i, p in enumerate(_subsystems(peers)))
    aged = [f"age(x.{peer}.v)" for peer in peers] or ["0"]
    probe = {"aged": f"[{', '.join(aged)}]", "m": "min(m + 1, 9)", "late": late or "0"}
    functions = {"probe": probe}
    for state in ("f", "g"):
        told = [b for b in readers if state == "f" or rng.randrange(4)]
        functions[state] = {f"y.{b}.v": sent() for b in told} or {"n": "n + 1"}
    first, last = (f"x.{rng.choice(peers)}.v" if peers else "n" for _ in "ab")
    both = f"({last} if fresh({last}) and not odd else 0)" if peers else last
    return {
        "rate": f"{rng.choice(PERIODS_MS)} ms",
        "x": {peer: {"v": {"type": "int", "init": 0}} for peer in peers},
        **({"y": {b: {"v": "int"} for b in readers}} if readers else {}),
        "memory": {
            "m": {"type": "int", "init": 0},
            "n": {"type": "int", "init": 0},
            "late": {"type": "int", "init": 0},
            "aged": {"type": f"vector[{len(aged)}, s]", "init": str([0] * len(aged))},
        },
        "let": {"odd": f"{first} > 2", "both": both},
        "functions": functions,
        "behaviours": {s: {"functions": ["probe", s], "terminal": "always"} for s in ("f", "g")},
        "states": {"S0": "f", "S1": "g"},
        "initial_state": "S0",
        "transitions": [["S0", "terminal", "always", "S1"], ["S1", "terminal", "always", "S0"]],
    }


def _subsystems(peers: list[str]) -> list[str]:
    return [peer for peer in peers if peer != "R"]


def limits(facts: Facts) -> dict[InputNode, Fraction]:
    """The ages that `specc ages` lists."""
    oldest = {node: facts.ages.oldest(node) for node, _ in facts.inputs()}
    return {node: trail.age_s for node, trail in oldest.items() if isinstance(trail, AgeChain)}


def run_twice(result: Result, seed: str) -> dict[tuple[str, tuple[str, str]], Met]:
    """Run generated code and the interpreter, which have to agree; the ages that were met."""
    system, facts = result.system, result.proofs
    assert system is not None
    entered = {m.subsystem.qualified_name: frozenset(m.reachable_states) for m in facts.machines}
    script = Script(system, seed, marks_of(system))
    interpreter = AgedInterpreter(system, PLAIN, script.measure, entered)
    expected = interpreter.run(TICKS)
    with built(system, result.proofs, facts.ages) as made:
        found: Run = executed(made, ScriptedPlant(script) if made.plant else None, TICKS)
    assert differences(expected, found, tolerance=1e-12) == []
    return interpreter.met


def with_limits(tree: Tree, listed: dict[InputNode, Fraction]) -> Tree:
    """The specification with the listed ages as limits, where an element has no interface."""
    for agent, parts in tree["agents"].items():
        every = {"c": parts["control"], **parts.get("virtual_effectors", {})}
        for name, part in (every | parts.get("virtual_receptors", {})).items():
            for peer, elements in part.get("x", {}).items():
                for element in elements if isinstance(elements, dict) else ():
                    age = listed.get(InputNode(f"{agent}.{name}", peer, element))
                    if age:
                        said = elements[element]
                        said = said if isinstance(said, dict) else {"type": said}
                        elements[element] = said | {"max_age": f"{float(age * 1000)} ms"}
    return tree


def chain(rng: Random) -> Tree:
    """A receptor, its control subsystem and others behind it, which pass on what they read."""
    names = [f"a{i}" for i in range(rng.randrange(1, 4))]
    agents: Tree = {}
    for name, source, reader in zip(names, ["k", *names[:-1]], [*names[1:], ""], strict=True):
        agents[name] = {"control": _passing(rng, source, reader)}
    receptor = _passing(rng, "R", "c") | {"uses": ["k"]}
    period = int(receptor["rate"].split()[0])
    kind: Tree = rng.choice(({}, {"rate": f"{rng.choice((2, 3)) * period} ms"}))
    agents["a0"] |= {
        "real_receptors": {"k": {"y": {"v": "int"}}},
        "virtual_receptors": {"k": receptor},
    }
    plant = {"model": "plant.xml", "bind": {"a0.R.k.v": RAW | kind}}
    return {"specc": 1.2, "system": "chain", "agents": agents, "plant": plant}


def _passing(rng: Random, source: str, reader: str) -> Tree:
    read = f"x.{source}.v"
    told = {f"y.{reader}.v": read} if reader else {}
    return {
        "rate": f"{rng.choice(PERIODS_MS)} ms",
        "x": {source: {"v": "int" if source == "R" else {"type": "int", "init": 0}}},
        **({"y": {reader: {"v": "int"}}} if reader else {}),
        "memory": {"old": {"type": "real[s]", "init": 0}, "n": {"type": "int", "init": 0}},
        "functions": {"pass": {"old": f"age({read})", "n": read, **told}},
        "behaviours": {"b": {"functions": ["pass"], "terminal": "never"}},
        "states": {"S0": "b"},
        "initial_state": "S0",
    }


@pytest.mark.parametrize("seeds", blocks(range(3), also=range(3, 20), long=40, each=20))
def test_the_listed_age_is_met_at_the_end_of_a_chain(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        the_listed_age_is_met_at_the_end_of_a_chain(seed, tmp_path)


def the_listed_age_is_met_at_the_end_of_a_chain(seed: int, folder: Path) -> None:
    result = compiled(chain(Random(seed)), folder)
    system, facts = result.system, result.proofs
    assert result.ok
    assert system is not None
    last = [agent.name for agent in system.agents][-1]
    (listed,) = (age for node, age in limits(facts).items() if node.reader == f"{last}.c")
    with built(system, None, facts.ages) as made:
        memory: Any = made.scheduled(f"{last}.c").subsystem.memory
        plant = ScriptedPlant(Script(system, str(seed), ()))
        with Executor(made, plant, inline=True) as executor:
            met = []
            while executor.tick * made.tick_s < 4.0 and executor.advance():
                met.append(memory.old)
    assert max(met) == float(listed), seed


class Sampled(Plant):
    """Notes the base ticks at which there was a sample."""

    def __init__(self, script: Script, tick_s: float) -> None:
        super().__init__(script, tick_s)
        self.ticks: dict[str, list[int]] = defaultdict(list)

    def sample(self, name: str) -> Any:
        value = super().sample(name)
        if value is not NO_SAMPLE:
            self.ticks[name].append(self.tick)
        return value


@dataclass(frozen=True, slots=True)
class Told:
    """A step: when it began and was seen, in base ticks, and what it was told."""

    stamp: int
    began: int
    visible: int
    state: str
    aged: tuple[float, ...]
    late: int


class Reckoned:
    """Ages and lateness of a run in real time, from when its steps began and were seen."""

    def __init__(
        self, static: AgedInterpreter, steps: dict[str, list[Told]], sampled: dict[str, list[int]]
    ) -> None:
        self.static, self.steps, self.sampled = static, steps, sampled
        self.made: dict[tuple[str, int, Element], Origin] = {}

    def origin(self, name: str, index: int, key: Key) -> tuple[Origin, bool]:
        """Where the value came from that an input has in a step, and whether it is fresh there."""
        now = self.steps[name][index].began
        before = self.steps[name][index - 1].began if index else -1
        sender = self.static.subsystems[name].sender(key[0])
        if sender not in self.steps:
            ticks = [tick for tick in self.sampled[f"{sender}.{key[1]}"] if tick <= now]
            return Origin(ticks[-1], ticks[-1]), ticks[-1] > before
        sent = [
            (i, step)
            for i, step in enumerate(self.steps[sender])
            if step.visible <= now and self.static.sends(sender, step.state, (name, key))
        ]
        if not sent:
            return Origin(0), False
        last, step = sent[-1]
        place = sender, last, (name, key)
        if place not in self.made:
            self.made[place] = self._made(*place)
        return self.made[place], step.visible > before

    def _made(self, sender: str, index: int, reader: Element) -> Origin:
        step = self.steps[sender][index]
        behind = []
        for key, only_fresh in self.static.reads_in(sender, step.state, reader):
            origin, is_fresh = self.origin(sender, index, key)
            if self.static.is_followed((sender, key), reader) and (is_fresh or not only_fresh):
                behind.append(origin)
        if not self.static.is_measured(reader):
            return Origin(min((origin.computed for origin in behind), default=step.began))
        measured = (origin.measured for origin in behind)
        return Origin(step.began, min((m for m in measured if m is not None), default=None))

    def late(self, sender: str, now: int) -> int:
        """Periods in a row, with that of now, in which it has begun no step."""
        begun = [step.stamp for step in self.steps[sender] if step.began <= now]
        return now // self.static.ticks(sender) - begun[-1]


@pytest.mark.parametrize("seeds", blocks([2], also=range(9), long=20, each=20))
def test_ages_in_real_time_follow_from_when_steps_began_and_were_seen(
    seeds: Seeds, tmp_path: Path
) -> None:
    tally: Counter[str] = Counter()
    for seed in seeds:
        ages_in_real_time(seed, tmp_path, tally)
    assert tally["late"] or seeds.are_fresh


def ages_in_real_time(seed: int, folder: Path, tally: Counter[str]) -> None:
    result = compiled(net(Random(seed)), folder)
    system, facts = result.system, result.proofs
    assert result.ok
    assert system is not None
    script, random = Script(system, str(seed), marks_of(system)), Random(seed)
    entered = {m.subsystem.qualified_name: frozenset(m.reachable_states) for m in facts.machines}
    static = AgedInterpreter(system, PLAIN, script.measure, entered)
    steps: dict[str, list[Told]] = defaultdict(list)
    with built(system, None, facts.ages) as made:

        def note(record: StepRecord) -> None:
            memory: Any = made.scheduled(record.subsystem).subsystem.memory
            times = (round(time_s / made.tick_s) for time_s in (record.time_s, record.visible_s))
            aged = tuple(memory.aged.tolist())
            told = Told(record.stamp, *times, record.state, aged, memory.late)
            steps[record.subsystem].append(told)

        clock, plant = DrivenClock(), Sampled(script, made.tick_s)
        slow = {
            s.subsystem.name: partial(random.uniform, 0, 2.5 * s.ticks * made.tick_s)
            for s in made.subsystems
            if random.random() < 0.4
        }
        driven = Driven(made, clock, elsewhere=slow, plant=plant, observers=(note,))
        driven.until(TICKS, lambda: clock.busy(_stall(random) * made.tick_s)).finish()
        assert not driven.executor.faults
    reckoned = Reckoned(static, steps, plant.ticks)
    for name, told in steps.items():
        for index, step in enumerate(told):
            keys = list(static.subsystems[name].inputs)
            since = (reckoned.origin(name, index, key)[0].since for key in keys)
            expected = tuple(float((step.began - s) * static.tick_s) for s in since)
            assert step.aged == (expected or (0,)), seed
            senders = [static.subsystems[name].sender(key[0]) for key in keys]
            lates = [reckoned.late(s, step.began) for s in senders if s in steps]
            assert step.late == sum(1000**i * n for i, n in enumerate(lates)), seed
            tally["late"] += any(lates)


def _stall(random: Random) -> float:
    return random.expovariate(0.2) if random.random() < 0.1 else 0.0
