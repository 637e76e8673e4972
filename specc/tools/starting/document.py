"""The specification of a robot by its model: an agent that holds the pose of the start."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from specc.diagnostics.phrases import join_some
from specc.mjcf.model import ModelObject
from specc.reachable import grouped
from specc.tools.fmt import format_text
from specc.tools.importers.writing import PEERS, Data, SpecNames, filled, rate, to_yaml
from specc.tools.starting.channels import (
    NEAR,
    ChannelWriter,
    Draft,
    camel,
    channels,
    noted,
    number,
    qualified,
)
from specc.tools.starting.facts import ModelFacts
from specc.tools.starting.groups import ActuatorGroup
from specc.tools.starting.receptors import Receptor, ReceptorElement

_WIDTH = 96
HELD_S = 5
_SENSED_S, _DECIDED_S, _SEEN_S = 0.01, 0.02, 0.5
_MOST_SHOWN = 6
_DIVERGED = 1e3


@dataclass(frozen=True, slots=True)
class Robot:
    """All that a specification is written from."""

    name: str
    facts: ModelFacts
    groups: Sequence[ActuatorGroup]
    receptors: Sequence[Receptor]
    refused: Mapping[str, str]


def document(robot: Robot, system: str, plant: str, command: str) -> str:
    """The text of a whole specification, in the canonical layout."""
    parts = AgentSections(robot, SpecNames(PEERS))
    remarks = [
        f"Made by `{command}`. What the model does not say is called a guess.",
        *parts.remarks(),
    ]
    data: dict[str, Data] = {
        "specc": "1.2",
        "system": system,
        "title": f"Holds the pose of {pose(robot.facts)}",
        **parts.definitions(),
        "agents": {robot.name: parts.agent()},
        "plant": {"model": plant, "bind": parts.bind()},
        "task": parts.task(),
    }
    return written(remarks, data)


def written(remarks: Iterable[str], data: Mapping[str, Data]) -> str:
    """The text of a specification, remarks at its head, in the canonical layout."""
    head = "".join(f"# {line}\n" for line in wrapped(*remarks))
    return format_text(head + to_yaml(filled(data), fold=True))


def wrapped(*remarks: str) -> list[str]:
    """Remarks as lines of comments."""
    return [line for remark in remarks for line in _wrapped(remark, 4)]


def pose(facts: ModelFacts) -> str:
    """Where the robot is at the start, in words."""
    return f"keyframe {facts.keyframe}" if facts.keyframe else "the start"


def left_out(refused: Mapping[str, str]) -> Iterator[str]:
    """Lines about actuators and sensors that a specification does not have, one for each reason."""
    for why, names in grouped((why, name) for name, why in refused.items()).items():
        yield f"{join_some(names, _MOST_SHOWN)}: {why}"


def by_mocap(facts: ModelFacts) -> Iterator[str]:
    """A line for each body that mocap places: what a specification commands does not move it."""
    for body, tied in facts.mocap.items():
        bound = f", with what is tied to it ({join_some(tied, _MOST_SHOWN)})" if tied else ""
        out = " Take the tie out of the model where actuators are to move that." if tied else ""
        yield f"MOCAP: {body} stays where the model has it{bound}: no actuator moves it.{out}"


def not_held(facts: ModelFacts) -> str:
    """A line about the joints that left the start in the rehearsal; empty if none did."""
    most = {joint.name: NEAR[joint.unit][1] for joint in facts.joints}
    far = {name: value for name, value in facts.strayed.items() if value > most[name]}
    farthest = sorted(far.items(), key=lambda pair: -pair[1])
    shown = join_some([f"{name} {_rough(value)}" for name, value in farthest], _MOST_SHOWN)
    said = f"NOT HELD: in a rehearsal of {HELD_S} s, joints went this far (rad, m): {shown}."
    return said if far else ""


@dataclass(frozen=True, slots=True)
class _Sensed:
    """A receptor with its name, the names of its elements, and their interface if it has one."""

    name: str
    receptor: Receptor
    elements: Mapping[str, ReceptorElement]
    reports: Mapping[str, Data]
    interface: str

    @property
    def buffer(self) -> Data:
        return self.interface or self.reports


class AgentSections:
    """What the agent of a robot needs in every section of a specification."""

    def __init__(
        self,
        robot: Robot,
        names: SpecNames,
        known: Mapping[str, Any] | None = None,
        frames: Mapping[str, Any] | None = None,
    ) -> None:
        """`names` gives the names of types, constants and frames.

        `known` and `frames` are the constants and frames of a specification that has other agents.
        """
        self._known_frames = {str(title): name for name, title in (frames or {}).items()}
        self._frames: dict[str, str] = {}
        """By their titles."""
        self._robot, self._names = robot, names
        self._before = "" if known is None else f"{robot.name}_"
        self._known = {
            unit: name
            for unit, (name, most) in NEAR.items()
            if (known or {}).get(name) == f"{most}[{unit}]"
        }
        fresh = {unit: names.new(NEAR[unit][0]) for unit in NEAR if unit not in self._known}
        self._near = self._known | fresh
        self._parts = SpecNames(PEERS)
        self._effectors = [self._effector(group) for group in robot.groups]
        self._receptors = [self._sensor(receptor) for receptor in robot.receptors]
        self._period = Fraction(str(round(robot.facts.period_s, 9)))

    def _effector(self, group: ActuatorGroup) -> tuple[str, ActuatorGroup, Draft]:
        name = self._parts.new(group.wish)
        found = channels(group.actuators, self._robot.facts)
        draft, prefix = Draft(), self._before + name
        for index, channel in enumerate(found, 1):
            own = f"{prefix}_{index}" if len(found) > 1 else prefix
            ChannelWriter(draft, channel, own, self._robot.facts, self._names, self._near).write()
        return name, group, draft

    def _sensor(self, receptor: Receptor) -> _Sensed:
        """The elements that a receptor reports, under an interface if they are several."""
        names, name = SpecNames(), self._parts.new(receptor.wish)
        elements = {names.new(each.wish): each for each in receptor.elements}
        reports: dict[str, Data] = {key: self._type(each) for key, each in elements.items()}
        interface = self._names.new(camel(self._before + name)) if len(reports) > 1 else ""
        return _Sensed(name, receptor, elements, reports, interface)

    def _type(self, element: ReceptorElement) -> str:
        if element.frames is None:
            return element.type
        parent, child = (self._frame(each) for each in element.frames)
        return f"pose[{parent}, {child}]"

    def _frame(self, of: ModelObject | None) -> str:
        """The name of the frame that a part of the model has; of None, the world."""
        title = _clean(f"{of[0]} {of[1]}") if of else "world"
        if title in self._known_frames:
            return self._known_frames[title]
        if title not in self._frames:
            self._frames[title] = self._names.new(of[1] if of else "world")
        return self._frames[title]

    def definitions(self) -> dict[str, Data]:
        """The sections of definitions."""
        drafts = [draft for _, _, draft in self._effectors]
        interfaces = {each.interface: each.reports for each in self._receptors if each.interface}
        constants = {k: v for draft in drafts for k, v in draft.constants.items()}
        return {
            "frames": {name: title for title, name in self._frames.items()},
            "types": {k: v for draft in drafts for k, v in draft.types.items()},
            "interfaces": interfaces,
            "constants": self._tolerances() | constants,
            "operators": {k: v for draft in drafts for k, v in draft.operators.items()},
        }

    def agent(self) -> dict[str, Data]:
        """Its devices, virtual effectors and receptors, and control subsystem."""
        return filled(
            {
                "real_effectors": {n: self._device(g, d) for n, g, d in self._effectors},
                "real_receptors": {each.name: {"y": each.buffer} for each in self._receptors},
                "virtual_effectors": {n: self._moving(g, d) for n, g, d in self._effectors},
                "virtual_receptors": {each.name: self._sensing(each) for each in self._receptors},
                "control": self._control(),
            }
        )

    def bind(self) -> dict[str, Data]:
        """What stands behind the elements of its devices."""
        name = self._robot.name
        bind: dict[str, Data] = {}
        for part, _, draft in self._effectors:
            bind |= qualified(f"{name}.E.{part}", draft.bind)
        for each in self._receptors:
            own = {key: self._bound(e, each.receptor) for key, e in each.elements.items()}
            bind |= qualified(f"{name}.R.{each.name}", own)
        return bind

    def task(self) -> dict[str, Data]:
        """The task of a system that has no other one."""
        cycle = {"of": f"{self._robot.name}.c", "from": "hold", "to": "hold"}
        return filled({"cycle": cycle, "scene": self.scene()})

    def _tolerances(self) -> dict[str, Data]:
        used = {near for _, _, draft in self._effectors for _, near in draft.near.values()}
        return {
            name: f"{NEAR[unit][1]}[{unit}]"
            for unit, name in self._near.items()
            if name in used and unit not in self._known
        }

    def scene(self) -> dict[str, Data]:
        """Positions at the start: of joints as they are written, by their units."""
        units = {joint.name: joint.unit for joint in self._robot.facts.joints}
        return {
            name: f"{number(value)}[{units.get(name, 'm')}]"
            for name, value in self._robot.facts.scene.items()
        }

    def remarks(self) -> Iterator[str]:
        """What is to be said of all of it."""
        facts = self._robot.facts
        if facts.settled:
            yield (
                f"Nothing holds the model in the pose of {pose(facts)}: bodies may overlap there, "
                "or the robot stand above its floor. Runs begin where it settles: see the scene."
            )
        yield from by_mocap(facts)
        if far := not_held(facts):
            yield far
        elif facts.strayed:
            most = max(facts.strayed.values())
            yield (
                f"In a rehearsal of {HELD_S} s no joint went farther from the start than "
                f"{_rough(most)} (rad or m)."
            )
        yield from (f"Left out: {line}" for line in left_out(self._robot.refused))

    # Devices and virtual effectors.

    def _device(self, group: ActuatorGroup, draft: Draft) -> Data:
        lines = [f"A guess: {group.why}."] if group.why else []
        return noted({"x": draft.device["x"], "y": draft.device["y"]}, lines)

    def _moving(self, group: ActuatorGroup, draft: Draft) -> Data:
        x: dict[str, Data] = {"c": draft.inputs, "E": draft.device["y"]}
        y: dict[str, Data] = {
            "c": draft.outputs,
            "E": {key: _type(value) for key, value in draft.device["x"].items()},
        }
        lines = [line for note in dict.fromkeys(draft.notes) for line in _wrapped(note, 8)]
        title = _moved(group, self._robot.facts)
        data: dict[str, Data] = {"title": title, "rate": rate(self._period), "x": x, "y": y}
        if draft.memory:
            data["memory"] = draft.memory
        if draft.let:
            data["let"] = draft.let
        data["through"] = {**draft.move, **draft.tell}
        return noted(data, lines)

    # Receptors.

    def _sensing(self, sensed: _Sensed) -> Data:
        return {
            "title": sensed.receptor.title,
            "rate": self._rate(_SEEN_S if sensed.receptor.camera else _SENSED_S),
            "through": "identity",
        }

    def _bound(self, element: ReceptorElement, receptor: Receptor) -> Data:
        rates: dict[str, Data] = {"rate": self._rate(_SEEN_S)} if receptor.camera else {}
        return noted({**element.bind, **rates}, _wrapped(element.remarks, 4))

    def _rate(self, every_s: float) -> str:
        """About as often, in whole periods of each other."""
        period = self._period
        for wanted in (_SENSED_S, _DECIDED_S, _SEEN_S):
            period *= max(1, round(Fraction(wanted).limit_denominator(1000) / period))
            if wanted == every_s:
                break
        return rate(period)

    # Control.

    def _control(self) -> Data:
        x: dict[str, Data] = {}
        y: dict[str, Data] = {}
        hold: dict[str, Data] = {}
        near, seen = [], []
        for name, _, draft in self._effectors:
            x[name] = {
                key: {"type": type_, "init": draft.near[key][0]} if key in draft.near else type_
                for key, type_ in draft.outputs.items()
            }
            y[name] = {key: _type(value) for key, value in draft.inputs.items()}
            hold |= {f"y.{name}.{key}": value for key, value in draft.hold.items()}
            near += [f"near(x.{name}.{k}, {s}, {t})" for k, (s, t) in draft.near.items()]
            seen += [f"present(x.{name}.{key})" for key in draft.outputs if key not in draft.near]
        for each in self._receptors:
            x[each.name] = each.buffer
            seen += [f"present(x.{each.name}.{key})" for key in each.elements]
        lets = filled({"in_place": " and ".join(near), "sensed": " and ".join(seen)})
        done = " and ".join((f"elapsed >= {HELD_S}[s]", *lets))
        title = f"Holds the pose of {pose(self._robot.facts)}"
        data: dict[str, Data] = {"title": title, "rate": self._rate(_DECIDED_S), "x": x, "y": y}
        if lets:
            data["let"] = lets
        return data | {
            "conditions": {"terminal": {"held": done}},
            "functions": {"hold": hold},
            "behaviours": {"hold": {"functions": ["hold"], "terminal": "held"}},
            "states": {"hold": "hold"},
            "initial_state": "hold",
            "transitions": [["hold", "terminal", "always", "hold"]],
        }


def _moved(group: ActuatorGroup, facts: ModelFacts) -> str:
    """The title of a virtual effector: the joints that it moves."""
    joints = list(dict.fromkeys(facts.joints[j].name for a in group.actuators for j, _ in a.joints))
    shown = ", ".join(joints) if len(joints) < 3 else f"{joints[0]} to {joints[-1]}"
    return _clean(f"Moves {shown}" + (f" ({len(joints)} joints)" if len(joints) > 2 else ""))


def _rough(far: float) -> str:
    return number(float(f"{far:.2g}")) if far < _DIVERGED else "without end"


def _type(value: Data) -> Data:
    return value["type"] if isinstance(value, Mapping) else value


def _clean(text: str) -> str:
    return "".join(c if c.isprintable() else "?" for c in text)


def _wrapped(text: str, indent: int = 0) -> list[str]:
    return textwrap.wrap(_clean(text), _WIDTH - indent, break_long_words=False)
