"""What resolving a file needs to know, and what it found wrong; rates and durations."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import isfinite
from typing import Any, Literal

from specc.diagnostics import Diagnostic, Related, is_typo, nearest, rename_fix, sole_correction
from specc.lang import FOLLOW_UP, ExprError, Scope, TypeNames, joined_help
from specc.model.expr import Expr, Unknown
from specc.model.fsm import Trace
from specc.model.types import Real, Type
from specc.model.units import DIMENSIONLESS, UnitError, parse_unit
from specc.read import AllowedPaths
from specc.schema.desugar import Desugared, route_below
from specc.schema.keys import Traced
from specc.source import Place, Route

# What every part of resolving shares: a cursor into the files and the list of findings.


@dataclass(frozen=True, slots=True)
class YamlNode:
    """A value in a file: its route and what the YAML has there."""

    file: str
    route: Route
    raw: object

    def __getitem__(self, key: str | int) -> YamlNode:
        raw, value = self.raw, None
        if isinstance(raw, dict):
            value = raw.get(key)
        elif isinstance(raw, list) and isinstance(key, int) and key < len(raw):
            value = raw[key]
        return YamlNode(self.file, route_below(raw, key, self.route), value)

    @property
    def mapping(self) -> dict[str, Any]:
        """A copy of the mapping that stands here; empty if there is none."""
        return dict(self.raw) if isinstance(self.raw, dict) else {}

    def with_content(self, raw: Mapping[str, Any]) -> YamlNode:
        """The same place with other contents, of which some may come from elsewhere as before."""
        routes = self.raw.routes if isinstance(self.raw, Desugared) else {}
        return YamlNode(self.file, self.route, Desugared(raw, routes))

    @property
    def place(self) -> Place:
        """The value itself."""
        return Place(self.file, self.route)

    @property
    def key(self) -> Place:
        """The key that names the value."""
        return Place(self.file, self.route, "key")


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a text in a file was taken for, in its scope; `expr` is None if it has an error.

    `places` are those of the definitions in force, by kind and name, `home` is the subsystem.
    """

    where: YamlNode
    text: str
    scope: Scope
    expr: Expr | None
    places: Mapping[str, Place]
    home: YamlNode | None = None


@dataclass(frozen=True, slots=True)
class TypeText:
    """The text of a type, of a signature or of an interface with its arguments, in its scope."""

    where: YamlNode
    form: Literal["type", "signature", "parameters", "interface"]
    text: str
    names: TypeNames
    places: Mapping[str, Place]


@dataclass(frozen=True, slots=True)
class Use:
    """A name in a text of a file, and what it names: the place of a definition.

    `type` is that of the value there.
    """

    place: Place
    of: Place
    type: Type | None = None


