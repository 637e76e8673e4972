"""The runs of the scenarios of one specification, as many at once as there is room.

Code is generated for every scenario before the first run begins. Failures are recorded by a second
run with the same seed, so that runs that pass cost nothing but themselves.
"""

from __future__ import annotations

import uuid
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from specc import pipeline
from specc.model.scenario import Scenario
from specc.model.system import System
from specc.pipeline import Build, Result
from specc.tools.scenarios.judging import ScenarioResult, ScenarioRun, judge_run
from specc.tools.sweep.running import (
    LIMIT,
    Outcome,
    SweepJob,
    Workspace,
    close_workspace,
    open_workspace,
    outcome_of,
)
from specc.tools.sweep.sweeping import bundle_of, inputs_of


@dataclass(frozen=True, slots=True)
class RunSettings:
    """How runs are made: the wall time of each, and where failures are recorded, with which texts.

    At most `recorded` failures of a scenario are.
    """

    limit_s: float
    folder: Path
    recorded: int
    texts: Mapping[str, str]


class ScenarioRefusedError(Exception):
    """A scenario that cannot be run as it is written: what it sets is refused."""

    def __init__(self, scenario: Scenario, result: Result) -> None:
        super().__init__(scenario.name)
        self.scenario, self.result = scenario, result


@dataclass(eq=False)
class _Course:
    """A scenario with its code, and the runs that are done."""

    scenario: Scenario
    system: System
    directory: str
    options: Mapping[str, Any]
    done: dict[int, ScenarioRun] = field(default_factory=dict)
    endless: set[int] = field(default_factory=set)
    """Seeds of runs that were ended, since they took too long."""

    @property
    def result(self) -> ScenarioResult:
        """What is known by now."""
        order = {seed: place for place, seed in enumerate(self.scenario.seeds)}
        runs = sorted(self.done.values(), key=lambda run: order[run.seed])
        return ScenarioResult(self.scenario, tuple(runs))


class ScenarioRuns:
    """The runs of some scenarios of one specification, which begin in the executor at once."""

    def __init__(
        self,
        spec: str,
        result: Result,
        scenarios: Sequence[Scenario],
        executor: ThreadPoolExecutor,
        folder: Path,
        settings: RunSettings,
    ) -> None:
        """Generate the code of all scenarios into the folder, and begin with the runs.

        Raises ScenarioRefusedError.
        """
        assert result.system is not None
        self._executor, self._settings = executor, settings
        self._name = f"scenarios-{uuid.uuid4()}"
        files: dict[str, str] = {}
        self._courses: list[_Course] = []
        for number, (scenario, built) in enumerate(_built(spec, result, scenarios)):
            assert built.result.system is not None
            directory = f"{number}/{built.system}"
            files |= {f"{directory}/{name}": text for name, text in built.files.items()}
            options = {
                "duration_s": scenario.duration_s,
                "cycles": scenario.cycles,
                "spec": spec,
                "scenario": scenario.name,
            }
            self._courses.append(_Course(scenario, built.result.system, directory, options))
        inputs = inputs_of(spec, result.sources, result.system)
        open_workspace(self._name, Workspace(folder.absolute(), bundle_of(files, inputs)))
        self._recording: dict[Future[Outcome], tuple[_Course, int, Path]] = {}
        self._is_stopped = False
        self._pending = {
            self._submit(course, seed, {}): (course, seed)
            for course in self._courses
            for seed in course.scenario.seeds
        }

    @property
    def count(self) -> int:
        """How many runs there are."""
        return sum(len(course.scenario.seeds) for course in self._courses)

    @property
    def done(self) -> int:
        """How many of them are over."""
        return sum(len(course.done) for course in self._courses)

    def collect(self, timeout_s: float) -> bool:
        """Wait for runs for some time; whether all are over and recorded."""
        futures = [*self._pending, *self._recording]
        finished, _ = wait(futures, timeout_s, FIRST_COMPLETED) if futures else ((), ())
        for future in finished:
            if (pending := self._pending.pop(future, None)) is not None:
                course, seed = pending
                outcome = future.result()
                run = judge_run(course.system, course.scenario, seed, outcome)
                course.done[seed] = run
                if outcome.ended == LIMIT:
                    course.endless.add(seed)
                if len(course.done) == len(course.scenario.seeds):
                    self._record(course)
            else:
                course, seed, file = self._recording.pop(future)
                with suppress(Exception):  # what came of it is known already
                    future.result()
                if file.exists():
                    course.done[seed] = replace(course.done[seed], recording=file.name)
        return not (self._pending or self._recording)

    @property
    def results(self) -> list[ScenarioResult]:
        """What came of the scenarios by now, in their order."""
        return [course.result for course in self._courses]

    def stop(self) -> None:
        """Begin no more runs, but record the failures there are."""
        if self._is_stopped:
            return
        self._is_stopped = True
        for future in [*self._pending]:
            if future.cancel():
                del self._pending[future]
        for course in self._courses:
            if course.done and len(course.done) < len(course.scenario.seeds):
                self._record(course)

    def close(self) -> None:
        """End the runs that are under way; what was recorded of them goes."""
        for future in (*self._pending, *self._recording):
            future.cancel()
        close_workspace(self._name)
        wait(self._recording)
        for _, _, file in self._recording.values():
            file.unlink(missing_ok=True)

    def _submit(self, course: _Course, seed: int, more: Mapping[str, Any]) -> Future[Outcome]:
        setting, limit_s = dict(course.scenario.settings), self._settings.limit_s
        options = {name: value for name, value in course.options.items() if value is not None}
        job = SweepJob(self._name, course.directory, setting, seed, {**options, **more}, limit_s)
        return self._executor.submit(outcome_of, job)

    def _record(self, course: _Course) -> None:
        """Record the first failures of a scenario, each by another run."""
        failed = [run for run in course.result.runs if not run.is_passed and not run.recording]
        for run in failed[: self._settings.recorded]:
            if run.seed in course.endless:
                continue
            self._settings.folder.mkdir(parents=True, exist_ok=True)
            file = self._settings.folder / f"{course.scenario.name}-{run.seed}.mcap"
            file.unlink(missing_ok=True)
            more = {"record": str(file.absolute()), "texts": dict(self._settings.texts)}
            future = self._submit(course, run.seed, more)
            self._recording[future] = course, run.seed, file


def _built(
    spec: str, result: Result, scenarios: Sequence[Scenario]
) -> Iterator[tuple[Scenario, Build]]:
    """The code of each scenario; what sets nothing follows from what is compiled already."""
    for scenario in scenarios:
        if scenario.settings:
            settings = dict(scenario.settings)
            built = pipeline.build(spec, settings, scenario=scenario.name, is_read=False)
        else:
            built = pipeline.generated(result.in_scenario(scenario.name), spec, is_read=False)
        if not built.files:
            raise ScenarioRefusedError(scenario, built.result)
        yield scenario, built
