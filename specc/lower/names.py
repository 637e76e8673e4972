"""Names, texts, imports and plans of generated modules."""

from __future__ import annotations

import builtins
import keyword
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from specc.lang.builtins import FUNCTIONS
from specc.model.fsm import Trace

# Texts of a specification inside Python: they can end neither a docstring nor a comment.


def one_line(text: str) -> str:
    """`text` without line breaks and invisible characters."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def in_docstring(text: str) -> str:
    """`text` for the inside of a docstring in triple quotes, at whose end it must not stand."""
    return one_line(text).replace("\\", "\\\\").replace('""', '\\"\\"')


def docstring(*parts: str) -> str:
    """Join the parts that are not empty to a sentence for the inside of a docstring."""
    sentence = ", ".join(part for part in map(in_docstring, parts) if part)
    if not sentence:
        return ""
    return sentence if sentence[-1] in ".!?" else f"{sentence}."


def comment(*parts: str) -> str:
    """Join the parts that are not empty to a comment; instructions to linters lose their sign."""
    return ", ".join(part for part in (one_line(p).replace("#", "") for p in parts) if part)


def with_trace(line: str, trace: Trace, *before: str) -> str:
    """Append a comment to `line`: its trace, after what stands `before`."""
    text = comment(*before, str(trace))
    return f"{line}  # {text}" if text else line


def literal(value: object) -> str:
    """A text, number, boolean or tuple as Python writes it."""
    if isinstance(value, tuple):
        inside = ", ".join(map(literal, value))
        return f"({inside},)" if len(value) == 1 else f"({inside})"
    return repr(value)


# Identifiers: any name of a specification becomes a safe and unique name of Python.


_AMBIGUOUS = frozenset("lOI")
"""Letters that fonts do not tell from digits; linters refuse them as names."""
_IMPORTED = {
    "collections.abc": ("Callable", "Mapping"),
    "dataclasses": ("dataclass",),
    "functools": ("cache",),
    "math": ("inf", "nan"),
    "os.path": ("join",),
    "specc_runtime": ("forms",),
    "specc_runtime.ages": ("AgeRules", "Behind", "MaxAge", "MaxCommandAge"),
    "specc_runtime.builtins": ("composed", "moved", "near_pose", "read_only", "some", "vector"),
    "specc_runtime.contracts": (
        "as_any", "as_bool", "as_depth", "as_instance", "as_int", "as_list", "as_member",
        "as_optional", "as_partial", "as_pose", "as_real", "as_record", "as_rgb", "as_text",
        "as_tuple", "as_vector", "operator",
    ),
    "specc_runtime.panel": ("PanelElement",),
    "specc_runtime.plants.binding": ("ActuatorBinding", "SensorBinding"),
    "specc_runtime.requirements": ("Reading", "Requirement", "Requirements"),
    "specc_runtime.ros2.binding": ("Ros2", "Ros2Published", "Ros2Topic"),
    "specc_runtime.safety": ("SafeOutputs",),
    "specc_runtime.subsystem": ("Equations", "Subsystem", "Transition"),
    "specc_runtime.system": (
        "Connection", "Disturbance", "Draw", "LiveConstant", "PlantInput", "PlantOutput",
        "PlantSpec", "Scheduled", "System", "Task",
    ),
    "specc_runtime.temporal": (
        "And", "Atom", "Historically", "Judgement", "Not", "Once", "Or", "Since", "Stays",
        "Throughout", "Watched", "Within", "judged",
    ),
    "specc_runtime.values": ("Depth", "Pose", "Rgb", "Spatial", "Vector"),
    "typing": ("Any", "ClassVar", "Final", "Literal"),
    ".requirements": ("SystemRequirements",),
    ".triggers": ("SystemTriggers",),
}  # fmt: skip
"""What generated modules import by names that no specification gives."""
_MODULE_OF = {name: module for module, names in _IMPORTED.items() for name in names} | {
    name: function.python for name, function in FUNCTIONS.items() if function.python
}
_DEFINED = (
    "Inputs", "LAYOUTS", "Memory", "Outputs", "PERIOD", "Samples", "Values", "annotations", "base",
    "build", "files", "holds", "memory", "row", "self", "x", "y",
)  # fmt: skip
OWN_NAMES = frozenset((*dir(builtins), *_MODULE_OF, *_DEFINED))
"""What generated modules have without any name of a specification."""
OWN_ATTRIBUTES = ("abc_impl", "files", "periods", "settle", "start", "work")
"""Private attributes that every generated class may have, without their underscore."""
FINALISE = "_settle"
"""Puts together once what no behaviour changes any more; a run may go on from another, too."""
_WORD = re.compile(r"[A-Za-z0-9]+")


def identifier(text: str) -> str:
    """`text` as an ASCII identifier that is not a keyword and does not start with an underscore.

    Names with a leading underscore are private to classes, with two they are mangled.
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    stripped = name.lstrip("_")
    name = stripped + "_" * (len(name) - len(stripped)) if stripped else "unnamed"
    if name[0].isdigit():
        name = f"n{name}"
    if keyword.iskeyword(name) or name in _AMBIGUOUS:
        name = f"{name}_"
    return name


