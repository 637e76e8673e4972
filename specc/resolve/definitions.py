"""Names that are defined: constants, lets, parameters; values put in their place."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count
from zlib import crc32

from specc.diagnostics import Related
from specc.lang import FOLLOW_UP, Declaration, ExprError, TypeNames, parse_type
from specc.lang.types import MakeType, names_of_signature, names_of_type
from specc.limits import MAX_DEPTH, MAX_EXPRESSION_PARTS, MAX_TYPE_PARTS, OUT_OF_PARTS, spend
from specc.model.expr import ConstantRef, Expr, Number, map_children
from specc.model.fsm import Trace
from specc.model.system import Constant, NamedType, Operator, OuterName
from specc.model.types import Enum, Frame, Int, Opaque, Record, Type
from specc.resolve.context import Findings, TypeText, YamlNode
from specc.schema.files import TypeDef
from specc.schema.subsystem import InterfaceDef
from specc.source import Place

# Sizes of vectors and images that parameters are to give.


def size_marks() -> Iterator[int]:
    """Marks of open sizes, by parameter: large numbers with distinct sums and products."""
    return (2**32 + crc32(str(number).encode()) for number in count())


class OpenSize(int):
    """A size that a parameter is to give: a small example of it, spelt as the parameter is.

    It equals no number, and another such size if both are computed alike: `mark` is the value that
    it has if each parameter is a large number that nobody writes.
    """

    name: str
    mark: int

    def __new__(cls, mark: int, name: str) -> OpenSize:
        """The size that the parameter of that name stands for."""
        size = super().__new__(cls, 11 + mark % 7)
        size.mark, size.name = mark, name
        return size

    def __eq__(self, other: object) -> bool:
        return isinstance(other, OpenSize) and self.mark == other.mark

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = int.__hash__

    def __repr__(self) -> str:
        return f"{self.name}: {self.mark}"

    def __str__(self) -> str:
        return self.name


# Constants of a described file stand for their values: only those of the main file are shared.


def inlined(expr: Expr, constants: Mapping[str, Constant], skip: Collection[str] = ()) -> Expr:
    """Replace constants in `expr` by their values, except for those in `skip`.

    Raises:
        ExprError: the values have too many parts; constants of constants can stand for billions.
    """
    inside = parts = 0

    def written_out(part: Expr) -> Expr:
        nonlocal inside, parts
        if inside:
            parts += 1
            is_allowed = spend("parts", 1)
            if parts > MAX_EXPRESSION_PARTS or not is_allowed:
                most = f"more than {MAX_EXPRESSION_PARTS} parts"
                message = f"with its constants written out, this has {most}"
                message = message if is_allowed else OUT_OF_PARTS
                raise ExprError(message, *part.span, "compute the value in an operator", "E0017")
        if not isinstance(part, ConstantRef):
            return map_children(part, written_out)
        if part.name in skip or part.name not in constants:
            return part
        inside += 1
        value = replace(written_out(constants[part.name].value), span=part.span)
        inside -= 1
        return value

    return written_out(expr) if constants else expr


Groups = dict[str, dict[tuple[int, ...], str]]
"""Name of a group -> indices of each member and its name."""


# Named sets of elements of buffers.


@dataclass(frozen=True, slots=True)
class Interface:
    """An interface at its place, with what the texts of its elements may name."""

    definition: InterfaceDef
    where: YamlNode
    definitions: Definitions


def indices_of(each: Mapping[str, str], where: YamlNode) -> dict[str, Constant]:
    """The indices of the `for` of a part at `where`, each with its one value."""
    return {
        name: Constant(name, Number(int(text), type=Int()), "", where["for"][name].key)
        for name, text in each.items()
    }


def report_clash(index: Constant, kind: str, first: Place, findings: Findings) -> None:
    """Report an index with the name of something else, which is defined at `first`."""
    message = f"`{index.name}` is the name of {kind} already"
    related = (Related(first, "first defined here"),)
    help_text = "choose another name for the index"
    findings.report("E0205", message, index.place, related=related, help=help_text)


# Parameters that may stand for sizes.


def may_be_size(kind: str) -> bool:
    """Whether a parameter of a kind may stand for a size."""
    return kind.strip() == "int"


def open_sizes(parameters: Mapping[str, str]) -> dict[str, int]:
    """Sizes in a description that are not given: each equals itself alone."""
    named = (name for name, kind in parameters.items() if may_be_size(kind))
    return {name: OpenSize(mark, name) for name, mark in zip(named, size_marks(), strict=False)}


def sizes_in(signature: str, types: Mapping[str, TypeDef]) -> set[str]:
    """The names of sizes in a signature and in the types of one file that it mentions."""
    named, done, found = list(names_of_signature(signature, types)), set[str](), set[str]()
    while named:
        name = named.pop()
        if name.kind == "size":
            found.add(name.name)
        elif name.kind == "type" and name.name not in done:
            done.add(name.name)
            inner = types[name.name]
            for text in (inner.type or "", *(inner.fields or {}).values()):
                named += names_of_type(text, types)
    return found


# What the expressions of one file may name: frames, types, constants, files and operators.


@dataclass(eq=False, slots=True)
class Definitions:
    """Names in force in one file. `frames` maps a name to the frame that it stands for."""

    frames: dict[str, Frame] = field(default_factory=dict)
    sizes: Mapping[str, int] = field(default_factory=dict)
    """Parameters that may stand for the size of a vector or an image."""
    frame_titles: dict[Frame, str] = field(default_factory=dict)
    types: dict[str, MakeType] = field(default_factory=dict)
    type_traces: dict[str, Trace] = field(default_factory=dict)
    interfaces: dict[str, Interface] = field(default_factory=dict)
    constants: dict[str, Constant] = field(default_factory=dict)
    declared: dict[str, Declaration] = field(default_factory=dict)
    """The constants as scopes have them."""
    files: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Each with its name in the system and its path."""
    operators: dict[str, Operator] = field(default_factory=dict)
    places: dict[str, Place] = field(default_factory=dict)
    """Kind and name (`type Mode`) -> where it is defined."""
    broken: set[str] = field(default_factory=set)
    """Names whose own definition has an error."""
    agents: dict[str, str] = field(default_factory=dict)
    """Parameters that stand for agents, each with the name of the agent."""
    groups: Groups = field(default_factory=dict)
    """Parameters that stand for all agents of a `for`; `agents` has each of them."""
    parameters: dict[str, Constant] | None = None
    """The parameters of a described file with their values; None for any other file."""
    has_points: bool = True
    """As `Scope.has_points`."""
    in_place: bool = False
    """Whether the parameters are indices, and all other constants those of the file."""

    def add(self, constant: Constant) -> None:
        """Add a constant, which later ones may name."""
        self.constants[constant.name] = constant
        self.declared[constant.name] = Declaration(
            constant.value.type, constant.place, constant.value
        )

    def inlined(self, expr: Expr) -> Expr:
        """The expression without constants of descriptions. Raises as the function `inlined`."""
        keeps_names = self.parameters is None or self.in_place
        return expr if keeps_names else inlined(expr, self.constants, self.parameters or ())

    def indexed(self, indices: tuple[Constant, ...], findings: Findings) -> Definitions:
        """The same definitions with the indices of a `for`, which are like parameters."""
        found = replace(
            self,
            constants=dict(self.constants),
            parameters=(self.parameters or {}) | {index.name: index for index in indices},
            in_place=self.parameters is None or self.in_place,
            declared=dict(self.declared),
        )
        for index in indices:
            if earlier := self.constants.get(index.name):
                report_clash(index, "a constant", earlier.place, findings)
            found.add(index)
        return found

    def names(self, *, variables: bool = False) -> TypeNames:
        """What type texts may name; with `variables`, undeclared frames are variables."""
        return TypeNames(self.frames, self.types, self.sizes, variables)

    def outside(self) -> tuple[OuterName, ...]:
        """Constants and files, also those with an error in their definition."""
        return tuple(
            OuterName("constant" if kind == "constant" else "file", name, place)
            for label, place in self.places.items()
            for kind, _, name in [label.partition(" ")]
            if kind in ("constant", "file")
        )

    def claim(self, kind: str, name: str, place: Place, findings: Findings) -> bool:
        """Whether `name` is free; reports a second definition with the place of the first."""
        first = self.places.setdefault(f"{kind} {name}", place)
        if first == place:
            return True
        related = (Related(first, "first defined here"),)
        message, help_text = f"{kind} `{name}` is defined twice", "delete or rename one of the two"
        findings.report("E0205", message, place, related=related, help=help_text)
        return False

    def absorb(self, other: Definitions, findings: Findings) -> None:
        """Add the definitions of a file that this one uses."""
        self.broken |= other.broken
        self.frame_titles |= other.frame_titles
        for label, place in other.places.items():
            kind, name = label.split(" ", 1)
            if kind == "parameter" or not self.claim(kind, name, place, findings):
                continue
            theirs = getattr(other, f"{kind}s")
            if name in theirs and kind == "constant":
                self.add(theirs[name])
            elif name in theirs:
                getattr(self, f"{kind}s")[name] = theirs[name]
            if kind == "type" and name in other.type_traces:
                self.type_traces[name] = other.type_traces[name]


