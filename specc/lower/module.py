"""What one generated module needs: annotations, contracts, constants, names, layouts."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from itertools import count
from types import MappingProxyType
from typing import NamedTuple

from specc.analysis.reads import live_constants, nodes
from specc.lang.kinds import Python, kind
from specc.lang.show import show
from specc.lower.names import (
    OWN_ATTRIBUTES,
    OWN_NAMES,
    ConstantPlan,
    FilePlan,
    Functions,
    Imports,
    NamedPlan,
    Namespace,
    call,
    identifier,
    in_docstring,
    literal,
    pair_names,
)
from specc.lower.terms import Term
from specc.model import expr as e
from specc.model.bindings import PLANT
from specc.model.fsm import Behaviour, Trace
from specc.model.system import (
    Constant,
    Device,
    Element,
    Memory,
    Subsystem,
    System,
    types_used,
)
from specc.model.types import Enum, Image, Opaque, Record, Type
from specc.reachable import grouped, reachable

# The named types of a system, found in everything that has a type.


def named_types(system: System) -> tuple[tuple[str, Type], ...]:
    """Name and type of every enum and record in use, in the order of their declaration."""
    found: dict[Type, tuple[str, Type]] = {}
    for type_ in types_used(system):
        if name := getattr(type_, "name", ""):
            found.setdefault(frameless(type_), (name, type_))
    order = {named.name: index for index, named in enumerate(system.types)}
    # Of several with one name, each in another file, the first in the system keeps it.
    return tuple(sorted(found.values(), key=lambda t: (order.get(t[0], len(order)), t[0])))


# Annotations: the Python type of every type of the language.


class PythonTypes:
    """Names of the system's own types, the same in all its modules."""

    def __init__(self, types: tuple[tuple[str, Type], ...]) -> None:
        names = Namespace(OWN_NAMES)
        self.names: dict[Type, str] = {}
        self.declared: list[tuple[str, Type]] = []
        for name, type_ in types:
            if isinstance(type_, Opaque) and not type_.python:
                continue  # the types of its values are not known
            if frameless(type_) not in self.names:
                self.names[frameless(type_)] = names.new(name)
                if not getattr(type_, "python", ""):
                    self.declared.append((self.names[frameless(type_)], type_))


def frameless(type_: Type) -> Type:
    """A type without frames: Python does not tell `Object[K]` from `Object[B]`."""
    return type_.framed(lambda frame: "")


class Annotations:
    """Annotations for one module; what they need is imported."""

    def __init__(self, imports: Imports, names: PythonTypes, own_module: str = ".types") -> None:
        self._imports = imports
        self._names = names
        self._own_module = own_module

    def of(self, type_: Type) -> str:
        """The annotation of a type."""
        return kind(type_).annotation(
            type_, Python(self.of, self._imports.runtime_name, self._named)
        )

    def _named(self, type_: Type) -> str:
        name = self._names.names.get(frameless(type_))
        python = getattr(type_, "python", "")
        if python:
            module, _, attribute = python.partition(":")
            return self._imports.add(module, attribute, name or identifier(attribute))
        if name is not None:
            return self._imports.add(self._own_module, name) if self._own_module else name
        if isinstance(type_, Enum):
            self._imports.runtime_name("Literal")
            return literal_type(type_)
        if isinstance(type_, Opaque):
            return self._imports.runtime_name("Any")
        raise TypeError(f"no annotation for {type_!r}")


def literal_type(enum: Enum) -> str:
    """`Literal["u", "c"]`."""
    return f"Literal[{', '.join(map(literal, enum.members))}]"


# Contracts: how generated code checks what comes from outside against its declared type.


_HUMP = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


def _is_replaceable(type_: Type) -> bool:
    """Whether something else may represent a value: an image, or what has a class."""
    return isinstance(type_, Image) or hasattr(type_, "python")


