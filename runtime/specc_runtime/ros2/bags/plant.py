"""The plant of a bag: devices report what the bag has of their topics, commands go nowhere.

The time of the run is that of the bag: it begins when a run behind ROS 2 would, and ends with it.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from specc_runtime.changes import PARAMETER, TASK, Event
from specc_runtime.faults import error_text
from specc_runtime.options import UsageError
from specc_runtime.plant import NO_SAMPLE, Sample
from specc_runtime.plants.errors import PlantError
from specc_runtime.printing import say, visible
from specc_runtime.records import StepRecord
from specc_runtime.ros2.bags.names import TopicNames
from specc_runtime.ros2.bags.readings import Readings
from specc_runtime.ros2.bags.types import NoMessage
from specc_runtime.ros2.goals import goals_of
from specc_runtime.ros2.plant import conversions
from specc_runtime.ros2.run import Ros2Run
from specc_runtime.system import System

_UNREADABLE = KeyError, TypeError, ValueError, IndexError, AttributeError, NoMessage
"""What is raised on the way from data that a stranger made to a value."""


class BagPlant:
    """Implements `Plant` by the messages of a bag. `is_over` after its last one."""

    def __init__(self, system: System, file: Path, ros_args: Sequence[str] = ()) -> None:
        """Reads the bag until the run begins.

        Raises UsageError for a bag that cannot be read, or that lacks a topic.
        """
        spec = system.plant
        if spec is None or spec.ros2 is None:
            raise UsageError("--bag: the plant is not behind ROS 2, so it reads no topics")
        if not {"-p", "--param", "--params-file"}.isdisjoint(ros_args):
            raise UsageError(
                "--ros-args: a bag has no parameters: --set gives constants their values"
            )
        self.is_over = False
        self.step_observers = (_States(system).observe,)
        self._decode, self._encode = conversions(spec)
        self._goals = goals_of(spec.ros2.topics)
        names = TopicNames(spec.ros2.node, ros_args)
        self._readings = Readings(
            spec, names, file, {each.subsystem.name for each in system.subsystems}
        )
        self.other_commanders: dict[str, dict[str, Any]] = {}
        self._run: Ros2Run | None = None
        self._time_s = 0.0
        self._has_ended = False

    def join(self, run: Ros2Run) -> None:
        """Change the constants of the run, and operate its panel, as the bag says."""
        self._run = run
        self._repeat_changes()

    def changed(self, change: Event) -> None:
        """Nothing: the bag stays as it is."""

    def _repeat_changes(self) -> None:
        """Have the run change at its next tick; what its task does, it does again by itself."""
        if (run := self._run) is None:
            return
        changes, self._readings.changes = self._readings.changes, []
        for change in changes:
            constant, element = change.get("constant"), change.get("element")
            value: Any = change.get("value")
            try:
                if change.get("by") == TASK:
                    continue
                if isinstance(constant, str):
                    run.set_constant(constant, value, PARAMETER)
                elif isinstance(element, str):
                    run.operate(element, value)
            except ValueError as error:
                say(f"--bag: a change that is not made: {visible(str(error))}")

    def reset(self, seed: int) -> None:
        """Nothing: the bag is as it is."""

    def sample(self, name: str) -> Any:
        """See `Plant`: the newest message until now, converted as that of a node."""
        goals = self._goals.get(name)
        return self._new(name) if goals is None else goals.sample(name, self._new)

    def _new(self, name: str) -> Any:
        news = self._readings.news(name)
        if news is None:
            return NO_SAMPLE
        try:
            value = self._decode[name](news.make())
        except _UNREADABLE as error:
            raise PlantError(f"a message that cannot be read: {error_text(error)}") from error
        return Sample(value, self._readings.begin_s + self._time_s - news.measured_s)

    def actuate(self, name: str, value: Any) -> None:
        """Compare a command with those in the bag; nobody gets it."""
        if name in self._goals:
            self._goals[name].take(value)
        else:
            self._readings.commands.now(name, self._encode[name](value), self._time_s)

    def advance(self, duration_s: float) -> None:
        """See `Plant`; raises PlantError for a bag that cannot be read any further."""
        self.is_over = self._has_ended
        self._time_s += duration_s
        self._has_ended = self._readings.until(self._readings.begin_s + self._time_s)
        self._repeat_changes()

    def close(self) -> None:
        """Say what the bag had besides."""
        for difference in self._readings.differences():
            print(visible(difference), flush=True)
        for loss in self._readings.losses():
            say(f"--bag: {loss}")


class _States:
    """Prints each change of a state, with its time and the row that was taken."""

    def __init__(self, system: System) -> None:
        self._tables = {s.subsystem.name: s.subsystem.transitions for s in system.subsystems}
        self._last: dict[str, str] = {}

    def observe(self, record: StepRecord) -> None:
        """See `specc_runtime.records.Observer`."""
        name = record.subsystem
        before = self._last.get(name)
        self._last[name] = record.state
        if before != record.state:
            row = str(self._tables[name][record.transition]) if record.transition >= 0 else ""
            print(visible(f"{record.time_s:.3f} s {name}: {row or record.state}"), flush=True)
