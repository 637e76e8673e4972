"""Whether a run passes its scenario, by its report; and how many of the runs do."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil
from typing import Any

from specc.diagnostics.phrases import counted, join_words
from specc.model.scenario import Scenario
from specc.model.system import System
from specc.model.task import Disturbance
from specc.tools.sweep.running import Outcome
from specc.tools.sweep.summary import Estimate, Z, rate


@dataclass(frozen=True, slots=True)
class ViolatedFormula:
    """A formula that does not hold in a run: since when, and by how much if it compares numbers."""

    formula: str
    time_s: float | None
    margin: float | None

    def as_data(self) -> dict[str, Any]:
        """It as plain data."""
        return {"formula": self.formula, "time_s": self.time_s, "margin": self.margin}


@dataclass(frozen=True, slots=True)
class ScenarioRun:
    """What came of one run of a scenario.

    It passes if all that is required and expected holds, as far as the run goes; nothing that is
    expected is left open; all that the scenario lets happen did; and there is no fault.
    """

    seed: int
    violated: tuple[ViolatedFormula, ...] = ()
    fault: str = ""
    """Why it does not pass, besides what is violated."""
    records_sha256: str = ""
    recording: str = ""
    """The name of its recording, if it has one."""

    @property
    def is_passed(self) -> bool:
        """Whether it passes."""
        return not (self.violated or self.fault)

    @property
    def reasons(self) -> list[str]:
        """Why it does not pass, each on one line."""
        found = []
        for each in self.violated:
            at = "" if each.time_s is None else f" at {each.time_s:.3f} s"
            by = "" if each.margin is None else f", margin {each.margin:.3g}"
            found.append(f"violated{at}: {each.formula}{by}")
        return [*found, self.fault] if self.fault else found

    def as_data(self) -> dict[str, Any]:
        """The entry of the results."""
        return {
            "seed": self.seed,
            "passed": self.is_passed,
            "violated": [each.as_data() for each in self.violated],
            "fault": self.fault or None,
            "recording": self.recording or None,
            "records_sha256": self.records_sha256 or None,
        }


def judge_run(system: System, scenario: Scenario, seed: int, outcome: Outcome) -> ScenarioRun:
    """Judge a run of a system, as it is in the scenario."""
    if outcome.report is None:
        return ScenarioRun(seed, fault=outcome.reason or f"exit code {outcome.code}")
    report = outcome.report
    violated = tuple(
        ViolatedFormula(each["that"], each["time_s"], each["margin"])
        for each in report.get("requirements", ())
        if each["verdict"] == "violated"
    )
    faults = [f"{each['culprit']}: {each['message']}" for each in report["faults"]]
    faults += _open_ends(system, scenario, report)
    return ScenarioRun(seed, violated, "; ".join(faults), report["records_sha256"])


def _open_ends(system: System, scenario: Scenario, report: Mapping[str, Any]) -> list[str]:
    """What was expected and is not decided, and what should have happened and did not."""
    expected = {each.that for each in scenario.expect}
    found = [
        f"undecided at the end of the run: {each['that']}"
        for each in report.get("requirements", ())
        if each["verdict"] == "unknown" and each["that"] in expected
    ]
    disturbances = system.task.disturbances if system.task else ()
    own = len(scenario.disturbances)
    pairs = zip(disturbances[::-1][:own], report.get("disturbances", ())[::-1], strict=False)
    for disturbance, happened in reversed([*pairs]):
        if not happened["times"] and disturbance.probability is None:
            found.append(f"never happened: {_words(disturbance)}")
    return found


def _words(disturbance: Disturbance) -> str:
    when = f" when {disturbance.when.that}" if disturbance.when else ""
    return f"{disturbance.subject}{when}"


@dataclass(frozen=True)
class ScenarioResult:
    """The runs of a scenario, in the order of their seeds."""

    scenario: Scenario
    runs: tuple[ScenarioRun, ...]

    @property
    def passes(self) -> int:
        """How many of them pass."""
        return sum(run.is_passed for run in self.runs)

    @property
    def required(self) -> int:
        """How many runs of all seeds have to pass."""
        seeds, share = len(self.scenario.seeds), self.scenario.success
        return seeds if share is None else ceil(seeds * share[0] / share[1])

    @property
    def is_passed(self) -> bool:
        """Whether enough of all runs pass."""
        return self.passes >= self.required

    @property
    def is_failed(self) -> bool:
        """Whether too many runs failed, whatever comes of the others."""
        return len(self.scenario.seeds) - (len(self.runs) - self.passes) < self.required

    @property
    def is_cut(self) -> bool:
        """Whether runs that would decide are missing: the test ended before."""
        return not (self.is_passed or self.is_failed)

    @cached_property
    def estimate(self) -> Estimate | None:
        """How often runs pass, with its interval of 95 %; None without runs."""
        return rate(self.passes, len(self.runs)) if self.runs else None

    @property
    def remark(self) -> str:
        """What the seeds do not show, if they pass: that the rate is what is claimed of it."""
        share, estimate = self.scenario.success, self.estimate
        if share is None or estimate is None or not self.is_passed:
            return ""
        claimed, low = share[0] / share[1], estimate.low
        if share[0] == share[1] or low is None or low >= claimed:
            return ""
        needed = ceil(Z * Z * claimed / (1 - claimed))
        claim = f"{share[0]} of {share[1]}"
        if len(self.runs) < needed:
            words = counted(len(self.runs), "run")
            return f"{words}: too few to show {claim}; {needed} that all pass would"
        return f"the interval begins below {claim}: more runs may show it"

    def as_data(self) -> dict[str, Any]:
        """The entry of the results."""
        count, estimate = len(self.runs), self.estimate
        share = self.scenario.success or (len(self.scenario.seeds),) * 2
        return {
            "name": self.scenario.name,
            "because": self.scenario.because,
            "success": {"required": share[0], "of": share[1]},
            "passed": None if self.is_cut else self.is_passed,
            "rate": {
                "passed": self.passes,
                "of": count,
                "low": estimate.low if estimate else None,
                "high": estimate.high if estimate else None,
            },
            "remark": self.remark or None,
            "runs": [run.as_data() for run in self.runs],
        }


def reasons_by_seeds(runs: Sequence[ScenarioRun]) -> list[tuple[str, list[ScenarioRun]]]:
    """Each reason for which runs fail, with these runs; the most frequent one first."""
    found: dict[str, list[ScenarioRun]] = {}
    for run in runs:
        for formula in dict.fromkeys(each.formula for each in run.violated):
            found.setdefault(f"violated: {formula}", []).append(run)
        if run.fault:
            found.setdefault(run.fault, []).append(run)
    return sorted(found.items(), key=lambda item: -len(item[1]))


def seeds_in_words(runs: Sequence[ScenarioRun], most: int) -> str:
    """The seeds of some runs: `seed 3`, `seeds 1, 2 and 7`."""
    seeds = [str(run.seed) for run in runs[:most]]
    if len(runs) > most:
        seeds.append(f"{len(runs) - most} more")
    return f"seed{'s' * (len(runs) > 1)} {join_words(seeds, 'and')}"