class Namespace:
    """Hands out names that differ from each other and from those already taken."""

    def __init__(self, reserved: Iterable[str] = (), outer: Namespace | None = None) -> None:
        self._names = set(reserved)
        self._outer = outer
        self._inner_names: set[str] = set()
        """Names of inner scopes, which would hide a later one of this scope."""

    def new(self, wanted: str) -> str:
        """`wanted` made safe, with a number behind it if that name is taken."""
        base = identifier(wanted)
        name, count = base, 1
        while name in self._inner_names or self._has(name):
            count += 1
            name = f"{base}_{count}"
        self._names.add(name)
        outer = self._outer
        while outer is not None:
            outer._inner_names.add(name)
            outer = outer._outer
        return name

    def inner(self) -> Namespace:
        """Names of an inner scope, which must not hide those of this one, whichever comes first."""
        return Namespace(outer=self)

    def _has(self, name: str) -> bool:
        return name in self._names or (self._outer is not None and self._outer._has(name))


def pair_names(
    pairs: Iterable[tuple[str, str]], reserved: Iterable[str] = ()
) -> dict[tuple[str, str], str]:
    """A name for every pair, `<first>_<second>`.

    Pairs that would share a name (`a, b_c` and `a_b, c`) get two underscores in the middle instead,
    so that the name of a pair does not depend on the order of the pairs.
    """
    short = {pair: identifier("_".join(pair)) for pair in pairs}
    uses = Counter(short.values())
    names = Namespace(reserved)
    return {
        pair: names.new(name if uses[name] == 1 else "__".join(pair))
        for pair, name in short.items()
    }


def class_name(name: str) -> str:
    """`irp m` -> `IrpM`."""
    return identifier("".join(word[0].upper() + word[1:] for word in _WORD.findall(name)))


# What a generated module imports, collected while it is lowered; the formatter sorts it.


class Imports:
    """Names from modules, in order of their first use."""

    def __init__(self) -> None:
        self._lines: dict[str, None] = {}
        self.named: dict[tuple[str, str], None] = {}
        """Module and name of all that is imported by its own name."""

    def add(self, module: str, name: str, alias: str = "") -> str:
        """Import `name`; the name it has here."""
        alias = alias or name
        renamed = f" as {alias}" if alias != name else ""
        if not renamed:
            self.named[module, name] = None
        self._lines[f"from {module} import {name}{renamed}"] = None
        return alias

    def runtime_name(self, name: str) -> str:
        """Import one of the names that are reserved for generated code; raises KeyError."""
        return self.add(_MODULE_OF[name], name)

    @property
    def lines(self) -> tuple[str, ...]:
        """The import statements."""
        return tuple(self._lines)


class Functions:
    """Imports functions of operators and bindings, `module:name`; two of one name get two names."""

    def __init__(self, imports: Imports, names: Namespace) -> None:
        self._imports = imports
        self._names = names
        self._known: dict[tuple[str, str], str] = {}

    def use(self, python: str) -> str:
        """What stands for the function here; a method keeps the path below its class."""
        module, _, attribute = python.partition(":")
        first, dot, rest = attribute.partition(".")
        if (module, first) not in self._known:
            alias = self._imports.add(module, first, self._names.new(first))
            self._known[module, first] = alias
        return self._known[module, first] + dot + rest


# What templates print. A plan is a template and the texts that fill it in, in order and spelled.


@dataclass(frozen=True, slots=True)
class FilePlan:
    """A generated file: the name of its template, and what each name in the template stands for."""

    template: str
    parts: Mapping[str, object]


@dataclass(frozen=True, slots=True)
class ConstantPlan:
    """A constant. `is_computed`: an operator or a file gives it, so the class holds it."""

    name: str
    annotation: str
    value: str
    comment: str
    is_computed: bool


@dataclass(frozen=True, slots=True)
class NamedPlan:
    """A name at the top of a module and its value: an enum, a contract, an operator."""

    name: str
    value: str


@dataclass(frozen=True, slots=True)
class AttributePlan:
    """An attribute of a buffer or of the memory, or a field of a record."""

    name: str
    annotation: str
    comment: str


@dataclass(frozen=True, slots=True)
class MethodPlan:
    """A method; `lines` carry their indentation relative to its body."""

    name: str
    parameters: tuple[str, ...]
    returns: str
    doc: str
    lines: tuple[str, ...]


def call(name: str, arguments: Iterable[str]) -> str:
    """A call with these arguments."""
    return f"{name}({', '.join(arguments)})"


def keyword_arguments(arguments: Mapping[str, object]) -> Iterator[str]:
    """Named arguments, but those that say nothing."""
    return (f"{name}={literal(value)}" for name, value in arguments.items() if value)