def types_in(several: Iterable[Definitions]) -> tuple[NamedType, ...]:
    """Named types of these files, without duplicates."""
    found = {
        name: NamedType(name, trace, known.places[f"type {name}"])
        for known in several
        for name, trace in known.type_traces.items()
    }
    return tuple(found[name] for name in sorted(found))


@dataclass(eq=False, slots=True)
class TypeMaker:
    """Makes the type of a name, for given frames; a type that contains itself is an error."""

    name: str
    definition: TypeDef
    where: YamlNode
    definitions: Definitions
    findings: Findings
    _types: dict[tuple[Frame, ...], Type] = field(default_factory=dict)
    _is_open: bool = False
    _broken: bool = False

    def __call__(self, frames: tuple[Frame, ...]) -> Type:
        """The type with these frames; raises `ExprError` if they do not suit it."""
        if frames not in self._types:
            self._types[frames] = self._bounded(frames)
        return self._types[frames]

    def _bounded(self, frames: tuple[Frame, ...]) -> Type:
        if len(frames) != len(self.definition.frames):
            wanted = len(self.definition.frames)
            raise ExprError(
                f"type `{self.name}` takes {wanted} frames, not {len(frames)}",
                0,
                0,
                f"write `{self.name}[{', '.join(self.definition.frames)}]` with frames of yours"
                if wanted
                else f"write `{self.name}`",
                "E0306",
            )
        if self._is_open:
            message, help_text = f"type `{self.name}` contains itself", "break the circle"
            raise ExprError(message, 0, 0, help_text, "E0306")
        self._is_open = True
        self.findings.depth += 1
        try:
            if self.findings.depth > MAX_DEPTH:
                message = f"types are more than {MAX_DEPTH} levels deep"
                raise ExprError(message, 0, 0, _TOO_LARGE, "E0017")
            type_ = self._make(frames)
        finally:
            self._is_open = False
            self.findings.depth -= 1
        parts, levels = type_.extent
        whole = f"with the types in it written out, `{self.name}`"
        if levels > MAX_DEPTH:
            raise self._refused(f"{whole} is more than {MAX_DEPTH} levels deep", "E0017")
        if parts > MAX_TYPE_PARTS:
            raise self._refused(f"{whole} has more than {MAX_TYPE_PARTS} parts", "E0017")
        return type_

    def enum(self) -> Type | None:
        """The type if it is an enum without errors."""
        if not (self.definition.type or "").lstrip().startswith("enum"):
            return None
        try:
            return self(())
        except ExprError:
            return None

    def check(self, frames: tuple[Frame, ...]) -> None:
        """Report what is wrong with the definition, once, at its own place."""
        given = [self.definition.type, self.definition.fields, self.definition.opaque]
        if sum(part is not None for part in given) != 1:
            message = f"type `{self.name}` needs one of `type`, `fields` and `opaque`"
            help_text = "keep the one that says what the type is"
            self.findings.report("E0104", message, self.where.place, help=help_text)
            return
        if self.definition.codec is not None and not self.definition.opaque:
            message = f"type `{self.name}` has a codec and is not opaque"
            help_text = "remove `codec`: values of all other types are recorded as they are"
            self.findings.report("E0104", message, self.where["codec"].place, help=help_text)
        known = self.definitions
        local = known.frames | dict(zip(self.definition.frames, frames, strict=True))
        names = TypeNames(local, known.types, known.sizes)
        fields = (self.definition.fields or {}).items()
        texts = [(self.where["fields"][name], text) for name, text in fields]
        texts += [(self.where["type"], self.definition.type)] if self.definition.type else []
        for at, text in texts:
            self.findings.types.append(TypeText(at, "type", text, names, known.places))
        try:
            self(frames)
        except ExprError as error:
            self.findings.expression_error(self.where["type"], error)

    def _refused(self, message: str, code: str) -> ExprError:
        """Report that the type is too large, here and nowhere else."""
        error = ExprError(message, 0, 0, _TOO_LARGE, code)
        self.findings.expression_error(self.where["type"], error)
        self._broken = True
        return ExprError(message, 0, 0, code=FOLLOW_UP)

    def _parsed(self, where: YamlNode, text: str, names: TypeNames) -> Type:
        """A type in the definition; what is wrong with it is reported here and nowhere else."""
        if not self._broken:
            try:
                return parse_type(text, names)
            except ExprError as error:
                self.findings.expression_error(where, error)
                self._broken = True
        raise ExprError(f"type `{self.name}` has an error", 0, 0, code=FOLLOW_UP)

    def _make(self, frames: tuple[Frame, ...]) -> Type:
        definition = self.definition
        local = dict(zip(definition.frames, frames, strict=True))
        known = self.definitions
        names = TypeNames(known.frames | local, known.types, known.sizes)
        if definition.opaque:
            codec = definition.codec
            functions = (codec.encode, codec.decode) if codec else ()
            return Opaque(self.name, frames, definition.python or "", functions)
        if definition.fields is not None:
            texts, at = definition.fields.items(), self.where["fields"]
            fields = tuple((n, self._parsed(at[n], t, names)) for n, t in texts)
            return Record(self.name, frames, fields, definition.python or "")
        parsed = self._parsed(self.where["type"], definition.type or "", names)
        return Enum(self.name, parsed.members) if isinstance(parsed, Enum) else parsed


_TOO_LARGE = "use an opaque type for a part"
