"""Which subsystems and devices share a module: uses of one description, or parts of one `for`.

They differ in their names, their peers and the values of parameters, which their class is given.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace

from specc.analysis.reads import nodes
from specc.diagnostics.phrases import common_stem
from specc.lower.annotations import PythonTypes
from specc.lower.flow import Proofs
from specc.lower.module import Module
from specc.lower.names import literal
from specc.lower.nodes import Nodes
from specc.lower.table import TermTable
from specc.model.expr import ConstantRef, Expr, constants_in, mapped
from specc.model.system import Constant, Device, Subsystem, System
from specc.reachable import grouped
from specc.source import Place


@dataclass(frozen=True, slots=True)
class Family:
    """The parts of one module. `given` are the parameters whose values differ among them."""

    members: tuple[Subsystem | Device, ...]
    given: tuple[str, ...] = ()
    values: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    """Qualified name of a member -> its values of `given`, as arguments in Python."""
    imports: tuple[tuple[str, str], ...] = ()
    """What the values need: module and name."""

    @property
    def first(self) -> Subsystem | Device:
        """The member that stands for all."""
        return self.members[0]

    @property
    def is_shared(self) -> bool:
        """Whether there are several members."""
        return len(self.members) > 1

    @property
    def stem(self) -> tuple[str, str]:
        """Agent and own name, or what those of all members begin with."""
        agents = [part.agent for part in self.members]
        return common_stem(agents), common_stem([part.name for part in self.members])

    def made(self, part: Subsystem | Device, class_name: str) -> str:
        """The call that makes a member."""
        own = (f"name={literal(part.qualified_name)}",) if self.is_shared else ()
        return (
            f"{class_name}({', '.join(('files', *own, *self.values.get(part.qualified_name, ())))})"
        )


def families(
    system: System, parts: Iterable[Subsystem | Device], proofs: Proofs, types: PythonTypes
) -> Iterator[Family]:
    """The parts by the module that they share, in the order of the first ones."""
    for members in grouped((_shape(part, proofs), part) for part in parts).values():
        family = _family(system, members, types) if len(members) > 1 else None
        yield from (family,) if family else (Family((part,)) for part in members)


_NOWHERE = Place("")


def _shape(part: Subsystem | Device, proofs: Proofs) -> object:
    """What parts of one family have in common."""
    constants = tuple((c.name, c.title, c.value.type) for c in part.constants)
    if isinstance(part, Device):
        return constants, replace(part, agent="", name="", place=_NOWHERE, constants=())
    proved = tuple(
        proofs.is_proved(part.qualified_name, state.name, cause)
        for state in part.states
        for cause in ("terminal", "error")
    )
    ports = tuple(replace(port, other_end="") for port in part.ports)
    own = (part.kind, part.title, part.rate_hz, ports, part.memory, part.lets, part.conditions)
    machine = (part.functions, part.behaviours, part.states, part.initial_state, part.transitions)
    return constants, proved, own, machine, part.axioms, part.trace


def _family(system: System, members: list[Subsystem | Device], types: PythonTypes) -> Family | None:
    """The family of parts that are alike; none if Python cannot write their values down."""
    first = {c.name: c.value for c in members[0].constants}
    differ = {c.name for part in members for c in part.constants if c.value != first[c.name]}
    given = tuple(name for name in first if name in differ & _used(members[0]))
    known = {constant.name: constant.value for constant in system.constants}
    values, imports = {}, dict[tuple[str, str], None]()
    for part in members:
        module = Module(system, part, types, given=given)
        own = [constant for constant in part.constants if constant.name in given]
        arguments = ((module.given[c.name], _written(module, c, known)) for c in own)
        values[part.qualified_name] = tuple(f"{name}={text}" for name, text in arguments)
        if module.parts_are_needed:
            return None
        imports |= dict.fromkeys(module.imports.named)
    return Family(tuple(members), given, values, tuple(imports))


def _used(part: Subsystem | Device) -> set[str]:
    """The constants that a part names."""
    if isinstance(part, Device):
        safe = [value for _, s in part.safe for value in (s.value, s.otherwise) if value]
        return {name for value in safe for name in constants_in(value)}
    return {node.name for node in nodes(part) if isinstance(node, ConstantRef)}


def _written(module: Module, constant: Constant, known: Mapping[str, Expr]) -> str:
    """The value of a parameter in Python, without names of constants."""

    def plain(expr: Expr) -> Expr:
        if isinstance(expr, ConstantRef) and expr.name in known:
            return plain(known[expr.name])
        return mapped(expr, plain)

    term = TermTable(()).of(plain(constant.value))
    text = Nodes(module, TermTable(()), hoists=False).value(term).text
    return f"{module.imports.own('read_only')}({text})" if term.type.is_array else text
