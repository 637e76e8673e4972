"""Receptors for the sensors and cameras of a model."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass

from specc.analysis.plant import FRAME_ORIENTATION, FRAME_POSITION, units_of_sensor
from specc.mjcf import Model
from specc.mjcf.model import ModelObject
from specc.model.units import Unit
from specc.reachable import grouped
from specc.tools.starting.facts import BRACED, ModelFacts, Sensor

DEFAULT_CAMERA = (640, 480)


@dataclass(frozen=True, slots=True)
class ReceptorElement:
    """What a receptor reports: its type, what it is bound to, and its wish for a name.

    A pose has `frames`, parent and child, in the place of a type: parts of the model, the world
    being None. `remarks` are told beside the binding.
    """

    wish: str
    type: str
    bind: Mapping[str, str | list[str]]
    frames: tuple[ModelObject | None, ModelObject | None] | None = None
    remarks: str = ""


@dataclass(frozen=True, slots=True)
class Receptor:
    """A real receptor and the virtual one that passes on what it reports."""

    wish: str
    title: str
    elements: tuple[ReceptorElement, ...]
    camera: bool = False


def receptors(
    facts: ModelFacts, model: Model, taken: Collection[str] = ()
) -> tuple[list[Receptor], dict[str, str]]:
    """Receptors, and name -> why not of all sensors that have none; not of those `taken`."""
    refused: dict[str, str] = {}
    own = (each for each in facts.sensors if each.name not in taken)
    usable = [each for each in own if _is_usable(each, model, refused)]
    found = [*_of_sensors(usable, model), *_of_cameras(facts, model, taken)]
    return found, refused


def _is_usable(sensor: Sensor, model: Model, refused: dict[str, str]) -> bool:
    name = sensor.name or "a sensor"
    part = model.parts.get(("sensor", sensor.name))
    why = ""
    if not sensor.name:
        why = "it has no name"
    elif set(sensor.name) & set("{}"):
        why = BRACED
    elif part is None or model.sensors.get(sensor.name) != sensor.size:
        why = "specc does not know how many numbers it gives"
    elif part.kind == "rangefinder" and sensor.cutoff <= 0:
        why = "it has no cutoff, and so no number where its beam meets nothing"
    if why:
        refused[name] = why
    return not why


def _of_sensors(sensors: list[Sensor], model: Model) -> Iterator[Receptor]:
    """Sensors of several kinds at one object, unlike any other one, are one receptor."""
    at = grouped(((sensor.of, sensor.object), sensor) for sensor in sensors)
    kinds = {place: _kinds(own, model) for place, own in at.items()}
    often = Counter(kinds.values())
    alone = [p for p, own in kinds.items() if p[1] and len(own) > 1 and often[own] == 1]
    for place in alone:
        yield Receptor(place[1], f"Sensors at {place[1]}", tuple(_elements(at[place], model)))
    rest = [s for s in sensors if (s.of, s.object) not in alone]
    if rest:
        yield Receptor(
            "sensors", "All other sensors" if alone else "Sensors", tuple(_elements(rest, model))
        )


def _kinds(sensors: Iterable[Sensor], model: Model) -> tuple[str, ...]:
    return tuple(sorted({model.parts["sensor", each.name].kind for each in sensors}))


def _elements(sensors: list[Sensor], model: Model) -> Iterator[ReceptorElement]:
    """Poses, and one for all other sensors of a kind and unit."""
    found: dict[tuple[str, Unit | None], list[Sensor]] = {}
    poses = dict(_poses(sensors, model))
    for frames, names in poses.items():
        wish = f"X_{frames[1][1]}" if frames[1] and len(poses) > 1 else "X"
        yield ReceptorElement(wish, "", {"sensors": names}, frames)
    posed = {name for names in poses.values() for name in names}
    for sensor in (each for each in sensors if each.name not in posed):
        units = units_of_sensor(sensor.name, model)
        unit = units[0] if units and len(set(units)) == 1 else None
        found.setdefault((model.parts["sensor", sensor.name].kind, unit), []).append(sensor)
    for (kind, unit), own in found.items():
        size = sum(sensor.size for sensor in own)
        text = str(unit) if unit is not None else ""
        inner = f", {text}" if text and text != "1" else ""
        plain = f"[{inner[2:]}]" if inner else ""
        type_ = f"real{plain}" if size == 1 else f"vector[{size}{inner}]"
        names = [sensor.name for sensor in own]
        remarks = _QUATERNION if kind in ("framequat", "ballquat") else ""
        yield ReceptorElement(kind, type_, {"sensors": names}, remarks=remarks)


_QUATERNION = (
    "MuJoCo gives a quaternion as w, x, y, z; `pose` takes x, y, z, w: [q[1], q[2], q[3], q[0]]. "
    "With a sensor `framepos` of the same thing before it, `framequat` gives a pose."
)
_Frames = tuple[ModelObject | None, ModelObject | None]


def _poses(sensors: list[Sensor], model: Model) -> Iterator[tuple[_Frames, list[str]]]:
    """Reference and object of which there is a position and an orientation, with the sensors."""
    at: dict[_Frames, dict[str, str]] = {}
    for sensor in sensors:
        part = model.parts["sensor", sensor.name]
        if part.kind in (FRAME_POSITION, FRAME_ORIENTATION) and part.object:
            at.setdefault((part.reference, part.object), {}).setdefault(part.kind, sensor.name)
    for frames, of_kind in at.items():
        if len(of_kind) == 2:
            yield frames, [of_kind[FRAME_POSITION], of_kind[FRAME_ORIENTATION]]


def _of_cameras(facts: ModelFacts, model: Model, taken: Collection[str]) -> Iterator[Receptor]:
    # The simulator knows which are there, the text which are not added by the runtime.
    for name, size in model.cameras.items():
        if name in facts.cameras and name not in taken and not set(name) & set("{}"):
            width, height = size or DEFAULT_CAMERA
            bind = {"camera": name, "image": "rgb"}
            image = ReceptorElement("image", f"image[{height}, {width}, 3]", bind)
            yield Receptor(name, f"Camera {name}", (image,), camera=True)
