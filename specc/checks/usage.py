"""What is defined, sent or remembered without being used."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Set
from operator import attrgetter

from specc.analysis import Facts
from specc.analysis.reads import inputs_read, nodes
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import join_words
from specc.lang import RESERVED
from specc.model.expr import (
    Call,
    ConstantRef,
    Expr,
    FileRef,
    LetRef,
    MemoryRef,
    ParameterRef,
    walk,
)
from specc.model.fsm import Behaviour, Condition, Function, Generic
from specc.model.requirement import expressions_in
from specc.model.system import Let, Memory, Subsystem
from specc.model.types import Enum
from specc.model.wires import Wire
from specc.reachable import grouped, reachable
from specc.source import Place

# What serves a purpose, directly or through others. Things have labels such as `let T_c`.


MOST = 8
"""Things that are shown with one that is not used."""
_NONE: frozenset[str] = frozenset()
_KINDS = {
    Call: ("operator", attrgetter("operator")),
    ConstantRef: ("constant", attrgetter("name")),
    FileRef: ("file", attrgetter("name")),
}


def _named(parts: Iterable[Expr]) -> set[str]:
    """The names of definitions that parts of expressions use."""
    kinds = ((_KINDS[type(part)], part) for part in parts if type(part) in _KINDS)
    return {f"{kind} {name(part)}" for (kind, name), part in kinds}


def _unused_findings(
    code: str, places: Mapping[str, Place], uses: Mapping[str, Set[str]], roots: Set[str]
) -> Iterator[Diagnostic]:
    """Yield a finding for each definition not reachable from `roots`, with those that only it uses.

    `uses` has the names that each definition uses.
    """
    used = reachable(roots, lambda one: uses.get(one, _NONE)).keys()
    left = {label: index for index, label in enumerate(places) if label not in used}
    inner = {other for label in left for other in uses.get(label, _NONE) if other != label}
    for label in (label for label in left if label not in inner):
        found = reachable(uses.get(label, _NONE), lambda one: uses.get(one, _NONE) - used)
        behind = sorted(found.keys() & left.keys(), key=left.__getitem__)
        yield Diagnostic(
            code,
            f"{_quoted(label)} is not used",
            places[label],
            related=tuple(
                Related(places[other], f"and so is {_quoted(other)}") for other in behind[:MOST]
            ),
            help="use or delete it",
        )


def _quoted(label: str) -> str:
    kind, _, name = label.rpartition(" ")
    return f"{kind} `{name}`"


# Every named part of a subsystem is used somewhere in it.


SubsystemPart = Behaviour | Condition | Function | Generic | Let | Memory
Readable = dict[tuple[type[Expr], str], Let | Memory]


def parts_used(facts: Facts) -> Iterator[Diagnostic]:
    """W0611; memory that is written counts as used."""
    for machine in facts.complete_machines:
        yield from _unused_parts(machine.subsystem, facts.watched(machine.subsystem))
        for generic in machine.subsystem.generics:
            yield from _unused_parameters(generic)


def _unused_parameters(generic: Generic) -> Iterator[Diagnostic]:
    nodes = (node for _, expr in generic.exprs for node in walk(expr))
    used = {node.name for node in nodes if isinstance(node, ParameterRef)}
    for parameter in (p for p in generic.parameters if p.name not in used):
        message = f"parameter `{parameter.name}` is not used"
        help = "use it, or delete it here and in the calls"
        yield Diagnostic("W0611", message, parameter.place, help=help)


def _unused_parts(subsystem: Subsystem, watched: Set[str]) -> Iterator[Diagnostic]:
    named: Readable = {(LetRef, item.name): item for item in subsystem.lets}
    named |= {(MemoryRef, item.name): item for item in subsystem.memory}
    every: list[SubsystemPart] = [*subsystem.behaviours, *subsystem.functions]
    every += [*subsystem.generics, *subsystem.conditions, *named.values()]
    parts: dict[str, SubsystemPart] = {_label(part): part for part in every}
    start: list[SubsystemPart] = [state.behaviour for state in subsystem.states]
    start += [error for mode in subsystem.modes for _, error in mode.errors]
    start += [row.condition for row in subsystem.transitions]
    exprs = [row.condition.when for row in subsystem.transitions if row.resumes]
    start += _named_in([*exprs, *(axiom.that for axiom in subsystem.axioms)], named)
    start += [item for item in subsystem.memory if item.name in watched]
    # Nothing can name these in an expression, which is an error of its own.
    start += [part for part in named.values() if part.name in RESERVED]
    uses = {label: [*map(_label, _direct_uses(part, named))] for label, part in parts.items()}
    used = reachable(map(_label, start), lambda label: uses.get(label, ()))
    left = {label: part for label, part in parts.items() if label not in used}
    # Calls, and what the work cycle keeps for modes, are there for what names them.
    unused = {
        label: part
        for label, part in left.items()
        if not (
            getattr(part, "generic", None) or (isinstance(part, (Let, Memory)) and "(" in label)
        )
    }
    edges = {label: set(uses[label]) for label in unused}
    yield from _unused_findings(
        "W0611", {label: _place(part) for label, part in unused.items()}, edges, _NONE
    )


def _place(part: SubsystemPart) -> Place:
    return part.part.place if isinstance(part, Generic) else part.place


def _label(part: SubsystemPart) -> str:
    match part:
        case Generic(part=whole):
            return _label(whole)
        case Condition(kind=kind):
            return f"{kind} condition {part.name}"
        case Memory():
            return f"memory element {part.name}"
    return f"{type(part).__name__.lower()} {part.name}"


def _direct_uses(part: SubsystemPart | None, named: Readable) -> list[SubsystemPart]:
    """The parts that a part names, and the memory that it writes."""
    match part:
        case Generic(part=Behaviour() as whole):
            # What stands in place in it is a part of the subsystem in its calls only.
            inner = _direct_uses(whole, named)
            return inner + [used for one in inner for used in _direct_uses(one, named)]
        case Generic(part=whole):
            return _direct_uses(whole, named)
        case Behaviour(functions=functions):
            calls = [call for call in functions if call.generic]
            of_calls = [used for call in calls for used in _direct_uses(call, named)]
            own = [part.generic] if part.generic else []
            errors = [error for _, error in part.errors]
            return [*functions, part.terminal, *errors, *own, *of_calls]
        case Function(assignments=items):
            written = [(MemoryRef, item.name) for item in items if not item.peer]
            found: list[SubsystemPart] = [named[name] for name in written if name in named]
            found += [part.generic] if part.generic else []
            return found + _named_in([item.value for item in items], named)
        case Condition(when=value) | Let(value=value):
            return _named_in([value], named)
    return []


def _named_in(values: Iterable[Expr], named: Readable) -> list[SubsystemPart]:
    """The lets and the memory that expressions name."""
    nodes = [n for value in values for n in walk(value) if isinstance(n, (LetRef, MemoryRef))]
    return [named[name] for n in nodes if (name := (type(n), n.name)) in named]


# What the main file defines for all agents is used by one of them.


def definitions_used(facts: Facts) -> Iterator[Diagnostic]:
    """W0240, if there are agents; a library may define more than one system needs."""
    system = facts.system
    if not system.subsystems:
        return
    places = {definition.label: definition.place for definition in system.definitions}
    edges: dict[str, Set[str]] = {d.label: d.names for d in system.definitions}
    for constant in system.constants:
        label = f"constant {constant.name}"
        edges[label] = edges.get(label, _NONE) | _named(walk(constant.value))
    yield from _unused_findings("W0240", places, edges, _needed_by_agents(facts))


def observed_used(facts: Facts) -> Iterator[Diagnostic]:
    """W0240, if there are formulas; one used copy of a `for` is enough."""
    plant, readings = facts.system.plant, [r for item in facts.formulas for r in item.readings]
    named = {reading.element[0] for reading in readings if reading.kind == "observed"}
    observed = plant.observed if plant and facts.formulas else ()
    used = {item.place for item in observed if item.name in named}
    for place, name in {item.place: item.name for item in reversed(observed)}.items():
        if place not in used:
            message = f"`plant.{name}` is observed and not used"
            help = "name it in a requirement, or delete it"
            yield Diagnostic("W0240", message, place, help=help)


def formula_lets_used(facts: Facts) -> Iterator[Diagnostic]:
    """W0240; those of formulas, which no expression of an agent names."""
    lets = {f"let {item.name}": item for item in facts.system.formula_lets}
    edges = {label: {f"let {name}" for name in item.names} for label, item in lets.items()}
    start = {f"let {name}" for item in facts.formulas for name in item.names}
    yield from _unused_findings(
        "W0240", {label: i.place for label, i in lets.items()}, edges, start
    )


def _needed_by_agents(facts: Facts) -> set[str]:
    system = facts.system
    found = set(system.named_in_agents)
    for subsystem in system.subsystems:
        found |= _named(nodes(subsystem))
    for device in system.devices:
        for _, safe in device.safe:
            found |= _named(walk(safe.value))
            found |= _named(walk(safe.otherwise)) if safe.otherwise else set()
    for requirement in facts.formulas:
        for part in expressions_in(requirement.formula):
            found |= _named(walk(part))
    numbers = (number for each in system.disturbances for number in each.numbers)
    for start in (*system.starts, *numbers):
        for part in start.texts:
            found |= _named(walk(part))
    for binding in system.plant.bindings if system.plant else ():
        for part in binding.panel.texts if binding.panel else ():
            found |= _named(walk(part))
        for given in filter(None, (binding.initial, binding.on_loss)):
            found |= _named(walk(given.expr))
    return found


# What is sent to a subsystem is read there.


def elements_read(facts: Facts) -> Iterator[Diagnostic]:
    """W0412, at the end that receives the element.

    What devices and reused descriptions send is not for the reader to choose; of an interface, one
    of its readers reads each element.
    """
    found = {s.qualified_name: inputs_read(s) for s in facts.subsystems}
    anywhere = {
        s.inputs[name].place
        for s in facts.subsystems
        for name in found[s.qualified_name] & s.inputs.keys()
    }
    for subsystem in facts.subsystems:
        read = found[subsystem.qualified_name]
        for wire in facts.wires.wires_of(subsystem):
            port, sender = wire.port, wire.peer_subsystem
            # What a description in another file sends is said there.
            given = wire.peer_port and wire.peer_port.place.file != subsystem.place.file
            if port.direction == "y" or sender is None or given:
                continue
            for element in port.elements:
                if (port.peer, element.name) not in read and element.place not in anywhere:
                    yield Diagnostic(
                        "W0412",
                        f"`{subsystem.qualified_name}` never reads `x.{port.peer}.{element.name}`",
                        element.place,
                        related=(Related(sender.place, f"`{wire.peer_name}` has it in its `y`"),),
                        help="use it, or delete it at both ends",
                    )


# Every member of an event's enum that is sent makes a difference to its reader.


def members_heard(facts: Facts) -> Iterator[Diagnostic]:
    """W0422; of an interface, one of its readers is to react to each member."""
    read = {s.qualified_name: inputs_read(s) for s in facts.subsystems}
    events = grouped(
        (element.place, (wire, element))
        for subsystem in facts.subsystems
        for wire in facts.wires.wires_of(subsystem)
        for element in (
            wire.port.elements if wire.port.direction == "x" and wire.peer_subsystem else ()
        )
        if element.event and isinstance(element.type, Enum)
    )
    for readers in events.values():
        heard, sent = set[str](), dict[str, Place]()
        for wire, element in readers:
            machine, key = facts.of(wire.subsystem), (wire.port.peer, element.name)
            if not machine.is_complete or key not in read[wire.subsystem.qualified_name]:
                break
            if all(key in state.ignores for state in wire.subsystem.states):
                break  # it says that it means to miss members
            states, rows = wire.subsystem.states, wire.subsystem.transitions
            exprs = [end.when for state in states for _, end in state.behaviour.endings]
            exprs += [item.value for state in states for item in state.behaviour.assignments]
            heard |= machine.reactions((*exprs, *(row.condition.when for row in rows)), key)
            sent |= _members_sent(facts, wire, element.name)
        else:
            unheard = {member: sent[member] for member in sent if member not in heard}
            if unheard:
                wire, element = readers[0]
                name = f"x.{wire.port.peer}.{element.name}"
                members = join_words([f"`{member}`" for member in unheard], "and")
                yield Diagnostic(
                    "W0422",
                    f"`{wire.subsystem.qualified_name}` does not react to {members} of `{name}`",
                    element.place,
                    "lost in every state",
                    tuple(Related(place, f"sends `{m}`") for m, place in unheard.items()),
                    f"ask for it beside `fresh({name})`, or let `fresh({name})` end a state, with "
                    "a row `otherwise` for all that no other row names",
                )


def _members_sent(facts: Facts, wire: Wire, element: str) -> dict[str, Place]:
    """The members that the sender of an element surely names, each with where it does."""
    found: dict[str, Place] = {}
    sender, end = wire.peer_subsystem, wire.peer_port
    if sender is None or end is None or sender.qualified_name in facts.broken:
        return found
    machine = facts.of(sender)
    for state in (s for s in sender.states if s.name in machine.reachable_states):
        for item in state.behaviour.assignments:
            if (item.peer, item.name) == (end.peer, element):
                for member in sorted(machine.value_ranges.members(item.value)):
                    found.setdefault(member, item.place)
    return found


# Every element of an output buffer is written by some behaviour.


def elements_written(facts: Facts) -> Iterator[Diagnostic]:
    """W0413, for an output that no behaviour writes."""
    for subsystem in facts.subsystems:
        for wire in facts.wires.wires_of(subsystem):
            port, reader = wire.port, wire.peer_subsystem
            for element in port.elements if port.direction == "y" else ():
                if (port.peer, element.name) in subsystem.assigned_values:
                    continue
                yield Diagnostic(
                    "W0413",
                    f"no behaviour of `{subsystem.qualified_name}` writes "
                    f"`y.{port.peer}.{element.name}`",
                    port.place_of(element),
                    "never sent",
                    (Related(reader.place, "waits for it forever"),) if reader else (),
                    "write it in a function of a behaviour, or delete it at both ends",
                )


# What is remembered is used for something.


def memory_read(facts: Facts) -> Iterator[Diagnostic]:
    """W0615; memory that is not even written is `parts_used`'s matter."""
    for subsystem in facts.subsystems:
        read = {node.name for node in nodes(subsystem) if isinstance(node, MemoryRef)}
        read |= facts.watched(subsystem)
        writers = {a.name: a for f in subsystem.functions for a in f.assignments if not a.peer}
        for element in subsystem.memory:
            if element.name in writers and element.name not in read:
                yield Diagnostic(
                    "W0615",
                    f"memory element `{element.name}` is written and never read",
                    element.place,
                    related=(Related(writers[element.name].place, "written here"),),
                    help="read it, delete it, or list it under `watch:` of the task",
                )
