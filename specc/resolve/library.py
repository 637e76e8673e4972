"""Builds the definitions of a file: its own and those of the files that it uses."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from specc.diagnostics import Related
from specc.lang import (
    RESERVED,
    TYPE_WORDS,
    ExprError,
    Scope,
    enums_by_member,
    parse_signature,
    show,
)
from specc.limits import DESCRIBE_LESS, MAX_DEPTH, OUT_OF_PARTS, remaining, spend
from specc.model.expr import Expr, Live, Number
from specc.model.system import Constant, Operator
from specc.model.types import Enum, Frame, Int, Real
from specc.model.units import DIMENSIONLESS
from specc.read import ANYWHERE, AllowedPaths
from specc.resolve.context import (
    Findings,
    SetValues,
    TypeText,
    YamlNode,
    file_hint,
    in_unit,
    quantity,
    trace_of,
)
from specc.resolve.definitions import (
    Definitions,
    Groups,
    Interface,
    TypeMaker,
    open_sizes,
    sizes_in,
)
from specc.resolve.expressions import Expressions, known_number
from specc.schema import SpecFile
from specc.schema.files import ConstantDef, OperatorDef, TypeDef
from specc.source import Place, beside, relative_path


@dataclass(frozen=True, slots=True)
class Loaded:
    """A file that has the right shape."""

    path: str
    spec: SpecFile
    top: YamlNode


_Section = Literal["frames", "types", "operators", "files", "constants", "interfaces"]
_WORDS = {"types": TYPE_WORDS, "operators": RESERVED}
"""Names that a specification does not give."""

Load = Callable[[str, YamlNode | None], Loaded | None]
"""Reads and shapes a file, reporting what is wrong at the place that names it."""


@dataclass(eq=False, slots=True)
class Library:
    """Definitions of files. `base` is the directory of the main file.

    With `shared` its constants, and those of files that it uses, are given on the command line.
    """

    load: Load
    base: str
    findings: Findings
    reach: AllowedPaths = ANYWHERE
    set_values: SetValues = field(default_factory=SetValues)
    shared: bool = False
    agents: tuple[str, ...] = ()
    """Names of all agents of the system, some of which are `groups`."""
    groups: Groups = field(default_factory=dict)
    _using: tuple[str, ...] = ()
    _built: dict[str, Definitions] = field(default_factory=dict)
    """Of files that others use, by path: what two use is built once."""
    _names_by_meaning: dict[str, dict[object, str]] = field(default_factory=dict)
    """Operator or file, as it is written -> what it means and where -> its name in the system."""

    def definitions(
        self,
        file: Loaded,
        frames: dict[str, Frame] | None = None,
        given: tuple[Constant, ...] | None = None,
        sizes: Mapping[str, int] | None = None,
    ) -> Definitions:
        """Resolve what is in force in `file`.

        `frames`, `given` and `sizes` are of its parameters.
        """
        own = self.start(file, frames, sizes)
        self.complete(own, file, given)
        return own

    def start(
        self,
        file: Loaded,
        frames: dict[str, Frame] | None = None,
        sizes: Mapping[str, int] | None = None,
    ) -> Definitions:
        """The definitions that types in `file` may name; values of parameters may have such types.

        They are to be made `complete`. The files that `file` uses are in them.
        """
        own = Definitions(frames=dict(frames or {}), has_points=file.spec.specc > 1)
        parameters = file.top["parameters"]
        own.places |= {f"parameter {n}": parameters[n].key for n in file.spec.parameters}
        own.sizes = open_sizes(file.spec.parameters) if sizes is None else sizes
        self._use_others(file, own)
        for name, title, _ in self._unclashing("frames", file, own):
            own.frames.setdefault(name, name)
            own.frame_titles[own.frames[name]] = title
        self._types(file, own)
        for name, text in file.spec.parameters.items():
            note = TypeText(parameters[name], "type", text, own.names(), own.places)
            self.findings.types.append(note)
        return own

    def complete(
        self, own: Definitions, file: Loaded, given: tuple[Constant, ...] | None = None
    ) -> None:
        """Add the other definitions of `file`, whose value parameters are `given`."""
        if given is not None:
            own.parameters = {c.name: c for c in given}
            for constant in given:
                if constant.name not in own.constants:
                    own.add(constant)
        self._files(file, own)
        self._operators(file, own)
        self._constants(file, own)
        for name, definition, where in self._unclashing("interfaces", file, own):
            own.interfaces[name] = Interface(definition, where, own)

    def _use_others(self, file: Loaded, own: Definitions) -> None:
        for index, relative in enumerate(file.spec.use):
            where = file.top["use"][index]
            path = beside(file.path, relative)
            if len(self._using) >= MAX_DEPTH:
                message = f"files use files more than {MAX_DEPTH} levels deep"
                self.findings.report("E0017", message, where.place, help="use them side by side")
                continue
            if path in (file.path, *self._using):
                help_text = "delete it, or put what both files need into a third one"
                message = f"`{relative}` uses itself"
                self.findings.report("E0206", message, where.place, help=help_text)
                continue
            other = self.load(path, where)
            if other is None:
                self.findings.has_unread_file = True
                continue
            if other.path not in self._built:
                inner = replace(self, _using=(*self._using, file.path))
                self._built[other.path] = inner.definitions(other)
            known = self._built[other.path]
            if self._is_allowed(1 + len(known.places) // _NAMES_OF_A_PART, where.place):
                own.absorb(known, self.findings)
            else:
                self.findings.has_unread_file = True

    def _unclashing(
        self, section: _Section, file: Loaded, own: Definitions
    ) -> Iterator[tuple[str, Any, YamlNode]]:
        """Yield the definitions of a section whose names are free; others are reported.

        A description has them again each time that it is used. Where the allowance for that is used
        up, there are none, and the names of the section are broken.
        """
        defined, kind = getattr(file.spec, section), section.removesuffix("s")
        at = file.top[section]
        if not self._is_allowed(sum(map(_parts, defined.values())), at.key):
            own.broken |= defined.keys()
            return
        for name, definition in defined.items():
            where = at[name]
            if name in _WORDS.get(section, ()):
                a = "an" if kind == "operator" else "a"
                message = f"`{name}` is a word of the language and cannot name {a} {kind}"
                self.findings.report("E0221", message, where.key, help="choose another name")
            elif own.claim(kind, name, where.key, self.findings):
                yield name, definition, where

    def _types(self, file: Loaded, own: Definitions) -> None:
        makers = []
        for name, definition, where in self._unclashing("types", file, own):
            makers.append(TypeMaker(name, definition, where, own, self.findings))
            own.types[name] = makers[-1]
            own.type_traces[name] = trace_of(definition)
        for maker in makers:
            maker.check(tuple(f"?{f}" for f in maker.definition.frames))

    def _files(self, file: Loaded, own: Definitions) -> None:
        for name, relative, where in self._unclashing("files", file, own):
            path = beside(file.path, relative)
            own.files[name] = (
                self._unique_name("file", name, path, where.key),
                relative_path(path, self.base),
            )
            if not self.reach.contains(path):
                self.findings.report_outside(self.reach, path, where)
            elif os.path.isdir(path):
                self.findings.report_escape(self.reach, path, where)
            elif not os.path.isfile(path):
                what = f"`{relative}` is neither a file nor a folder"
                message = what if os.path.exists(path) else f"no file `{relative}`"
                hint = file_hint(path, relative)
                self.findings.report("E0208", message, where.place, help=hint)

    def _operators(self, file: Loaded, own: Definitions) -> None:
        names = own.names(variables=True)
        # Uses of one description with other frames have one operator.
        unframed = replace(names, frames={f: f for f in own.frames})
        is_unframed = unframed.frames == names.frames
        for name, definition, where in self._unclashing("operators", file, own):
            text, at = definition.signature, where["signature"]
            self.findings.types.append(TypeText(at, "signature", text, names, own.places))
            try:
                signature = parse_signature(text, names)
            except ExprError as error:
                self.findings.expression_error(at, error)
                own.broken.add(name)
                continue
            if definition.python is None:
                message = f"operator `{name}` has no Python function yet"
                help_text = "add `python: package.module:function`"
                self.findings.report("O0201", message, where.key, help=help_text)
            same = signature if is_unframed else parse_signature(text, unframed)
            means = definition.python, same
            met = sizes_in(text, file.spec.types) if own.sizes else ()
            sizes = ",".join(f"{n}={size}" for n, size in own.sizes.items() if n in met)
            own.operators[name] = Operator(
                self._unique_name("operator", name, means, where.key, sizes),
                *signature,
                definition.python or "",
                definition.title,
                trace_of(definition),
                where.key,
                definition.symbol or "",
            )

    def _is_allowed(self, parts: int, where: Place) -> bool:
        """Whether so many parts are allowed; reports the first ones that are not."""
        is_first = remaining("parts") >= 0
        if spend("parts", parts):
            return True
        if is_first:
            self.findings.report("E0017", OUT_OF_PARTS, where, help=DESCRIBE_LESS)
        return False

    def _unique_name(self, kind: str, name: str, means: object, at: Place, sizes: str = "") -> str:
        """The name of an operator or file in the whole system, where names may be used again.

        An operator with `sizes` has a name of its own for each of these.
        """
        known = self._names_by_meaning.setdefault(f"{kind} {name}", {})
        found = known.get((at, sizes)) or known.get(means)
        if found is None:
            found = name if not (known or sizes) else f"{name}@{relative_path(at.file, self.base)}"
            found += f"#{sizes}" if sizes else ""
        known[at, sizes] = known[means] = found
        return found

    def _constants(self, file: Loaded, own: Definitions) -> None:
        expressions = Expressions(self.findings, own)
        below = set(file.spec.constants) - own.constants.keys() - own.broken
        around = replace(constant_scope(own), later_constants=below)
        for name, definition, where in self._unclashing("constants", file, own):
            wanted = expressions.type(where["type"], definition.type) if definition.type else None
            value = expressions.value(where["is"], definition.value, around, wanted)
            place = where.key
            other = self.set_values.of(name, definition.value, wanted) if self.shared else None
            if value is not None and other is not None:
                value = expressions.value(other, str(other.raw), around, value.type, place)
                place = other.key
            below.discard(name)
            if value is None:
                own.broken.add(name)
                continue
            # A file that is used for its definitions, too, has what the command line gives.
            is_set = not self.shared and name in self.set_values.texts
            known = self._built.get(file.path) if is_set else None
            constant = known.constants.get(name) if known else None
            symbol = definition.symbol or ""
            constant = constant or Constant(name, value, definition.title, place, symbol=symbol)
            if definition.range or definition.live:
                constant = self._bounded(constant, definition, where, expressions)
            if constant is None:
                own.broken.add(name)
            else:
                own.add(constant)

    def _bounded(
        self, constant: Constant, definition: ConstantDef, where: YamlNode, expressions: Expressions
    ) -> Constant | None:
        """The constant with its bounds, between which it lies; None after reporting."""
        name, value, place = constant.name, constant.value, constant.place
        type_ = value.type
        wrong = way = ""
        if constant.bounds is not None:
            return constant  # that of a file that was read before
        if not isinstance(type_, Int | Real):
            wrong, way = f"`{name}` is a `{type_}`, not a number", "leave out `range` and `live`"
        elif not definition.range:
            wrong = f"nothing says between which values `{name}` may change"
            way = "add the least and the greatest one, e.g. `range: [0, 1]`"
        elif definition.live and not self.shared:
            wrong = f"`{name}` is `live` in a file that describes a part of systems"
            way = "use the file in the system as well, or make the constant a parameter"
        if wrong:
            self.findings.report("E0343", wrong, where.key, help=way)
            return None
        written = quantity(definition.value)
        unit = str(type_.unit) if isinstance(type_, Real) and type_.unit != DIMENSIONLESS else ""
        unit = written[1] if written and written[1] else unit
        ends = []
        for index, text in enumerate(definition.range):
            at = where["range"][index]
            end = expressions.value(
                at, in_unit(text, unit), constant_scope(expressions.definitions), type_
            )
            number = None if end is None else self._number(end, at, expressions)
            if number is not None:
                ends.append(number)
        now = self._number(value, where["is"], expressions)
        if now is None or len(ends) < 2:
            return None
        low, high = ends
        if low.value > high.value:
            wrong, way = f"the range of `{name}` is empty", "write the least value first"
            self.findings.report("E0343", wrong, where["range"].place, help=way)
            return None
        if not low.value <= now.value <= high.value:
            wrong = f"`{name}` is {show(now)}, outside of its range, {show(low)} to {show(high)}"
            way = "correct the value, or make the range wider"
            related = (Related(where["range"].place, "its range"),)
            written_at = where["is"].place if place == where.key else Place(place.file, place.route)
            self.findings.report("E0343", wrong, written_at, related=related, help=way)
            return None
        bounds = low.value, high.value
        if definition.live:
            live = Live(name, *bounds, type=type_, span=value.span)
            return replace(constant, value=live, bounds=bounds, initial=now)
        return replace(constant, bounds=bounds)

    def _number(self, expr: Expr, at: YamlNode, expressions: Expressions) -> Number | None:
        """The number that an expression over constants gives; None after reporting."""
        try:
            number = known_number(expr, expressions.definitions.constants, "E0343")
        except ExprError as error:
            expressions.report(at, str(at.raw), error)
            return None
        return Number(int(number) if isinstance(expr.type, Int) else number, type=expr.type)


_NAMES_OF_A_PART = 8
"""Of another file: taking in so many costs what giving one part a meaning does."""


def _parts(definition: object) -> int:
    """Names and types that a definition spells, or more; expressions count their own."""
    if isinstance(definition, OperatorDef):
        return 2 + definition.signature.count(":")
    if isinstance(definition, TypeDef):
        return 1 + len(definition.fields or ()) + (definition.type or "").count(",")
    return 1


def constant_scope(definitions: Definitions) -> Scope:
    """The scope of a constant: earlier constants, operators, enum members and files."""
    makers = [maker for maker in definitions.types.values() if isinstance(maker, TypeMaker)]
    enums = (maker.enum() for maker in makers)
    return Scope(
        constants=definitions.declared,
        enums=enums_by_member(enum for enum in enums if isinstance(enum, Enum)),
        files={name: known for name, (known, _) in definitions.files.items()},
        operators=definitions.operators,
        has_points=definitions.has_points,
    )
