"""`specc status`, `specc ages` and `specc graph`: what is known of a specification."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Literal

from specc.analysis import Facts
from specc.analysis.dataflow import AgeChain, Ages, Measured, UnboundedAge
from specc.cli import streams
from specc.cli.files import write_output
from specc.diagnostics import Diagnostic
from specc.diagnostics.phrases import in_ms
from specc.diagnostics.visible import visible
from specc.lang.show import show
from specc.model.requirement import Requirement
from specc.model.system import Subsystem, System
from specc.reachable import grouped
from specc.refusal import Refused
from specc.schema.places import walk
from specc.source import Place

if TYPE_CHECKING:
    pass

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
    relevant = [finding for finding in findings if finding.severity != "warning"]
    own = grouped((owner, finding) for finding in relevant for owner in _owners(finding, system))

    def steps_of(
        name: str, steps: tuple[str, ...], missing: Iterable[str], owner: str | None = None
    ) -> Progress:
        gaps, found = set(missing), own.get(name if owner is None else owner, [])
        return Progress(name, tuple(_step(step, steps, step in gaps, found) for step in steps))

    system_steps = SIMULATED_STEPS if system.plant or system.task else SYSTEM_STEPS
    parts = {"scenario": system.title, "structure": system.agents}
    missing = [name for name, part in parts.items() if not part]
    found = [steps_of("system", PART_STEPS if is_part else system_steps, missing, "")]
    for agent in system.agents:
        if not is_part:
            missing = [] if agent.subsystems else ["control"]
            found.append(steps_of(agent.name, AGENT_STEPS, missing))
        for part in agent.subsystems:
            found.append(steps_of(part.qualified_name, SUBSYSTEM_STEPS, _missing(part)))
    return found


def _step(
    name: str, steps: tuple[str, ...], is_missing: bool, findings: list[Diagnostic]
) -> DesignStep:
    own = [finding for finding in findings if _step_of(finding, steps) == name]
    errors = [finding for finding in own if finding.severity == "error"]
    if errors:
        return DesignStep(name, "wrong", _advice(errors, errors[0].message))
    if own:
        return DesignStep(name, "open", _advice(own, own[0].help or own[0].message))
    return DesignStep(name, "open", _HINTS[name]) if is_missing else DesignStep(name, "done")


def _advice(findings: list[Diagnostic], words: str) -> str:
    """What to do about the first finding, by its name, and how many others there are."""
    first = findings[0]
    has_name = "`" in first.message and first.severity == "open" and words != first.message
    text = f"{first.message}: {words}" if has_name else words
    return text if len(findings) == 1 else f"{text} (and {len(findings) - 1} more)"


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
    by_code = _BY_CODE.get(finding.code, "")
    by_key = [node.key.step for node in walk(finding.primary.route) if node.key]
    default = "definitions" if "definitions" in steps else "behaviours"
    candidates = (by_code, *reversed(by_key), default, steps[-1])
    return next(name for name in candidates if name in steps)


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


VERSION = 1
"""Of the JSON formats of `status` and `ages`."""


def status(options: Namespace) -> int:
    """Print how far a specification has come along the procedure of section 3."""
    from specc import pipeline

    result = pipeline.check_spec(options.spec)
    if result.system is None:
        return streams.print_findings(result, options.spec, options.format)
    name = result.system.name
    found = progress(result.system, result.diagnostics, is_part=result.is_part)
    assumed, required = list(assumption_rows(result.proofs)), result.system.requirements
    if options.format == "json":
        text = _status_as_json(name, found, assumed, required)
    else:
        text = _status_as_text(name or options.spec, found, assumed, required)
    streams.print_output(text, options.format)
    return 0


_GROUNDS = {
    "": "on your word",
    "proved": "follows from what is sent",
    "broken": "a sender breaks it",
}
AssumptionRows = list[tuple[str, str, str]]


def assumption_rows(facts: Facts) -> Iterator[tuple[str, str, str]]:
    """Yields subsystem, assumption and its grounds in words.

    The grounds take only what subsystems send into account.
    """
    for machine in facts.machines:
        for axiom in machine.subsystem.axioms:
            grounds = facts.assumption_checker.check_assumption(machine, axiom).grounds
            name = machine.subsystem.qualified_name.removeprefix(".")
            yield name, show(axiom.that), _GROUNDS[grounds]


def _status_as_text(
    name: str, found: list[Progress], assumed: AssumptionRows, required: Sequence[Requirement]
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
    if assumed:
        blocks.append(streams.format_table([("subsystem", "assumption", "rests on"), *assumed]))
    if required:
        words = "requirement is" if len(required) == 1 else "requirements are"
        blocks.append(f"{len(required)} {words} watched in every run\n")
    steps_left = [(item, step) for item in found if (step := item.next) is not None]
    lines = (f"  {_name(item, name)}, {step.name}: {step.next}" for item, step in steps_left)
    head = "next:" if steps_left else "every step is done"
    blocks.append("\n".join([head, *map(visible, lines)]))
    return "\n".join(blocks) + "\n"


def _status_as_json(
    name: str, found: list[Progress], assumed: AssumptionRows, required: Sequence[Requirement]
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
    assumption_rows = [
        {"subsystem": subsystem, "that": that, "rests_on": grounds}
        for subsystem, that, grounds in assumed
    ]
    texts = [{"that": item.that, "because": item.because} for item in required]
    return streams.as_json(
        VERSION, name, parts=parts, assumptions=assumption_rows, requirements=texts
    )


def _name(item: Progress, system: str) -> str:
    return system if item.subject == "system" else item.subject.removeprefix(".")


# `specc ages`: how old the values are that subsystems and devices receive.


def ages(options: Namespace) -> int:
    """Print the greatest age of every value that is received; 1 if the specification has errors."""
    from specc import pipeline

    result = pipeline.compile_spec(options.spec)
    if not result.ok or result.system is None:
        return streams.print_findings(result, options.spec, options.format) or 1
    render = _ages_as_json if options.format == "json" else _ages_as_text
    streams.print_output(render(result.proofs), options.format)
    return 0


def _ages_as_text(facts: Facts) -> str:
    """A table: reader, element, greatest age, what is allowed, and the path of the oldest value."""
    rows = [("reader", "element", "age", "allowed", "path of the oldest value")]
    for reader, name, limit, oldest in _oldest_values(facts):
        age, path = _age(oldest, facts.ages)
        rows.append((reader, name, age, "" if limit is None else in_ms(limit), path))
    return streams.format_table(rows)


def _ages_as_json(facts: Facts) -> str:
    """An object with `version`, `system` and `values`; ages in s, null where none is known."""
    values = [
        {
            "reader": reader,
            "element": name,
            "age_s": float(oldest.age_s) if isinstance(oldest, AgeChain) else None,
            "max_age_s": None if limit is None else float(limit),
            "way": _age(oldest, facts.ages)[1],
        }
        for reader, name, limit, oldest in _oldest_values(facts)
    ]
    return streams.as_json(VERSION, facts.system.name, values=values)


def _oldest_values(
    facts: Facts,
) -> Iterator[tuple[str, str, Fraction | None, AgeChain | UnboundedAge | None]]:
    """Reader, element, how old it may be, and what its oldest value comes from."""
    for node, element in facts.inputs():
        name = node.short if node.peer else node.element
        yield node.reader, name, element.max_age_s, facts.ages.oldest(node)


def _age(oldest: AgeChain | UnboundedAge | None, ages: Ages) -> tuple[str, str]:
    """The age in words, and how it comes about."""
    if oldest is None:
        return "-", "source not known"
    if isinstance(oldest, UnboundedAge):
        silent = oldest.source
        if isinstance(silent, Measured):
            return "any", f"`{silent.device}.{oldest.node.element}` may have no new sample"
        state = silent.silent_state.name if silent.silent_state else ""
        return "any", f"`{silent.sender.qualified_name}` is silent in `{state}`"
    steps = oldest.steps()
    source = ages.sources.origin(steps[0].node)
    if isinstance(source, Measured):
        start = f"{source.device}.{steps[0].node.element}"
    else:
        start = f"computed by {source.sender.qualified_name}" if source else ""
    readers = [f"{s.node.reader} after {in_ms(s.read_s - oldest.since_s)}" for s in steps]
    condition = ", used only when fresh" if ages.sources.only_on_arrival(oldest.node) else ""
    return in_ms(oldest.age_s), " -> ".join((start, *readers)) + condition


# `specc graph`: a picture of a specification, in a file or as DOT text.


def graph(options: Namespace) -> int:
    """Draw what is known of a specification.

    0 if all of it is right; 1 if it has errors, which are told: without them, more might be drawn;
    2 for wrong usage, and where a file cannot be written.
    """
    from specc import pipeline
    from specc.tools.graph import FORMATS, picture

    result, code = pipeline.read_spec(options.spec), 0
    if result.system is None or any(each.severity == "error" for each in result.diagnostics):
        code = streams.print_findings(result, options.spec) or 1
    if result.system is None or code == streams.USAGE_ERROR or (code and not result.system.agents):
        return code
    suffix = os.path.splitext(options.out or "")[1].lower().removeprefix(".")
    form = options.format or suffix or next(iter(FORMATS))
    if form not in FORMATS:
        raise Refused(
            f"{options.out}: {suffix} is none of {', '.join(FORMATS)}; choose one with --format"
        )
    kind, diagram = picture(result.system, options.place, options.of)
    content = FORMATS[form].render(diagram)
    if FORMATS[form].is_text and not options.out:
        streams.print_output(content.decode())
        return code
    stem = os.path.splitext(os.path.basename(options.spec))[0]
    path = options.out or "-".join(filter(None, (stem, options.place, kind))) + f".{form}"
    write_output(path, content, form, [options.spec], by="graph", force=options.force)
    streams.print_output(f"{path}\n")
    return code
