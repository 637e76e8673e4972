"""`specc status`: what is there of a specification, and the next step (section 3)."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from specc.analysis import Facts
from specc.cli import streams
from specc.diagnostics import Diagnostic
from specc.diagnostics.visible import visible
from specc.lang.show import show
from specc.model.requirement import Requirement
from specc.model.system import Subsystem, System
from specc.reachable import grouped
from specc.schema.places import walk
from specc.source import Place

# How far a specification has come along the procedure of section 3 (Fig. 4).


SYSTEM_STEPS = ("scenario", "structure", "definitions")
SIMULATED_STEPS = (*SYSTEM_STEPS, "simulation")
"""Of a system with a plant or a task, which Fig. 4 does not ask for."""
PART_STEPS = ("definitions",)
"""Of a file that has no system, but what systems use."""
AGENT_STEPS = ("devices", "control", "assignment")
SUBSYSTEM_STEPS = ("buffers", "role", "fsm", "behaviours", "ends")

_HINTS = {
    "scenario": "say in a `title:` what the system is for",
    "structure": "divide the work among `agents:`",
    "control": "give the agent a `control:` subsystem",
    "buffers": "add `x:` and `y:` with what goes in and out, and `memory:`",
    "role": "say in a `title:` what the subsystem is for",
    "fsm": "add `states:`, `initial_state:` and `transitions:`",
    "behaviours": "add `functions:` and the `behaviours:` that execute them",
    "ends": "give each behaviour a `terminal:` condition",
}
_BY_CODE = {
    "O0401": "structure",
    "O0501": "simulation",
    "O0502": "simulation",
    "O0503": "simulation",
    "O0402": "control",
    "O0404": "assignment",
    "O0601": "role",
    "O0602": "fsm",
    "O0603": "behaviours",
    "O0604": "fsm",
    "O0605": "fsm",
    "O0606": "ends",
    "O0607": "behaviours",
}


@dataclass(frozen=True, slots=True)
class DesignStep:
    """A step of the procedure; `next` says what to do for it, empty if it is done."""

    name: str
    state: Literal["done", "open", "wrong"]
    next: str = ""


@dataclass(frozen=True, slots=True)
class Progress:
    """The steps of the system, an agent or a subsystem."""

    subject: str
    steps: tuple[DesignStep, ...]

    @property
    def next(self) -> DesignStep | None:
        """The first step that is not done; what is wrong comes before what is open."""
        left = [step for step in self.steps if step.state != "done"]
        return min(left, key=lambda step: step.state != "wrong", default=None)


def progress(
    system: System, findings: Iterable[Diagnostic], *, is_part: bool = False
) -> list[Progress]:
    """The system, then each agent with its subsystems; of a part its definitions stand for both."""
    told = [finding for finding in findings if finding.severity != "warning"]
    own = grouped((owner, finding) for finding in told for owner in _owners(finding, system))
    own_steps = SIMULATED_STEPS if system.plant or system.task else SYSTEM_STEPS
    steps: tuple[str, ...] = PART_STEPS if is_part else own_steps
    found = [_of("system", steps, _missing_of_system(system), own.get("", []))]
    for agent in system.agents:
        missing = () if agent.subsystems else ("control",)
        if not is_part:
            found.append(_of(agent.name, AGENT_STEPS, missing, own.get(agent.name, [])))
        for part in agent.subsystems:
            name = part.qualified_name
            found.append(_of(name, SUBSYSTEM_STEPS, tuple(_missing(part)), own.get(name, [])))
    return found


def _of(
    name: str, steps: tuple[str, ...], missing: tuple[str, ...], findings: list[Diagnostic]
) -> Progress:
    return Progress(name, tuple(_step(step, steps, step in missing, findings) for step in steps))


def _step(
    name: str, steps: tuple[str, ...], missing: bool, findings: list[Diagnostic]
) -> DesignStep:
    own = [finding for finding in findings if _step_of(finding, steps) == name]
    wrong = [finding for finding in own if finding.severity == "error"]
    if wrong:
        return DesignStep(name, "wrong", _told(wrong, wrong[0].message))
    if own:
        return DesignStep(name, "open", _told(own, own[0].help or own[0].message))
    return DesignStep(name, "open", _HINTS[name]) if missing else DesignStep(name, "done")


def _told(findings: list[Diagnostic], words: str) -> str:
    """What to do about the first finding, by its name, and how many others there are."""
    first = findings[0]
    named = "`" in first.message and first.severity == "open" and words != first.message
    text = f"{first.message}: {words}" if named else words
    return text if len(findings) == 1 else f"{text} (and {len(findings) - 1} more)"


def _missing_of_system(system: System) -> tuple[str, ...]:
    return tuple(
        name
        for name, there in (("scenario", system.title), ("structure", system.agents))
        if not there
    )


def _missing(subsystem: Subsystem) -> Iterator[str]:
    """Steps that no finding speaks of where nothing has been written at all."""
    if not subsystem.ports:
        yield "buffers"
    if not subsystem.title:
        yield "role"
    if not subsystem.states:
        yield "fsm"
    if not subsystem.behaviours:
        yield "behaviours"
        yield "ends"


def _step_of(finding: Diagnostic, steps: tuple[str, ...]) -> str:
    """The step that a finding belongs to; what has no step of its own goes to the last of them."""
    named = _BY_CODE.get(finding.code, "")
    by_key = [here.key.step for here in walk(finding.primary.route) if here.key]
    found = [name for name in (named, *reversed(by_key)) if name in steps]
    if found:
        return found[0]
    if "definitions" in steps:
        return "definitions"
    return "behaviours" if "behaviours" in steps else steps[-1]


def _owners(finding: Diagnostic, system: System) -> frozenset[str]:
    """Qualified names of what a finding is about; a file that is used twice has two owners."""
    at = finding.primary
    subsystems = [s for s in system.subsystems if any(place.contains(at) for place in _places(s))]
    if subsystems:
        return frozenset(s.qualified_name for s in subsystems)
    agents = {
        agent.name
        for agent in system.agents
        if agent.place.contains(at) or any(device.place.contains(at) for device in agent.devices)
    }
    return frozenset(agents or {""})


def _places(subsystem: Subsystem) -> Iterator[Place]:
    """Where a subsystem is described: at its place and, if it is reused, in another file."""
    yield subsystem.place
    groups = subsystem.ports, subsystem.behaviours, subsystem.states, subsystem.memory
    places = [part.place for group in groups for part in group]
    for place in places:
        if place.file != subsystem.place.file:
            yield Place(place.file, place.route[:1])


# What is printed.


VERSION = 1


def status(options: Namespace) -> int:
    """Print how far a specification has come along the procedure of section 3."""
    from specc import pipeline

    result = pipeline.check_spec(options.spec)
    if result.system is None:
        return streams.print_findings(result, options.spec, options.format)
    name = result.system.name
    found = progress(result.system, result.diagnostics, is_part=result.is_part)
    believed = list(assumptions(result.proofs))
    if options.format == "json":
        streams.print_output(as_json(name, found, believed, result.system.requirements), "json")
    else:
        required = result.system.requirements
        streams.print_output(as_text(name or options.spec, found, believed, required))
    return 0


_GROUNDS = {
    "": "on your word",
    "proved": "follows from what is sent",
    "broken": "a sender breaks it",
}


def assumptions(facts: Facts) -> Iterator[tuple[str, str, str]]:
    """Subsystem, assumption, and on what it rests, as far as senders alone tell."""
    for machine in facts.machines:
        for axiom in machine.subsystem.axioms:
            grounds = facts.assumption_checker.check_assumption(machine, axiom).grounds
            name = machine.subsystem.qualified_name.removeprefix(".")
            yield name, show(axiom.that), _GROUNDS[grounds]


AssumptionRows = list[tuple[str, str, str]]


def as_text(
    name: str, found: list[Progress], believed: AssumptionRows, required: Sequence[Requirement]
) -> str:
    """Tables of the system, its agents, their subsystems and assumptions, then what comes next.

    Between them stands how much is required of every run.
    """
    of_system = tuple(step.name for step in found[0].steps)
    whole = "file" if of_system == PART_STEPS else "system"
    groups = ((whole, of_system), ("agent", AGENT_STEPS), ("subsystem", SUBSYSTEM_STEPS))
    blocks = []
    for kind, steps in groups:
        members = [item for item in found if tuple(step.name for step in item.steps) == steps]
        if members:
            rows = [(_name(item, name), *(step.state for step in item.steps)) for item in members]
            blocks.append(streams.format_table([(kind, *steps), *rows]))
    if believed:
        blocks.append(streams.format_table([("subsystem", "assumption", "rests on"), *believed]))
    if required:
        words = "requirement is" if len(required) == 1 else "requirements are"
        blocks.append(f"{len(required)} {words} watched in every run\n")
    blocks.append("\n".join(_next(name, found)) + "\n")
    return "\n".join(blocks)


def as_json(
    name: str, found: list[Progress], believed: AssumptionRows, required: Sequence[Requirement]
) -> str:
    """An object with `version`, `system`, `assumptions`, `requirements`, and `parts` with `of` and
    `steps`.
    """
    parts = [
        {
            "of": _name(item, name),
            "steps": [
                {"name": step.name, "state": step.state, "next": step.next} for step in item.steps
            ],
        }
        for item in found
    ]
    told = [
        {"subsystem": subsystem, "that": that, "rests_on": grounds}
        for subsystem, that, grounds in believed
    ]
    texts = [{"that": item.that, "because": item.because} for item in required]
    return streams.as_json(VERSION, name, parts=parts, assumptions=told, requirements=texts)


def _name(item: Progress, system: str) -> str:
    return system if item.subject == "system" else item.subject.removeprefix(".")


def _next(name: str, found: list[Progress]) -> list[str]:
    left = [(item, step) for item in found if (step := item.next) is not None]
    if not left:
        return ["every step is done"]
    lines = (f"  {_name(item, name)}, {step.name}: {step.next}" for item, step in left)
    return ["next:", *map(visible, lines)]