@dataclass(eq=False, slots=True)
class Findings:
    """Collects diagnostics, so that all that is wrong is reported in one go.

    `meanings` has every expression that was read, `types` every type, `uses` the names in all
    other texts. `suppressed` counts errors that only follow from others and are not reported.
    """

    diagnostics: list[Diagnostic] = field(default_factory=list)
    meanings: list[Meaning] = field(default_factory=list)
    types: list[TypeText] = field(default_factory=list)
    uses: list[Use] = field(default_factory=list)
    suppressed: int = 0
    depth: int = 0
    """Of the definition that is being made inside others."""
    has_unread_file: bool = False
    """Whether a file under `use:` cannot be read: any name that is unknown may be one of its."""
    repeated: list[Diagnostic] = field(default_factory=list)
    """Missing parts that are reported at another place that needs them."""
    _lacking: dict[object, int] = field(default_factory=dict)

    def certain(self, found: Iterable[Diagnostic]) -> tuple[Diagnostic, ...]:
        """The findings that do not depend on names in a file that cannot be read."""
        return tuple(d for d in found if not self.has_unread_file or d.code.startswith(_OF_FILES))

    def use(
        self,
        of: Place | None,
        at: YamlNode,
        *below: str | int,
        part: Literal["key", "value"] = "value",
        start: int | None = None,
        end: int | None = None,
        type: Type | None = None,
    ) -> None:
        """Record that a value at or below a place, a key or a part of it names a definition."""
        if of is not None:
            self.uses.append(Use(Place(at.file, (*at.route, *below), part, start, end), of, type))

    def report(
        self,
        code: str,
        message: str,
        place: Place,
        *,
        label: str = "",
        related: tuple[Related, ...] = (),
        help: str = "",
    ) -> None:
        """Add a diagnostic."""
        self.diagnostics.append(Diagnostic(code, message, place, label, related, help))

    def expression_error(
        self,
        where: YamlNode,
        error: ExprError,
        target: Related | None = None,
        lacks: Place | None = None,
    ) -> None:
        """Report an error in the text at `where`, at its own offsets.

        `target` is the declaration that the whole text has its expected type from, `lacks` where
        an element would have to be declared that it asks for.
        """
        if error.code == FOLLOW_UP:
            self.suppressed += 1
            return
        place = Place(where.file, where.route, "value", error.start, error.end)
        related = tuple(Related(origin.place, origin.words) for origin in error.origins)
        if target is not None and error.expected is not None:
            related += (target,)
        missing = (lacks,) if lacks else ()
        found = Diagnostic(error.code, error.message, place, "", related, error.help, lacks=missing)
        self._add(replace(found, fix=rename_fix(place, error.wrong, error.repair)))

    def report_outside(self, reach: AllowedPaths, path: str, where: YamlNode) -> None:
        """Report a file that a specification may not name."""
        message = f"the file lies outside the project: {path}"
        self.report("E0021", message, where.place, help=reach.hint_to_allow(path))

    def report_escape(self, reach: AllowedPaths, folder: str, where: YamlNode) -> None:
        """Report a folder from which a link leads to what a specification may not name."""
        try:
            link = reach.escaping_link(folder)
        except OverflowError as error:
            self.report("E0017", str(error), where.place, help="name a smaller folder")
        else:
            if link:
                self.report_outside(reach, link, where)

    def unknown(
        self,
        code: str,
        what: str,
        name: str,
        known: object,
        place: Place,
        lacks: Place | None = None,
    ) -> bool:
        """Report an unknown name with the nearest known ones, or all of them if they are few.

        `lacks` is where an element of that name would have to be declared. Returns whether the
        name may be that of something to come.
        """
        names = sorted(map(str, known))  # type: ignore[call-overload]  # any iterable of names
        help = suggest(name, names)
        may_come = what in _MAY_COME and (what not in _IDENTIFIERS or name.isidentifier())
        if may_come and not is_typo(name, names):
            part = f"`{name}`" if what in _TARGETS else f"{what} `{name}`"
            way = joined_help(_MAY_COME[what], help if names else "")
            if what.endswith("condition") and not name.isidentifier():
                way = "give it a name under `conditions:`, and write that name here"
                way = way if what.startswith("initial") else f"write `{{when: ...}}`, or {way}"
            self.report_missing(part, place, way, lacks)
            return True
        fix = rename_fix(place, name, sole_correction(name, nearest(name, names)))
        message = f"unknown {'target' if what in _TARGETS else what} `{name}`"
        self.diagnostics.append(
            Diagnostic(code, message, place, "", (), help, fix, lacks=(lacks,) if lacks else ())
        )
        return False

    def report_missing(
        self, part: str, place: Place, help: str, lacks: Place | None = None
    ) -> None:
        """Report a part that something refers to and that may still come."""
        message = f"{part} is not there yet"
        self._add(Diagnostic("O0205", message, place, help=help, lacks=(lacks,) if lacks else ()))

    def _add(self, found: Diagnostic) -> None:
        """Add a diagnostic; a missing part is reported once, with everything that refers to it."""
        if found.code == "O0205":
            index = self._lacking.setdefault(_missing_part_key(found), len(self.diagnostics))
            if index < len(self.diagnostics):
                earlier = self.diagnostics[index]
                more = (Related(found.primary, "needed here as well"),)
                known = {earlier.primary, *(other.place for other in earlier.related)}
                if len(earlier.related) < _MOST_RELATED and found.primary not in known:
                    self.diagnostics[index] = replace(earlier, related=earlier.related + more)
                self.suppressed += 1
                self.repeated.append(found)
                return
        self.diagnostics.append(found)


_OF_FILES = ("E00", "E01", "O0401")
_TARGETS = ("memory target", "output target")
_IDENTIFIERS = ("agent", "state or mode", "mode")
"""What has no other names, so that anything else is a mistake and not a part to come."""
_MAY_COME = {
    "frame": "declare it under `frames:`",
    "agent": "add it under `agents:`",
    "subsystem": "add it under `agents:`",
    "real effector": "add it under `real_effectors:`",
    "real receptor": "add it under `real_receptors:`",
    "peer": "add what is at the other end",
    "memory element": "declare it under `memory:`",
    "initial condition": "declare it under `conditions:`",
    "terminal condition": "declare it under `conditions:`",
    "error condition": "declare it under `conditions:`",
    "memory target": "declare it under `memory:`",
    "output target": "declare it under `y:` here and under `x:` of what reads it",
    "function": "declare it under `functions:`",
    "behaviour": "declare it under `behaviours:`",
    "state": "declare it under `states:`",
    "state or mode": "declare it under `states:` or `modes:`",
    "mode": "declare it under `modes:`",
}
"""Parts that may be added later, and how to add them."""
_MOST_RELATED = 4


def _missing_part_key(finding: Diagnostic) -> object:
    """A key that findings about the same missing part share.

    It consists of file, message and the scope in which the part is missing.
    """
    place, message = finding.primary, finding.message
    if message.startswith(_OF_A_FILE):
        return place.file, message, ()
    route = place.route
    above = {"agents": 2, "agent": 1}.get(str(route[0]) if route else "", 0)
    depth = 1 if not above or route[above : above + 1] == ("control",) else 2
    return place.file, message, route[: above + depth]


