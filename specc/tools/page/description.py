"""What the page has to know of a specification before it shows anything: names, texts, pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

from specc.lang.show import show
from specc.model.expr import Live
from specc.model.fsm import State
from specc.model.system import Constant, Subsystem, System
from specc.model.types import OptionalOf, Pose, complete_type
from specc.pipeline import Result
from specc.refusal import Refused
from specc.source import Place
from specc.tools.graph import picture
from specc.tools.graph.formats import FORMATS
from specc.tools.page.messages import Message
from specc.tools.page.server import Asset
from specc.tools.plot import ListedSignal, list_signals

_SVG = "image/svg+xml"
_LONGEST = 10_000
"""Characters of a text of a specification that are shown."""


class Assets:
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

    def __init__(self, system: System, result: Result, assets: Assets) -> None:
        self.system = system
        self._result = result
        self.subsystems = {s.qualified_name: s for s in system.subsystems}
        self.signals = {each.name: each for each in list_signals(system)}
        self.arcs: dict[tuple[str, str], str] = {}
        """What is sent from one part to another -> the id of its arc in the structure."""
        self._structure = assets.add(lambda: _drawn(system, "", "structure"))
        self._pictures = {
            name: assets.add(lambda name=name: _drawn(system, name, "states"))
            for name, subsystem in self.subsystems.items()
            if subsystem.states
        }

    def at(self, place: Place) -> str:
        """`file:line` of a place."""
        span = self._result.sources.span(place)
        return f"{span.file}:{span.line}"

    @cached_property
    def message(self) -> dict[str, Any]:
        """What `hello` says of the specification."""
        system = self.system
        requirements = (
            {"that": r.that, "because": r.because, "place": self.at(r.place)}
            for r in system.requirements
        )
        return _shortened(
            {
                "title": system.title or system.name,
                "system": system.name,
                "machines": list(map(self._machine, system.subsystems)),
                "structure": self._structure,
                "parts": {},
                "signals": [*map(_state_signal, system.subsystems), *self._signals()],
                "requirements": list(requirements),
                "frames": [name for name, _ in system.frames],
                "poses": list(self._poses()),
                "constants": list(self._constants()),
            }
        )

    def _machine(self, subsystem: Subsystem) -> dict[str, Any]:
        """A subsystem with its states and rows, and their ids in its picture."""
        name = subsystem.qualified_name
        prefix = self.prefix(name)
        rows = [
            {
                "label": row.label,
                "id": f"{prefix}-r-{number}",
                "source": row.source,
                "target": row.target,
                "cause": row.cause,
                "place": self.at(row.place),
            }
            for number, row in enumerate(subsystem.transitions)
        ]
        return {
            "name": name,
            "title": subsystem.title,
            "period_s": float(1 / subsystem.rate_hz),
            "svg": self._pictures.get(name),
            "states": [
                {
                    "name": state.name,
                    "title": state.title or state.behaviour.title,
                    "id": f"{prefix}-s-{state.name}",
                    "is_error": _is_error(subsystem, state),
                    "modes": list(state.modes),
                    "place": self.at(state.place),
                }
                for state in subsystem.states
            ],
            "rows": rows,
        }

    def prefix(self, machine: str) -> str:
        """What the ids in the picture of a machine begin with."""
        return f"m{list(self.subsystems).index(machine)}"

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

    def _constants(self) -> Iterator[dict[str, str]]:
        """What another run can set."""
        known = {each.name: each for each in self.system.constants}
        for name, unit in self._result.units.items():
            constant = known.get(name)
            yield {"name": name, "text": _initial(constant) if constant else "", "unit": unit}


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
    is_live = isinstance(constant.value, Live) and constant.initial is not None
    return show(constant.initial if is_live and constant.initial else constant.value)


def _drawn(system: System, place: str, kind: Any) -> Asset | None:
    """The picture of a place, if there is one and Graphviz can draw it."""
    try:
        _, diagram = picture(system, place, kind)
        return Asset(_SVG, FORMATS["svg"].render(diagram))
    except Refused:
        return None


def _shortened(data: Any) -> Any:
    """Data with no text longer than anybody reads."""
    if isinstance(data, str):
        return data if len(data) <= _LONGEST else f"{data[:_LONGEST]}…"
    if isinstance(data, Mapping):
        return {_shortened(name): _shortened(value) for name, value in data.items()}
    return [_shortened(value) for value in data] if isinstance(data, Sequence) else data


def hello_of(description: Description, about: Message) -> Message:
    """`hello`: what is known of the specification, and of the run or the file."""
    return {**description.message, **about}
