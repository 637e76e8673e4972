"""The command that runs a generated system, from options to exit code."""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from specc_runtime.clock import WallClock
from specc_runtime.companion import Companion, OutputLost, Recording, ReportKeeper, ViewerCompanion
from specc_runtime.cycle import REST_S
from specc_runtime.ending import tell
from specc_runtime.environment import made_plant, open_judge, prepare
from specc_runtime.examination import shortcomings
from specc_runtime.faults import Fault, PlantFailed, error_text
from specc_runtime.interruption import SAFE_S, Abandoned, Interruption
from specc_runtime.loading import load_layouts, load_system, timed
from specc_runtime.options import Options, UsageError
from specc_runtime.panel import PanelElement
from specc_runtime.placement import placed
from specc_runtime.plant import Grouped, Pictured, Viewable
from specc_runtime.plants.errors import PlantError
from specc_runtime.printing import abandon, say
from specc_runtime.processes.worker import Processes
from specc_runtime.report import Report, check_outputs, stillborn, write
from specc_runtime.session import Session
from specc_runtime.system import PlantSpec, System
from specc_runtime.watchdog import Watchdog

if TYPE_CHECKING:
    from specc_runtime.page.feed import Feed
    from specc_runtime.page.page import Page
    from specc_runtime.recording.snapshots import Snapshot
    from specc_runtime.video import Video

FULFILLED, UNFULFILLED, WRONG_USAGE = 0, 1, 2


def execute(options: Options, page: Page | None = None) -> int:
    """Run what the options ask for; faults and errors go to standard error.

    A `page` shows the run.
    """
    files = options.named_absolutely()  # operators may change the folder
    with Interruption() as interruption:
        attempt = _Attempt(options, interruption, page)
        interruption.last_resort = attempt.leave
        try:
            attempt.run()
        except (UsageError, PlantError) as error:
            say(f"error: {error}")
            if page is not None:
                page.refuse(f"The run cannot be started again: {error}")
            return WRONG_USAGE
        interruption.allow(always=False)
        report = attempt.report()
        code = _write(report, files)
    if page is not None:
        page.is_interrupted = interruption.is_signalled
    if page is None or page.restart is None or page.is_interrupted:
        try:
            tell(report, options)
        except OSError:
            if not report.interrupted:
                raise
            abandon(sys.stdout, sys.stderr)  # the terminal is gone that has ended the run
    code = _exit_code(attempt, report, interruption, code)
    if page is not None:
        page.end(report.as_data(), code)
    return code


def _exit_code(attempt: _Attempt, report: Report, interruption: Interruption, code: int) -> int:
    """The exit code of a run whose report was written with this one; says what is wrong."""
    for film in attempt.lost:
        say(f"error: {film}")
    if code or attempt.lost:
        return code or WRONG_USAGE
    session = attempt.session
    if report.interrupted and (session is None or not session.is_endless):
        return interruption.exit_code
    if session is not None and session.fulfilled:
        return FULFILLED
    if session is not None and (why := session.shortfall):
        say(f"not fulfilled: {why}")
    return UNFULFILLED


