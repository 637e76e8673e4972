"""What the methods of one generated module share; its constants."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from fractions import Fraction
from types import MappingProxyType

from specc.analysis.reads import nodes
from specc.lang.show import show
from specc.lower.annotations import Annotations, Contracts, PythonTypes
from specc.lower.names import (
    OWN_ATTRIBUTES,
    OWN_NAMES,
    ConstantPlan,
    Functions,
    Imports,
    NamedPlan,
    Namespace,
    identifier,
    literal,
    pair_names,
)
from specc.lower.terms import Term
from specc.model import expr as e
from specc.model.system import Constant, Device, Subsystem, System
from specc.model.types import Type
from specc.reachable import grouped, reachable

# Constants of a module: declared ones, and literal arrays that need not be built every period.


def computed_constants(
    constants: dict[str, Constant], parameters: Collection[str] = ()
) -> frozenset[str]:
    """Constants whose value an operator or a file gives, or that are `given`: known when the system
    is built.
    """
    users = grouped(
        (used, name) for name, c in constants.items() for used in e.constant_names(c.value)
    )
    outside = (
        name
        for name, constant in constants.items()
        if any(isinstance(node, (e.Call, e.FileRef)) for node in e.walk(constant.value))
    )
    return frozenset(reachable((*parameters, *outside), lambda name: users.get(name, ())))


def literal_name(value: e.Expr) -> str:
    """Name of a literal array that says what it holds, whatever it is for; "" if there is none."""
    match value:
        case e.Items(items=items) if items and all(isinstance(item, e.Unused) for item in items):
            return f"UNUSED_{len(items)}"
        case e.Items(items=items) if items and all(_is_zero(item) for item in items):
            return f"ZERO_{len(items)}"
        case e.Builtin(name=name, args=()):
            return name.upper()
    return ""


def _is_zero(item: e.Expr) -> bool:
    return isinstance(item, e.Number) and item.value == 0


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
        """`given` are the parameters that the class gets when it is made."""
        self.imports = Imports()
        self.annotations = Annotations(self.imports, types)
        self.constants: dict[object, ConstantPlan] = {}
        self.uses_files = False
        declared = {c.name: c for c in (*system.constants, *part.constants)}
        self._declared: dict[str, Constant] = declared
        self.computed = computed_constants(declared, parameters)
        arguments = Namespace(("self", "files", "name"))
        self.parameters = {name: arguments.new(name) for name in parameters}
        """Parameter of the specification -> argument of the class."""
        self._operators = {operator.name: operator for operator in system.operators}
        self._names = Namespace((*OWN_NAMES, *types.names.values()))
        self._aliases = {name: self._names.new(e.source_name(name)) for name in self._operators}
        self.attributes = methods = Namespace(OWN_ATTRIBUTES)
        self._constant_names = {
            name: methods.new(name) if name in self.computed else self._names.new(name.upper())
            for name in declared
        }
        self.contracts = Contracts(
            self.imports, self.annotations, self._names.new, stand_ins=stand_ins
        )
        self.operators: dict[str, NamedPlan] = {}
        self._functions = Functions(self.imports, self._names)
        self.hoisted: dict[Term, str] = {}
        """Attributes for arrays that stay as they are once the first period is over."""
        self.memory = memory_names(part)
        self.input_properties: set[tuple[str, str, str]] = set()
        """`fresh`, `present`, `age` or `late`, peer, element: what is asked of inputs."""
        if isinstance(part, Subsystem):
            self.rate_hz = part.rate_hz
            self.inputs = buffer_names(part.inputs)
            self.outputs = buffer_names(part.outputs)
            self.state_methods = {
                s.name: f"_{methods.new(f'in_{s.name.lower()}')}" for s in part.states
            }
            self.behaviour_methods = {b.name: f"_{methods.new(b.name)}" for b in part.behaviours}

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

    def local_names(self) -> Namespace:
        """Names for the inside of a method."""
        return self._names.inner()

    def new_name(self, wanted: str) -> str:
        """A name at the top of the module."""
        return self._names.new(wanted)

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
            self.operators[name] = NamedPlan(self._aliases[name], self._checked(name))
        return self._aliases[name]

    def _checked(self, name: str) -> str:
        operator = self._operators[name]
        function = self._functions.use(operator.python)
        parts = [literal(e.source_name(name)), function, self.contracts.of(operator.result)]
        parts += [literal(said) for said in (str(operator.result), str(operator.trace)) if said]
        return f"{self.imports.runtime_name('operator')}({', '.join(parts)})"

    def file(self, name: str) -> str:
        """The path of a file of the specification."""
        self.uses_files = True
        return f"self._files[{name!r}]"

    def declared(self, name: str) -> Constant:
        """The constant of that name; parameters of the subsystem hide constants of the system."""
        return self._declared[name]

    def constant_name(self, name: str) -> str:
        """What a declared constant is called, at the top of the module or in the class."""
        return self._constant_names[name]


def buffer_names(pairs: Collection[tuple[str, str]]) -> dict[tuple[str, str], str]:
    """Attribute of every element of the input or output buffers, `<peer>_<element>`."""
    kinds = "fresh", "present", *e.LAGS
    return pair_names(pairs, {f"{kind}_{identifier('_'.join(p))}" for p in pairs for kind in kinds})


def memory_names(part: Subsystem | Device) -> dict[str, str]:
    """Attribute of every memory element; the memory of a device is what it reported last."""
    names = Namespace()
    items = part.memory if isinstance(part, Subsystem) else part.y
    return {item.name: names.new(item.name) for item in items}


def lag_slots(
    subsystem: Subsystem, inputs: Mapping[tuple[str, str], str]
) -> dict[str, tuple[str, Type]]:
    """The slots beside `inputs` that say how far these are behind, with their types.

    They go by what asks for them in expressions: `age(x.c.T_d)`.
    """
    asked = (node for node in nodes(subsystem) if isinstance(node, e.Lag))
    return {show(lag): (f"{lag.name}_{inputs[lag.input.key]}", lag.type) for lag in asked}
