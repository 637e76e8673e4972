"""Tests of one subsystem: inputs in units of the specification go in, a step is made, what came of
it is compared. docs/your_robot.md shows how.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

from specc_runtime.faults import Fault
from specc_runtime.loading import load_layouts, load_system
from specc_runtime.stepping import Stepper, array
from specc_runtime.track import outcome_of

from specc import output
from specc.atomic_files import temporary_folder
from specc.diagnostics.nearest import suggestion
from specc.lang import (
    Environment,
    ExprError,
    ExprErrors,
    Scope,
    enums_by_member,
    evaluate,
    expression,
)
from specc.lang.errors import Declaration
from specc.lower.module import lag_slots, live_slots
from specc.model import expr as e
from specc.model.system import types_used
from specc.model.types import Enum, Real, Type
from specc.pipeline import build

Values = Mapping[str, Any]
"""Values by the names of the specification: `x.c.v_d`, or `v_p` of memory.

A text is an expression of the specification's language, as in `"0.2[m/s]"` or `"2 * patience"`;
anything else is a value in SI units as operators get it (docs/your_robot.md).
"""

NONE: Mapping[str, Any] = MappingProxyType({})
T = TypeVar("T")


class Stepped:
    """A subsystem at its beginning, which is stepped by hand; its operators are the real ones."""

    def __init__(self, spec: str | Path, subsystem: str, values: Mapping[str, str] = NONE) -> None:
        """The subsystem of that qualified name, `irp.m`; `values` of constants as for `--set`.

        Raises:
            ValueError: the specification has errors, or no such subsystem.
        """
        built = build(str(spec), values, is_read=False)
        system = built.result.system
        if not built.files or system is None:
            raise ValueError(f"{spec} has errors: see `specc validate {spec}`")
        known = {s.qualified_name: s for s in system.subsystems}
        if subsystem not in known:
            raise ValueError(_unknown("subsystem", subsystem, known))
        self._model = known[subsystem]
        with temporary_folder() as scratch:
            package = Path(scratch, built.system)
            list(output.write(package, built.files))
            loaded = load_system(package, Path(spec).parent)
            layout = load_layouts(loaded)[subsystem]
        self._subsystem = loaded.scheduled(subsystem).subsystem
        self._stepper = Stepper(self._subsystem)
        constants = (*system.constants, *self._model.constants)
        every = types_used(system)
        self._scope = Scope(
            constants={c.name: Declaration(c.value.type, c.place, c.value) for c in constants},
            enums=enums_by_member(type_ for type_ in every if isinstance(type_, Enum)),
        )
        self._environment = _environment({c.name: c.initial or c.value for c in constants})
        self._methods = {state: method for state, (*_, method) in layout.ends.items()}
        of_inputs = {(e.name[0], e.name[1]): e.attribute for e in layout.x}
        self._x = {
            f"x.{peer}.{name}": (of_inputs[peer, name], item.type)
            for (peer, name), item in self._model.inputs.items()
        }
        slots = live_slots(system, self._model).items()
        live = {name: (each.attribute, each.constant.value.type) for name, each in slots}
        self._beside = lag_slots(self._model, of_inputs) | live
        self._y = {".".join(("y", *element.name)): element.attribute for element in layout.y}
        of_memory = {element.name[0]: element.attribute for element in layout.memory}
        self._memory = {m.name: (of_memory[m.name], m.type) for m in self._model.memory}
        self.row = ""
        """The row that the last step took, as `state cause condition -> next`; empty for none."""

    @property
    def state(self) -> str:
        """The state whose behaviour ran last; empty before the first step."""
        return self._subsystem.state

    def step(
        self, arrives: Values = NONE, there: Values = NONE, absent: Collection[str] = ()
    ) -> str:
        """Make one period; the row that is taken, empty for none.

        What `arrives` is fresh, what is `there` has a value without being fresh, what is `absent`
        has none any more. All else keeps its value and is not fresh. How old an input is, and how
        late its sender, is among what is `there`, if anything asks: `age(x.c.T_d)`, `late(...)`.
        So is a constant that may change, by its name.

        Raises:
            ValueError: a name that is no input, or a text that is no value of its type.
            Fault: what ends a run, such as an assumption that does not hold.
        """
        __tracebackhide__ = True
        gone = [_known(self._x, name)[0] for name in absent]
        self._stepper.feed(self._inputs(arrives), self._inputs(there), gone)
        outcome = outcome_of(self._subsystem, ())
        if isinstance(outcome, Fault):
            raise outcome
        self.row = str(self._subsystem.transitions[outcome]) if outcome >= 0 else ""
        return self.row

    def place(self, state: str = "", memory: Values = NONE, periods: int = 0) -> None:
        """Put it into a state in which it has been for some periods, and give memory values.

        Raises:
            ValueError: as `step`, or some memory has no value yet, as before the first step.
        """
        for name, value in memory.items():
            attribute, type_ = _known(self._memory, name)
            setattr(self._subsystem.memory, attribute, self.value(value, type_))
        if state:
            if state not in self._methods:
                raise ValueError(_unknown("state", state, self._methods))
            slots, buffer = self._memory.items(), self._subsystem.memory
            if missing := [n for n, (slot, _) in slots if not hasattr(buffer, slot)]:
                names = " and ".join(missing)
                raise ValueError(f"{names} has no value before the first `step()`; or give one")
            self._stepper.place(state, self._methods[state])
            self._stepper.lasted(periods)
        if self.state:  # else the first step gives memory its values
            self._stepper.settle()

    def __getitem__(self, name: str) -> Any:
        """An output that was written last, `y.c.v`, or memory, in SI units.

        Raises:
            ValueError: there is no such element, or it has no value yet.
        """
        if name.startswith("y."):
            buffer, attribute = self._subsystem.y, _known(self._y, name)
        else:
            buffer, (attribute, _) = self._subsystem.memory, _known(self._memory, name)
        if not hasattr(buffer, attribute):
            raise ValueError(f"{name} has no value yet")
        return getattr(buffer, attribute)

    @property
    def sent(self) -> dict[str, Any]:
        """The outputs that the last step wrote, by name."""
        written = self._subsystem.sends.get(self.state, ())
        return {name: self[name] for name, attribute in self._y.items() if attribute in written}

    def value(self, given: Any, type_: Type | None = None) -> Any:
        """The value of a text in the specification's language; any other value as it is.

        Raises:
            ValueError: the text is no value of that type.
        """
        if not isinstance(given, str) or isinstance(type_, Enum):
            return float(given) if type(given) is int and isinstance(type_, Real) else given
        try:
            expr = expression(given, self._scope, type_)
            return _as_runtime(evaluate(expr, self._environment), expr.type)
        except (ExprError, ExprErrors) as error:
            raise ValueError(f"{given!r}: {error}") from None
        except (KeyError, ArithmeticError) as error:
            raise ValueError(f"{given!r} has no value here: {error}") from None

    def _inputs(self, values: Values) -> dict[str, Any]:
        slots = {name: self._beside.get(name) or _known(self._x, name) for name in values}
        return {slot: self.value(values[name], type_) for name, (slot, type_) in slots.items()}


def _environment(constants: Mapping[str, e.Expr]) -> Environment:
    """The constants that no operator or file gives."""
    values: dict[str, Any] = {}
    for name, value in constants.items():
        if all(not isinstance(node, e.Call | e.FileRef) for node in e.walk(value)):
            values[name] = evaluate(value, Environment(constants=values))
    return Environment(constants=values)


def _as_runtime(value: Any, type_: Type) -> Any:
    if type_.is_array:
        made = array(value)
        made.setflags(write=False)
        return made
    return float(value) if isinstance(type_, Real) and isinstance(value, int) else value


def _known(known: Mapping[str, T], name: str) -> T:
    if name not in known:
        raise ValueError(_unknown("element", name, known))
    return known[name]


def _unknown(what: str, name: str, known: Iterable[str]) -> str:
    return f"there is no {what} {name!r}; {suggestion(name, known)}"
