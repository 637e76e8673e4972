"""What exploring says of all runs of a system, against what some runs do."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from specc_runtime.cycle import Executor

from specc.emit import fill_templates
from specc.lower import lower
from specc.model import requirement as r
from specc.model.system import System
from specc.pipeline import Result
from specc.tools.explore.explorer import Exploration
from tests.soundness.interpreter import Interpreter, Run
from tests.soundness.law import marks_of
from tests.soundness.operators import PLAIN
from tests.soundness.running import Script, ScriptedPlant, package
from tests.soundness.values import NASTY


def interpreted(system: System, seed: int, ticks: int) -> Run:
    """A run of so many base ticks, with measurements of all sorts."""
    script = Script(system, str(seed), marks_of(system), NASTY)
    return Interpreter(system, PLAIN, script.measure).run(ticks)


def belied(result: Result, there: Exploration, seeds: range, ticks: int) -> tuple[list[str], int]:
    """Assumptions and findings that a run belies, and how many such things were said."""
    assert result.system is not None
    found, said = [], 0
    runs = [interpreted(result.system, seed, ticks) for seed in seeds]
    for name, axiom, verdict in there.assumptions:
        subsystem = next(s for s in result.system.subsystems if s.qualified_name == name)
        index = str(subsystem.axioms.index(axiom))
        for failure in (f for run in runs for f in run.failures):
            wrong = failure.subsystem == name and failure.kind == "AxiomViolated"
            if verdict == "proved" and wrong and index in failure.about:
                found.append(f"{name} {index}: {failure}")
        said += verdict == "proved"
    for finding in (f for f in there.findings if f.trace.is_decided and f.code != "W1006"):
        said += 1
        for run in runs:
            ran = {name: iter(steps) for name, steps in run.steps.items()}
            for step in finding.trace.steps:
                took = next(ran[step.walker.name], None)
                if took and (took.state, took.transition) != (
                    step.transition.target,
                    step.transition.row,
                ):
                    found.append(f"{finding.message}: {step.description()}, but {took}")
            if finding.code in ("W1001", "W1003", "W1004") and finding.identity[-1] != "task":
                _, name, state = finding.identity
                found += [f"{finding.message}: {s}" for s in ran[str(name)] if s.state != state]
    return found, said


def monitored(result: Result, seed: int, ticks: int) -> tuple[list[str], Fraction]:
    """The verdicts of a run on the requirements, and how long it went before a step failed.

    That time is exact: what happens at it must not come before it by rounding.
    """
    assert result.system is not None
    script = Script(result.system, str(seed), marks_of(result.system), NASTY)
    with package(fill_templates(lower(result.system, None))) as modules:
        made = modules["system.py"].build("")
        required = made.requirements
        assert required is not None
        required.follow(
            {s.subsystem.name: (s.subsystem, s.ticks) for s in made.subsystems}, made.tick_s
        )
        plant = ScriptedPlant(script) if made.plant else None
        executor = Executor(made, plant, [required], inline=True)
        with np.errstate(all="ignore"):
            while executor.tick < ticks and executor.advance():
                required.advance(executor.tick)
            executor.finish()
        required.finish(executor.tick)
        lasted_s = min((fault.time_s for fault in executor.faults), default=executor.time_s)
        exactly = Fraction(lasted_s).limit_denominator(10**6)
        return [item["verdict"] for item in required.as_data()], exactly


def misjudged(result: Result, found: Exploration, seeds: range, ticks: int) -> list[str]:
    """Requirements of which exploring says what a monitored run belies."""
    wrong = []
    ways = {f.identity[1]: f.trace for f in found.findings if f.code == "W1007"}
    for seed in seeds:
        verdicts, lasted_s = monitored(result, seed, ticks)
        for judged, verdict in zip(found.requirements, verdicts, strict=True):
            that = judged.requirement.that
            if judged.verdict == "proved" and verdict == "violated":
                wrong.append(f"{that}: proved, but violated in run {seed}")
            if judged.verdict == "violated" and verdict != "violated":
                late_s = ways[that].time_s + 2 * r.horizon_s(judged.requirement.formula)
                if lasted_s > late_s:
                    wrong.append(f"{that}: violated, but {verdict} in run {seed}")
    return wrong
