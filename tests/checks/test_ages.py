"""Ages that are computed from the timeline are those that a slow simulation of it observes."""

from __future__ import annotations

import random
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import pytest

from specc.analysis import Facts
from specc.analysis.dataflow import AgeChain, InputNode, UnboundedAge
from specc.pipeline import read_spec
from tests.seeds import Seeds, blocks

RATES = (100, 50, 40, 30, 25, 20, 12, 10)
TICKS_HZ = 600
STEPS = 40_000
"""Ticks of a simulation; the first tenth is not looked at."""


@dataclass
class Stage:
    """A subsystem of a chain: it passes on what it reads, in all periods or only in some."""

    rate: int
    asks: bool
    pauses: bool


def chain(seed: int) -> list[Stage]:
    """Stages in the order of the data; who reads what comes now and then asks for it mostly."""
    draw = random.Random(seed)
    stages = [Stage(draw.choice(RATES), False, draw.random() < 0.3)]
    for _ in range(draw.randint(1, 4)):
        asks = draw.random() < (0.9 if stages[-1].pauses else 0.3)
        stages.append(Stage(draw.choice(RATES), asks, draw.random() < 0.3))
    return stages


def specification(stages: list[Stage]) -> str:
    """A receptor, its control subsystem, and other agents behind it."""
    lines = ["specc: 1", "system: chain", "agents:"]
    for index, stage in enumerate(stages[1:], start=1):
        source = "k" if index == 1 else f"a{index - 1}"
        target = f"a{index + 1}"
        lines += [f"  a{index}:", "    control:"]
        lines += machine(stage, source, target if index < len(stages) - 1 else "")
        if index == 1:
            lines += [
                "    real_receptors: {k: {y: {v: int}}}",
                "    virtual_receptors:",
                "      k:",
            ]
            lines += ["  " + line for line in machine(stages[0], "R", "c")]
    return "\n".join(lines) + "\n"


def machine(stage: Stage, source: str, target: str) -> list[str]:
    read = f"x.{source}.v"
    value = f"{read} if fresh({read}) else 0" if stage.asks else read
    init = "" if source == "R" else ", init: 0"
    send = f"functions: {{send: {{y.{target}.v: {value}}}}}"
    keep = f"functions: {{send: {{m: {value}}}}}\n      memory: {{m: {{type: int, init: 0}}}}"
    rest = "" if stage.pauses else "functions: [send], "
    return [
        f"      rate: {stage.rate} Hz",
        f"      x: {{{source}: {{v: {{type: int{init}}}}}}}",
        *([f"      y: {{{target}: {{v: int}}}}"] if target else []),
        f"      {send if target else keep}",
        "      behaviours:",
        "        work: {functions: [send], terminal: always}",
        f"        rest: {{{rest}terminal: always}}",
        "      states: {S0: work, S1: rest}",
        "      initial_state: S0",
        "      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]",
    ]


