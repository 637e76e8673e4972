"""What goes on between the subsystems of a run while no step is under way, for snapshots."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any

from specc_runtime.plant import NO_SAMPLE
from specc_runtime.safety import Commands
from specc_runtime.sampling import Port, Sensor
from specc_runtime.snapshot import Values
from specc_runtime.subsystem import Subsystem
from specc_runtime.track import Track
from specc_runtime.wiring import SensorRate

_ROUNDING = 1e-6  # times are multiples of a rounded tick


@dataclass(frozen=True, slots=True)
class Standing:
    """Tracks, sensors and the last commands of a run."""

    tracks: Mapping[str, Track]
    sensors: Mapping[str, Sensor]
    rates: Mapping[str, SensorRate]
    commands: Commands
    tick_s: float

    def saved(self, tick: int, values: Values) -> dict[str, Any]:
        """It as plain data, at a tick; raises NotRecorded."""
        late = [track for track in self.tracks.values() if track.late]
        renewed = self.renewed(tick)
        return {
            "tick": tick,
            "stamps": self.stamps,
            "late": {t.name: values.of_sent(t.runner.subsystem, t.late) for t in late},
            "sensors": {
                name: sensor.saved(
                    partial(values.encoded, "sensor"),
                    whole=values.is_lenient or any((n, name) not in renewed for n in readers),
                )
                | {"had": [n for n, ports in self._ports if any(p.has_had(name) for p in ports)]}
                for name, sensor in self.sensors.items()
                for readers in [self.rates[name].readers]
            },
            "commands": {
                name: {"by": by, "value": values.encoded("actuator", name, value)}
                for name, (by, value) in self.commands.items()
            },
            **({"ages": ages} if (ages := self._ages()) else {}),
        }

    def _ages(self) -> dict[str, Any]:
        every = ((name, track.ageing) for name, track in self.tracks.items())
        return {name: each.saved(self.tick_s) for name, each in every if each is not None}

    def restore(self, saved: Any, values: Values) -> tuple[int, dict[str, Any]]:
        """Go on from there; gives the tick to go on with, and what devices were commanded last.

        Raises LookupError, TypeError, ValueError for other data.
        """
        sensors, commands = saved["sensors"], saved["commands"]
        values_held = {name: each["value"] for name, each in sensors.items() if "value" in each}
        samples = values.found("sensor", values_held)
        tick = math.ceil(saved["time"] / self.tick_s - _ROUNDING)
        if abs(tick * self.tick_s - saved["time"]) > _ROUNDING:
            of_time = f"there is no base tick at {saved['time']:g} s"
            values.lost.append(f"agents go on from {tick * self.tick_s:g} s: {of_time}")
        for name, track in self.tracks.items():
            known = saved["subsystems"].get(name)
            track.go_on(tick, known and known["entered"] / self.tick_s)
            track.late = values.sent(name, saved.get("late", {}).get(name, {}))
            if track.ageing is not None:
                track.ageing.restore(saved.get("ages", {}).get(name, {}))
        for name, sensor in self.sensors.items():
            if name in sensors:
                sensor.restore(sensors[name], samples.get(name, NO_SAMPLE))
        for reader, ports in self._ports:
            for port in ports:
                port.restore(reader in sensors.get(port.sensor, {}).get("had", ()))
        sent = values.found("actuator", {name: each["value"] for name, each in commands.items()})
        self.commands.update({n: (str(commands[n]["by"]), value) for n, value in sent.items()})
        return tick, sent

    @property
    def _ports(self) -> list[tuple[str, tuple[Port, ...]]]:
        """Of every subsystem."""
        return [(name, track.ports) for name, track in self.tracks.items()]

    def inboxes(self) -> Iterator[tuple[Subsystem, Any, float]]:
        """All subsystems, each with the inputs of its next step and when it entered its state."""
        for track in self.tracks.values():
            entered_s = track.entered * track.ticks * self.tick_s
            yield track.runner.subsystem, track.runner.inbox, entered_s

    @property
    def stamps(self) -> dict[str, int]:
        """Of the last step of each subsystem."""
        return {name: track.stamp for name, track in self.tracks.items()}

    def renewed(self, tick: int) -> frozenset[tuple[str, str]]:
        """Subsystems, each with a sensor of which it gets a new sample before its next step."""
        return frozenset(
            (name, sensor)
            for sensor, rate in self.rates.items()
            for name in rate.readers
            if self.sensors[sensor].is_renewed
            and rate.last_before(self.tracks[name].next_tick(tick)) >= tick
        )
