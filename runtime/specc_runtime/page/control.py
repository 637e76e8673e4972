"""How fast a run goes on, and where it stops: what its page asks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from threading import Condition

from specc_runtime.clock import EndingClock, WallClock
from specc_runtime.page.breakpoints import RequirementBreak, StepBreak
from specc_runtime.records import StepRecord
from specc_runtime.timing import Timing

_LOOK_S = 0.05
"""How soon a run that is paused notices that it is over."""


class Control:
    """What was asked for; any thread may ask. Call it with each record."""

    def __init__(self, speed: float | None = 1.0) -> None:
        self.speed = speed
        """Simulated seconds in one of the clock, at most; None if it is as fast as it goes."""
        self.hurries_until_s = 0.0
        """Simulated time until which it goes on as fast as it goes."""
        self.is_paused = False
        self.beats = 0
        """A number that changes while a run is paused."""
        self.version = 0
        """A number that changes whenever something else is asked for."""
        self.on_stop: Callable[[str], None] = lambda why: None
        self._steps: dict[str, list[StepBreak]] = {}
        self._requirements: list[RequirementBreak] = []
        self._stepping = ""
        self._is_left = False
        self._changed = Condition()

    def leave(self) -> None:
        """Go on and never pause again: nobody is there who could let the run go on."""
        self._is_left = True
        self.go_on()

    def pause(self) -> None:
        """Stop before the next base tick."""
        self._set(paused=True)

    def go_on(self, step_of: str = "") -> None:
        """Go on, to the next step of a subsystem if one is named."""
        self._stepping = step_of
        self._set(paused=False)

    def set_speed(self, speed: float | None) -> None:
        """Go on at another speed."""
        self.speed = speed
        self._set(paused=self.is_paused)

    def set_breakpoints(self, breakpoints: Sequence[StepBreak | RequirementBreak]) -> None:
        """Stop there, and nowhere else."""
        steps: dict[str, list[StepBreak]] = {}
        for each in breakpoints:
            if isinstance(each, StepBreak):
                steps.setdefault(each.machine, []).append(each)
        violated = [each for each in breakpoints if isinstance(each, RequirementBreak)]
        self._requirements = [v for v in violated if v.requirement.verdict != "violated"]
        self._steps = steps

    def __call__(self, record: StepRecord) -> None:
        """Look at a committed step: perhaps the run stops there."""
        machine = record.subsystem
        for each in self._steps.get(machine, ()):
            if each.matches(record):
                self._stop(each.words)
        if machine == self._stepping:
            self._stop(f"a step of {machine}")

    def look(self) -> None:
        """Look at the requirements after a base tick."""
        for each in self._requirements:
            if each.requirement.verdict == "violated":
                self._requirements = [other for other in self._requirements if other is not each]
                self._stop(each.words)

    def wait(self) -> None:
        """Let time pass while the run is paused, until something else is asked for."""
        with self._changed:
            if self.is_paused:
                self._changed.wait(_LOOK_S)
        self.beats += 1

    def _stop(self, why: str) -> None:
        self._stepping = ""
        self._set(paused=True)
        self.on_stop(why)

    def _set(self, *, paused: bool) -> None:
        with self._changed:
            self.is_paused = paused and not self._is_left
            self.version += 1
            self._changed.notify_all()


class Steered(Timing):
    """Simulated time at the pace that is asked for meanwhile; no tick is ever skipped.

    Time that was lost is not made up for.
    """

    def __init__(
        self,
        control: Control,
        clock: Callable[[WallClock, Callable[[], bool]], WallClock],
        wall: WallClock,
        pausing: Callable[[], None],
    ) -> None:
        """`clock` makes one that ends; `pausing` is called while the run is paused."""
        self._control = control
        self._version = 0
        self._clock = clock(wall, self._is_disturbed)
        self._pausing = pausing
        self._last_s = 0.0
        self._tick_s = 0.0

    def _is_disturbed(self) -> bool:
        return self._control.version != self._version or self.is_over()

    def begin(self, tick: int, tick_s: float) -> None:
        """See `Timing`."""
        self._tick_s, self._last_s = tick_s, self._clock.now_s()

    def next(self, tick: int) -> int:
        """See `Timing`."""
        control, clock, waited = self._control, self._clock, False
        while not self.is_over():
            self._version = control.version
            if control.is_paused:
                self._pausing()
                control.wait()
                self._last_s, waited = clock.now_s(), False
                continue
            speed, now_s = control.speed, clock.now_s()
            if speed is None or tick * self._tick_s < control.hurries_until_s:
                self._last_s = now_s
                break
            due_s = self._last_s + self._tick_s / speed
            if due_s <= now_s:
                self._last_s = due_s if waited else now_s
                break
            clock.wait(due_s - now_s)
            waited = self._version == control.version
        return tick


def steered(
    control: Control,
    plant: object,
    wall: WallClock,
    is_over: Callable[[], bool],
    pausing: Callable[[], None],
) -> Timing:
    """How a run follows the clock, or that of a plant that has one, as its page asks."""
    own = getattr(plant, "clock_of_run", EndingClock)
    found = Steered(control, own, wall, pausing)
    found.is_over = is_over
    return found
