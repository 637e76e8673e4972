"""The document of a system: its chapters, in the order of section 4 of the paper."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

from specc.analysis import Facts
from specc.diagnostics.phrases import truncate
from specc.lang.show import show
from specc.model.expr import NEAR
from specc.model.fsm import Trace
from specc.model.system import Agent, Device, NamedType, Subsystem, System
from specc.source import Place, Sources
from specc.tools.doc.departures import Departure
from specc.tools.doc.formulas import FormulaWriter, requirement_forms
from specc.tools.doc.machines import KINDS, SubsystemSection
from specc.tools.doc.markup import array, string, verbatim
from specc.tools.doc.pages import Pages, Part, mono, plain
from specc.tools.doc.symbols import SystemNames, name_math, operator_symbol, symbol_for
from specc.tools.graph.diagram import AgentFamily, Diagram, agent_families
from specc.tools.graph.structure import frames, structure

_AGENT, _SUBSYSTEM = 1, 2
_LONGEST_TYPE = 160
_WIDE_VALUE = 42
"""Of a constant that is written as in the language, in several lines."""
_LEGEND = {
    "fresh": ('$cal("P")(x)$', "the buffer element x got a new value since the step before"),
    "present": ('$"present"(x)$', "x has got a value at least once"),
    NEAR: (
        "$a attach(=, br: epsilon) b$",
        "a and b differ by at most ε: in their components; of poses, the first tolerance is of the "
        "positions and the second one of the orientations",
    ),
    "field": ('$attach(cal("F"), br: c)(x)$', "the part c of what the operator F returns"),
    "elapsed": ('$"elapsed"$', "the time since the state was entered"),
    "entered": ('$"entered"$', "whether this is the first period of the state"),
    "period": ("$Delta iota$", "the period of the subsystem"),
    "age": ('$"age"(x)$', "the age of the oldest measurement behind x"),
    "late": ('$"late"(x)$', "for how many periods in a row the sender of x has been late"),
    "unused": ('$"–"$', "a component that the chosen mode does not use"),
    "always": ("$square.stroked thin p$", "p holds at every tick"),
    "within": (
        "$attach(diamond.stroked, br: lt.eq t) thin p$",
        "p holds at some time within t from now",
    ),
    "throughout": ("$attach(square.stroked, br: lt.eq t) thin p$", "p holds from now on for t"),
    "once": (
        "$attach(diamond.filled, br: lt.eq t) thin p$",
        "p has held at some time of the last t",
    ),
    "historically": ("$attach(square.filled, br: lt.eq t) thin p$", "p has held for the last t"),
    "since": ('$p "since" q$', "q has held, and p ever since"),
}
_ALWAYS_EXPLAINED = (
    (
        '$attach(e, tl: c, bl: x, br: "j,n")[accent(T, tilde)]$',
        "the element T of the input buffer (x; y: output buffer) of the subsystem n of agent j, "
        "whose other end is the control subsystem (c; e, r: virtual effector, receptor; E, R: real "
        "ones; T: another agent)",
    ),
    ('$attach(e, tl: e, br: "j,n")[accent(m, tilde)]$', "the memory element m of that subsystem"),
    (
        "$attach(f, tl: #[e], tr: sigma)$, $attach(f, tr: tau)$, $attach(f, tr: epsilon)$",
        "initial, terminal and error conditions",
    ),
    (
        "$attach(f, tl: e#sym.comma E)$",
        "a transition function: what it computes goes to the buffer of E, or to the memory",
    ),
    (
        "$attach(T, tl: B, bl: E)$",
        "a pose of frame E with respect to frame B; also a value in frame B",
    ),
    ("$iota$", "the time stamp; what is computed at ι takes effect at ι + 1"),
)


@dataclass(frozen=True, slots=True)
class DocumentText:
    """A document in Typst without its frame, and the pictures in it."""

    text: str
    title: str
    pictures: tuple[Diagram, ...]


@dataclass
class DocumentWriter:
    """Writes the document of a system."""

    system: System
    facts: Facts
    sources: Sources
    path: str
    departures: Sequence[Departure] = ()
    errors: int = 0
    signs: dict[str, None] = field(default_factory=dict)

    def write(self) -> DocumentText:
        """All chapters."""
        self.pages = Pages(self.sources, self.path)
        self.names = SystemNames(self.system)
        self.formulas = FormulaWriter(None, self.names, signs=self.signs)
        self.pages.marks.update(
            {
                number: f"departure-{i}"
                for i, each in enumerate(self.departures, 1)
                for number in each.equations
            }
        )
        body = self.pages
        self._system()
        self._frames_and_constants()
        self._types_and_operators()
        for family in agent_families(self.system):
            self._agent(family)
        self._communication()
        self._requirements()
        self._plant()
        self._departures()
        self._index()
        self._listing()
        main = self._legend() + body.finished()
        head = f"#let defined = (\n{''.join(f'{string(i)}: true,' for i in self.pages.places)})\n"
        title = self.system.title or self.system.name
        text = head + self._front(title) + main
        return DocumentText(text, title, tuple(body.pictures))

    def _front(self, title: str) -> str:
        name = self.pages.shown(self.system.file and self.path)
        notice = ""
        if self.errors:
            words = "The specification has errors; the document shows what is known."
            notice = f"#par_[#strong[#{string(words)}]]\n"
        entries = array(
            f"({level}, {string(number)}, {string(id)}, [#{string(text)}])"
            for level, number, id, text in self.pages.contents
            if level < 3
        )
        given = string(title), string(self.system.name), string(name), entries
        return f"#front({', '.join(given)})\n{notice}"

    def _legend(self) -> str:
        rows = [*_ALWAYS_EXPLAINED, *(_LEGEND[s] for s in _LEGEND if s in self.signs)]
        cells = "".join(f"[{sign_}], [#{string(words)}], " for sign_, words in rows)
        heads = "([Sign], [Meaning], )"
        table = f"#table_((auto, 1fr), {heads}, [], ({cells}))\n"
        return f'#title_(1, "", "notation", [Notation])\n{table}'

    # Chapters.

    def _system(self) -> None:
        pages = self.pages
        pages.heading(1, "System", "system")
        diagram = structure(self.system)
        if any(diagram.all_nodes):
            words = f"Structure of {self.system.name}"
            caption: list[Part] = []
            for agent in self.system.agents:
                figures = Trace(fig=agent.trace.fig)
                caption += pages.caption(figures, f"Structure of {agent.name}", agent.place)
            pages.picture(diagram, [*caption, plain(words)], words)
        rows = (self._subsystem_row(s) for s in self.system.subsystems)
        columns: tuple[str, ...] = ("Subsystem", "Name", "Rate", "Purpose", "Source")
        widths = "(auto, auto, auto, 1fr, auto)"
        pages.table(columns, rows, [plain("Subsystems")], widths)
        devices = (self._device_row(d) for d in self.system.devices)
        columns = ("Device", "Name", "Accepts", "Reports", "Meaning", "Source")
        pages.table(columns, devices, [plain("Devices")], "(auto, auto, 1fr, 1fr, auto, auto)")

    def _subsystem_row(self, s: Subsystem) -> list[str | list[Part]]:
        names = self.names.subsystems[s.qualified_name]
        rate = plain(_hz(s.rate_hz)) if s.has_rate else ""
        purpose = plain(s.title or KINDS[s.kind])
        return [names.symbol.inline, mono(s.qualified_name), rate, purpose, self._source(s.place)]

    def _device_row(self, d: Device) -> list[str | list[Part]]:
        anchor = f"#{self.pages.anchor(f'device.{d.qualified_name}')}"
        accepted = [symbol_for(e.name, e.symbol, e.type).inline for e in d.x]
        for element in d.x:
            if element.safe:
                at = list(d.x).index(element)
                value = self.formulas.math(element.safe.value).inline
                accepted[at] += f" (safe: {value})"
        reported = [symbol_for(e.name, e.symbol, e.type).inline for e in d.y]
        meaning: list[Part] = [plain(d.title)]
        if d.trace:
            meaning += [" (", *self.pages.mentions(d.trace, d.title or d.name, d.place), ")"]
        symbol = f"{anchor}{self.names.device(d).inline}"
        cells = ", ".join(accepted), ", ".join(reported)
        return [symbol, mono(d.qualified_name), *cells, meaning, self._source(d.place)]

    def _frames_and_constants(self) -> None:
        pages, system = self.pages, self.system
        if not system.frames and not system.constants:
            return
        pages.heading(1, "Frames and constants", "frames")
        if system.frames:
            diagram = frames(system, system.subsystems)
            if any(diagram.all_nodes):
                pages.picture(diagram, [plain("Frames and poses between them")], "Frames")
            rows = (
                [name_math(name).inline, mono(name), plain(title)] for name, title in system.frames
            )
            pages.table(("Frame", "Name", "Meaning"), rows, [plain("Frames")], "(auto, auto, 1fr)")
        constants = (self._constant_row(name) for name in self.names.constants)
        columns = ("Constant", "Name", "Value", "Meaning", "Source")
        pages.table(columns, constants, [plain("Constants")], "(auto, auto, 1.3fr, 1fr, auto)")

    def _constant_row(self, name: str) -> list[str | list[Part]]:
        item = self.names.constants[name]
        anchor = f"#{self.pages.anchor(f'constant.{name}')}"
        symbol = symbol_for(name, item.symbol, item.value.type)
        math = self.formulas.math(item.initial or item.value)
        is_long = math.width > _WIDE_VALUE
        value = mono(show(item.initial or item.value)) if is_long else f"#fit{bracket(math.inline)}"
        if item.bounds:
            low, high = (f"{bound:g}" for bound in item.bounds)
            value += f" ({low} to {high}{', live' if item.initial else ''})"
        shown = f"{anchor}{symbol.inline}"
        return [shown, mono(name), value, plain(item.title), self._source(item.place)]

    def _types_and_operators(self) -> None:
        pages, system = self.pages, self.system
        if not system.types and not system.operators:
            return
        pages.heading(1, "Types and operators", "types")
        rows = (self._type_row(item) for item in system.types)
        columns: tuple[str, ...] = ("Type", "Is", "Meaning", "Source")
        pages.table(columns, rows, [plain("Types")], "(auto, 1fr, 1fr, auto)")
        operators = (self._operator_row(name) for name in self.names.operators)
        columns = ("Operator", "Name", "Signature", "Meaning", "Source")
        widths = "(auto, auto, 1fr, 1fr, auto)"
        pages.table(columns, operators, [plain("Operators")], widths)

    def _type_row(self, item: NamedType) -> list[str | list[Part]]:
        source = self.sources.get(item.place.file)
        node = source.node(item.place.route) if source else None
        title, shown = "", ""
        if source and node:
            texts = {
                str(key): value.scalar or source.text[value.start : value.end]
                for key, value in node.values.items()
            }
            written = next((texts[key] for key in ("type", "fields") if key in texts), "opaque")
            title = texts.get("title", "")
            shown = truncate(" ".join((node.scalar or written).split()), _LONGEST_TYPE)
        meaning: list[Part] = [plain(title)]
        if item.trace:
            words = title or f"Type {item.name}"
            meaning += [" (", *self.pages.mentions(item.trace, words, item.place), ")"]
        return [mono(item.name), mono(shown), meaning, self._source(item.place)]

    def _operator_row(self, name: str) -> list[str | list[Part]]:
        item = self.names.operators[name]
        anchor = f"#{self.pages.anchor(f'operator.{name}')}"
        given = ", ".join(f"{each}: {type_}" for each, type_ in item.parameters)
        meaning: list[Part] = [plain(item.title)]
        if item.trace:
            meaning += [" (", *self.pages.mentions(item.trace, item.title or name, item.place), ")"]
        symbol = f"{anchor}{operator_symbol(item, name).inline}"
        signature = mono(f"({given}) -> {item.result}")
        return [symbol, mono(name), signature, meaning, self._source(item.place)]

    def _agent(self, family: AgentFamily) -> None:
        first = family.agents[0]
        title = f"Agent {family.name}" + (f": {first.title}" if first.title else "")
        self.pages.heading(_AGENT, title, f"agent.{first.name}")
        self.pages.add(f"#lead_[{self._agent_words(family.agents)}]\n")
        for copies in family.parts():
            subsystems = [each for each in copies if isinstance(each, Subsystem)]
            if not subsystems:
                continue
            section = SubsystemSection(
                self.pages,
                self.facts,
                self.names.subsystems[subsystems[0].qualified_name],
                _SUBSYSTEM,
                self.signs,
            )
            section.write(subsystems)

    def _agent_words(self, agents: Sequence[Agent]) -> str:
        kind = f"of kind {agents[0].kind}," if agents[0].kind else ""
        names = ", ".join(mono(agent.name) for agent in agents)
        return f"{names}, {plain(kind)} {self._source(agents[0].place)}"

    def _communication(self) -> None:
        def rows() -> Iterator[list[str | list[Part]]]:
            for s in self.system.subsystems:
                own = self.names.subsystems[s.qualified_name]
                for wire in self.names.wires.wires_of(s):
                    other = wire.peer_subsystem
                    if wire.port.direction != "y":
                        continue
                    left = own.buffer(wire.port).inline
                    right = word_of(wire.peer_name)
                    if other is not None and wire.peer_port is not None:
                        right = (
                            self.names.subsystems[other.qualified_name]
                            .buffer(wire.peer_port)
                            .inline
                        )
                    elif wire.peer_device is not None:
                        right = self.names.device(wire.peer_device).inline
                    shown = (
                        symbol_for(e.name, e.symbol, e.type).inline for e in wire.port.elements
                    )
                    yield [left, right, ", ".join(shown), self._source(wire.port.place)]
                for wire in self.names.wires.wires_of(s):
                    device = wire.peer_device
                    if wire.port.direction == "x" and device is not None:
                        shown = (
                            symbol_for(e.name, e.symbol, e.type).inline for e in wire.port.elements
                        )
                        ends = self.names.device(device).inline, own.buffer(wire.port).inline
                        yield [*ends, ", ".join(shown), self._source(wire.port.place)]

        found = list(rows())
        if found:
            self.pages.heading(1, "Communication", "communication")
            columns = ("From", "To", "Elements", "Source")
            self.pages.table(columns, found, None, "(auto, auto, 1fr, auto)")

    def _requirements(self) -> None:
        pages = self.pages
        pages.heading(1, "Requirements and proofs", "requirements")
        if self.system.requirements:
            pages.text("Every run is watched for these.")
        for number, item in enumerate(self.system.requirements, 1):
            readings = {reading.name: reading for reading in item.readings}
            writer = FormulaWriter(None, self.names, readings=readings, signs=self.signs)
            forms = requirement_forms(writer, item)
            pages.equation(f"requirement.{number}", forms, name=item.name, place=item.place)
            pages.text(f"Because {item.because.rstrip('.')}.")
        self._proofs()
        self._disturbances()

    def _proofs(self) -> None:
        rows: list[list[str | list[Part]]] = []
        for machine in self.facts.machines:
            s = machine.subsystem
            verdicts = machine.row_verdicts
            proved = sum(each.verdict.proved for each in verdicts)
            missing = ", ".join(
                self.names.subsystems[s.qualified_name].state(each.state.name).inline
                for each in verdicts
                if not each.verdict.proved
            )
            names = self.names.subsystems[s.qualified_name]
            assumed = ", ".join(
                f"#u({string(names.id('assumption', str(n)))})[{n}]"
                for n, _ in enumerate(s.axioms, 1)
            )
            cells = plain(f"{proved} of {len(verdicts)}"), missing, assumed
            rows.append([names.symbol.inline, mono(s.qualified_name), *cells])
        words = (
            "In how many cases, each a state and what ends it, exactly one row of the table is "
            "proved to apply; what is not proved is tested while the subsystem runs"
        )
        columns = ("Subsystem", "Name", "Proved", "Not proved", "Assumptions")
        self.pages.table(columns, rows, [plain(words)], "(auto, 1fr, auto, 1fr, auto)")

    def _disturbances(self) -> None:
        task = self.system.task
        if task is None:
            return
        source, target = mono(task.source), mono(task.target)
        ends = f"from {source} to {target}"
        self.pages.content(
            f"A cycle of the task ends with a transition of {mono(task.subsystem)} {ends}."
        )
        rows = (
            [mono(each.subject), plain(each.because), self._source(each.place)]
            for each in task.disturbances
        )
        columns = ("Disturbance", "Stands for", "Source")
        self.pages.table(columns, rows, [plain("Disturbances")], "(1fr, 1fr, auto)")

    def _plant(self) -> None:
        plant = self.system.plant
        if plant is None:
            return
        pages = self.pages
        pages.heading(1, "Plant and bindings", "plant")
        named = plant.model, plant.python, plant.ros2.node if plant.ros2 else ""
        if behind := " and ".join(mono(name) for name in named if name):
            pages.content(f"#{string('Behind the devices stands')} {behind}.")

        def rows() -> Iterator[list[str | list[Part]]]:
            for b in plant.bindings:
                parts = [f"{kind} {', '.join(names)}" for kind, names in (
                    ("joints", b.joints), ("sensors", b.sensors), ("actuators", b.actuators),
                ) if names]  # fmt: skip
                parts += [f"camera {b.camera} ({b.image})"] * bool(b.camera)
                parts += [f"topic {b.topic}"] * bool(b.topic)
                kind, called = b.call
                parts += [f"{b.part} of {kind.replace('_', ' ')} {called}"] * bool(kind)
                parts += [f"field {b.field}"] * bool(b.field)
                parts += [f"panel {b.panel.kind}"] if b.panel else []
                parts += [_hz(b.rate_hz)] if b.rate_hz else []
                parts += [f"through {b.through}"] * bool(b.through)
                yield [mono(b.name), mono("; ".join(parts)), self._source(b.place)]

        pages.table(("Element", "Stands for it", "Source"), rows(), None, "(auto, 1fr, auto)")

    # Appendices.

    def _departures(self) -> None:
        if not self.departures:
            return
        self.pages.heading(1, "Departures", "departures")

        def rows() -> Iterator[list[str | list[Part]]]:
            for number, each in enumerate(self.departures, 1):
                anchor = f"#{self.pages.anchor(f'departure-{number}')}"
                yield [f"{anchor}{plain(each.where)}", plain(each.wrong), plain(each.chosen)]

        columns = ("Where", "What is wrong", "What was chosen")
        self.pages.table(columns, rows(), None, "(auto, 1fr, 1fr)")

    def _index(self) -> None:
        if not self.pages.index:
            return
        self.pages.heading(1, "Index of equations, tables and figures", "index")
        cells = []
        words = {"eq": "Equation", "table": "Table", "fig": "Figure"}
        order = {"eq": 0, "table": 1, "fig": 2}
        for (kind, value), found in sorted(
            self.pages.index.items(), key=lambda i: (order[i[0][0]], i[0][1])
        ):
            place = f"{kind}-{value}"
            texts = "; ".join(dict.fromkeys(each.words for each in found if each.words))
            lines = ", ".join(
                dict.fromkeys(self._source(each.place) for each in found if each.place)
            )
            number = f"{words[kind]} #ref_({string(place)})[{value}]"
            cells.append(f"[{number}], [#{string(texts)}], [{lines}], ")
        rows = "".join(cells)
        heads = "([Number], [What], [Source], )"
        self.pages.add(f"#table_((auto, 1fr, auto), {heads}, [], ({rows}))\n")

    def _listing(self) -> None:
        self.pages.heading(1, "The specification", "specification")
        for number, (file, referred) in enumerate(list(self.pages.lines.items()), 1):
            source = self.sources.get(file)
            if source is None:
                continue
            lines = array(verbatim(line) for line in source.lines)
            targets = array(str(line) for line in sorted(referred))
            name = string(self.pages.shown(file))
            self.pages.add(f"#listing({number}, {name}, {lines}, {targets})\n")

    def _source(self, place: Place | None) -> str:
        code = self.pages.source(place)
        return "" if code == "none" else f"#{code}"


def bracket(content: str) -> str:
    """Content as an argument of a function of Typst."""
    return f"[{content}]"


def word_of(name: str) -> str:
    """The name of a part that is not there."""
    return mono(name)


def _hz(rate: Fraction) -> str:
    return f"{float(rate):.6g} Hz"
