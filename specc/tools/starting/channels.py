"""What one group of actuators is commanded and reports, as parts of a specification.

Actuators of a group that take the same kind of command, in one unit, are a channel: vectors with a
component for each, or numbers where there is one.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from specc.tools.importers.writing import Data, SpecNames, printable
from specc.tools.starting.facts import Actuator, Joint, ModelFacts
from specc.tools.starting.groups import ActuatorGroup

TOLERANCES = {"rad": ("angle_tolerance", 0.05), "m": ("distance_tolerance", 0.005)}
"""Unit of a joint -> the constant that says how near to the start is near, and its value."""
_SPEED = {"rad": "rad/s", "m": "m/s"}
_FORCE = {"rad": "N*m", "m": "N"}
_NO_LIMIT = 1e6
_OPERATORS = "specc_runtime.operators.joints"


@dataclass(frozen=True, slots=True)
class Channel:
    """Actuators of one kind of command.

    `unit` is that of the joints, rad or m, empty where they are several; `command` that of what
    actuators take, empty for a number in a scale of the model's own.
    """

    kind: str
    unit: str
    command: str
    actuators: tuple[Actuator, ...]


def channels_of(actuators: Iterable[Actuator], facts: ModelFacts) -> list[Channel]:
    """Groups actuators into channels, in the order of the model.

    A channel never has two single-joint actuators of the same joint; the second one starts another
    channel.
    """
    found: list[tuple[tuple[str, str, str], list[Actuator]]] = []
    for actuator in actuators:
        kind, joint = _kind(actuator, facts), actuator.joints[0][0]
        for other, members in found:
            driven = {index for member in members for index, _ in member.joints}
            if other == kind and not (len(actuator.joints) == 1 and joint in driven):
                members.append(actuator)
                break
        else:
            found.append((kind, [actuator]))
    return [Channel(*kind, tuple(members)) for kind, members in found]


def _kind(actuator: Actuator, facts: ModelFacts) -> tuple[str, str, str]:
    joints = [facts.joints[joint] for joint, _ in actuator.joints]
    units = {joint.unit for joint in joints}
    unit = units.pop() if len(units) == 1 else ""
    single = len(joints) == 1
    factor = actuator.factor * actuator.joints[0][1]
    force = _FORCE[unit] if single and abs(factor - 1.0) < 1e-9 else ""
    if joints[0].wheel and single and actuator.kind in ("velocity", "force"):
        return "wheel", unit, _SPEED[unit] if actuator.kind == "velocity" else force or "u"
    if single and actuator.linear and actuator.kind in ("position", "velocity", "force"):
        command = {"position": unit, "velocity": _SPEED[unit], "force": force}
        return actuator.kind, unit, command[actuator.kind]
    return "other", unit, ""


class NearStart(NamedTuple):
    """Constants with the start of joints that stayed near it in the rehearsal, and a tolerance."""

    start: str
    tolerance: str


class Effector:
    """A virtual effector with its device: what the template prints of it."""

    def __init__(
        self,
        name: str,
        group: ActuatorGroup,
        prefix: str,
        facts: ModelFacts,
        names: SpecNames,
        tolerances: Mapping[str, str],
    ) -> None:
        """`prefix` begins the names of its constants and types; `tolerances` are those by unit."""
        self.name, self.group = name, group
        self.types: dict[str, Data] = {}
        self.constants: dict[str, Data] = {}
        self.operators: dict[str, Data] = {}
        self.commands: dict[str, Data] = {}
        self.reports: dict[str, str] = {}
        self.inputs: dict[str, Data] = {}
        self.memory: dict[str, Data] = {}
        self.let: dict[str, Data] = {}
        self.hold: dict[str, Data] = {}
        """Elements that the control subsystem sends to hold the pose."""
        self.near: dict[str, NearStart] = {}
        self.bind: dict[str, Data] = {}
        self.remarks: dict[str, None] = {}
        self.command_types: dict[str, Data] = {}
        self.input_types: dict[str, Data] = {}
        self._move: dict[str, Data] = {}
        self._starts: dict[str, str] = {}
        self._letters: Counter[str] = Counter()
        self._facts, self._names, self._tolerances = facts, names, tolerances
        found = channels_of(group.actuators, facts)
        writers = {
            "position": self._position,
            "velocity": self._velocity,
            "force": self._force,
            "wheel": self._wheel,
            "other": self._other,
        }
        for index, channel in enumerate(found, 1):
            self._channel, self._actuators = channel, channel.actuators
            self._prefix = f"{prefix}_{index}" if len(found) > 1 else prefix
            self._measured: dict[str, tuple[str, list[Joint]]] = {}
            self._report_joints()
            writers[channel.kind]()
        self.through = self._move | {f"y.c.{name}": f"x.E.{name}" for name in self.reports}

    @property
    def title(self) -> str:
        """The joints that it moves."""
        joints = self._facts.joints
        moved = list(
            dict.fromkeys(joints[j].name for a in self.group.actuators for j, _ in a.joints)
        )
        if len(moved) < 3:
            return printable(f"Moves {', '.join(moved)}")
        return printable(f"Moves {moved[0]} to {moved[-1]} ({len(moved)} joints)")

    # Names, types and constants.

    def _new_element_name(self, wish: str) -> str:
        """The name of a new element."""
        self._letters[wish] += 1
        count = self._letters[wish]
        return wish if count == 1 else f"{wish}{count}"

    def _constant(self, name: str, values: Sequence[float], unit: str, title: str = "") -> str:
        full = self._names.new(f"{self._prefix}_{name}")
        value = vector(values, unit)
        self.constants[full] = {"is": value, "title": title} if title else value
        return full

    def _type(self, size: int, unit: str, word: str) -> str:
        if size == 1:
            return f"real[{unit}]" if unit else "real"
        text = f"vector[{size}, {unit}]" if unit else f"vector[{size}]"
        known = next((name for name, type_ in self.types.items() if type_ == text), "")
        if not known:
            known = self._names.new(camel(f"{self._prefix}_{word}".replace("joints_", "joint_")))
            self.types[known] = text
        return known

    def _report_joints(self) -> None:
        """Report the positions of the joints that move, in one element for each unit."""
        order = dict.fromkeys(joint for a in self._actuators for joint, _ in a.joints)
        for unit, letter, word in (("rad", "q", "angles"), ("m", "s", "positions")):
            joints = [j for index in order if (j := self._facts.joints[index]).unit == unit]
            if not joints:
                continue
            name = self._new_element_name(letter)
            self._measured[unit] = name, joints
            self.reports[name] = self._type(len(joints), unit, word)
            self.bind[name] = {"joints": [joint.name for joint in joints]}
            most = TOLERANCES[unit][1]
            if all(self._facts.drift.get(joint.name, 0.0) < most for joint in joints):
                self.near[name] = NearStart(self._start(name, unit), self._tolerances[unit])

    def _start(self, name: str, unit: str) -> str:
        """The constant with the positions at the start."""
        if name not in self._starts:
            starts = [joint.start for joint in self._measured[unit][1]]
            self._starts[name] = self._constant("start", starts, unit)
        return self._starts[name]

    def _command(self, name: str, unit: str, word: str, safe: Data) -> str:
        """Command the actuators of the channel; the type of the command."""
        type_ = self._type(len(self._actuators), unit, word)
        self.commands[name] = {"type": type_, "safe": safe}
        self.command_types[name] = type_
        self.bind[name] = {"actuators": [a.name for a in self._actuators]}
        return type_

    def _accept(self, name: str, type_: str, rest: str) -> None:
        """Accept commands of the control subsystem, which sends `rest` to hold the pose."""
        self.inputs[name] = {"type": type_, "init": rest}
        self.input_types[name] = type_
        self.hold[name] = rest

    def _limited(self, expression: str, type_: str, unit: str) -> str:
        """An expression within the ranges of the controls in the model, if there are any."""
        least, greatest = ([getattr(a, e) for a in self._actuators] for e in ("least", "greatest"))
        if all(end is None for end in (*least, *greatest)):
            return expression
        low = self._constant("least", [-_NO_LIMIT if v is None else v for v in least], unit)
        high = self._constant("greatest", [_NO_LIMIT if v is None else v for v in greatest], unit)
        if len(self._actuators) == 1:
            return f"min(max({expression}, {low}), {high})"
        signature = f"(u: {type_}, least: {type_}, greatest: {type_}) -> {type_}"
        return (
            f"{self._declare_operator('limit', signature, 'within')}({expression}, {low}, {high})"
        )

    def _declare_operator(self, name: str, signature: str, function: str) -> str:
        full = self._names.new(f"{name}_{self._prefix}")
        self.operators[full] = {"signature": signature, "python": f"{_OPERATORS}:{function}"}
        return full

    def _rest(self, name: str, unit: str, title: str) -> str:
        return self._constant(name, [a.rest for a in self._actuators], unit, title)

    def _measured_joints(self) -> tuple[str, str, str]:
        """Element, type and start of the joints of a channel with one joint an actuator."""
        unit = self._channel.unit
        name = self._measured[unit][0]
        start = self._start(name, unit)
        return name, self.reports[name], start

    def _differentiated(self, name: str, type_: str) -> str:
        before = f"{name}_p"
        title = "positions of the period before"
        self.memory[before] = {"type": type_, "init": f"x.E.{name}", "title": title}
        self._move[before] = f"x.E.{name}"
        self.let[f"{name}_v"] = f"(x.E.{name} - {before}) / period"
        return f"{name}_v"

    def _vectors(self, *units: str) -> list[str]:
        return [f"vector[{len(self._actuators)}, {unit}]" for unit in units]

    # Kinds.

    def _position(self) -> None:
        name, type_, start = self._measured_joints()
        unit = self._channel.unit
        self._command(f"{name}_d", unit, "", {"is": name, "otherwise": start})
        leads = [a.rest - self._facts.joints[a.joints[0][0]].start for a in self._actuators]
        target = f"x.c.{name}_d"
        if max(map(abs, leads)) > 1e-4:
            title = "what the servos must be ahead for the weight"
            target = f"{target} + {self._constant('lead', leads, unit, title)}"
        self._accept(f"{name}_d", type_, start)
        self._move[f"y.E.{name}_d"] = self._limited(target, type_, unit)

    def _velocity(self) -> None:
        name, type_, start = self._measured_joints()
        unit = self._channel.command
        letter = self._new_element_name("w" if self._channel.unit == "rad" else "v")
        rest = self._rest("rest", unit, "speeds that carry the weight")
        gain = self._actuators[0].gain
        rate = self._constant("rate", [gain], "1/s", "speed by distance: a guess")
        sent = self._command(f"{letter}_d", unit, "speeds", rest)
        self._accept(f"{name}_d", type_, start)
        self.let[letter] = f"{rest} + {rate} * (x.c.{name}_d - x.E.{name})"
        self._move[f"y.E.{letter}_d"] = self._limited(letter, sent, unit)
        self.remarks["Servos for speeds: the loop around them for positions is a guess."] = None

    def _force(self) -> None:
        name, type_, start = self._measured_joints()
        unit, force = self._channel.unit, self._channel.command
        letter = self._new_element_name({"N*m": "tau", "N": "F"}.get(force, "u"))
        weight = self._rest("weight", force, "carries the weight at the start")
        sent = self._command(letter, force, "efforts", weight)
        scaled = [(a, a.joints[0][1]) for a in self._actuators]
        by, by_speed = _per(force, unit), _per(force, unit, "s")
        K = self._constant("stiffness", [a.gain * scale for a, scale in scaled], by)
        D = self._constant("damping", [a.damping * scale for a, scale in scaled], by_speed)
        speed = self._differentiated(name, type_)
        error = f"x.c.{name}_d - x.E.{name}"
        effort = f"{weight} + {K} * ({error}) - {D} * {speed}"
        if len(self._actuators) > 1:
            vectors = type_, *self._vectors(_SPEED[unit], by, by_speed)
            signature = "(e: {}, v: {}, K: {}, D: {}) -> ".format(*vectors) + sent
            drive = self._declare_operator("drive", signature, "regulated")
            effort = f"{weight} + {drive}({error}, {speed}, {K}, {D})"
        self.let[f"{letter}_d"] = effort
        self._accept(f"{name}_d", type_, start)
        self._move[f"y.E.{letter}"] = self._limited(f"{letter}_d", sent, force)
        remark = (
            f"Motors without a controller of their own: a joint gets critically damped gains for "
            f"{number(self._facts.frequency)} rad/s (a guess), by the mass that its motor feels at "
            f"the start in the model, and the weight that it carries there."
        )
        self.remarks[remark] = None

    def _wheel(self) -> None:
        unit = self._channel.unit
        name, speed_unit, size = self._measured[unit][0], _SPEED[unit], len(self._actuators)
        letter = self._new_element_name("w")
        speeds = self._type(size, speed_unit, "speeds")
        stop = self._constant("stop", [0.0] * size, speed_unit)
        self._accept(f"{letter}_d", speeds, stop)
        if self._channel.command == speed_unit:
            self._command(f"{letter}_d", speed_unit, "speeds", stop)
            limited = self._limited(f"x.c.{letter}_d", speeds, speed_unit)
            self._move[f"y.E.{letter}_d"] = limited
            return
        force = self._channel.command.replace("u", "")
        effort = self._new_element_name("tau" if force else "u")
        sent = self._command(effort, force, "efforts", vector([0.0] * size, force))
        dampings = [a.damping * a.joints[0][1] for a in self._actuators]
        by = _per(force, unit, "s")
        error = f"x.c.{letter}_d - {self._differentiated(name, self.reports[name])}"
        if max(dampings) - min(dampings) <= 1e-3 * abs(dampings[0]):
            D = self._constant("damping", [float(f"{dampings[0]:.4g}")], by)
            self.let[f"{effort}_d"] = f"{D} * ({error})"
        else:  # as of wheels on both sides, of which one is geared backwards
            D = self._constant("damping", dampings, by)
            signature = f"(v: {speeds}, by: {self._vectors(by)[0]}) -> {sent}"
            drive = self._declare_operator("drive", signature, "scaled")
            self.let[f"{effort}_d"] = f"{drive}({error}, {D})"
        self._move[f"y.E.{effort}"] = self._limited(f"{effort}_d", sent, force)
        remark = (
            f"Wheels with motors: their speed is controlled for {number(self._facts.frequency)} "
            "rad/s (a guess), by the mass that a motor feels in the model."
        )
        self.remarks[remark] = None

    def _other(self) -> None:
        """In the scale of the model: what is sent to hold the pose is a constant."""
        letter = self._new_element_name("u")
        rest = self._rest("rest", "", "controls that hold the start")
        sent = self._command(letter, "", "controls", rest)
        self._accept(f"{letter}_d", sent, rest)
        self._move[f"y.E.{letter}"] = self._limited(f"x.c.{letter}_d", sent, "")
        self.remarks[_OWN_SCALE] = None


_OWN_SCALE = (
    "Controls in a scale of the model's own, passed on as they are; what they move follows."
)


def _per(force: str, unit: str, by: str = "") -> str:
    above = "*".join(filter(None, (force, by))) or "1"
    return f"{above}/{unit}"


def number(value: float) -> str:
    """A number as the language writes it."""
    return f"{value:.6g}".replace("e-0", "e-").replace("e+0", "e+").replace("e+", "e")


def vector(values: Sequence[float], unit: str) -> str:
    """Numbers with their unit: one, or a vector of several, `[1, 2] * 1[m]`."""
    if len(values) == 1:
        return f"{number(values[0])}[{unit}]" if unit else number(values[0])
    shown = f"[{', '.join(map(number, values))}]"
    return f"{shown} * 1[{unit}]" if unit else shown


def camel(text: str) -> str:
    """`left_arm` as `LeftArm`."""
    return "".join(word[:1].upper() + word[1:] for word in re.split(r"_+", text))
