"""Pictures of a run that somebody asks for: of cameras of the plant, and images among inputs.

They change nothing of the run. A plant that draws in a thread of its own (`Photographed`) does not
wait for them either; any other (`Pictured`) draws between two ticks.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

from specc_runtime.clock import WallClock
from specc_runtime.examination import shortcomings
from specc_runtime.faults import error_text
from specc_runtime.forms import Layout
from specc_runtime.plant import Filmable, Photographed, Pictured
from specc_runtime.recording.pictures import shown
from specc_runtime.recording.steps import topic_of
from specc_runtime.sampling import PLANT
from specc_runtime.workers import Workers

PERIOD_S = 0.2
"""Least wall time between two pictures of a camera."""
SIZE_PX = 640, 480
_QUALITY = 80


class Picture(NamedTuple):
    """What a camera saw at a simulated time, as the file of a JPEG or PNG."""

    camera: str
    time_s: float
    data: bytes


@dataclass(slots=True)
class _Demand:
    """What is asked of a camera: its last picture, and the one that is being made."""

    asked_at_s: float = float("-inf")
    asked_s: float | None = None
    """Wall and simulated time of the last picture."""
    coming: Future[bytes] | None = None
    image: tuple[float, Any] | None = None
    """The newest image of an element, and when it was seen."""


class Pictures:
    """The cameras of a plant, and the inputs that are images: `irp.k.x.R.I_rgb`."""

    def __init__(
        self,
        plant: Any,
        layouts: Mapping[str, Layout],
        clock: WallClock,
        failed: Callable[[str], None] = lambda text: None,
    ) -> None:
        """`failed` gets the reason why a camera gives no picture; it is not asked again."""
        self._plant, self._clock, self._failed = plant, clock, failed
        self._is_apart = not shortcomings(plant, Photographed)
        self._drawn = _cameras(plant)
        self._demands = {name: _Demand() for name in (*self._drawn, *_images(layouts))}
        self._wanted: Collection[str] = ()
        self._workers: Workers | None = None

    @property
    def cameras(self) -> tuple[str, ...]:
        """All names that may be wanted."""
        return tuple(self._demands)

    def wanted(self, cameras: Collection[str]) -> None:
        """Make pictures of these cameras from now on, and of no others; any thread may ask."""
        self._wanted = frozenset(cameras) & self._demands.keys()

    def see(self, topic: str, time_s: float, image: Any) -> None:
        """Note the newest image of an element, by its topic in recordings; any thread may tell."""
        demand = self._demands.get(_name(topic))
        if demand is not None:
            demand.image = time_s, image

    def take(self, time_s: float) -> list[Picture]:
        """The pictures that are ready; has those made that are due. Called between two ticks."""
        found = []
        for camera in sorted(self._wanted & self._demands.keys()):
            demand = self._demands[camera]
            coming, asked_s = demand.coming, demand.asked_s
            if coming is not None and coming.done() and asked_s is not None:
                demand.coming = None
                try:
                    found.append(Picture(camera, asked_s, coming.result()))
                except Exception as error:  # noqa: BLE001  # whatever the plant raises
                    self._give_up(camera, error)
                    continue
            if demand.coming is None and self._clock.now_s() - demand.asked_at_s >= PERIOD_S:
                try:
                    self._ask(camera, demand, time_s)
                except Exception as error:  # noqa: BLE001  # whatever the plant raises
                    self._give_up(camera, error)
        return found

    def close(self) -> None:
        """No pictures any more; what is being drawn is not waited for."""
        self._wanted = ()
        if self._workers is not None:
            self._workers.close()
            self._workers = None

    def _ask(self, camera: str, demand: _Demand, time_s: float) -> None:
        """Have the picture of now made, unless it is the last one."""
        image = None
        if camera not in self._drawn:
            if demand.image is None:
                return
            time_s, image = demand.image
        if demand.asked_s == time_s:
            return
        drawn = self._begun(camera) if image is None else lambda: image
        if self._workers is None:
            self._workers = Workers(1, "specc-pictures")
        demand.asked_at_s, demand.asked_s = self._clock.now_s(), time_s
        demand.coming = self._workers.submit(lambda: shown(drawn(), _QUALITY))

    def _begun(self, camera: str) -> Callable[[], Any]:
        """What gives the picture of now, at once or later."""
        if self._is_apart:
            return cast(Photographed, self._plant).picture_of_now(camera, *SIZE_PX).result
        picture = cast(Pictured, self._plant).picture(camera, *SIZE_PX)
        return lambda: picture

    def _give_up(self, camera: str, error: Exception) -> None:
        del self._demands[camera]
        self._failed(f"there are no pictures of {camera} any more: {error_text(error)}")


def _cameras(plant: Any) -> tuple[str, ...]:
    """The names of the cameras of a plant that can be filmed."""
    if plant is None or shortcomings(plant, Pictured) or shortcomings(plant, Filmable):
        return ()
    return tuple(viewpoint.camera for viewpoint in cast(Filmable, plant).viewpoints())


def _images(layouts: Mapping[str, Layout]) -> Iterator[str]:
    """The names of all inputs that have images."""
    for name, layout in layouts.items():
        for element in layout.x if name != PLANT else ():
            if element.form.has_image:
                yield _name("/".join((topic_of(name), "x", *element.name)))


def _name(topic: str) -> str:
    """The name of an element with a topic."""
    return topic[1:].replace("/", ".")