class _Attempt:
    """A run from the first file that it reads until its plant is closed, whatever ends it."""

    def __init__(
        self, options: Options, interruption: Interruption, page: Page | None = None
    ) -> None:
        self.session: Session | None = None
        self.lost: list[OutputLost] = []
        self._options = options
        self._interruption = interruption
        self._page = page
        self._clock = WallClock()
        self._faults: list[Fault] = []
        self._plant: Any = None
        self._plant_of = ""
        self._processes = Processes()
        self._is_closing = False
        self._restore_terminal: Callable[[], None] = lambda: None
        self._companions: list[Companion] = []

    def run(self) -> None:
        """Raises UsageError, PlantError for what is wrong before the first tick."""
        try:
            self._run()
        except Fault as fault:
            self._faults.append(fault)
        except (Abandoned, KeyboardInterrupt):
            self._interruption.request()

    def _run(self) -> None:
        check_outputs(self._options)
        self._options = self._options.named_absolutely()
        progress = lambda: self.session.progress if self.session else -1  # noqa: E731  # no more
        with Watchdog(progress, self._clock, elsewhere=self._elsewhere):
            try:
                self._go()
            finally:
                self._close()

    def _elsewhere(self) -> list[str]:
        """What is waited for that is no step of this process."""
        return self._processes.under_way() or getattr(self._plant, "waits_for", list)()

    def _go(self) -> None:
        snapshot = self._snapshot()
        options = self._options
        examined = options.check_operators
        system = load_system(options.directory, options.base, check_operators=examined)
        self._options = options = placed(timed(options, system), system)
        keys = _keys(options, system)
        self._check_interrupted()
        self._processes.begin(system, options, is_shown=self._page is not None)
        spec = system.plant
        plant = None
        if spec is not None and system.needs_plant:
            plant = self._handed_over(spec) or self._set_up(system)
        recorder = self._recorder(system, plant, snapshot.time_s if snapshot else 0.0)
        feed = self._feed(system, plant)
        session = self._session(system, plant, recorder, feed)
        if recorder is not None:
            recorder.report = session.report
        if snapshot:
            for lost in snapshot.go_on(session, system):
                say(f"--from: {lost}")
            session.stop_from(snapshot.until_s)
            if snapshot.saved and recorder is not None and self._page is not None:
                recorder.keep(snapshot.time_s, session.saved)  # the page may ask for this stretch
        if keys:
            self._operate(session, keys)
        _accompany(self._companions, session, options, system, plant, self._clock)
        if options.report is not None:
            self._companions.append(ReportKeeper(session.report, options.report, self._clock))
        if self._page is not None:
            if recorder is not None:
                self._page.reaches[recorder.file] = recorder.reach
            self._page.begin(session)
        self.session = session
        session.run(self._companions)

    def _operate(self, session: Session, keys: Mapping[str, PanelElement]) -> None:
        from specc_runtime.keys import Keys

        operator = Keys(session.panel, keys, quiet=self._options.quiet)
        self._restore_terminal = operator.restore
        self._companions.insert(0, operator)  # what others close takes its time
        operator.begin()

    def _feed(self, system: System, plant: Any) -> Feed | None:
        """What shows the run, if anything does."""
        if self._page is None:
            return None
        end = self._interruption.request
        layouts = load_layouts(system)
        return self._page.feed(self._options, system, layouts, plant, self._clock, end)

    def _session(
        self, system: System, plant: Any, recorder: Recording | None, feed: Feed | None
    ) -> Session:
        options, clock, interruption = self._options, self._clock, self._interruption
        if options.cycles is not None and system.task is None:
            raise UsageError(f"--cycles: {system.name} has no task; use --duration")
        alone = (options.endless or options.duration_s is not None) and options.cycles is None
        if options.cycle_limit_s is not None and (alone or system.task is None):
            raise UsageError("--cycle-limit: the run does not count cycles; add --cycles")
        judge, processes = open_judge(system, plant), self._processes
        processes.wait()
        whole = options, system, plant, judge, clock, interruption, recorder, processes, feed
        try:
            return Session(*whole)
        except ValueError as error:
            raise UsageError(str(error)) from error

    def _handed_over(self, spec: PlantSpec) -> Any:
        """The plant in Python that the run goes on with, since it cannot be kept."""
        if self._plant is not None and self._plant_of != spec.python:
            say("--from: the plant is as at the beginning: it is another one")
            self._close_plant()
        return self._plant

    def _set_up(self, system: System) -> Any:
        assert system.plant is not None
        options = self._options
        with self._interruption.loading():
            self._plant = plant = made_plant(system, options)
        self._check_interrupted()
        prepare(plant, system.task, options.seed)
        return plant

    def _snapshot(self) -> Snapshot | None:
        """What the run goes on from, if anything; the run gets its seed."""
        resume, record = self._options.resume, self._options.record
        if resume is None:
            return None
        if self._options.real_time:
            raise UsageError("--from: a run in real time has its begin at 0 s; try --speed 1")
        if record is not None and record.exists() and record.samefile(resume[0]):
            raise UsageError(f"cannot write {record}: the run goes on from it")
        from specc_runtime.recording.snapshots import last_before, settings_text

        snapshot = last_before(*resume)
        self._options = options = replace(self._options, seed=snapshot.seed)
        if snapshot.is_of(options):
            if snapshot.saved is None and resume[1] >= REST_S:
                say(f"--from: the run is repeated from its start: {snapshot.missing}")
            return snapshot
        if snapshot.is_set_otherwise(options):
            now = settings_text(options.built_with)
            then = settings_text(snapshot.set)
            say(f"--from: set for the recorded run: {then}; for this one: {now}")
        if options.past is not None:
            self._repeat(snapshot, options.past, resume[1])
        elif snapshot.saved is None:
            raise UsageError(f"{resume[0]} has nothing to go on from: {snapshot.missing}")
        if abs(snapshot.time_s - resume[1]) > 1e-6:
            say(f"--from: the specification goes on from {snapshot.time_s:.9g} s")
        snapshot.is_other = True
        return snapshot

    def _repeat(self, snapshot: Snapshot, past: Path, until_s: float) -> None:
        """Let the recorded specification run until then, and keep what the other goes on from."""
        if self._page is not None:
            self._page.tell_start(f"repeating until {until_s:g} s")
        tick_s = load_system(self._options.directory, self._options.base).tick_s
        system = load_system(past, self._options.base)
        plant = self._set_up(system) if system.needs_plant else None
        judge, options = open_judge(system, plant), self._options
        session = Session(options, system, plant, judge, self._clock, self._interruption)
        try:
            snapshot.go_on(session, system)
            self.session = session
            session.go_to(until_s, tick_s)
            snapshot.take(session, system)
        finally:
            self.session = None
            session.close()
        self._plant_of = system.plant.python if system.plant else ""
        if snapshot.saved is None or snapshot.saved["plant"] is not None:
            self._close_plant()

    def _recorder(self, system: System, plant: Any, begin_s: float) -> Any:
        """What records the run, if anything does."""
        options = self._options
        if options.record is None and (options.snapshots is None or options.real_time):
            return None
        if options.profile is not None:
            if self._page is not None:
                raise UsageError("--profile: a page goes back into its recording, and not a bag")
            from specc_runtime.ros2.bags.recorder import BagRecorder

            bag = BagRecorder(options, system, plant, self._clock)
            self._companions.append(bag)
            return bag
        from specc_runtime.recording.recorder import Recorder, SnapshotRecorder

        recorder: SnapshotRecorder
        if options.record is not None:
            recorder = Recorder(options, system, plant, self._clock, begin_s)
        else:
            assert options.snapshots is not None
            recorder = SnapshotRecorder(options.snapshots, options, system, self._clock, begin_s)
        self._companions.append(recorder)
        return recorder

    def _check_interrupted(self) -> None:
        if self._interruption.requested:
            raise KeyboardInterrupt

    def _close(self) -> None:
        """Close the companions and then the plant."""
        self._is_closing = True
        self._processes.close()
        self._interruption.allow(always=False)
        self.lost = [film for c in self._companions if (film := _closed(c))]
        self._interruption.allow(always=False)
        self._close_plant()

    def _close_plant(self) -> None:
        """Close the plant, if there is one; that it cannot be closed is a fault."""
        plant, self._plant = self._plant, None
        try:
            if plant is not None:
                plant.close()
        except KeyboardInterrupt:
            self._interruption.request()
        except BaseException as error:  # noqa: BLE001  # whatever the user's class raises
            self._faults.append(PlantFailed(error))

    def report(self) -> Report:
        """What happened."""
        if self.session is None:
            return stillborn(self._options, self._faults, interrupted=self._interruption.requested)
        for fault in self._faults:
            self.session.note(fault)
        self._faults.clear()
        return self.session.report()

    def leave(self) -> None:
        """End the process during what cannot be stopped, with safe outputs and the report."""
        self._restore_terminal()
        code = self._interruption.exit_code if self._interruption.requested else UNFULFILLED
        # What devices get may hang as the step does.
        late = threading.Timer(SAFE_S, os._exit, (code,))
        late.daemon = True
        late.start()
        try:
            if self._is_closing:
                self._faults.append(PlantFailed(self._interruption.abandoned()))
            elif self.session is not None:
                self.session.abandon()
            report = self.report()
            _write(report, self._options)
            if not self._is_closing:
                self._close()
            tell(report, self._options)
        finally:
            os._exit(code)


