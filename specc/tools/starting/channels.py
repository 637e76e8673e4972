"""What one group of actuators is commanded and reports, as parts of a specification.

Actuators of a group that take the same kind of command, in one unit, are a channel: vectors with a
component for each, or numbers where there is one.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from specc.tools.importers.writing import Data, Noted, SpecNames
from specc.tools.starting.facts import Actuator, Joint, ModelFacts

NEAR = {"rad": ("angle_tolerance", 0.05), "m": ("distance_tolerance", 0.005)}
"""By the unit of a joint: a constant that says how near to the start is near, and its value."""
_SPEED = {"rad": "rad/s", "m": "m/s"}
_FORCE = {"rad": "N*m", "m": "N"}
_NO_LIMIT = 1e6
_OPERATORS = "specc_runtime.operators.joints"


@dataclass(eq=False, slots=True)
class Draft:
    """Parts of a specification, by where they stand."""

    types: dict[str, Data] = field(default_factory=dict)
    constants: dict[str, Data] = field(default_factory=dict)
    operators: dict[str, Data] = field(default_factory=dict)
    device: dict[str, dict[str, Data]] = field(default_factory=lambda: {"x": {}, "y": {}})
    inputs: dict[str, Data] = field(default_factory=dict)
    outputs: dict[str, Data] = field(default_factory=dict)
    memory: dict[str, Data] = field(default_factory=dict)
    let: dict[str, Data] = field(default_factory=dict)
    move: dict[str, Data] = field(default_factory=dict)
    tell: dict[str, Data] = field(default_factory=dict)
    hold: dict[str, Data] = field(default_factory=dict)
    """Elements that the control subsystem sends to hold the pose."""
    initial: dict[str, str] = field(default_factory=dict)
    """Elements of `outputs` -> the constant with its value at the start."""
    near: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Elements of `outputs` -> start and tolerance, of joints that stayed near in the rehearsal."""
    bind: dict[str, Data] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    letters: Counter[str] = field(default_factory=Counter)

    def letter(self, wish: str) -> str:
        """A name of an element that no other one has."""
        self.letters[wish] += 1
        count = self.letters[wish]
        return wish if count == 1 else f"{wish}{count}"


@dataclass(frozen=True, slots=True)
class Channel:
    """Actuators of one kind of command."""

    kind: str
    unit: str
    """Of the joints: rad, m; empty where they are several."""
    command: str
    """Unit of what actuators take; empty for a number in a scale of the model's own."""
    actuators: tuple[Actuator, ...]

    @property
    def size(self) -> int:
        """How many they are."""
        return len(self.actuators)


def channels(actuators: Iterable[Actuator], facts: ModelFacts) -> list[Channel]:
    """The channels of a group, in the order of the model.

    A channel has a joint once: of several actuators of one kind on a joint, each is in another one.
    """
    found: list[tuple[tuple[str, str, str], list[Actuator]]] = []
    for actuator in actuators:
        kind = _kind(actuator, facts)
        same = (own for other, own in found if other == kind and not _share(actuator, own))
        if (own := next(same, None)) is not None:
            own.append(actuator)
        else:
            found.append((kind, [actuator]))
    return [Channel(*kind, tuple(own)) for kind, own in found]


def _share(actuator: Actuator, others: Iterable[Actuator]) -> bool:
    """Whether an actuator with one joint moves one that others move."""
    joints = {joint for other in others for joint, _ in other.joints}
    return len(actuator.joints) == 1 and actuator.joints[0][0] in joints


def _kind(actuator: Actuator, facts: ModelFacts) -> tuple[str, str, str]:
    joints = [facts.joints[joint] for joint, _ in actuator.joints]
    units = {joint.unit for joint in joints}
    unit = units.pop() if len(units) == 1 else ""
    single = len(joints) == 1
    factor = actuator.factor * actuator.joints[0][1]
    force = _FORCE[unit] if single and abs(factor - 1.0) < 1e-9 else ""
    if joints[0].wheel and single and actuator.kind in ("velocity", "force"):
        return "wheel", unit, _SPEED[unit] if actuator.kind == "velocity" else force or "u"
    if single and actuator.linear and actuator.kind == "position":
        return "position", unit, unit
    if single and actuator.linear and actuator.kind == "velocity":
        return "velocity", unit, _SPEED[unit]
    if single and actuator.linear and actuator.kind == "force":
        return "force", unit, force
    return "other", unit, ""