def observed(stages: list[Stage], seed: int, gap: int = 0) -> Fraction | None:
    """The greatest age that the last stage meets, pauses coming by chance; None if it meets none.

    A stage that asks may be read only when it has found nothing new. So it is with a device that
    may have no sample for up to `gap` ticks.
    """
    draw, taken = random.Random(seed), 0
    ticks = [TICKS_HZ // stage.rate for stage in stages]
    boxes: list[tuple[int | None, bool]] = [(None, False)] * len(stages)
    sent: list[tuple[bool, int | None]] = [(False, None)] * len(stages)
    greatest = None
    for now in range(STEPS):
        due = [i for i, period in enumerate(ticks) if now % period == 0]
        for i in due:
            if sent[i][0] and i + 1 < len(stages):
                boxes[i + 1] = (sent[i][1], True)
        if 0 in due and (now - taken > gap or draw.random() < 0.1):
            taken = now
        for i in due:
            measured, fresh = (taken, taken == now) if i == 0 else boxes[i]
            value = measured if fresh or not stages[i].asks else None
            boxes[i] = (boxes[i][0], False)
            if i == len(stages) - 1 and value is not None and now > STEPS // 10:
                greatest = max(greatest or 0, now - value)
            sent[i] = (not stages[i].pauses or draw.random() < 0.6, value)
    return None if greatest is None else Fraction(greatest, TICKS_HZ)


@pytest.mark.parametrize("seeds", blocks(range(4), also=range(4, 40), long=48, each=40))
def test_the_greatest_age_is_met_and_never_exceeded(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        the_greatest_age_is_met_and_never_exceeded(seed, tmp_path)


def the_greatest_age_is_met_and_never_exceeded(seed: int, tmp_path: Path) -> None:
    stages = chain(seed)
    path = tmp_path / "chain.yaml"
    path.write_text(specification(stages))
    system = read_spec(str(path)).system
    assert system is not None
    last = len(stages) - 1
    node = InputNode(f"a{last}.c", "k" if last == 1 else f"a{last - 1}", "v")
    found = Facts(system).ages.oldest(node)
    holds = any(b.pauses and not r.asks for b, r in pairwise(stages))
    assert isinstance(found, UnboundedAge) == holds
    if not isinstance(found, UnboundedAge):
        # Where several pause, one simulation may meet nothing by chance.
        chances = range(seed, seed + (1 if found is None else 20))
        simulated = (observed(stages, chance) for chance in chances)
        met = next((age_s for age_s in simulated if age_s is not None), None)
        assert (met is None) == (found is None)
        if found is not None and met is not None:
            assert met <= found.age_s
            if not any(stage.pauses for stage in stages[:-1]):
                assert met == found.age_s


@pytest.mark.parametrize("seeds", blocks(range(4), also=range(4, 40), long=60, each=40))
def test_samples_of_a_sporadic_device_are_as_old_as_its_gap(seeds: Seeds, tmp_path: Path) -> None:
    for seed in seeds:
        samples_of_a_sporadic_device_are_as_old_as_its_gap(seed, tmp_path)


def samples_of_a_sporadic_device_are_as_old_as_its_gap(seed: int, tmp_path: Path) -> None:
    stages = chain(seed)
    draw = random.Random(seed)
    stages[0].asks = draw.random() < 0.3
    gap = draw.choice((0, 20, 60, 100))
    limit = f", max_gap: {gap * 1000 // TICKS_HZ} ms" if gap else ""
    gap = gap * 1000 // TICKS_HZ * TICKS_HZ // 1000
    path = tmp_path / "chain.yaml"
    bind = f"{{a1.R.k.v: {{sporadic: true{limit}}}}}"
    path.write_text(f'{specification(stages)}plant: {{python: "a:b", bind: {bind}}}\n')
    system = read_spec(str(path)).system
    assert system is not None
    last = len(stages) - 1
    node = InputNode(f"a{last}.c", "k" if last == 1 else f"a{last - 1}", "v")
    found = Facts(system).ages.oldest(node)
    held = any(b.pauses and not r.asks for b, r in pairwise(stages))
    assert isinstance(found, UnboundedAge) == (held or (not limit and not stages[0].asks))
    if isinstance(found, AgeChain):
        met = observed(stages, seed, gap or STEPS)
        assert met is None or met <= found.age_s


@pytest.mark.long
def test_the_ways_of_a_trail_add_up(tmp_path: Path) -> None:
    for seed in range(40):
        path = tmp_path / "chain.yaml"
        stages = chain(seed)
        path.write_text(specification(stages))
        system = read_spec(str(path)).system
        assert system is not None
        last = len(stages) - 1
        node = InputNode(f"a{last}.c", "k" if last == 1 else f"a{last - 1}", "v")
        found = Facts(system).ages.oldest(node)
        if isinstance(found, AgeChain):
            hops = found.steps()
            assert [hop.node.reader for hop in hops][-1] == f"a{last}.c"
            for earlier, later in pairwise(hops):
                period = 1 / next(
                    s.rate_hz for s in system.subsystems if s.qualified_name == earlier.node.reader
                )
                assert later.read_s >= earlier.read_s + period
