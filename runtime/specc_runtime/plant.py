"""What the executor asks of a plant, and what a plant may give: a value, none, or one later.

Implementations live in `specc_runtime.plants`.
"""

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from enum import Enum
from threading import Condition, Lock, Thread
from typing import Any, Final, NamedTuple, Protocol

from specc_runtime.plants.errors import PlantError


class NoSample(Enum):
    """The type of `NO_SAMPLE` and `LOST`."""

    NO_SAMPLE = "no sample"
    LOST = "lost"


NO_SAMPLE: Final = NoSample.NO_SAMPLE
"""What a plant gives for an element that is bound as sporadic and has no new value."""
LOST: Final = NoSample.LOST
"""What it may give for one that is bound with `on_loss` if it knows that the device is lost."""


class Sample(NamedTuple):
    """A value that was measured `age_s` seconds before the call of `sample` that returns it.

    So a plant needs no clock but its own, simulated or not. A negative age counts as 0. The value
    may be a `Deferred`.
    """

    value: Any
    age_s: float

    def measured_s(self, now_s: float) -> float:
        """When it was measured, on any clock; raises PlantError for an age that is no time."""
        try:
            age_s = float(self.age_s)
        except (TypeError, ValueError, OverflowError):
            age_s = math.nan
        if not math.isfinite(age_s):
            text = reprlib.repr(self.age_s)
            raise PlantError(f"the sample has the age {text}, which is no time in s")
        return now_s - max(age_s, 0.0)


class Deferred:
    """A sample taken now whose value is computed later, by whoever asks for it first.

    What it is computed from has to be a copy, since the plant goes on meanwhile, and noise has to
    come from a stream of the sample's own, since other samples may be computed before or never.
    """

    __slots__ = ("_begin", "_compute", "_error", "_lock", "_value", "reference")

    def __init__(
        self,
        compute: Callable[[], Any],
        begin: Callable[[], None] = lambda: None,
        reference: Any = None,
    ) -> None:
        """`begin` and then `compute` are called once, or never if nobody asks.

        Before a step computes its samples it begins all of them, so that what `begin` starts in
        other threads goes on at the same time. With a `reference`, of the device host, another
        process finds the value by itself.
        """
        self.reference = reference
        self._begin: Callable[[], None] | None = begin
        self._compute: Callable[[], Any] | None = compute
        self._error: BaseException | None = None
        self._value: Any = None
        self._lock = Lock()

    def begin(self) -> None:
        """Start what takes time; never raises."""
        with self._lock:
            if self._begin is not None:
                begin, self._begin = self._begin, None
                self._noted(begin)

    def value(self) -> Any:
        """The value; raises what was raised on the way to it, every time."""
        self.begin()
        with self._lock:
            if self._compute is not None and self._error is None:
                self._value = self._noted(self._compute)
            self._compute = None
        if self._error is not None:
            raise self._error
        return self._value

    def _noted(self, call: Callable[[], Any]) -> Any:
        try:
            return call()
        except BaseException as error:  # noqa: BLE001  # it is raised to all who ask for the value
            self._error = error

    def __repr__(self) -> str:
        return "<a sample that is computed when it is read>"


class Latest:
    """The newest value of `read`, a function that blocks until a device has one.

    A thread calls it again and again; values that nobody took in time are lost. The thread is a
    daemon: a `read` that never returns does not keep the process alive.
    """

    def __init__(self, read: Callable[[], Any]) -> None:
        """Starts the thread."""
        self._read = read
        self._value: Any = NO_SAMPLE
        self._error: BaseException | None = None
        self._closed = False
        self._changed = Condition()
        self._thread = Thread(target=self._run, name="specc-device", daemon=True)
        self._thread.start()

    def wait(self, timeout_s: float) -> None:
        """Wait until there is a value to take; raises PlantError if none comes in time."""
        with self._changed:
            self._changed.wait_for(self._is_there, timeout_s)
            if not self._is_there():
                raise PlantError(f"no value came within {timeout_s:g} s")

    def take(self) -> Any:
        """The newest value, once; `NO_SAMPLE` if none has come since. Raises what `read` raised."""
        with self._changed:
            if self._error is not None:
                raise self._error
            value, self._value = self._value, NO_SAMPLE
            return value

    def close(self, timeout_s: float = 1.0) -> None:
        """Ask the thread to end and wait for it, but not for long."""
        self._closed = True
        self._thread.join(timeout_s)

    def _is_there(self) -> bool:
        return self._value is not NO_SAMPLE or self._error is not None

    def _run(self) -> None:
        while not self._closed:
            try:
                value, error = self._read(), None
            except BaseException as raised:  # noqa: BLE001  # it is raised again by `take`
                value, error = NO_SAMPLE, raised
            with self._changed:
                self._value, self._error = value, error
                self._changed.notify_all()
            if error is not None:
                return


