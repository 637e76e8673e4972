"""Model objects built by hand, the packages generated from them, and operators that count calls."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from types import ModuleType
from typing import Any

from specc.emit import fill_templates
from specc.lang import (
    Scope,
    TypeNames,
    declarations,
    enums_by_member,
    expression,
    parse_signature,
    parse_type,
)
from specc.lower import lower
from specc.model import expr as m
from specc.model.fsm import (
    Assignment,
    Axiom,
    Behaviour,
    Condition,
    Function,
    State,
    Trace,
    Transition,
)
from specc.model.system import (
    Agent,
    Constant,
    Element,
    Let,
    Memory,
    NamedType,
    Operator,
    Port,
    Subsystem,
    System,
)
from specc.model.types import Bool, Enum, Type
from specc.source import Place

HERE = Place("hand.yaml")
NO_TRACE = Trace()
MODE = Enum("Mode", ("u", "c", "g", "s"))


class Known:
    """Proofs for a test: all tables are proved, or none."""

    def __init__(self, proved: bool) -> None:
        self.proved = proved

    def is_proved(self, subsystem: str, state: str, cause: str) -> bool:
        return self.proved


def condition(
    name: str, when: m.Expr, kind: Any = "initial", eq: tuple[int, ...] = (), title: str = ""
) -> Condition:
    return Condition(name, kind, when, title, Trace(eq), HERE)


ALWAYS = condition("always", m.TRUE)
NEVER = condition("never", m.FALSE)


class Spec:
    """One subsystem `demo.m`, spelled as briefly as in YAML; texts are expressions and types."""

    def __init__(
        self,
        *,
        x: Mapping[str, str],
        y: Mapping[str, str] | None = None,
        memory: Mapping[str, tuple[str, str]] | None = None,
        lets: Mapping[str, str] | None = None,
        constants: Mapping[str, tuple[str, str]] | None = None,
        operators: Mapping[str, tuple[str, Callable[..., Any]]] | None = None,
        frames: str = "ABC",
    ) -> None:
        """`x` and `y` map `peer.element` to a type; `memory` and `constants` a name to type, value;
        `operators` a name to signature and function."""
        self.names = TypeNames(
            frames={f: f for f in frames}, types={"Mode": lambda _: MODE}, variables_allowed=True
        )
        self.x = {_split(key): self.type(text) for key, text in x.items()}
        self.y = {_split(key): self.type(text) for key, text in (y or {}).items()}
        self._memory = memory or {}
        self._lets = lets or {}
        self._constants = constants or {}
        self.functions = {name: f for name, (_, f) in (operators or {}).items()}
        self.operators = {
            name: _operator(name, text, self.names) for name, (text, _) in (operators or {}).items()
        }
        self._let_types: dict[str, Type] = {}
        self.memory_items = tuple(
            Memory(name, self.type(t), self.expr(value, self.type(t)), "", NO_TRACE, HERE)
            for name, (t, value) in self._memory.items()
        )
        self.constant_items = tuple(
            Constant(name, self.expr(value, self.type(t)), "", HERE)
            for name, (t, value) in self._constants.items()
        )
        self.let_items = tuple(self._let(name, text) for name, text in self._lets.items())

    def _let(self, name: str, text: str) -> Let:
        value = self.expr(text, None)
        self._let_types[name] = value.type
        return Let(name, value, "", NO_TRACE, HERE)

    def type(self, text: str) -> Type:
        return parse_type(text, self.names)

    def expr(self, text: str, type: Type | None) -> m.Expr:
        scope = Scope(
            memory=declarations({n: self.type(t) for n, (t, _) in self._memory.items()}),
            lets=declarations(self._let_types),
            constants=declarations({n: self.type(t) for n, (t, _) in self._constants.items()}),
            enums=enums_by_member([MODE]),
            operators=self.operators,
            inputs=declarations(self.x),
            allow_clock=True,
        )
        return expression(text, scope, type)

    def when(self, text: str) -> m.Expr:
        return self.expr(text, Bool())

    def behaviour(
        self,
        name: str,
        assignments: Mapping[str, str],
        terminal: str = "True",
        error: str = "False",
    ) -> Behaviour:
        """`assignments` maps `peer.element` of y, or a memory element, to its value."""
        made = []
        for target, text in assignments.items():
            peer, element = _split(target) if "." in target else ("", target)
            wanted = self.y[peer, element] if peer else self.type(self._memory[target][0])
            made.append(Assignment(peer, element, self.expr(text, wanted), NO_TRACE, HERE))
        function = Function(f"do_{name}", tuple(made), "", NO_TRACE, HERE)
        return Behaviour(
            name,
            (function,),
            condition(f"{name}_ended", self.when(terminal), "terminal"),
            (("error", condition(f"{name}_failed", self.when(error), "error")),),
            "",
            NO_TRACE,
            HERE,
        )

    def system(
        self,
        behaviours: Iterable[Behaviour],
        rows: Iterable[tuple[str, str, str, str]],
        axioms: Iterable[str] = (),
    ) -> System:
        """One state per behaviour, of the same name; rows are source, cause, condition, target."""
        found = tuple(behaviours)
        states = tuple(State(b.name, b, "", NO_TRACE, HERE) for b in found)
        table = tuple(
            Transition(
                source, _cause(cause), condition(f"row_{i}", self.when(w)), target, NO_TRACE, HERE
            )
            for i, (source, cause, w, target) in enumerate(rows)
        )
        return system_of(
            subsystem_of(
                x=self.x,
                y=self.y,
                memory=self.memory_items,
                lets=self.let_items,
                behaviours=found,
                states=states,
                transitions=table,
                axioms=tuple(Axiom(self.when(a), "", HERE) for a in axioms),
            ),
            operators=tuple(self.operators.values()),
            constants=self.constant_items,
            types=(NamedType("Mode", NO_TRACE, HERE),),
        )


def subsystem_of(
    *,
    x: Mapping[tuple[str, str], Type],
    y: Mapping[tuple[str, str], Type],
    behaviours: tuple[Behaviour, ...],
    states: tuple[State, ...],
    transitions: tuple[Transition, ...],
    memory: tuple[Memory, ...] = (),
    lets: tuple[Let, ...] = (),
    axioms: tuple[Axiom, ...] = (),
    title: str = "",
    agent: str = "demo",
    name: str = "m",
) -> Subsystem:
    """A virtual effector at 500 Hz."""
    return Subsystem(
        agent=agent,
        name=name,
        kind="virtual_effector",
        title=title,
        rate_hz=Fraction(500),
        ports=(*_ports("x", x), *_ports("y", y)),
        constants=(),
        memory=memory,
        lets=lets,
        conditions=(),
        functions=(),
        behaviours=behaviours,
        states=states,
        initial_state=states[0].name,
        transitions=transitions,
        axioms=axioms,
        trace=NO_TRACE,
        place=HERE,
    )


def system_of(
    *subsystems: Subsystem,
    operators: tuple[Operator, ...] = (),
    constants: tuple[Constant, ...] = (),
    types: tuple[NamedType, ...] = (),
    name: str = "demo",
    title: str = "",
) -> System:
    """A system of one agent without devices."""
    agent = Agent(subsystems[0].agent, "", "", subsystems, (), HERE)
    return System(
        name=name,
        title=title,
        file="specs/hand.yaml",
        frames=(),
        types=types,
        operators=operators,
        constants=constants,
        files=(),
        agents=(agent,),
        plant=None,
        task=None,
    )


def _split(key: str) -> tuple[str, str]:
    peer, _, element = key.partition(".")
    return peer, element


def _cause(text: str) -> Any:
    return text


def _operator(name: str, text: str, names: TypeNames) -> Operator:
    parameters, result = parse_signature(text, names)
    return Operator(name, parameters, result, f"{RECORDED}:{name}", "", NO_TRACE, HERE)


def _ports(direction: Any, elements: Mapping[tuple[str, str], Type]) -> Iterable[Port]:
    peers = dict.fromkeys(peer for peer, _ in elements)
    for peer in peers:
        inside = tuple(
            Element(name, type, None, "", NO_TRACE, HERE)
            for (p, name), type in elements.items()
            if p == peer
        )
        yield Port(peer, direction, inside, f"elsewhere.{peer}", HERE)


# Running what was generated ------------------------------------------------------------

RECORDED = "recorded_operators"
Calls = list[tuple[str, tuple[Any, ...]]]
_serial = itertools.count()


def install(functions: Mapping[str, Callable[..., Any]], calls: Calls) -> None:
    """Make operators importable for generated code; every call is noted in `calls`."""
    module = ModuleType(RECORDED)
    for name, function in functions.items():

        def recorded(
            *args: Any, _name: str = name, _function: Callable[..., Any] = function
        ) -> Any:
            calls.append((_name, args))
            return _function(*args)

        setattr(module, name, recorded)
    sys.modules[RECORDED] = module


def load(files: Mapping[str, str]) -> dict[str, ModuleType]:
    """Import generated files as a package of a new name, without writing them."""
    package = f"generated_{next(_serial)}"
    modules: dict[str, ModuleType] = {}
    order = sorted(files, key=lambda path: ("__init__.py", "types.py").count(path), reverse=True)
    for path in sorted(order, key=lambda path: path == "system.py"):
        name = package if path == "__init__.py" else f"{package}.{path.removesuffix('.py')}"
        module = ModuleType(name)
        module.__package__ = package
        if path == "__init__.py":
            module.__path__ = []
        sys.modules[name] = module
        exec(compile(files[path], f"{package}/{path}", "exec"), module.__dict__)
        modules[path] = module
    return modules


def running(
    system: System, functions: Mapping[str, Callable[..., Any]], *, proved: bool
) -> tuple[Any, Calls]:
    """The first subsystem of a system as generated code, and the calls of its operators."""
    calls: Calls = []
    install(functions, calls)
    modules = load(fill_templates(lower(system, Known(proved))))
    subsystem = system.subsystems[0]
    module = modules[f"{subsystem.agent}_{subsystem.name}.py"]
    own = (c for c in vars(module).values() if getattr(c, "__module__", "") == module.__name__)
    generated = next(c for c in own if hasattr(c, "transitions"))
    return generated({}), calls
