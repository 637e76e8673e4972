"""`specc import fabric`: subsystem definitions of FABRIC become agents of a specification."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction

from specc.lang.packages import PACKAGES
from specc.tools.importers.fabric.reader import FabricSubsystem, read_definition
from specc.tools.importers.fabric.subsystem import AgentMaker
from specc.tools.importers.fabric.wiring import End, Ends, SharedDefinitions, Wiring, connect
from specc.tools.importers.import_notes import Notes, document, read_markup
from specc.tools.importers.writing import PEERS, Data, SpecNames, rate

DEFAULT_PERIOD_S = Fraction(1, 1000)
_WAITING = "a subsystem of specc steps every period, whether or not data has come"
_TIME = "whether time is simulated or real is decided by `specc run`"
_REASONS = {
    ("buffer_groups", ""): _WAITING,
    ("trigger_methods", ""): _WAITING,
    ("new_data_on_buffer", ""): _WAITING,
    ("no_data_on_buffer", ""): _WAITING,
    ("interval", "first"): _WAITING,
    ("interval", "first_sim"): _WAITING,
    ("interval", "next"): _WAITING,
    ("buffer_group", "name"): _WAITING,
    ("buffer_group", "first_timeout"): _WAITING,
    ("buffer_group", "next_timeout"): _WAITING,
    ("buffer_group", "first_timeout_sim"): _TIME,
    ("buffer_group", "min_period_sim"): _TIME,
    ("buffer_group", "used_time"): _TIME,
    ("simulation", ""): _TIME,
    ("in", "converter"): "messages are opaque; convert them in the operators",
    ("out", "converter"): "messages are opaque; convert them in the operators",
}


def import_fabric(
    paths: Sequence[str],
    *,
    name: str = "",
    period: Fraction | None = None,
    wires: Iterable[tuple[End, End]] = (),
) -> Notes:
    """The specification of the subsystems that some files define.

    `name` is that of the system; `period`, in seconds, replaces the periods in the files; `wires`
    are pairs of buffers that are connected, beyond what is evident.
    """
    notes = Notes()
    definitions: list[FabricSubsystem] = []
    for path in dict.fromkeys(paths):
        root = read_markup(path, "subsystem_definition", notes)
        definition = read_definition(root, notes) if root is not None else None
        if definition is not None:
            if any(d.name == definition.name for d in definitions):
                message = f"two files define a subsystem `{definition.name}`"
                help = "rename one of the files: subsystems are called as their files or packages"
                notes.error("E0806", message, definition.root.place, help)
            definitions.append(definition)
    wiring = None if notes.failed else connect(definitions, wires, notes)
    if wiring is not None and not notes.failed:
        notes.text = _text(definitions, name, period, wiring, notes)
    return notes


def _text(
    definitions: Sequence[FabricSubsystem],
    name: str,
    period: Fraction | None,
    wiring: Wiring,
    notes: Notes,
) -> str:
    names, library = SpecNames(PEERS), SharedDefinitions()
    for definition in definitions:
        names.of(definition.name)
    agents: dict[str, Data] = {}
    for definition in definitions:
        own = rate(_period(definition, period, notes))
        ends = Ends(definition, names, library, wiring, own)
        agents |= AgentMaker(definition, own, ends, library, notes).agents()
        _assumed(definition, notes)
        notes.leftovers(definition.root, _REASONS)
    wish = name or (definitions[0].name if len(definitions) == 1 else "fabric")
    system = SpecNames(PACKAGES).of(wish)
    data: dict[str, Data] = {"specc": "1", "system": system, "types": library.types}
    data |= {"operators": library.operators, "agents": agents}
    modules = ", ".join(library.modules)
    provided = f"What `specc build` makes of it imports, and you provide, the modules {modules}."
    return document("specc import fabric", [provided], notes, data)


def _assumed(definition: FabricSubsystem, notes: Notes) -> None:
    """What holds of every import: the two work cycles differ in little."""
    place = definition.root.place
    notes.changed(
        "conditions are not evaluated in the first period; FABRIC evaluates them there too", place
    )
    if any(not b.is_input for b in definition.buffers):
        notes.changed("every behaviour is taken to write every output buffer", place)
    if any(b.is_input for b in definition.buffers):
        message = "an input buffer keeps its last message, and holds an empty one before the first"
        notes.changed(message, place)


def _period(definition: FabricSubsystem, given: Fraction | None, notes: Notes) -> Fraction:
    """The period of a subsystem: the given one, or the shortest of those of its states."""
    if given is not None:
        return given
    periods = [s.period_s for s in definition.states if s.period_s]
    periods += [definition.period_s] if definition.period_s else []
    if not periods:
        text = f"{float(DEFAULT_PERIOD_S * 1000):g} ms"
        message = f"`{definition.name}` has no period; {text} is assumed"
        notes.changed(message, definition.root.place, "give one with `--period`")
        return DEFAULT_PERIOD_S
    shortest = min(periods)
    waiting = [s for s in definition.states if not s.period_s and not definition.period_s]
    slower = [s for s in definition.states if s.period_s and s.period_s != shortest]
    for state in slower or waiting:
        message = f"the period is {float(shortest * 1000):g} ms in all states"
        notes.changed(f"{message}; state `{state.name}` has another one", state.element.place)
    return shortest