class Contracts:
    """Contracts for one module; those of enums and records get a name there, in `plans`."""

    def __init__(
        self,
        imports: Imports,
        annotations: Annotations,
        new_name: Callable[[str], str],
        *,
        stand_ins: bool = False,
    ) -> None:
        """`stand_ins`: images and what has a class are represented by something else."""
        self._stand_ins = stand_ins
        self.plans: list[NamedPlan] = []
        self._names: dict[Type, str] = {}
        self._imports = imports
        self._python = Python(self.of, imports.runtime_name, annotations.of)
        self._new_name = new_name

    def of(self, type_: Type) -> str:
        """The contract of a type, as an expression."""
        if self._stand_ins and _is_replaceable(type_):
            return self._imports.runtime_name("as_any")
        if not isinstance(type_, Enum | Record):
            return kind(type_).contract(type_, self._python)
        key = frameless(type_)  # frames do not show in values
        if key not in self._names:
            value = kind(type_).contract(type_, self._python)
            words = _HUMP.sub("_", type_.name or "one_of").lower()
            self._names[key] = self._new_name(f"as_{words}")
            self.plans.append(NamedPlan(self._names[key], value))
        return self._names[key]


# Constants of a module: declared ones, and literal arrays that need not be built every period.


def computed_constants(
    constants: dict[str, Constant], parameters: Collection[str] = ()
) -> frozenset[str]:
    """Constants whose value an operator or a file gives, or that are `parameters`: known when the
    system is built.

    What depends on a constant that may change is computed where it is used.
    """
    users = grouped(
        (used, name) for name, c in constants.items() for used in e.constant_names(c.value)
    )
    outside = (
        name
        for name, constant in constants.items()
        if any(isinstance(node, (e.Call, e.FileRef)) for node in e.walk(constant.value))
    )
    found = reachable((*parameters, *outside), lambda name: users.get(name, ()))
    return frozenset(name for name in found if not e.is_live(constants[name].value))


def literal_name(value: e.Expr) -> str:
    """Name of a literal array that says what it holds, whatever it is for; "" if there is none."""
    match value:
        case e.Items(items=items) if items and all(isinstance(item, e.Unused) for item in items):
            return f"UNUSED_{len(items)}"
        case e.Items(items=items) if items and all(
            isinstance(item, e.Number) and item.value == 0 for item in items
        ):
            return f"ZERO_{len(items)}"
        case e.Builtin(name=name, args=()):
            return name.upper()
    return ""


# The names that one generated module uses: operators, constants, buffers, memory, clock.