def _keys(options: Options, system: System) -> dict[str, PanelElement]:
    """The keys that operate the panel, if any do; raises UsageError."""
    if not options.keys:
        return {}
    from specc_runtime.keys import check_terminal, keys_of

    check_terminal()
    return keys_of(system.panel)


def _closed(companion: Companion) -> OutputLost | None:
    """Close a companion; returns the error of a film that is missing."""
    try:
        companion.close()
    except OutputLost as error:
        return error
    except BaseException as error:  # noqa: BLE001  # whatever it is, the run is over
        lost = OutputLost(f"a file of the run is not complete: {error_text(error)}")
        return None if isinstance(companion, ViewerCompanion) else lost
    return None


def _accompany(
    companions: list[Companion],
    session: Session,
    options: Options,
    system: System,
    plant: Any,
    clock: WallClock,
) -> None:
    if (options.video or options.viewer) and plant is None:
        raise UsageError(f"--video and --viewer: {system.name} has no plant to look at")
    for wanted, option, protocol in (
        (options.video, "--video", Pictured),
        (options.geom_groups, "--geom-groups", Grouped),
        (options.viewer, "--viewer", Viewable),
    ):
        if wanted and (lacking := shortcomings(plant, protocol)):
            raise UsageError(f"{option}: the plant {'; '.join(lacking)}")
    if options.viewer:
        companions.append(ViewerCompanion(plant, clock, session.interruption.request))
    video: Video | None = None
    if options.video is not None:
        from specc_runtime.video import Video

        video = Video(options, plant, system.tick_s, clock)
        companions.append(video)
    if not options.quiet:
        from specc_runtime.progress.bar import progress

        companions.append(progress(clock, lambda: video.busy_s if video else 0.0))


def _write(report: Report, options: Options) -> int:
    """Write the report; returns an exit code if that fails, else 0."""
    if options.report is None:
        return FULFILLED
    try:
        write(report, options.report)
    except (Exception, Abandoned) as error:  # noqa: BLE001  # what a judge says may be anything
        why = error.strerror if isinstance(error, OSError) else error_text(error)
        say(f"error: cannot write {options.report}: {why}")
        return WRONG_USAGE
    return FULFILLED