_OF_A_FILE = ("frame ", "type ", "interface ", "field ", "member ", "operator ")
"""How findings begin that miss what is one for a whole file."""


def suggest(name: str, known: list[str]) -> str:
    """A help text for an unknown name: `did you mean ...?`, or the known names."""
    close = nearest(name, known)
    if close:
        return "did you mean " + " or ".join(f"`{n}`" for n in close) + "?"
    if not known:
        return "none is declared"
    listed = ", ".join(f"`{n}`" for n in known[:8])
    return f"known: {listed}" + (", ..." if len(known) > 8 else "")


def trace_of(part: Traced) -> Trace:
    """Where in the paper a part comes from."""
    return Trace(part.eq, part.table, part.fig)


def unknown_at(where: YamlNode, type_: Type) -> Unknown:
    """A distinct value for every place, so that no two of them count as the same."""
    return Unknown("/".join(map(str, where.route)), type=type_)


# Durations in the texts of a specification.


# A Fraction of `1e999999999` is computed digit by digit.
_DURATION = re.compile(r"\s*(\d{1,12}(?:\.\d{1,12})?)\s+([a-z]+)\s*", re.ASCII)


def duration_in(
    definition: object, where: YamlNode, key: str, findings: Findings
) -> Fraction | None:
    """Seconds that a definition says under a key, as `20 ms` or `0.5 s`.

    None if it says nothing there, or after reporting.
    """
    text = getattr(definition, key)
    if text is None:
        return None
    found = _DURATION.fullmatch(text)
    if found:
        number, unit_text = found.groups()
        try:
            unit = parse_unit(unit_text)
        except UnitError:
            unit = None
        if unit and unit.same_kind(parse_unit("s")) and Fraction(number) > 0:
            return Fraction(number) * Fraction(unit.scale).limit_denominator(10**9)
    findings.report(
        "E0104",
        f"`{text}` is not a duration",
        where[key].place,
        help="write it with its unit, e.g. `20 ms` or `0.5 s`",
    )
    return None


def file_hint(path: str, relative: str) -> str:
    """A help text for a path without a file: similar names beside it."""
    folder, name = os.path.split(path)
    try:
        close = nearest(name, os.listdir(folder or "."))
    except OSError:
        close = []
    if not close:
        return "the path is relative to the file that names it"
    beside = os.path.dirname(relative)
    return f"did you mean `{os.path.join(beside, close[0])}`?"


_LONGEST_NUMBER = 100
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d{1,3})?"
_QUANTITY = rf"\s*({_NUMBER})\s*(?:\[([^\[\]]*)\])?\s*"


def quantity(text: str) -> tuple[Fraction, str] | None:
    """Number and unit of a value that is one, as written: `0.1[m/s]`."""
    found = re.fullmatch(_QUANTITY, text)
    if not found or len(found[1]) > _LONGEST_NUMBER or not isfinite(float(found[1])):
        return None
    return Fraction(found[1]), (found[2] or "").strip()


def in_unit(text: str, unit: str) -> str:
    """A value as written; a number without a unit gets this one, unless it is empty."""
    found = quantity(text) if unit else None
    return text if found is None or found[1] else f"{text.strip()}[{unit}]"


@dataclass(eq=False, slots=True)
class SetValues:
    """`texts` are those of the command line, by the names of what they are values of.

    `copies` has the agents of each `for` with the name of them all, `units` everything that can be
    given, each with the unit of a number without one.
    """

    texts: Mapping[str, YamlNode] = field(default_factory=dict)
    copies: Mapping[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)

    def of(self, name: str, written: str, declared: Type | None = None) -> YamlNode | None:
        """The text of the command line that replaces a value of a file, if there is one.

        Parameters of copies have a name that is their own, and one that they share.
        What has a name first keeps it: descriptions that use others come before these.
        """
        if name in self.units:
            return None
        agent, dot, rest = name.partition(".")
        shared = f"{self.copies.get(agent, agent)}{dot}{rest}"
        number = quantity(written)
        unit = number[1] if number else ""
        if not unit and isinstance(declared, Real) and declared.unit != DIMENSIONLESS:
            unit = str(declared.unit)
        self.units[name] = unit
        self.units.setdefault(shared, unit)
        found = self.texts.get(name) or self.texts.get(shared)
        return found and replace(found, raw=in_unit(str(found.raw), unit))

    def report_unknown(self, findings: Findings) -> None:
        """Report names on the command line that no constant or parameter has."""
        for name, where in self.texts.items():
            if name not in self.units:
                what = "parameter" if "." in name else "constant"
                known = [other for other in self.units if ("." in other) == ("." in name)]
                findings.unknown("E0201", what, name, known, where.key)