class Module:
    """Names for the module of one subsystem, with the constants and imports that are asked for."""

    rate_hz = Fraction(1)
    inputs: Mapping[tuple[str, str], str] = MappingProxyType({})
    outputs: Mapping[tuple[str, str], str] = MappingProxyType({})

    def __init__(
        self,
        system: System,
        part: Subsystem | Device,
        types: PythonTypes,
        *,
        stand_ins: bool = False,
        parameters: Collection[str] = (),
    ) -> None:
        """`parameters` are those that the class gets when it is made."""
        self.imports = Imports()
        self.annotations = Annotations(self.imports, types)
        self.constants: dict[object, ConstantPlan] = {}
        self.uses_files = False
        declared = {c.name: c for c in (*system.constants, *part.constants)}
        self.declared: dict[str, Constant] = declared
        """Those of the subsystem hide those of the system."""
        self.computed = computed_constants(declared, parameters)
        arguments = Namespace(("self", "files", "name"))
        self.parameters = {name: arguments.new(name) for name in parameters}
        """Parameter of the specification -> argument of the class."""
        self._operators = {operator.name: operator for operator in system.operators}
        self.names = Namespace((*OWN_NAMES, *types.names.values()))
        self._aliases = {name: self.names.new(e.source_name(name)) for name in self._operators}
        self.attributes = methods = Namespace(OWN_ATTRIBUTES)
        self.constant_names = {
            name: methods.new(name) if name in self.computed else self.names.new(name.upper())
            for name in declared
        }
        self.contracts = Contracts(
            self.imports, self.annotations, self.names.new, stand_ins=stand_ins
        )
        self.operators: dict[str, NamedPlan] = {}
        self._functions = Functions(self.imports, self.names)
        self.hoisted: dict[Term, str] = {}
        """Attributes for arrays that stay as they are once the first period is over."""
        self.memory = memory_names(part)
        self.input_properties: set[tuple[str, str, str]] = set()
        """`fresh`, `present`, `age` or `late`, peer, element: what is asked of inputs."""
        self.live: dict[str, str] = {}
        """Constants that may change, and what reads them."""
        if isinstance(part, Subsystem):
            self.rate_hz = part.rate_hz
            self.inputs = buffer_names(part.inputs)
            self.outputs = buffer_names(part.outputs)
            self.state_methods = {
                s.name: f"_{methods.new(f'in_{s.name.lower()}')}" for s in part.states
            }
            slots = live_slots(system, part)
            self.live = {name: f"x.{slot.attribute}" for name, slot in slots.items()}
            names = dict.fromkeys(
                (b.generic.part if b.generic else b).name for b in part.behaviours
            )
            self.behaviour_methods = {name: f"_{methods.new(name)}" for name in names}
            self.condition_methods = {
                error.name: f"_{methods.new(error.name)}"
                for mode in part.modes
                for _, error in mode.errors
                if len(mode.states) > 1
            }
            """Methods of error conditions that the states of a mode share."""

    def plan_parts(self) -> dict[str, object]:
        """What all that was asked for needs in the module."""
        constants = self.constants.values()
        return {
            "imports": self.imports.lines,
            "contracts": tuple(self.contracts.plans),
            "operators": tuple(self.operators.values()),
            "constants": tuple(c for c in constants if not c.is_computed),
            "computed": tuple(c for c in constants if c.is_computed),
            "uses_files": self.uses_files,
        }

    @property
    def has_content(self) -> bool:
        """Whether anything but imports was asked for."""
        return bool(self.constants or self.operators or self.uses_files or self.contracts.plans)

    def input(self, source: e.Input) -> str:
        """`x.c_T_d`."""
        return f"x.{self.inputs[source.peer, source.element]}"

    def input_property(self, kind: str, source: e.Input) -> str:
        """`x.fresh_c_T_d`; the buffer gets that slot."""
        self.input_properties.add((kind, source.peer, source.element))
        return f"x.{kind}_{self.inputs[source.peer, source.element]}"

    def operator(self, name: str) -> str:
        """What calls an operator, by the specification's name of it; its results are checked."""
        if name not in self.operators:
            operator = self._operators[name]
            parts = [literal(e.source_name(name)), self._functions.use(operator.python)]
            parts.append(self.contracts.of(operator.result))
            parts += [literal(text) for text in (str(operator.result), str(operator.trace)) if text]
            checked = call(self.imports.runtime_name("operator"), parts)
            self.operators[name] = NamedPlan(self._aliases[name], checked)
        return self._aliases[name]

    def file(self, name: str) -> str:
        """The path of a file of the specification."""
        self.uses_files = True
        return f"self._files[{name!r}]"


