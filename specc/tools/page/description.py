"""What the page has to know of a specification before it shows anything: names, texts, pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from itertools import chain
from typing import Any

from specc.diagnostics.visible import visible
from specc.lang.show import show
from specc.model.bindings import PLANT
from specc.model.expr import Expr, Live, Number, constant_names
from specc.model.fsm import State
from specc.model.requirement import Requirement, expressions_in
from specc.model.system import Constant, Subsystem, System
from specc.model.types import OptionalOf, Pose, complete_type
from specc.model.units import DIMENSIONLESS
from specc.model.wires import Wires
from specc.pipeline import Result
from specc.refusal import Refused
from specc.source import Place
from specc.tools.graph.page import (
    MachinePicture,
    StructurePicture,
    machine_picture,
    structure_picture,
)
from specc.tools.page.frames import carriers
from specc.tools.page.messages import Asset
from specc.tools.plot import ListedSignal, list_signals
from specc.tools.why import value_text

_SVG = "image/svg+xml"
_MOST_USUAL = 4
_LONGEST = 10_000
"""Characters of a text of a specification that are shown."""


class AssetShelf:
    """Files that have numbers in place of names; each is made when it is first asked for."""

    def __init__(self) -> None:
        self._makers: list[Callable[[], Asset | None]] = []
        self._made: dict[int, Asset | None] = {}

    def add(self, make: Callable[[], Asset | None]) -> str:
        """The URL of a further asset."""
        self._makers.append(make)
        return f"/asset/{len(self._makers) - 1}"

    def get(self, number: int) -> Asset | None:
        """None if there is none of that number, or it cannot be made."""
        if number not in self._made:
            if number >= len(self._makers):
                return None
            self._made[number] = self._makers[number]()
        return self._made[number]


class Description:
    """A compiled specification, as the page shows it."""

    def __init__(self, system: System, result: Result, assets: AssetShelf) -> None:
        self.system = system
        self._result = result
        self.subsystems = {s.qualified_name: s for s in system.subsystems}
        self.signals = {each.name: each for each in list_signals(system)}
        self._structure = structure_picture(system, "structure")
        self.arcs = dict(self._arcs_of_ports())
        """The arcs in the structure: subsystem, "x" or "y" and peer -> id."""
        self._assets = assets

    def at(self, place: Place) -> str:
        """`file:line` of a place."""
        span = self._result.sources.span(place)
        return f"{span.file}:{span.line}"

    def _arcs_of_ports(self) -> Iterator[tuple[tuple[str, str, str], str]]:
        wires = Wires(self.system.agents)
        for wire in (w for subsystem in self.system.subsystems for w in wires.wires_of(subsystem)):
            name, port = wire.subsystem.qualified_name, wire.port
            is_sent = port.direction == "y"
            ends = (name, wire.peer_name) if is_sent else (wire.peer_name, name)
            if id := self._structure.arcs.get(ends):
                yield (name, port.direction, port.peer), id

    @cached_property
    def words(self) -> dict[str, dict[str, str]]:
        """Title and unit of constants, and of what real receptors report."""
        found = {c.name: (c.title, c.value.type) for c in self.system.constants}
        for device in self.system.devices:
            found |= {f"{device.qualified_name}.{e.name}": (e.title, e.type) for e in device.y}
        return {
            name: {
                "title": _shortened(title),
                "unit": " and ".join(str(u) for u in type_.units if u != DIMENSIONLESS),
            }
            for name, (title, type_) in found.items()
        }

    @cached_property
    def message(self) -> dict[str, Any]:
        """What `hello` says of the specification."""
        system = self.system
        requirements = (
            {
                "that": r.that,
                "because": r.because,
                "place": self.at(r.place),
                "constants": dict(self._constants_of(r)),
            }
            for r in system.run_requirements
        )
        found = _shortened(
            {
                "title": system.title or system.name,
                "system": system.name,
                "machines": [
                    self._machine(subsystem, f"m{number}")
                    for number, subsystem in enumerate(system.subsystems)
                ],
                "structure": self._drawn_later(self._structure),
                "parts": dict(self._structure.parts),
                "signals": [*map(_state_signal, system.subsystems), *self._signals()],
                "requirements": list(requirements),
                "frames": [name for name, _ in system.frames],
                "poses": list(self._poses()),
                "carriers": carriers(system),
                "constants": list(self._constants()),
            }
        )
        return {**found, "usual": usual_signals(found["signals"])}

    def _machine(self, subsystem: Subsystem, prefix: str) -> dict[str, Any]:
        """A subsystem with its states and rows, and their ids in its picture."""
        drawn = machine_picture(subsystem, prefix)
        rows = [
            {
                "label": row.label,
                "id": id,
                "source": row.source,
                "target": row.target,
                "cause": row.cause,
                "place": self.at(row.place),
            }
            for row, id in zip(subsystem.transitions, drawn.rows, strict=True)
        ]
        states = [
            {
                "name": state.name,
                "title": state.title or state.behaviour.title,
                "id": drawn.states[state.name],
                "is_error": _is_error(subsystem, state),
                "modes": list(state.modes),
                "place": self.at(state.place),
            }
            for state in subsystem.states
        ]
        return {
            "name": subsystem.qualified_name,
            "title": subsystem.title,
            "period_s": float(1 / subsystem.rate_hz),
            "svg": self._drawn_later(drawn) if states else None,
            "states": states,
            "rows": rows,
            "modes": [{"name": name, "id": id} for name, id in drawn.modes.items()],
        }

    def _drawn_later(self, picture: MachinePicture | StructurePicture) -> str:
        """The URL of a picture, which Graphviz draws when it is asked for; or of why it cannot."""

        def draw() -> Asset:
            try:
                return Asset(_SVG, picture.svg.encode())
            except Refused as refused:
                return Asset("text/plain; charset=utf-8", visible(str(refused)).encode())

        return self._assets.add(draw)

    def _signals(self) -> Iterator[dict[str, Any]]:
        for each in self.signals.values():
            parts = each.signal.components if each.signal else ()
            units = dict.fromkeys(part.unit for part in parts if part.unit)
            yield {
                "name": each.name,
                "title": each.title,
                "unit": " and ".join(units),
                "kind": _kind(each),
                "components": [
                    {"name": p.name, "unit": p.unit, "words": list(p.words)} for p in parts
                ],
            }

    def _poses(self) -> Iterator[dict[str, str]]:
        """The signals that are poses, with their frames."""
        for each in self.signals.values():
            inner = each.type.value if isinstance(each.type, OptionalOf) else each.type
            match complete_type(inner):
                case Pose(parent=parent, child=child):
                    yield {"name": each.name, "base": parent, "end": child}

    def _constants_of(self, requirement: Requirement) -> Iterator[tuple[str, str]]:
        """The constants in a requirement, and what they are."""
        known = {each.name: each for each in self.system.constants}
        parts = map(constant_names, expressions_in(requirement.formula))
        for name in dict.fromkeys(chain.from_iterable(parts)):
            if constant := known.get(name):
                yield name, _quantity(constant)

    def _constants(self) -> Iterator[dict[str, str]]:
        """What another run can set."""
        known = {each.name: each for each in self.system.constants}
        for name, unit in self._result.units.items():
            constant = known.get(name)
            yield {"name": name, "text": _initial(constant) if constant else "", "unit": unit}


def usual_signals(signals: Sequence[Mapping[str, Any]]) -> list[str]:
    """Names of signals that are shown before any were chosen.

    First what is really so, then inputs of control subsystems, as far as they are numbers.
    """

    def rank(name: str) -> int:
        return 0 if name.startswith(f"{PLANT}.") else 1 if ".c.x." in name else 2

    drawn = [s["name"] for s in signals if s["components"] and s["kind"] != "state"]
    return sorted(drawn, key=rank)[:_MOST_USUAL]


def _is_error(subsystem: Subsystem, state: State) -> bool:
    """Whether only errors lead to it."""
    rows = [r for r in subsystem.transitions if r.target == state.name != r.source]
    return bool(rows) and all(row.cause != "terminal" for row in rows)


def _kind(signal: ListedSignal) -> str:
    if signal.signal is None:
        return "other"
    return "pose" if signal.signal.is_pose else "numbers"


def _state_signal(subsystem: Subsystem) -> dict[str, Any]:
    """The state of a machine as a signal."""
    words = [state.name for state in subsystem.states]
    return {
        "name": subsystem.qualified_name,
        "title": subsystem.title,
        "unit": "",
        "kind": "state",
        "components": [{"name": "", "unit": "", "words": words}],
    }


def _initial(constant: Constant) -> str:
    return show(_value(constant))


def _quantity(constant: Constant) -> str:
    """Its value as people write it."""
    value = _value(constant)
    return value_text(value.type, value.value) if isinstance(value, Number) else show(value)


def _value(constant: Constant) -> Expr:
    is_live = isinstance(constant.value, Live) and constant.initial is not None
    return constant.initial if is_live and constant.initial else constant.value


def _shortened(data: Any) -> Any:
    """Data with no text longer than anybody reads."""
    if isinstance(data, str):
        return data if len(data) <= _LONGEST else f"{data[:_LONGEST]}…"
    if isinstance(data, Mapping):
        return {_shortened(name): _shortened(value) for name, value in data.items()}
    return [_shortened(value) for value in data] if isinstance(data, Sequence) else data
