"""Descriptions that live in another file and are used with parameters."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial

from specc.diagnostics import Related, nearest
from specc.lang import A_SIZE, Environment, ExprError, evaluate, is_size, parse_type
from specc.lang.mentioned import names_of
from specc.limits import MAX_DEPTH, spend_or_raise
from specc.model.expr import Call, Expr, constants_in, walk
from specc.model.system import Constant
from specc.model.types import Frame, Int, Type
from specc.reachable import reachable
from specc.resolve.context import CommandLineValues, Findings, SourceValue
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


@dataclass(frozen=True, slots=True)
class Setting:
    """The file that describes a part, the names in force there and the parameters given to it."""

    file: Loaded
    definitions: Definitions
    given: tuple[Constant, ...] = ()
    groups: Groups = field(default_factory=dict)
    """Of peers: those in the same agent, then only those that the part names."""
    using: tuple[str, ...] = ()
    """Paths of the descriptions that led here."""


def reuse(
    user: AgentDef | SubsystemDef, where: SourceValue, at: Setting, library: Library, name: str
) -> Setting | None:
    """Load the file that `user` uses, at `where`, and bind its parameters to the arguments.

    `name` is that of the agent, or the qualified one of the subsystem, that it becomes.
    """
    relative, using = user.use or "", at.using
    path = library.beside(at.file, relative)
    if path in (at.file.path, *using):
        library.findings.report(
            "E0207", f"`{relative}` uses itself", where["use"].place, help=_APART
        )
        return None
    if len(using) >= MAX_DEPTH:
        message = f"files use files more than {MAX_DEPTH} levels deep"
        library.findings.report("E0016", message, where["use"].place, help=_FLAT)
        return None
    file = library.load(path, where["use"])
    if file is None:
        return None
    outer, findings = at.definitions, library.findings
    binder = _Binder(user.arguments, where["with"], where["use"], outer, findings)
    frames = binder.frames(file)
    whole, sizes = binder.sizes(file, library.given, name)
    if sizes is None:
        return None
    definitions = library.start(file, frames, sizes)
    given = binder.values(file, definitions, library.given, name, whole)
    agents, groups = binder.agents(file, definitions, library)
    if not binder.complete:
        return None
    library.complete(definitions, file, given)
    definitions.agents, definitions.groups = agents, groups
    return Setting(file, definitions, given, using=(*using, file.path))


def indexed(
    at: Setting, each: Mapping[str, str], where: SourceValue, findings: Findings
) -> Setting:
    """A setting with the indices of the `for` of a part at `where`, each with its one value."""
    if not each:
        return at
    indices = tuple(indices_of(each, where).values())
    definitions = at.definitions.indexed(indices, findings)
    return replace(at, definitions=definitions, given=(*at.given, *indices))


def agent_in(file: Loaded, name: str) -> tuple[AgentDef | None, SourceValue]:
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


_APART = "describe the part here, or use another file"
_FLAT = "use the file that describes the part"


@dataclass(eq=False, slots=True)
class _Binder:
    arguments: Mapping[str, str]
    where: SourceValue
    used: SourceValue
    outer: Definitions
    findings: Findings
    complete: bool = True

    def frames(self, file: Loaded) -> dict[str, Frame]:
        """Frame parameter -> actual frame; also reports missing and unknown arguments."""
        parameters = file.spec.parameters
        self._names(parameters)
        for name in self.arguments.keys() & parameters.keys():
            self.findings.use(file.top["parameters"][name].key, self.where[name], part="key")
        bound = {}
        for name, kind in parameters.items():
            if kind == "frame" and name in self.arguments:
                actual = self.arguments[name]
                if actual in self.outer.frames:
                    bound[name] = self.outer.frames[actual]
                    self._note("frame", actual, self.where[name])
                else:
                    self._fail()
                    known = self.outer.frames
                    self.findings.unknown("E0209", "frame", actual, known, self.where[name].place)
        return bound

    def sizes(
        self, file: Loaded, given: CommandLineValues, user: str
    ) -> tuple[dict[str, Constant | None], dict[str, int] | None]:
        """Parameters that may stand for sizes, as constants, and those that do.

        There are no sizes if one has no value, since no type is known without. What nothing in the
        description has as its size can be any whole number, and so can what is open.
        """
        constants: dict[str, Constant | None] = {}
        sizes: dict[str, int] = {}
        is_known = True
        for name, kind in file.spec.parameters.items():
            if not may_be_size(kind) or name not in self.arguments:
                continue
            where = self._written(name, Int(), given, user)
            constants[name] = constant = self._constant(name, where, Int(), file)
            if constant is None:
                is_known = False
                continue
            number = _whole(constant, self.outer)
            if isinstance(number, OpenSize) or (number is not None and is_size(number)):
                sizes[name] = number
            elif use := next(_uses(file.top, name, file.spec.types), None):
                self._no_size(name, number, where, use)
                is_known = False
        return constants, sizes if is_known else None

    def _no_size(self, name: str, number: int | None, where: SourceValue, use: SourceValue) -> None:
        """Report a parameter that is a size in the description, at `use`, and cannot be one."""
        is_told = "a number that only a run can tell" if number is None else str(number)
        message = f"`{name}` is a size, {A_SIZE}, and not {is_told}"
        related = (Related(use.place, f"`{name}` is the size of this"),)
        help = "write how many components there are, or a constant that no operator computes"
        self.findings.report("E0224", message, where.place, related=related, help=help)

    def values(
        self,
        file: Loaded,
        inner: Definitions,
        given: CommandLineValues,
        user: str,
        known: Mapping[str, Constant | None],
    ) -> tuple[Constant, ...]:
        """Value parameters as constants; their arguments are expressions of the using file.

        Those of the `user` may be given on the command line. Some are `known` already.
        """
        constants = []
        for name, text in file.spec.parameters.items():
            if text == "frame" or is_agent(text, inner) or name not in self.arguments:
                continue
            if name in known:
                constants.append(known[name])
                continue
            expected = self._type(file.top["parameters"][name], text, inner)
            if expected is not None:
                where = self._written(name, expected, given, user)
                constants.append(self._constant(name, where, expected, file))
        return tuple(constant for constant in constants if constant is not None)

    def _written(
        self, name: str, expected: Type, given: CommandLineValues, user: str
    ) -> SourceValue:
        """Where the argument for a parameter stands: in the file or on the command line."""
        other = given.of(f"{user}.{name}", self.arguments[name], expected)
        return other or replace(self.where[name], raw=self.arguments[name])

    def _constant(
        self, name: str, where: SourceValue, expected: Type, file: Loaded
    ) -> Constant | None:
        """A parameter with its value, an expression of the using file; None after reporting."""
        expressions = Expressions(self.findings, self.outer)
        value = expressions.value(where, str(where.raw), constant_scope(self.outer), expected)
        try:
            if value is not None:
                return Constant(name, _outside(value, self.outer, file.spec), "", where.key)
        except ExprError as error:
            self.findings.expression_error(where, error)
        self._fail()
        return None

    def agents(
        self, file: Loaded, inner: Definitions, library: Library
    ) -> tuple[dict[str, str], Groups]:
        """Parameter that stands for an agent -> its name, and parameters that stand for many."""
        known = {name: name for name in library.agents} | self.outer.agents
        many = library.groups | self.outer.groups
        bound: dict[str, str] = {}
        groups: Groups = {}
        for name, kind in file.spec.parameters.items():
            if not is_agent(kind, inner) or name not in self.arguments:
                continue
            actual = self.arguments[name]
            self._note("agent", actual, self.where[name])
            if actual in many:
                own = {at: "_".join((name, *map(str, at))) for at in many[actual]}
                groups[name] = own
                bound |= {own[at]: known[other] for at, other in many[actual].items()}
            elif actual in known:
                bound[name] = known[actual]
            else:
                self._fail()
                names = [*known, *many]
                self.findings.unknown("E0218", "agent", actual, names, self.where[name].place)
        return bound, groups

    def _names(self, parameters: Mapping[str, str]) -> None:
        meant = set()
        for name in self.arguments:
            if name not in parameters:
                self._fail()
                self.findings.unknown("E0210", "parameter", name, parameters, self.where[name].key)
                meant |= set(nearest(name, parameters))
        for name in parameters:
            if name not in self.arguments and name not in meant:
                self._fail()
                message = f"parameter `{name}` has no value"
                help_text = f"add `{name}: ...` under `with:`"
                self.findings.report("E0211", message, self.used.place, help=help_text)

    def _type(self, where: SourceValue, text: str, inner: Definitions) -> Type | None:
        try:
            return parse_type(text, inner.names())
        except ExprError as error:
            self._fail()
            self.findings.expression_error(where, error)
            return None

    def _note(self, kind: str, name: str, at: SourceValue) -> None:
        places = self.outer.places
        self.findings.use(places.get(f"{kind} {name}") or places.get(f"parameter {name}"), at)

    def _fail(self) -> None:
        self.complete = False


def _whole(given: Constant, outer: Definitions) -> int | None:
    """The value of a whole number, if it is known; that of an open size is open as well."""
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


def _uses(where: SourceValue, name: str, types: Collection[str]) -> Iterator[SourceValue]:
    """The texts of types that have a name in the place of a size."""
    if isinstance(where.raw, str):
        role = role_of(where.route)
        form = role.form if role is not None else ""
        if form == "type" or form == "signature" or form == "interface":
            named = names_of(form, where.raw, types)
            if any(n.kind == "size" and n.name == name for n in named):
                yield where
    elif isinstance(where.raw, (dict, list)):
        for key in where.raw if isinstance(where.raw, dict) else range(len(where.raw)):
            yield from _uses(where[key], name, types)


def _outside(value: Expr, outer: Definitions, used: SpecFile) -> Expr:
    """An argument without names that mean something else, or nothing, where it is used.

    What an agent is given goes on into its subsystems, so it keeps no names at all.
    """
    if outer.given is not None or used.agent is not None:
        return inlined(value, outer.constants)
    met = reachable(constants_in(value), lambda name: constants_in(outer.constants[name].value))
    return inlined(value, outer.constants) if met.keys() & used.parameters.keys() else value
