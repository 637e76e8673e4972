"""Shape of a file: a system, or a description that other files use."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from specc.schema.base import (
    ExprText,
    PythonPath,
    Strict,
    Traced,
    TypeText,
    short_form,
)
from specc.schema.subsystem import Element, SubsystemDef


class TypeDef(Traced):
    """A name for a type, a record of fields, or an opaque type that only operators look into."""

    type: TypeText | None = None
    frames: list[str] = Field([], description="Frame parameters of a record or opaque type.")
    fields: dict[str, TypeText] | None = None
    opaque: Literal[True] | None = None
    python: PythonPath | None = None


class ConstantDef(Traced):
    value: ExprText = Field(alias="is")


class OperatorDef(Traced):
    """A primitive function, written in Python."""

    signature: str = Field(description="`(q: vector[6, rad]) -> pose[B, E]`")
    python: PythonPath


class DeviceDef(Traced):
    """A real effector or receptor: what it accepts (x) and what it reports (y)."""

    x: dict[str, Element] = {}
    y: dict[str, Element] = {}


class AgentDef(Traced):
    """An embodied agent, or the use of one that another file describes."""

    use: str | None = None
    arguments: dict[str, ExprText] = Field({}, alias="with")
    kind: str | None = Field(None, description="Letters of section 2.2, e.g. CERT.")
    control: SubsystemDef | None = None
    virtual_effectors: dict[str, SubsystemDef] = {}
    virtual_receptors: dict[str, SubsystemDef] = {}
    real_effectors: dict[str, DeviceDef] = {}
    real_receptors: dict[str, DeviceDef] = {}


def _as_list(value: object) -> object:
    return value if value is None or isinstance(value, (list, dict)) else [value]


class BindingDef(Strict):
    """What stands behind one element of a device in the plant."""

    joints: list[str] = []
    sensors: list[str] = []
    actuators: list[str] = []
    camera: str = ""
    image: Literal["", "rgb", "depth"] = ""
    rate: str | None = None
    noise: Annotated[
        list[ExprText], BeforeValidator(_as_list, json_schema_input_type=str | list[str])
    ] = Field([], description="Standard deviation per sensor, or `kinect` for a depth image.")
    through: PythonPath | None = Field(
        None, description="Function between the model and the element."
    )


class PlantDef(Strict):
    model: str = Field(description="MJCF file, relative to this file.")
    bind: dict[str, BindingDef] = {}


class CycleDef(Strict):
    of: str = Field(description="Subsystem, e.g. `irp.c`.")
    source: str = Field(alias="from")
    target: str = Field(alias="to")


class TaskDef(Strict):
    """What `specc run` counts and judges."""

    cycle: CycleDef
    scene: PythonPath | None = None
    judge: PythonPath | None = None
    watch: list[str] = []


class SpecFile(Traced):
    """A specification (`system:`) or a description to reuse (`subsystem:` or `agent:`)."""

    specc: Literal[1] = Field(description="Version of the language.")
    system: str | None = None
    use: list[str] = Field([], description="Files whose definitions are merged in.")
    parameters: dict[str, TypeText] = {}
    frames: dict[str, str] = {}
    types: dict[str, Annotated[TypeDef, short_form("type")]] = {}
    constants: dict[str, Annotated[ConstantDef, short_form("is")]] = {}
    files: dict[str, str] = {}
    operators: dict[str, OperatorDef] = {}
    agents: dict[str, AgentDef] = {}
    subsystem: SubsystemDef | None = None
    agent: AgentDef | None = None
    plant: PlantDef | None = None
    task: TaskDef | None = None
