"""The specification of a robot by its model: an agent that holds the pose of the start.

The text is `templates/init/model.yaml.j2`; here is what that prints.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from specc.diagnostics.phrases import join_some
from specc.mjcf.model import ModelObject
from specc.model.system import System
from specc.reachable import grouped
from specc.tools.fmt import format_text
from specc.tools.fmt.tree import Collection, Entry
from specc.tools.importers.writing import (
    PEERS,
    Commented,
    Data,
    SpecNames,
    comment_lines,
    fill_yaml,
    fold,
    printable,
    rate,
)
from specc.tools.starting.channels import TOLERANCES, Effector, camel, number
from specc.tools.starting.facts import ModelFacts
from specc.tools.starting.groups import ActuatorGroup, Receptor, ReceptorElement

_WIDTH = 96
HELD_S = 5
_PERIODS_S = {"sense": 0.01, "decide": 0.02, "see": 0.5}
"""About how often sensors report, the control subsystem decides, and cameras see."""
_MOST_SHOWN = 6
_DIVERGED = 1e3
_NAMED = ("types", "interfaces", "constants", "operators", "files", "frames", "parameters")


@dataclass(frozen=True, slots=True)
class Robot:
    """All that a specification is written from."""

    name: str
    facts: ModelFacts
    groups: Sequence[ActuatorGroup]
    receptors: Sequence[Receptor]
    refused: Mapping[str, str]


def specification(robot: Robot, system: str, plant: str, command: str) -> str:
    """The text of a whole specification, in the canonical layout."""
    guess = f"Made by `{command}`. What the model does not say is called a guess."
    parts = _parts(robot, SpecNames(PEERS), plant)
    head = wrap(guess, 4) + [line for remark in _remarks(robot) for line in wrap(remark, 4)]
    return fill_yaml("init/model.yaml.j2", parts | {"system": system, "head": head}, fold)


def wrap(text: str, indent: int) -> list[str]:
    """A remark as lines of a comment."""
    return comment_lines(text, _WIDTH - indent)


# What is said of the whole robot.


def pose(facts: ModelFacts) -> str:
    """Where the robot is at the start, in words."""
    return f"keyframe {facts.keyframe}" if facts.keyframe else "the start"


def omissions(refused: Mapping[str, str]) -> Iterator[str]:
    """Lines about actuators and sensors that a specification does not have, one for each reason."""
    for why, names in grouped((why, name) for name, why in refused.items()).items():
        yield f"{join_some(names, _MOST_SHOWN)}: {why}"


def mocap_warnings(facts: ModelFacts) -> Iterator[str]:
    """A line for each body that mocap places: what a specification commands does not move it."""
    for body, tied in facts.mocap.items():
        bound = f", with what is tied to it ({join_some(tied, _MOST_SHOWN)})" if tied else ""
        out = " Take the tie out of the model where actuators are to move that." if tied else ""
        yield f"MOCAP: {body} stays where the model has it{bound}: no actuator moves it.{out}"


def drift_warning(facts: ModelFacts) -> str:
    """A line about the joints that left the start in the rehearsal; empty if none did."""
    most = {joint.name: TOLERANCES[joint.unit][1] for joint in facts.joints}
    far = {name: value for name, value in facts.drift.items() if value > most[name]}
    farthest = sorted(far.items(), key=lambda pair: -pair[1])
    shown = join_some([f"{name} {_distance_text(value)}" for name, value in farthest], _MOST_SHOWN)
    line = f"NOT HELD: in a rehearsal of {HELD_S} s, joints went this far (rad, m): {shown}."
    return line if far else ""


def _remarks(robot: Robot) -> Iterator[str]:
    facts = robot.facts
    if facts.settles_elsewhere:
        yield (
            f"Nothing holds the model in the pose of {pose(facts)}: bodies may overlap there, "
            "or the robot stand above its floor. Runs begin where it settles: see the scene."
        )
    yield from mocap_warnings(facts)
    if far := drift_warning(facts):
        yield far
    elif facts.drift:
        yield (
            f"In a rehearsal of {HELD_S} s no joint went farther from the start than "
            f"{_distance_text(max(facts.drift.values()))} (rad or m)."
        )
    yield from (f"Left out: {line}" for line in omissions(robot.refused))


def _distance_text(far: float) -> str:
    return number(float(f"{far:.2g}")) if far < _DIVERGED else "without end"


# What the template prints.


@dataclass(frozen=True, slots=True)
class _ReceptorPlan:
    """A receptor with the types of its elements by their names; the type of all of them."""

    name: str
    title: str
    rate: str
    elements: Mapping[str, ReceptorElement]
    reports: Mapping[str, Data]
    interface: str

    @property
    def buffer(self) -> Data:
        return self.interface or self.reports


class _FrameNames:
    """Names of the frames of a model, some of which the specification may have already."""

    def __init__(self, names: SpecNames, known: Mapping[str, Any]) -> None:
        self._names = names
        self._known = {str(title): name for name, title in known.items()}
        self.new: dict[str, Data] = {}

    def of(self, part: ModelObject | None) -> str:
        """The name of the frame that a part of the model has; of None, the world."""
        title = printable(f"{part[0]} {part[1]}") if part else "world"
        if title not in self._known:
            name = self._known[title] = self._names.new(part[1] if part else "world")
            self.new[name] = title
        return self._known[title]


def _parts(
    robot: Robot,
    names: SpecNames,
    plant: str,
    prefix: str = "",
    constants: Mapping[str, Any] | None = None,
    frames: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """What the template prints of a robot, as the first agent of a system.

    `names` gives the names of types, constants and frames; `constants` and `frames` are those that
    the specification has already.
    """
    facts, own_names, frame_names = robot.facts, SpecNames(PEERS), _FrameNames(names, frames or {})
    known = {
        unit: name
        for unit, (name, most) in TOLERANCES.items()
        if (constants or {}).get(name) == f"{most}[{unit}]"
    }
    fresh = {unit: names.new(TOLERANCES[unit][0]) for unit in TOLERANCES if unit not in known}
    effectors = []
    for group in robot.groups:
        name = own_names.new(group.wish)
        effectors.append(Effector(name, group, prefix + name, facts, names, known | fresh))
    receptors = [
        _receptor(each, own_names.new(each.wish), prefix, names, frame_names)
        for each in robot.receptors
    ]
    near = [(each.name, *pair) for each in effectors for pair in each.near.items()]
    used = {tolerance for _, _, (_, tolerance) in near}
    tolerances = {
        name: f"{TOLERANCES[unit][1]}[{unit}]" for unit, name in fresh.items() if name in used
    }
    in_place = [f"near(x.{part}.{name}, {start}, {most})" for part, name, (start, most) in near]
    elements = [(e.name, name) for e in effectors for name in e.reports if name not in e.near]
    elements += [(each.name, name) for each in receptors for name in each.elements]
    sensed = [f"present(x.{part}.{name})" for part, name in elements]
    # What nothing holds, or what does not stay, is no test that passes.
    stays = [
        f"near({robot.name}.c.x.{part}.{name}, {start}, {most})"
        for part, name, (start, most) in near
        if not drift_warning(facts)
    ]
    lets = {"in_place": " and ".join(in_place), "sensed": " and ".join(sensed)}
    rates = _rates(facts.period_s)
    bind = {
        f"{robot.name}.E.{each.name}.{name}": how
        for each in effectors
        for name, how in each.bind.items()
    }
    bind |= {
        f"{robot.name}.R.{each.name}.{name}": _binding(element, rates if each.rate == "see" else {})
        for each in receptors
        for name, element in each.elements.items()
    }
    units = {joint.name: joint.unit for joint in facts.joints}
    scene = {name: f"{number(v)}[{units.get(name, 'm')}]" for name, v in facts.scene.items()}
    return {
        "system": "",
        "head": (),
        "remarks": (),
        "title": f"Holds the pose of {pose(facts)}",
        "wrap": wrap,
        "agent": robot.name,
        "definitions": {
            "frames": frame_names.new,
            "types": {k: v for each in effectors for k, v in each.types.items()},
            "interfaces": {each.interface: each.reports for each in receptors if each.interface},
            "constants": tolerances | {k: v for e in effectors for k, v in e.constants.items()},
            "operators": {k: v for each in effectors for k, v in each.operators.items()},
        },
        "effectors": effectors,
        "receptors": receptors,
        "rates": rates,
        "lets": {name: text for name, text in lets.items() if text},
        "held_s": HELD_S,
        "plant": plant,
        "bind": bind,
        "cycle": True,
        "stays": " and ".join(stays),
        "scene": scene,
    }


def _receptor(
    receptor: Receptor, name: str, prefix: str, names: SpecNames, frames: _FrameNames
) -> _ReceptorPlan:
    """The elements that a receptor reports, under an interface if they are several."""
    element_names = SpecNames()
    elements = {element_names.new(each.wish): each for each in receptor.elements}
    reports: dict[str, Data] = {
        key: "pose[{}, {}]".format(*map(frames.of, each.frames)) if each.frames else each.type
        for key, each in elements.items()
    }
    interface = names.new(camel(prefix + name)) if len(reports) > 1 else ""
    rate = "see" if receptor.camera else "sense"
    return _ReceptorPlan(name, receptor.title, rate, elements, reports, interface)


def _rates(period_s: float) -> dict[str, str]:
    """Rates of the subsystems, in whole periods of each other; `act` is that of the effectors."""
    period = Fraction(str(round(period_s, 9)))
    rates = {"act": rate(period)}
    for name, every_s in _PERIODS_S.items():
        period *= max(1, round(Fraction(every_s).limit_denominator(1000) / period))
        rates[name] = rate(period)
    return rates


def _binding(element: ReceptorElement, rates: Mapping[str, str]) -> Data:
    bind: dict[str, Data] = {**element.bind}
    if rates:
        bind["rate"] = rates["see"]
    return Commented(bind, wrap(element.remarks, 4)) if element.remarks else bind


# Adding an agent to a specification that exists: its text, with the new entries in place.


def bound_parts(system: System) -> set[str]:
    """Actuators, sensors and cameras that a system has devices for."""
    bindings = system.plant.bindings if system.plant else ()
    each = ((*one.actuators, *one.sensors, one.camera) for one in bindings)
    return {name for names in each for name in names if name}


def specification_with_agent(
    text: str, data: Mapping[str, Any], robot: Robot, plant: str, command: str
) -> str:
    """The text of a specification, which is YAML without faults, with one more agent.

    All of it comes in the canonical layout. Whether the agent is in it shows when it is read.

    Raises:
        LayoutError: what is there would not survive.
    """
    names = SpecNames({*PEERS, *(name for key in _NAMED for name in _mapping(data, key))})
    constants, frames = _mapping(data, "constants"), _mapping(data, "frames")
    parts = _parts(robot, names, plant, f"{robot.name}_", constants, frames)
    scene = _mapping(_mapping(data, "task"), "scene")
    remarks = (f"Made by `{command}`.", *_remarks(robot))
    parts["remarks"] = [line for remark in remarks for line in wrap(remark, 4)]
    parts["cycle"] = "task" not in data
    parts["stays"] = ""
    parts["scene"] = {k: v for k, v in parts["scene"].items() if k not in scene}
    new = fill_yaml("init/model.yaml.j2", parts, fold)
    return format_text(text.rstrip("\n") + "\n" + new, _merge)


def _merge(root: Collection) -> None:
    """Put entries of a mapping that has keys twice into those that came first."""
    first: dict[str, Entry] = {}
    for entry in root.entries:
        earlier = first.setdefault(entry.name, entry)
        if earlier is entry:
            continue
        one, other = earlier.value, entry.value
        if isinstance(one, Collection) and isinstance(other, Collection):
            if other.entries:
                other.entries[0].above[:0] = entry.above
            one.entries += other.entries
            one.below += other.below
            one.flow &= not any(each.above for each in one.entries)
            _merge(one)
    root.entries = list(first.values())


def _mapping(data: Mapping[str, Any], key: str) -> Mapping[str, Any]:
    found = data.get(key)
    return found if isinstance(found, Mapping) else {}