class ChannelWriter:
    """Writes one channel into a draft: its names and types, then what its kind needs."""

    def __init__(
        self,
        draft: Draft,
        channel: Channel,
        prefix: str,
        facts: ModelFacts,
        names: SpecNames,
        near: Mapping[str, str],
    ) -> None:
        """`prefix` begins the names of its constants and types.

        `near`: by units of joints, the constants that say how near to the start is near.
        """
        self._draft, self._channel, self._prefix = draft, channel, prefix
        self._facts, self._names, self._near, self._letter = facts, names, near, draft.letter
        self._own = channel.actuators
        self._measured: dict[str, tuple[str, list[Joint]]] = {}

    def write(self) -> None:
        """Add the channel."""
        self._measure()
        {
            "position": self._position,
            "velocity": self._velocity,
            "force": self._force,
            "wheel": self._wheel,
            "other": self._other,
        }[self._channel.kind]()

    # Names, types and constants.

    def _constant(self, name: str, value: str, title: str = "") -> str:
        full = self._names.new(f"{self._prefix}_{name}")
        self._draft.constants[full] = {"is": value, "title": title} if title else value
        return full

    def _type(self, size: int, unit: str, word: str) -> str:
        if size == 1:
            return f"real[{unit}]" if unit else "real"
        text = f"vector[{size}, {unit}]" if unit else f"vector[{size}]"
        named = next((n for n, t in self._draft.types.items() if t == text), "")
        if not named:
            named = self._names.new(camel(f"{self._prefix}_{word}".replace("joints_", "joint_")))
            self._draft.types[named] = text
        return named

    def _measure(self) -> None:
        """Elements with the positions of the joints that move, one for each unit."""
        order = dict.fromkeys(joint for a in self._own for joint, _ in a.joints)
        joints = [self._facts.joints[joint] for joint in order]
        for unit, letter in (("rad", "q"), ("m", "s")):
            own = [joint for joint in joints if joint.unit == unit]
            if own:
                self._report(self._letter(letter), unit, own)

    def _report(self, name: str, unit: str, joints: list[Joint]) -> None:
        draft = self._draft
        type_ = self._type(len(joints), unit, "angles" if unit == "rad" else "positions")
        self._measured[unit] = name, joints
        draft.device["y"][name] = type_
        draft.outputs[name] = type_
        draft.tell[f"y.c.{name}"] = f"x.E.{name}"
        draft.bind[name] = {"joints": [joint.name for joint in joints]}
        most = NEAR[unit][1]
        if all(self._facts.strayed.get(joint.name, 0.0) < most for joint in joints):
            draft.near[name] = self._start(name, unit, joints), self._near[unit]

    def _start(self, name: str, unit: str, joints: list[Joint]) -> str:
        """The constant with the positions at the start."""
        initial = self._draft.initial
        if name not in initial:
            initial[name] = self._constant("start", vector([j.start for j in joints], unit))
        return initial[name]

    def _command(self, name: str, unit: str, word: str, safe: Data) -> str:
        type_ = self._type(self._channel.size, unit, word)
        self._draft.device["x"][name] = {"type": type_, "safe": safe}
        self._draft.bind[name] = {"actuators": [a.name for a in self._own]}
        return type_

    def _ask(self, name: str, type_: str, rest: str) -> None:
        self._draft.inputs[name] = {"type": type_, "init": rest}
        self._draft.hold[name] = rest

    def _limited(self, expression: str, type_: str, unit: str) -> str:
        """An expression within the ranges of the controls in the model, if there are any."""
        least, greatest = ([getattr(a, end) for a in self._own] for end in ("least", "greatest"))
        if all(end is None for end in (*least, *greatest)):
            return expression
        low = self._constant("least", vector([-_NO_LIMIT if v is None else v for v in least], unit))
        high = self._constant(
            "greatest", vector([_NO_LIMIT if v is None else v for v in greatest], unit)
        )
        if self._channel.size == 1:
            return f"min(max({expression}, {low}), {high})"
        limit = self._operator(
            "limit", f"(u: {type_}, least: {type_}, greatest: {type_}) -> {type_}", "within"
        )
        return f"{limit}({expression}, {low}, {high})"

    def _operator(self, name: str, signature: str, function: str) -> str:
        full = self._names.new(f"{name}_{self._prefix}")
        python = f"{_OPERATORS}:{function}"
        self._draft.operators[full] = {"signature": signature, "python": python}
        return full

    def _rest(self, unit: str, title: str) -> str:
        return self._constant("rest", vector([a.rest for a in self._own], unit), title)

    def _single(self) -> tuple[str, str, str]:
        """Element, type and start of the joints of a channel with one joint an actuator."""
        name, joints = self._measured[self._channel.unit]
        start = self._start(name, self._channel.unit, joints)
        return name, str(self._draft.device["y"][name]), start

    # Kinds.

    def _position(self) -> None:
        name, type_, start = self._single()
        self._command(f"{name}_d", self._channel.unit, "", {"is": name, "otherwise": start})
        leads = [a.rest - self._facts.joints[a.joints[0][0]].start for a in self._own]
        asked = f"x.c.{name}_d"
        if max(map(abs, leads)) > 1e-4:
            lead = self._constant(
                "lead",
                vector(leads, self._channel.unit),
                "what the servos must be ahead for the weight",
            )
            asked = f"{asked} + {lead}"
        self._ask(f"{name}_d", type_, start)
        self._draft.move[f"y.E.{name}_d"] = self._limited(asked, type_, self._channel.unit)

    def _velocity(self) -> None:
        name, type_, start = self._single()
        unit = self._channel.command
        letter = self._letter("w" if self._channel.unit == "rad" else "v")
        rest = self._rest(unit, "speeds that carry the weight")
        rate = self._constant(
            "rate", f"{number(self._own[0].gain)}[1/s]", "speed by distance: a guess"
        )
        sent = self._command(f"{letter}_d", unit, "speeds", rest)
        self._ask(f"{name}_d", type_, start)
        self._draft.let[letter] = f"{rest} + {rate} * (x.c.{name}_d - x.E.{name})"
        self._draft.move[f"y.E.{letter}_d"] = self._limited(letter, sent, unit)
        self._draft.notes.append(
            "Servos for speeds: the loop around them for positions is a guess."
        )

    def _force(self) -> None:
        name, type_, start = self._single()
        unit, force = self._channel.unit, self._channel.command
        letter = self._letter({"N*m": "tau", "N": "F"}.get(force, "u"))
        weight = self._constant(
            "weight", vector([a.rest for a in self._own], force), "carries the weight at the start"
        )
        sent = self._command(letter, force, "efforts", weight)
        scales = [a.joints[0][1] for a in self._own]
        rows = [(a.gain * c, a.damping * c) for a, c in zip(self._own, scales, strict=True)]
        K = self._constant("stiffness", vector([k for k, _ in rows], _per(force, unit)))
        D = self._constant("damping", vector([d for _, d in rows], _per(force, unit, "s")))
        speed = self._differentiated(name, type_)
        error = f"x.c.{name}_d - x.E.{name}"
        wanted = f"{weight} + {K} * ({error}) - {D} * {speed}"
        if self._channel.size > 1:
            vectors = (
                type_,
                *self._vectors(_SPEED[unit], _per(force, unit), _per(force, unit, "s")),
            )
            signature = "(e: {}, v: {}, K: {}, D: {}) -> ".format(*vectors) + sent
            drive = self._operator("drive", signature, "regulated")
            wanted = f"{weight} + {drive}({error}, {speed}, {K}, {D})"
        self._draft.let[f"{letter}_d"] = wanted
        self._ask(f"{name}_d", type_, start)
        self._draft.move[f"y.E.{letter}"] = self._limited(f"{letter}_d", sent, force)
        self._draft.notes.append(
            f"Motors without a controller of their own: a joint gets critically damped gains for "
            f"{number(self._facts.frequency)} rad/s (a guess), by the mass that its motor feels at "
            f"the start in the model, and the weight that it carries there."
        )

    def _vectors(self, *units: str) -> list[str]:
        return [f"vector[{self._channel.size}, {unit}]" for unit in units]

    def _differentiated(self, name: str, type_: str) -> str:
        before = f"{name}_p"
        self._draft.memory[before] = {
            "type": type_,
            "init": f"x.E.{name}",
            "title": "positions of the period before",
        }
        self._draft.move[before] = f"x.E.{name}"
        self._draft.let[f"{name}_v"] = f"(x.E.{name} - {before}) / period"
        return f"{name}_v"

    def _wheel(self) -> None:
        name, _ = self._measured[self._channel.unit]
        type_ = str(self._draft.device["y"][name])
        unit, speed_unit = self._channel.unit, _SPEED[self._channel.unit]
        letter = self._letter("w")
        speeds = self._type(self._channel.size, speed_unit, "speeds")
        stop = self._constant("stop", vector([0.0] * self._channel.size, speed_unit))
        self._ask(f"{letter}_d", speeds, stop)
        if self._channel.command == speed_unit:
            self._command(f"{letter}_d", speed_unit, "speeds", stop)
            asked = self._limited(f"x.c.{letter}_d", speeds, speed_unit)
            self._draft.move[f"y.E.{letter}_d"] = asked
            return
        force = self._channel.command.replace("u", "")
        effort = self._letter("tau" if force else "u")
        sent = self._command(effort, force, "efforts", vector([0.0] * self._channel.size, force))
        dampings = [a.damping * a.joints[0][1] for a in self._own]
        by = _per(force, unit, "s")
        error = f"x.c.{letter}_d - {self._differentiated(name, type_)}"
        if max(dampings) - min(dampings) <= 1e-3 * abs(dampings[0]):
            D = self._constant("damping", f"{dampings[0]:.4g}[{by}]")
            wanted = f"{D} * ({error})"
        else:  # as of wheels on both sides, of which one is geared backwards
            D = self._constant("damping", vector(dampings, by))
            signature = f"(v: {speeds}, by: {self._vectors(by)[0]}) -> {sent}"
            wanted = f"{self._operator('drive', signature, 'scaled')}({error}, {D})"
        self._draft.let[f"{effort}_d"] = wanted
        self._draft.move[f"y.E.{effort}"] = self._limited(f"{effort}_d", sent, force)
        self._draft.notes.append(
            f"Wheels with motors: their speed is controlled for {number(self._facts.frequency)} "
            "rad/s (a guess), by the mass that a motor feels in the model."
        )

    def _other(self) -> None:
        """In the scale of the model: what is sent to hold the pose is a constant."""
        letter = self._letter("u")
        rest = self._rest("", "controls that hold the start")
        sent = self._command(f"{letter}", "", "controls", rest)
        self._ask(f"{letter}_d", sent, rest)
        self._draft.move[f"y.E.{letter}"] = self._limited(f"x.c.{letter}_d", sent, "")
        self._draft.notes.append(
            "Controls in a scale of the model's own, passed on as they are; what they move follows."
        )


def _per(force: str, unit: str, by: str = "") -> str:
    above = "*".join(filter(None, (force, by))) or "1"
    return f"{above}/{unit}"


def number(value: float) -> str:
    """A number as it is written."""
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


def noted(value: Data, lines: Sequence[str]) -> Data:
    """A value with comments above it, if there are any."""
    return Noted(value, tuple(lines)) if lines else value


def qualified(prefix: str, bind: Mapping[str, Data]) -> dict[str, Data]:
    """Bindings of a device by their whole names."""
    return {f"{prefix}.{name}": how for name, how in bind.items()}