def buffer_names(pairs: Collection[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """Attribute of every element of the input or output buffers, `<peer>_<element>`."""
    kinds = "fresh", "present", *e.LAGS
    return pair_names(pairs, {f"{kind}_{identifier('_'.join(p))}" for p in pairs for kind in kinds})


def memory_names(part: Subsystem | Device) -> dict[str, str]:
    """Attribute of every memory element; the memory of a device is what it reported last."""
    names = Namespace()
    items = part.memory if isinstance(part, Subsystem) else part.y
    # Memory of modes has names such as `periods(mode)`.
    return {item.name: names.new(item.name.rstrip(")")) for item in items}


def lag_slots(
    subsystem: Subsystem, inputs: Mapping[tuple[str, str], str]
) -> dict[str, tuple[str, Type]]:
    """The slots beside `inputs` that say how far these are behind, with their types.

    They go by what asks for them in expressions: `age(x.c.T_d)`.
    """
    lags = (node for node in nodes(subsystem) if isinstance(node, e.Lag))
    return {show(lag): (f"{lag.name}_{inputs[lag.input.key]}", lag.type) for lag in lags}


class LiveSlot(NamedTuple):
    """The slot beside the inputs for a constant that may change, and its name in recordings."""

    attribute: str
    path: tuple[str, str]
    constant: Constant


def live_slots(system: System, subsystem: Subsystem) -> dict[str, LiveSlot]:
    """The slots for the constants that may change and that a subsystem reads, by their names."""
    peers = {peer for peer, _ in subsystem.inputs}
    group = next(name for name in (f"live{'_' * n}" for n in count()) if name not in peers)
    names = Namespace(buffer_names(subsystem.inputs).values())
    return {
        each.name: LiveSlot(names.new(f"{group}_{each.name}"), (group, each.name), each)
        for each in live_constants(system, subsystem)
    }


class _Forms:
    """Forms for the module; those of records get a name there, in `plans`."""

    def __init__(self, types: PythonTypes, names: Namespace) -> None:
        self.imports = Imports()
        self.plans: list[NamedPlan] = []
        self._python = Python(
            self.of,
            lambda name: f"forms.{name}",
            Annotations(self.imports, types).of,
            Functions(self.imports, names).use,
        )
        self._names = names
        self._known: dict[str, str] = {}

    def of(self, type_: Type) -> str:
        """The form of a type, as an expression."""
        text = kind(type_).form(type_, self._python)
        if not isinstance(type_, Record):
            return text
        if text not in self._known:
            self._known[text] = self._names.new(identifier(type_.name).upper())
            self.plans.append(NamedPlan(self._known[text], text))
        return self._known[text]


@dataclass(frozen=True, slots=True)
class _Layout:
    groups: tuple[tuple[str, tuple[str, ...]], ...]
    ends: tuple[tuple[str, str], ...]


def layouts_plan(system: System, types: PythonTypes) -> FilePlan:
    """The plan of `layouts.py`: the forms that values of each subsystem have in recordings.

    These are values of inputs, outputs and memory; equal layouts are shared.
    """
    names = Namespace((*OWN_NAMES, *types.names.values()))
    forms = _Forms(types, names)
    known: dict[_Layout, str] = {}
    owners = []
    for subsystem in system.subsystems:
        layout = _layout(system, subsystem, types, forms)
        if layout not in known:
            known[layout] = names.new(identifier(subsystem.qualified_name).upper())
        owners.append((literal(subsystem.qualified_name), known[layout]))
    if system.plant and system.plant.observed:
        observed = (((item.name,), f"{PLANT}.{item.name}", item) for item in system.plant.observed)
        groups = ("x", ()), ("y", tuple(_elements(observed, forms))), ("memory", ())
        layout = _Layout(groups, ())
        known[layout] = names.new(PLANT.upper())
        owners.append((literal(PLANT), known[layout]))
    parts = {
        "imports": forms.imports.lines,
        "records": forms.plans,
        "layouts": tuple((name, layout) for layout, name in known.items()),
        "subsystems": tuple(owners),
    }
    return FilePlan("layouts.py.j2", parts)


def _layout(system: System, subsystem: Subsystem, types: PythonTypes, forms: _Forms) -> _Layout:
    methods = Module(system, subsystem, types).state_methods
    x, y, memory = subsystem.inputs, subsystem.outputs, memory_names(subsystem)
    inputs, outputs = buffer_names(x), buffer_names(y)
    changing = [
        (slot.path, slot.attribute, _element_of(slot.constant))
        for slot in live_slots(system, subsystem).values()
    ]
    memory_elements = (((item.name,), memory[item.name], item) for item in subsystem.memory)
    groups = (
        (
            "x",
            (
                *_elements(zip(inputs, inputs.values(), x.values(), strict=True), forms),
                *_elements(changing, forms),
            ),
        ),
        ("y", tuple(_elements(zip(outputs, outputs.values(), y.values(), strict=True), forms))),
        ("memory", tuple(_elements(memory_elements, forms))),
    )
    ends = (
        (
            literal(s.name),
            literal((s.behaviour.terminal.name, _error_names(s.behaviour), methods[s.name])),
        )
        for s in subsystem.states
    )
    return _Layout(groups, tuple(ends))


def _element_of(constant: Constant) -> Element:
    """A constant that may change as an input."""
    return Element(
        constant.name, constant.value.type, None, constant.title, Trace(), constant.place
    )


def _error_names(behaviour: Behaviour) -> str | dict[str, str]:
    """The names of the error conditions by their causes, or that of the only one."""
    names = {cause: condition.name for cause, condition in behaviour.errors}
    return names["error"] if names.keys() == {"error"} else names


def _elements(
    named: Iterable[tuple[tuple[str, ...], str, Element | Memory]], forms: _Forms
) -> Iterator[str]:
    for name, attribute, item in named:
        description = ", ".join(filter(None, (str(item.type), in_docstring(item.title))))
        texts = (literal(attribute), literal(name), forms.of(item.type), literal(description))
        yield ", ".join(texts)
