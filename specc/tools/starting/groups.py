"""Which actuators belong together, as the user says or by the model, and which sensors do."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

from specc.analysis.plant import FRAME_ORIENTATION, FRAME_POSITION, units_of_sensor
from specc.diagnostics.nearest import suggestion
from specc.mjcf import Model
from specc.mjcf.model import ModelObject
from specc.model.units import Unit
from specc.reachable import grouped
from specc.refusal import Refused
from specc.tools.starting.facts import BRACED, Actuator, ModelFacts, Sensor

GroupKind = Literal["arm", "leg", "gripper", "hand", "base", "head", "torso", "joints"]
_WORDS: tuple[tuple[GroupKind, str], ...] = (
    ("base", "wheel|mobile|diff_ring|steer"),
    ("gripper", "grip|finger|jaw|claw"),
    ("hand", "thumb|palm"),
    ("leg", "leg|hip|knee|ankle|foot|calf|thigh|toe"),
    ("head", "head|neck"),
    ("torso", "torso|waist|lift|abdomen"),
    ("arm", "arm|shoulder|elbow|wrist"),
)
_MOST_FINGERS = 4
"""Joints of what is called a gripper; more are a hand."""


class NoGroup(Refused):
    """A `--group` that the model does not have; the message says why and what to write."""

    def __init__(self, why: str) -> None:
        super().__init__(f"--group: {why}")


@dataclass(frozen=True, slots=True)
class ActuatorGroup:
    """Actuators of one virtual effector; `why` is the reason of a guess, empty if it is none."""

    kind: GroupKind
    wish: str
    actuators: tuple[Actuator, ...]
    why: str = ""


def actuator_groups(
    facts: ModelFacts,
    wanted: Mapping[str, str],
    in_use: Iterable[str] = (),
    *,
    guess: bool = True,
) -> list[ActuatorGroup]:
    """Groups of actuators but those that are `in_use`: named ones, then guessed ones.

    `wanted` are the names of groups -> texts of `--group`.

    Raises:
        NoGroup: a group names something that does not exist or belongs to another group.
    """
    free = {a.name: a for a in facts.actuators if a.name not in set(in_use)}
    known = {a.name for a in facts.actuators} | {j.name for j in facts.joints}
    groups = []
    for name, text in wanted.items():
        members: dict[Actuator, None] = {}
        for item in _items(text, known):
            for actuator in _named(item, known, facts):
                if actuator.name not in free:
                    raise NoGroup(f"{actuator.name} is in another group, or driven already")
                members[actuator] = None
        groups.append(ActuatorGroup("joints", name, tuple(members)))
        for actuator in members:
            del free[actuator.name]
    return groups + (_guessed(facts, list(free.values())) if guess else [])


def _items(text: str, known: set[str]) -> Iterator[str]:
    """The parts between commas, but for names that have some themselves."""
    parts, begin = text.split(","), 0
    most = 1 + max((name.count(",") for name in known), default=0)
    while begin < len(parts):
        ends = range(min(len(parts), begin + most), begin, -1)
        joined = ((",".join(parts[begin:end]).strip(), end) for end in ends)
        item, begin = next((j for j in joined if j[0] in known), (parts[begin].strip(), begin + 1))
        yield item


def _named(item: str, known: set[str], facts: ModelFacts) -> list[Actuator]:
    """What an item of `--group` names: an actuator or joint, or all `FIRST..LAST` of the model.

    A range of joints has the actuators of only these; a range of actuators all between them.
    """
    if item in known or ".." not in item:  # a name may have dots itself
        return [facts.actuators[place] for place in _places(item, facts)]
    dots = (match.start() for match in re.finditer(r"(?=\.\.)", item))
    ranges = [(item[:dot].strip(), item[dot + 2 :].strip()) for dot in dots]
    first, last = next((ends for ends in ranges if known.issuperset(ends)), ranges[0])
    places = [*_places(first, facts), *_places(last, facts)]
    names = [joint.name for joint in facts.joints]
    if first not in names or last not in names:
        return list(facts.actuators[min(places) : max(places) + 1])
    low, high = sorted((names.index(first), names.index(last)))
    found = [a for a in facts.actuators if all(low <= joint <= high for joint, _ in a.joints)]
    if not found:
        wider = "name the actuators themselves, which move other joints, too"
        raise NoGroup(f"no actuator moves only joints from {first} to {last}; {wider}")
    return found


def _places(name: str, facts: ModelFacts) -> list[int]:
    """The indices of the actuator of a name, or of those that move the joint of that name."""
    joints = {index for index, joint in enumerate(facts.joints) if joint.name == name}
    places = [i for i, a in enumerate(facts.actuators) if a.name == name] or [
        i for i, a in enumerate(facts.actuators) if joints & {joint for joint, _ in a.joints}
    ]
    if places:
        return places
    if name in facts.refused:
        raise NoGroup(f"{name} cannot be held: {facts.refused[name]}")
    if joints:
        raise NoGroup(f"no actuator moves joint {name}")
    known = [a.name for a in facts.actuators] + [j.name for j in facts.joints if j.name]
    close = suggestion(name, known) if len(known) < 60 else ""
    raise NoGroup(f"no actuator, and no joint with one, is called {name}; {close}".rstrip("; "))


# Guesses. A body with a driven joint hangs from the nearest one above it: these form trees. A tree
# is cut where it branches. Short branches at the end of a chain are fingers.


def _guessed(facts: ModelFacts, actuators: list[Actuator]) -> list[ActuatorGroup]:
    wheels = [a for a in actuators if any(facts.joints[j].wheel for j, _ in a.joints)]
    rest = [a for a in actuators if a not in wheels]
    why = "hinges that turn without end"
    found = [ActuatorGroup("base", "base", tuple(wheels), why)] if wheels else []
    bodies = _bodies(rest, facts)
    parents = {body: _above(body, bodies, facts) for body in bodies}
    chains = [*_chains(grouped((parents[body], body) for body in sorted(bodies)), 0)]
    for actuator in rest:  # chains that one actuator moves together are one
        touched = [chain for chain in chains if chain & _bodies([actuator], facts)]
        if len(touched) > 1:
            union = set().union(*touched)
            chains = [union if c is touched[0] else c for c in chains if c not in touched[1:]]
    for chain in chains:
        if members := tuple(a for a in rest if max(_bodies([a], facts)) in chain):
            tops = sum(parents.get(body) not in chain for body in chain)
            kind, why = _kind_of_chain(members, tops, facts)
            found.append(ActuatorGroup(kind, kind, members, why))
    return _with_distinct_names(_with_small_ones_joined(found, facts))


def _bodies(actuators: Iterable[Actuator], facts: ModelFacts) -> set[int]:
    """Those with the joints that some actuators move."""
    return {facts.joints[joint].body for each in actuators for joint, _ in each.joints}


def _chains(children: Mapping[int, list[int]], of: int) -> Iterator[set[int]]:
    """Sets of bodies that belong together, below a body of a tree."""

    def below(body: int) -> set[int]:
        return {body}.union(*map(below, children.get(body, ())))

    for first in children.get(of, ()):
        chain, last = {first}, first
        while len(children.get(last, ())) == 1:
            (last,) = children[last]
            chain.add(last)
        branches = [below(child) for child in children.get(last, ())]
        yield chain
        if branches and all(len(branch) <= _MOST_FINGERS + 1 for branch in branches):
            yield set().union(*branches)
        elif branches:
            yield from _chains(children, last)


def _above(body: int, bodies: set[int], facts: ModelFacts) -> int:
    """The nearest of some bodies above a body; 0, the world, if there is none."""
    above = facts.parents[body]
    while above and above not in bodies:
        above = facts.parents[above]
    return above


def _kind_of_chain(
    actuators: tuple[Actuator, ...], tops: int, facts: ModelFacts
) -> tuple[GroupKind, str]:
    """The kind of a chain of bodies, `tops` of which hang from others; the reason for it."""
    joints = [facts.joints[j] for j in dict.fromkeys(j for a in actuators for j, _ in a.joints)]
    text = " ".join(f"{j.name} {j.body_name}" for j in joints).lower()
    counts = {kind: len(re.findall(words, text)) for kind, words in _WORDS}
    named = max(counts, key=lambda kind: counts[kind])
    if counts[named]:
        is_hand = named == "gripper" and len(actuators) > _MOST_FINGERS
        return "hand" if is_hand else named, "by the names in the model"
    slides = all(j.kind == "slide" for j in joints)
    if slides and 2 <= len(joints) <= _MOST_FINGERS and tops > 1:
        return "gripper", "slides beside each other"
    if tops > 1:
        is_hand = len(joints) > _MOST_FINGERS
        return "hand" if is_hand else "gripper", "branches at the end of a chain"
    if len(joints) >= 3 and all(j.kind == "hinge" for j in joints):
        body = joints[0].body
        floating = {joint.body for joint in facts.joints if joint.kind == "free"}
        is_leg = not floating.isdisjoint((body, _above(body, floating, facts)))
        return "leg" if is_leg else "arm", "a chain of hinges"
    return "joints", "neighbours in the tree of bodies"


def _with_small_ones_joined(groups: list[ActuatorGroup], facts: ModelFacts) -> list[ActuatorGroup]:
    """Groups of one kind that are not worth several effectors: single joints, parts of a base."""
    found: dict[object, ActuatorGroup] = {}
    for number, group in enumerate(groups):
        key: object = number
        if group.kind in ("joints", "base"):
            key = group.kind
        elif group.kind in ("gripper", "head", "torso"):
            # The body, above all that the group moves, that hangs from the world or another group.
            key = group.kind, facts.parents[min(_bodies(group.actuators, facts))]
        same = found.get(key)
        actuators = (*same.actuators, *group.actuators) if same else group.actuators
        found[key] = replace(same or group, actuators=actuators)
    return list(found.values())


def _with_distinct_names(groups: list[ActuatorGroup]) -> list[ActuatorGroup]:
    """Groups of one kind by what is common to the names of each, left_arm and right_arm, or leg_1.

    These are the words of all names of a group that not all groups have.
    """
    counts = Counter(group.wish for group in groups)
    found = []
    for group in groups:
        own = _common_words(group)
        alike = [_common_words(each) for each in groups if each.wish == group.wish]
        shared: set[str] = set.intersection(*alike)
        distinct = own - shared - {group.wish}
        if counts[group.wish] > 1 and distinct and alike.count(own) == 1:
            words = dict.fromkeys(_words(group.actuators[0].name))
            ordered = [word for word in words if word in distinct]
            letters = [word for word in ordered if not word.isdigit()][:2]
            parts = (*letters, group.wish) if letters else (group.wish, *ordered[:1])
            group = replace(group, wish="_".join(parts))
        found.append(group)
    return found


def _common_words(group: ActuatorGroup) -> set[str]:
    return set.intersection(*(set(_words(a.name)) for a in group.actuators))


def _words(name: str) -> list[str]:
    return re.findall(r"[a-z]+|\d+", name.lower())


# Receptors for the sensors and cameras of a model.


DEFAULT_CAMERA = (640, 480)
_QUATERNION = (
    "MuJoCo gives a quaternion as w, x, y, z; `pose` takes x, y, z, w: [q[1], q[2], q[3], q[0]]. "
    "With a sensor `framepos` of the same thing before it, `framequat` gives a pose."
)
_Frames = tuple[ModelObject | None, ModelObject | None]
"""Parent and child of a pose: parts of the model, the world being None."""


@dataclass(frozen=True, slots=True)
class ReceptorElement:
    """What a receptor reports: its type, what it is bound to, and its wish for a name.

    A pose has `frames` in the place of a type; `remarks` stand beside the binding.
    """

    wish: str
    type: str
    bind: Mapping[str, str | list[str]]
    frames: _Frames | None = None
    remarks: str = ""


@dataclass(frozen=True, slots=True)
class Receptor:
    """A real receptor and the virtual one that passes on what it reports."""

    wish: str
    title: str
    elements: tuple[ReceptorElement, ...]
    camera: bool = False


def receptors(
    facts: ModelFacts, model: Model, in_use: Collection[str] = ()
) -> tuple[list[Receptor], dict[str, str]]:
    """Receptors, and name -> why not of all sensors that have none; not of those `in_use`."""
    refused: dict[str, str] = {}
    usable = []
    for sensor in facts.sensors:
        if sensor.name in in_use:
            continue
        if why := _why_unusable(sensor, model):
            refused[sensor.name or "a sensor"] = why
        else:
            usable.append(sensor)
    found = [*_of_sensors(usable, model)]
    # The simulator knows which are there, the text which are not added by the runtime.
    for name, size in model.cameras.items():
        if name in facts.cameras and name not in in_use and not set(name) & set("{}"):
            width, height = size or DEFAULT_CAMERA
            bind: dict[str, str | list[str]] = {"camera": name, "image": "rgb"}
            image = ReceptorElement("image", f"image[{height}, {width}, 3]", bind)
            found.append(Receptor(name, f"Camera {name}", (image,), camera=True))
    return found, refused


def _why_unusable(sensor: Sensor, model: Model) -> str:
    part = model.parts.get(("sensor", sensor.name))
    if not sensor.name:
        return "it has no name"
    if set(sensor.name) & set("{}"):
        return BRACED
    if part is None or model.sensors.get(sensor.name) != sensor.size:
        return "specc does not know how many numbers it gives"
    if part.kind == "rangefinder" and sensor.cutoff <= 0:
        return "it has no cutoff, and so no number where its beam meets nothing"
    return ""


def _of_sensors(sensors: list[Sensor], model: Model) -> Iterator[Receptor]:
    """Sensors of several kinds at one object, unlike any other one, are one receptor."""
    at = grouped(((sensor.of, sensor.object), sensor) for sensor in sensors)
    kinds = {
        place: tuple(sorted({model.parts["sensor", each.name].kind for each in members}))
        for place, members in at.items()
    }
    often = Counter(kinds.values())
    single = [p for p, own in kinds.items() if p[1] and len(own) > 1 and often[own] == 1]
    for place in single:
        yield Receptor(place[1], f"Sensors at {place[1]}", tuple(_elements(at[place], model)))
    rest = [s for s in sensors if (s.of, s.object) not in single]
    if rest:
        title = "All other sensors" if single else "Sensors"
        yield Receptor("sensors", title, tuple(_elements(rest, model)))


def _elements(sensors: list[Sensor], model: Model) -> Iterator[ReceptorElement]:
    """Poses, and one for all other sensors of a kind and unit."""
    poses = dict(_poses(sensors, model))
    for frames, names in poses.items():
        wish = f"X_{frames[1][1]}" if frames[1] and len(poses) > 1 else "X"
        yield ReceptorElement(wish, "", {"sensors": names}, frames)
    in_poses = {name for names in poses.values() for name in names}
    alike: dict[tuple[str, Unit | None], list[Sensor]] = {}
    for sensor in (each for each in sensors if each.name not in in_poses):
        units = units_of_sensor(sensor.name, model)
        unit = units[0] if units and len(set(units)) == 1 else None
        alike.setdefault((model.parts["sensor", sensor.name].kind, unit), []).append(sensor)
    for (kind, unit), members in alike.items():
        size = sum(sensor.size for sensor in members)
        text = "" if unit is None or str(unit) == "1" else str(unit)
        if size == 1:
            type_ = f"real[{text}]" if text else "real"
        else:
            type_ = f"vector[{size}, {text}]" if text else f"vector[{size}]"
        names = [sensor.name for sensor in members]
        remarks = _QUATERNION if kind in ("framequat", "ballquat") else ""
        yield ReceptorElement(kind, type_, {"sensors": names}, remarks=remarks)


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
