"""The order of keys knows every key of the schema, and no other."""

from typing import Any

from specc.schema import files, subsystem
from specc.schema.base import Strict
from specc.schema.location import keys_of
from specc.tools.fmt.order import (
    AGENT,
    ASSIGNMENT,
    AXIOM,
    BEHAVIOUR,
    BINDING,
    COMMAND,
    CONDITION,
    CONDITIONS,
    CONSTANT,
    CYCLE,
    DEVICE,
    ELEMENT,
    FILE,
    FUNCTION,
    INPUT,
    LET,
    MEMORY,
    OPERATOR,
    PLANT,
    ROW,
    SAFE,
    STATE,
    SUBSYSTEM,
    TASK,
    TYPE,
    Kind,
)

KINDS: dict[str, Kind] = {
    "TypeDef": TYPE,
    "ConstantDef": CONSTANT,
    "OperatorDef": OPERATOR,
    "DeviceDef": DEVICE,
    "AgentDef": AGENT,
    "BindingDef": BINDING,
    "PlantDef": PLANT,
    "CycleDef": CYCLE,
    "TaskDef": TASK,
    "SpecFile": FILE,
    "ElementDef": ELEMENT,
    "InputDef": INPUT,
    "CommandDef": COMMAND,
    "SafeDef": SAFE,
    "MemoryDef": MEMORY,
    "LetDef": LET,
    "ConditionDef": CONDITION,
    "AssignmentDef": ASSIGNMENT,
    "FunctionDef": FUNCTION,
    "ConditionsDef": CONDITIONS,
    "BehaviourDef": BEHAVIOUR,
    "StateDef": STATE,
    "TransitionDef": ROW,
    "AxiomDef": AXIOM,
    "SubsystemDef": SUBSYSTEM,
}


def models() -> dict[str, Any]:
    return {
        name: value
        for module in (files, subsystem)
        for name, value in vars(module).items()
        if isinstance(value, type)
        and issubclass(value, Strict)
        and value.__module__ == module.__name__
    }


def test_every_mapping_of_the_schema_has_an_order() -> None:
    assert models().keys() == KINDS.keys()


def test_orders_have_the_keys_of_the_schema() -> None:
    for name, model in models().items():
        assert sorted(KINDS[name].keys) == sorted(keys_of(model)), name


def test_kinds_stand_where_the_schema_has_them() -> None:
    found: set[int] = set()
    waiting = [FILE]
    while waiting:
        kind = waiting.pop()
        if id(kind) not in found:
            found.add(id(kind))
            waiting += [*kind.below.values(), *([kind.each] if kind.each else [])]
    assert {name for name, kind in KINDS.items() if id(kind) not in found} == set()
