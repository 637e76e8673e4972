"""Which subsystems and devices share a module: uses of one description, or parts of one `for`.

They differ in their names, their peers and the values of parameters, which their class is given.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from specc.analysis.reads import nodes
from specc.diagnostics.phrases import common_stem
from specc.lower.flow import Proofs
from specc.lower.module import Module, PythonTypes
from specc.lower.names import call, literal
from specc.lower.nodes import Emitter
from specc.lower.terms import TermTable
from specc.model.expr import ConstantRef, Expr, constant_names, is_live, map_children
from specc.model.system import Constant, Device, Subsystem, System
from specc.reachable import grouped
from specc.source import Place


@dataclass(frozen=True, slots=True)
class Family:
    """The parts of one module. `parameters` are those whose values differ among them."""

    instances: tuple[Subsystem | Device, ...]
    parameters: tuple[str, ...] = ()
    arguments: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Qualified name of a member -> its values of `parameters`, as arguments in Python."""
    imports: tuple[tuple[str, str], ...] = ()
    """What the values need: module and name."""

    @property
    def first(self) -> Subsystem | Device:
        """The member that stands for all."""
        return self.instances[0]

    @property
    def is_shared(self) -> bool:
        """Whether there are several members."""
        return len(self.instances) > 1

    @property
    def common_name(self) -> tuple[str, str]:
        """Agent and own name, or what those of all members begin with."""
        agents = [part.agent for part in self.instances]
        return common_stem(agents), common_stem([part.name for part in self.instances])

    def constructor_call(self, part: Subsystem | Device, class_name: str) -> str:
        """The call that makes a member."""
        own = (f"name={literal(part.qualified_name)}",) if self.is_shared else ()
        values = self.arguments.get(part.qualified_name, ())
        return call(class_name, ("files", *own, *values))


def families(
    system: System, parts: Iterable[Subsystem | Device], proofs: Proofs, types: PythonTypes
) -> Iterator[Family]:
    """Group parts by the module that they share, in the order of the first ones."""
    for members in grouped((_family_key(part, proofs), part) for part in parts).values():
        family = _family(system, members, types) if len(members) > 1 else None
        yield from (family,) if family else (Family((part,)) for part in members)


_NOWHERE = Place("")


def _family_key(part: Subsystem | Device, proofs: Proofs) -> object:
    """A key that parts of one family share."""
    constants = tuple((c.name, c.title, c.value.type) for c in part.constants)
    if isinstance(part, Device):
        return constants, replace(part, agent="", name="", place=_NOWHERE, constants=())
    proved = tuple(
        proofs.is_proved(part.qualified_name, state.name, cause)
        for state in part.states
        for cause in state.behaviour.causes
    )
    ports = tuple(replace(port, other_end="") for port in part.ports)
    own = (part.kind, part.title, part.rate_hz, ports, part.memory, part.lets, part.conditions)
    states = (part.states, part.initial_state, part.modes, part.transitions)
    machine = (part.functions, part.behaviours, *states)
    return constants, proved, own, machine, part.axioms, part.trace


def _family(
    system: System, instances: list[Subsystem | Device], types: PythonTypes
) -> Family | None:
    """The family of parts that are alike; None if Python cannot write their values down."""
    first = {c.name: c.value for c in instances[0].constants}
    differ = {c.name for part in instances for c in part.constants if c.value != first[c.name]}
    parameters = tuple(name for name in first if name in differ & _constants_used(instances[0]))
    if any(is_live(first[name]) for name in parameters):
        return None  # their value is no argument
    known = {constant.name: constant.value for constant in system.constants}
    values, imports = {}, dict[tuple[str, str], None]()
    for part in instances:
        module = Module(system, part, types, parameters=parameters)
        own = [constant for constant in part.constants if constant.name in parameters]
        arguments = ((module.parameters[c.name], _argument(module, c, known)) for c in own)
        values[part.qualified_name] = tuple(f"{name}={text}" for name, text in arguments)
        if module.has_content:
            return None
        imports |= dict.fromkeys(module.imports.named)
    return Family(tuple(instances), parameters, values, tuple(imports))


def _constants_used(part: Subsystem | Device) -> set[str]:
    """The constants that a part names."""
    if isinstance(part, Device):
        safe = [value for _, s in part.safe for value in (s.value, s.otherwise) if value]
        return {name for value in safe for name in constant_names(value)}
    return {node.name for node in nodes(part) if isinstance(node, ConstantRef)}


def _argument(module: Module, constant: Constant, known: Mapping[str, Expr]) -> str:
    """The value of a parameter in Python, without names of constants."""

    def plain(expr: Expr) -> Expr:
        if isinstance(expr, ConstantRef) and expr.name in known:
            return plain(known[expr.name])
        return map_children(expr, plain)

    term = TermTable(()).of(plain(constant.value))
    text = Emitter(module, TermTable(()), hoists=False).emit(term).text
    return f"{module.imports.runtime_name('read_only')}({text})" if term.type.is_array else text
