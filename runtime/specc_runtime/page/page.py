"""The page of a run, and of those that it starts again: commands, and what there is to see."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

from specc_runtime.changes import PAGE
from specc_runtime.page.breakpoints import Parts, Unclear, breakpoints, machine_of, text_of
from specc_runtime.page.control import Control
from specc_runtime.page.link import Link

if TYPE_CHECKING:
    from specc_runtime.clock import WallClock
    from specc_runtime.forms import Layout
    from specc_runtime.options import Options
    from specc_runtime.page.feed import Feed, Run
    from specc_runtime.panel import Panel
    from specc_runtime.recording.snapshots import Reach
    from specc_runtime.system import System

_SPEEDS = 1e-3, 1e3
_MOST_SET, _LONGEST = 1000, 10_000
_IN_REAL_TIME = "a run in real time follows the clock: it has no"


@dataclass(frozen=True, slots=True)
class Restart:
    """A run from a simulated time of the present one on, or from its beginning, with constants."""

    from_s: float | None
    set: Mapping[str, str]


class Page:
    """What a server shows, and what it may ask. Commands are obeyed in the thread of the link."""

    def __init__(self, descriptor: int, speed: float | None = 1.0) -> None:
        """`descriptor` is a socket whose other end the server has."""
        self.restart: Restart | None = None
        """The run that is asked for instead of the present one."""
        self.is_interrupted = False
        """Whether a signal has ended the last run, whatever was asked for."""
        self.begun = 0
        """How many runs there were."""
        self.reaches: dict[Path, Reach] = {}
        """From where on runs can start again, by the files that they write."""
        self.objection: Callable[[Restart], str] = lambda restart: ""
        """Why there cannot be such a run; asked before the present one is to end."""
        self._is_starting = False
        """Whether a run was asked for that has not begun yet."""
        self.control = Control(speed)
        self._is_quitting = False
        self._wanted = Event()
        """Set once there is no need to wait for commands."""
        self._end_run: Callable[[], None] = lambda: None
        self._feed: Feed | None = None
        self._run: Run | None = None
        self._system: System | None = None
        self._parts = Parts({}, {}, ())
        self._breakpoints: list[Any] = []
        self._watched: dict[str, Any] = {"clients": 0}
        self._real_time = False
        self._link = Link(descriptor, self._obey, self._hang_up)

    # The run.

    def feed(
        self,
        options: Options,
        system: System,
        layouts: Mapping[str, Layout],
        plant: Any,
        clock: WallClock,
        end_run: Callable[[], None],
    ) -> Feed:
        """What shows a run that is about to begin; `end_run` asks it to end."""
        from specc_runtime.page.feed import Feed

        self.restart, self._real_time, self._end_run = None, options.real_time, end_run
        self._wanted.clear()
        self.control.hurries_until_s = options.resume[1] if options.resume else 0.0
        self._system = system
        subsystems = {s.subsystem.name: s.subsystem for s in system.subsystems}
        requirements = system.requirements.requirements if system.requirements else ()
        self._parts = Parts(subsystems, layouts, requirements)
        self._feed = Feed(self._link, self.control, options, system, layouts, plant, clock)
        self._feed.watch(self._watched)
        if not options.real_time:
            self._break({"breakpoints": self._breakpoints})
        return self._feed

    def begin(self, run: Run) -> None:
        """The run is about to begin, or to go on."""
        if self._feed is not None:
            self._feed.begin(run)
            self._run = run
            self.begun += 1
            self._is_starting = False

    def end(self, report: Mapping[str, Any], exit_code: int) -> None:
        """The run is over."""
        feed, self._feed = self._feed, None
        if feed is not None and self._run is not None:
            feed.end(report, exit_code)
        self._run = None

    def refuse(self, text: str) -> None:
        """Say why the run that was asked for does not begin."""
        self._is_starting = False
        self._tell("refused", text)

    def tell_start(self, text: str) -> None:
        """Say how far the run is that has not begun yet."""
        self._tell("starting", text)

    def _tell(self, kind: str, text: str) -> None:
        from specc_runtime.recording.text import dumped

        self._link.post(lambda: dumped({"kind": kind, "text": text}))

    def wait(self) -> Restart | None:
        """Stay after the end of a run, until another one is asked for; None if none is."""
        if self._is_starting and self.restart is None:
            self.refuse("The run cannot be started again; the terminal says why")
        while not (self._link.is_over or self._is_quitting or self._wanted.wait(0.2)):
            pass
        restart, self.restart = self.restart, None
        self._wanted.clear()
        self.control.go_on()
        if restart is not None:
            self.tell_start("starting again")
        return restart

    def close(self) -> None:
        """Send what waits, but not for long, and hang up."""
        self._link.close()

    def _hang_up(self) -> None:
        """The server has gone."""
        self.control.leave()
        self._wanted.set()

    # Commands.

    def _obey(self, command: Any) -> None:
        try:
            if not isinstance(command, dict):
                raise Unclear("a command is an object in JSON")
            do = text_of(command, "do")
            if do not in _COMMANDS:
                raise Unclear(f"there is no command {do}")
            _COMMANDS[do](self, command)
        except ValueError as error:
            self._tell("refused", str(error))
        except Exception as error:  # noqa: BLE001  # no command ends the thread that obeys them
            self._tell("refused", f"not understood: {type(error).__name__}: {error}")

    def _pause(self, command: Any) -> None:
        self._refuse_in_real_time("pause")
        self._refuse_after_the_end()
        self.control.pause()

    def _continue(self, command: Any) -> None:
        self._refuse_after_the_end()
        self.control.go_on()

    def _step(self, command: Any) -> None:
        self._refuse_in_real_time("steps")
        self._refuse_after_the_end()
        self.control.go_on(machine_of(command, self._parts.subsystems))

    def _speed(self, command: Any) -> None:
        self._refuse_in_real_time("other speed")
        value = command.get("value")
        if value is not None:
            least, greatest = _SPEEDS
            if not least <= (value := _number(command)) <= greatest:
                raise Unclear(f"a speed is from {least:g} to {greatest:g}, or null")
        self.control.set_speed(value)

    def _break(self, command: Any) -> None:
        listed = command.get("breakpoints")
        if listed:
            self._refuse_in_real_time("breakpoints")
        found, refused = breakpoints(listed, self._parts)
        self._breakpoints = listed
        if self._system is None:
            return  # they are looked up once there is a run
        self.control.set_breakpoints(found)
        for text in refused:
            self._tell("refused", text)

    def _set(self, command: Any) -> None:
        name = text_of(command, "name")
        if self._run is not None and name in self._run.live:
            self._run.set_constant(name, _number(command), PAGE)
            return
        text = text_of(command, "value")
        self._restart({"from_s": self._run.time_s if self._run else None, "set": {name: text}})

    def _panel(self, command: Any) -> None:
        self._panel_of_run().operate(text_of(command, "name"), command.get("value"), PAGE)

    def _hold(self, command: Any) -> None:
        self._panel_of_run().hold(text_of(command, "name"), _number(command, "wall_s"))

    def _release(self, command: Any) -> None:
        self._panel_of_run().release(text_of(command, "name"))

    def _panel_of_run(self) -> Panel:
        if self._run is None:
            raise Unclear("there is no run whose panel could be operated")
        return self._run.panel

    def _watch(self, command: Any) -> None:
        self._watched = command
        if self._feed is not None:
            self._feed.watch(command)

    def _restart(self, command: Any) -> None:
        self._refuse_in_real_time("restart")
        from_s, constants = command.get("from_s"), command.get("set", {})
        if from_s is not None:
            from_s = _number(command, "from_s")
            if from_s < 0.0:
                raise Unclear("from_s is before the beginning")
        if not isinstance(constants, dict) or len(constants) > _MOST_SET:
            raise Unclear(f"set has names and texts, {_MOST_SET} at most")
        for name, text in constants.items():
            if not isinstance(text, str) or len(text) + len(name) > _LONGEST:
                raise Unclear("set has names and texts")
        if self._is_starting:
            raise Unclear("a run is starting again; ask again once it has begun")
        restart = Restart(from_s, constants)
        if objection := self.objection(restart):
            raise Unclear(objection)
        self.restart = restart
        self._is_starting = True
        self._leave()

    def _quit(self, command: Any) -> None:
        self._is_quitting = True
        self._leave()

    def _leave(self) -> None:
        self._wanted.set()
        self._end_run()
        self.control.go_on()

    def _refuse_after_the_end(self) -> None:
        if self.begun and self._run is None:
            raise Unclear("the run is over")

    def _refuse_in_real_time(self, what: str) -> None:
        if self._real_time:
            raise Unclear(f"{_IN_REAL_TIME} {what}")


_COMMANDS: Mapping[str, Callable[[Page, Any], None]] = {
    "pause": Page._pause,
    "continue": Page._continue,
    "step": Page._step,
    "speed": Page._speed,
    "break": Page._break,
    "set": Page._set,
    "panel": Page._panel,
    "hold": Page._hold,
    "release": Page._release,
    "watch": Page._watch,
    "restart": Page._restart,
    "quit": Page._quit,
}


def _number(command: Any, name: str = "value") -> Any:
    number = command.get(name)
    if type(number) not in (int, float) or not math.isfinite(number):
        raise Unclear(f"{name} is missing, or no number")
    return number
