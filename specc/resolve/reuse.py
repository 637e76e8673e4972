"""Descriptions that live in another file and are used with parameters."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

from specc.diagnostics import Related, nearest
from specc.lang import A_SIZE, Environment, ExprError, evaluate, is_size, parse_type
from specc.lang.types import names_of
from specc.limits import MAX_DEPTH, spend_or_raise
from specc.model.expr import Call, Expr, constant_names, walk
from specc.model.system import Constant
from specc.model.types import Frame, Int, Type
from specc.reachable import reachable
from specc.resolve.context import Findings, YamlNode
from specc.resolve.definitions import (
    Definitions,
    Groups,
    OpenSize,
    indices_of,
    inlined,
    may_be_size,
)
from specc.resolve.expressions import Expressions
from specc.resolve.library import Library, Loaded, constant_scope
from specc.schema import SpecFile, SubsystemDef
from specc.schema.files import AgentDef
from specc.schema.places import role_of
from specc.source import beside


@dataclass(frozen=True, slots=True)
class Setting:
    """The file that describes a part, the names in force there and the parameters given to it."""

    file: Loaded
    definitions: Definitions
    parameters: tuple[Constant, ...] = ()
    groups: Groups = field(default_factory=dict)
    """Of peers: those in the same agent, then only those that the part names."""
    using: tuple[str, ...] = ()
    """Paths of the descriptions that led here."""


def reuse(
    user: AgentDef | SubsystemDef, where: YamlNode, at: Setting, library: Library, name: str
) -> Setting | None:
    """Load the file that `user` uses, at `where`, and bind its parameters to the arguments.

    `name` is that of the agent, or the qualified one of the subsystem, that it becomes.
    """
    relative, findings = user.use or "", library.findings
    path, used = beside(at.file.path, relative), where["use"]
    if path in (at.file.path, *at.using):
        help = "describe the part here, or use another file"
        findings.report("E0206", f"`{relative}` uses itself", used.place, help=help)
        return None
    if len(at.using) >= MAX_DEPTH:
        message = f"files use files more than {MAX_DEPTH} levels deep"
        findings.report("E0017", message, used.place, help="use the file that describes the part")
        return None
    file = library.load(path, used)
    if file is None:
        return None
    binder = _Binder(user.arguments, where, at.definitions, library, file, name)
    binder.check_names()
    frames = binder.frames()
    constants, sizes = binder.sizes()
    if sizes is None:
        return None
    definitions = library.start(file, frames, sizes)
    given = binder.values(definitions, constants)
    agents, groups = binder.agents(definitions)
    if not binder.complete:
        return None
    library.complete(definitions, file, given)
    definitions.agents, definitions.groups = agents, groups
    return Setting(file, definitions, given, using=(*at.using, file.path))


def indexed(at: Setting, each: Mapping[str, str], where: YamlNode, findings: Findings) -> Setting:
    """A setting with the indices of the `for` of a part at `where`, each with its one value."""
    if not each:
        return at
    indices = tuple(indices_of(each, where).values())
    definitions = at.definitions.indexed(indices, findings)
    return replace(at, definitions=definitions, parameters=(*at.parameters, *indices))


def agent_in(file: Loaded, name: str) -> tuple[AgentDef | None, YamlNode]:
    """The agent that a file describes; in a system that of the name, or the only one."""
    spec, top = file.spec, file.top
    if spec.agent is not None:
        return spec.agent, top["agent"]
    if name not in spec.agents and len(spec.agents) == 1:
        (name,) = spec.agents
    return spec.agents.get(name), top["agents"][name]


def is_agent(kind: str, known: Definitions) -> bool:
    """Whether a parameter of a kind stands for an agent, and not for a value of some type."""
    return kind == "agent" and kind not in known.types


@dataclass(eq=False, slots=True)
class _Binder:
    """Binds the parameters of a description in `file` to the arguments that `at` gives."""

    arguments: Mapping[str, str]
    at: YamlNode
    outer: Definitions
    library: Library
    file: Loaded
    user: str
    complete: bool = True
    findings: Findings = field(init=False)
    where: YamlNode = field(init=False)
    parameters: YamlNode = field(init=False)

    def __post_init__(self) -> None:
        self.findings, self.where = self.library.findings, self.at["with"]
        self.parameters = self.file.top["parameters"]

    def check_names(self) -> None:
        """Report unknown arguments, and parameters without one."""
        parameters, mistyped = self.file.spec.parameters, set[str]()
        for name in self.arguments:
            if name not in parameters:
                self.complete = False
                self.findings.unknown("E0201", "parameter", name, parameters, self.where[name].key)
                mistyped |= set(nearest(name, parameters))
        for name in parameters:
            if name not in self.arguments and name not in mistyped:
                self.complete = False
                message = f"parameter `{name}` has no value"
                help_text = f"add `{name}: ...` under `with:`"
                self.findings.report("E0211", message, self.at["use"].place, help=help_text)
        for name in self.arguments.keys() & parameters.keys():
            self.findings.use(self.parameters[name].key, self.where[name], part="key")

    def _bound(self) -> Iterator[tuple[str, str, str]]:
        """The parameters that have arguments: name, kind and argument."""
        for name, kind in self.file.spec.parameters.items():
            if name in self.arguments:
                yield name, kind, self.arguments[name]

    def frames(self) -> dict[str, Frame]:
        """Frame parameter -> actual frame."""
        bound, known = {}, self.outer.frames
        for name, kind, actual in self._bound():
            if kind == "frame" and actual in known:
                bound[name] = known[actual]
                self._note("frame", actual, self.where[name])
            elif kind == "frame":
                self.complete = False
                self.findings.unknown("E0201", "frame", actual, known, self.where[name].place)
        return bound

    def sizes(self) -> tuple[dict[str, Constant | None], dict[str, int] | None]:
        """Parameters that may stand for sizes, as constants, and those that do.

        There are no sizes if one has no value, since no type is known without. What nothing in the
        description has as its size can be any whole number, and so can what is open.
        """
        constants: dict[str, Constant | None] = {}
        sizes: dict[str, int] = {}
        is_known = True
        for name, kind, _ in self._bound():
            if not may_be_size(kind):
                continue
            where = self._argument(name, Int())
            constants[name] = constant = self._constant(name, where, Int())
            if constant is None:
                is_known = False
                continue
            number = _whole(constant, self.outer)
            if isinstance(number, OpenSize) or (number is not None and is_size(number)):
                sizes[name] = number
            elif use := next(_uses(self.file.top, name, self.file.spec.types), None):
                value = "a number that only a run can tell" if number is None else str(number)
                message = f"`{name}` is a size, {A_SIZE}, and not {value}"
                related = (Related(use.place, f"`{name}` is the size of this"),)
                self.findings.report("E0224", message, where.place, related=related, help=_SIZES)
                is_known = False
        return constants, sizes if is_known else None

    def values(
        self, inner: Definitions, known: Mapping[str, Constant | None]
    ) -> tuple[Constant, ...]:
        """Value parameters as constants; their arguments are expressions of the using file.

        Some may be given on the command line, and some are `known` already.
        """
        constants = []
        for name, text, _ in self._bound():
            if text == "frame" or is_agent(text, inner):
                continue
            if name in known:
                constants.append(known[name])
                continue
            try:
                expected = parse_type(text, inner.names())
            except ExprError as error:
                self.complete = False
                self.findings.expression_error(self.parameters[name], error)
            else:
                where = self._argument(name, expected)
                constants.append(self._constant(name, where, expected))
        return tuple(constant for constant in constants if constant is not None)

    def _argument(self, name: str, expected: Type) -> YamlNode:
        """Where the argument for a parameter stands: in the file or on the command line."""
        text = self.arguments[name]
        other = self.library.set_values.of(f"{self.user}.{name}", text, expected)
        return other or replace(self.where[name], raw=text)

    def _constant(self, name: str, where: YamlNode, expected: Type) -> Constant | None:
        """A parameter with its value, an expression of the using file; None after reporting."""
        expressions, scope = Expressions(self.findings, self.outer), constant_scope(self.outer)
        value = expressions.value(where, str(where.raw), scope, expected)
        try:
            if value is not None:
                value = _closed(value, self.outer, self.file.spec)
                return Constant(name, value, "", where.key)
        except ExprError as error:
            self.findings.expression_error(where, error)
        self.complete = False
        return None

    def agents(self, inner: Definitions) -> tuple[dict[str, str], Groups]:
        """Parameter that stands for an agent -> its name, and parameters that stand for many."""
        known = {name: name for name in self.library.agents} | self.outer.agents
        groups_known = self.library.groups | self.outer.groups
        bound: dict[str, str] = {}
        groups: Groups = {}
        for name, kind, actual in self._bound():
            if not is_agent(kind, inner):
                continue
            self._note("agent", actual, self.where[name])
            if actual in groups_known:
                own = {at: "_".join((name, *map(str, at))) for at in groups_known[actual]}
                groups[name] = own
                bound |= {own[at]: known[other] for at, other in groups_known[actual].items()}
            elif actual in known:
                bound[name] = known[actual]
            else:
                self.complete = False
                names = [*known, *groups_known]
                self.findings.unknown("E0201", "agent", actual, names, self.where[name].place)
        return bound, groups

    def _note(self, kind: str, name: str, at: YamlNode) -> None:
        places = self.outer.places
        self.findings.use(places.get(f"{kind} {name}") or places.get(f"parameter {name}"), at)


_SIZES = "write how many components there are, or a constant that no operator computes"


def _whole(given: Constant, outer: Definitions) -> int | None:
    """The size that a constant gives; open if it depends on an open size, None if not known."""
    still = {f"?{n}": s for n, s in outer.sizes.items() if isinstance(s, OpenSize)}
    marks = {name: partial(int, size.mark) for name, size in still.items()}
    try:
        value = inlined(given.value, outer.constants)
        env = Environment(operators=marks, count=partial(spend_or_raise, "folding"))
        number = int(evaluate(value, env))
    except (LookupError, ArithmeticError, ValueError, ExprError):
        return None
    is_open = any(isinstance(part, Call) for part in walk(value))
    return OpenSize(number, given.name) if is_open else number


def _uses(where: YamlNode, name: str, types: Collection[str]) -> Iterator[YamlNode]:
    """The texts of types that have a name in the place of a size."""
    if isinstance(where.raw, str):
        role = role_of(where.route)
        form = role.form if role is not None else ""
        if form in ("type", "signature", "parameters", "interface"):
            named = names_of(form, where.raw, types)
            if any(n.kind == "size" and n.name == name for n in named):
                yield where
    elif isinstance(where.raw, (dict, list)):
        for key in where.raw if isinstance(where.raw, dict) else range(len(where.raw)):
            yield from _uses(where[key], name, types)


def _closed(value: Expr, outer: Definitions, used: SpecFile) -> Expr:
    """The argument, with constants inlined if their names have another meaning where it is used.

    What an agent is given goes on into its subsystems, so it keeps no names at all.
    """
    if outer.parameters is not None or used.agent is not None:
        return inlined(value, outer.constants)
    met = reachable(constant_names(value), lambda name: constant_names(outer.constants[name].value))
    return inlined(value, outer.constants) if met.keys() & used.parameters.keys() else value
