"""Every state can be reached from the initial one."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.graph import components
from specc.model.system import Subsystem, System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0607, once for states that hang together, at those from which the others are reached."""
    for subsystem in facts.finished_subsystems:
        reached = facts.reached(subsystem)
        left = [s.name for s in subsystem.states if s.name not in reached]
        if left:
            yield from _findings(subsystem, left, reached, facts)


def _findings(
    subsystem: Subsystem, left: list[str], reached: frozenset[str], facts: Facts
) -> Iterator[Diagnostic]:
    """Of the components of the unreached states, those that no other one leads to."""
    edges = [(row.source, row.target) for row in subsystem.transitions]
    told: set[str] = set()
    for part in components(left, edges):
        dead = [r for r in subsystem.transitions if r.target in part.states and r.source in reached]
        if (part.entered and not dead) or told.issuperset(part.states):
            continue
        steps = [step for step in edges if step[1] not in reached]
        behind = [n for n in left if n in _from(part.states[0], steps) - told]
        told.update(behind)
        lasting = facts.lasting(subsystem)
        never = [Related(row.place, _never_taken(lasting.excludes(row))) for row in dead]
        yield _finding(subsystem, part.states, behind, never)


def _from(start: str, edges: list[tuple[str, str]]) -> set[str]:
    targets: dict[str, list[str]] = {}
    for source, target in edges:
        targets.setdefault(source, []).append(target)
    found, open_ = {start}, [start]
    while open_:
        new = [t for t in targets.get(open_.pop(), ()) if t not in found]
        found.update(new)
        open_ += new
    return found


def _finding(
    subsystem: Subsystem, first: tuple[str, ...], group: list[str], dead: list[Related]
) -> Diagnostic:
    named = ", ".join(f"`{name}`" for name in group)
    through = f", `{first[0]}` would have to be entered first" if len(group) > 1 else ""
    return Diagnostic(
        "W0607",
        f"{'state' if len(group) == 1 else 'states'} {named} cannot be reached from "
        f"`{subsystem.initial_state}`",
        subsystem.state(first[0]).place,
        f"never entered{through}",
        (*dead, *_unsent(subsystem, group)),
        _way_out(first[0], dead),
    )


def _unsent(subsystem: Subsystem, group: list[str]) -> Iterator[Related]:
    """The elements that only these states send."""
    sent = [(s.name, a) for s in subsystem.states for a in s.behaviour.assignments if a.peer]
    others = {a.target for name, a in sent if name not in group}
    lost = {a.target: a for name, a in sent if name in group and a.target not in others}
    return (Related(a.place, f"so `{a.target}` is never sent") for a in lost.values())


def _never_taken(excluded: bool) -> str:
    return f"this row can never be taken{': the times exclude it' if excluded else ''}"


def _way_out(name: str, dead: list[Related]) -> str:
    if dead:
        return "make the condition of the row possible, or delete what is not needed"
    return f"add a row that leads to `{name}`, or delete what is not needed"