class Plant(Protocol):
    """The real effectors and receptors, simulated or not.

    Names are those of elements, `agent.E.device.element` and `agent.R.device.element`; values are
    of their declared types. A plant that cannot go on raises `PlantError`, which ends the run.
    """

    def reset(self, seed: int) -> None:
        """Back to the initial state; the seed decides all noise from here on."""

    def sample(self, name: str) -> Any:
        """The value of an element that a device reports, now; `NO_SAMPLE` if none is new.

        Called once at each time stamp of its readers, or at its rate. What was measured earlier
        comes as a `Sample`. What takes long to compute may come as a `Deferred`, which each reader
        asks for its value at the begin of its step.
        """

    def actuate(self, name: str, value: Any) -> None:
        """What a device is commanded, from now on."""

    def advance(self, duration_s: float) -> None:
        """Let time pass: one base tick of the system."""

    def close(self) -> None:
        """Give up what the plant holds; called once, however the run ended."""


class Guarded(Protocol):
    """What a plant has in addition that gives devices their safe outputs if the agent cannot.

    It is told ahead of time what they are: its last will.
    """

    def inherit(self, will: Callable[[], None]) -> None:
        """`will` hands over what has changed: it is to be called now and after every tick."""

    def bequeath(self, device: str, will: Mapping[str, Sequence[tuple[str, Any]]]) -> None:
        """What each element of a device is to get, by its name: the first value that it takes.

        The text before a value is how the report of a run calls it.
        """

    def leave(self) -> None:
        """The run is over: from now on the agent gives safe outputs itself."""


class Pictured(Protocol):
    """What a plant that can be filmed has in addition."""

    def picture(self, camera: str, width: int, height: int) -> Any:
        """What a camera for people sees now: an array (height, width, 3) of uint8, RGB."""


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """A camera: its pose in a body, x, y, z in m and the quaternion w, x, y, z; it sees along its
    -z, with y upwards. `fovy` is the vertical angle of view in rad.
    """

    camera: str
    body: str
    pose: tuple[float, ...]
    fovy: float


class Filmable(Protocol):
    """What a plant that names its cameras has in addition."""

    def viewpoints(self) -> Sequence[Viewpoint]:
        """The cameras, and where they are; the body `world` is none of `Posed`."""


class Photographed(Protocol):
    """What a plant that draws pictures in a thread of its own has in addition."""

    def picture_of_now(self, camera: str, width: int, height: int) -> Future[Any]:
        """What `picture` gives, once it is drawn; the plant may go on meanwhile."""


class Grouped(Protocol):
    """What a plant has in addition whose geoms are in groups, some of which may be hidden."""

    def show_geom_groups(self, groups: Sequence[int]) -> None:
        """Show geoms of these groups, 0 to 5, and no others in pictures from now on."""


@dataclass(frozen=True, slots=True)
class Shape:
    """A part of a body: a `cube`, `sphere` or `cylinder` with the lengths of its edges in m.

    `pose` is x, y, z in m and the quaternion w, x, y, z in the body; `colour` is RGBA from 0 to 1.
    """

    body: str
    kind: str
    size: tuple[float, float, float]
    pose: tuple[float, ...]
    colour: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Mesh:
    """A part of a body that is made of triangles.

    `corners` (n, 3) are in m, `triangles` (m, 3) have the numbers of three of them; `body`, `pose`
    and `colour` are as those of a `Shape`. What has a texture has `texels` (h, w, 3) of bytes and
    `uv` (n, 2), where the corners are on it: from 0 to 1, from its first row and column.
    """

    body: str
    pose: tuple[float, ...]
    colour: tuple[float, ...]
    corners: Any
    triangles: Any
    uv: Any = None
    texels: Any = None


class Posed(Protocol):
    """What a plant whose bodies are recorded has in addition."""

    def body_names(self) -> Sequence[str]:
        """Names of n bodies."""

    def body_poses(self) -> Any:
        """(n, 7) where the bodies are in the world: x, y, z in m, quaternion w, x, y, z."""

    def shapes(self) -> Sequence[Shape | Mesh]:
        """What the bodies look like."""


class Viewable(Protocol):
    """What a plant that can be watched in a window has in addition."""

    def open_viewer(self) -> Any:
        """A window with `sync()`, `is_open` and `close()`."""
