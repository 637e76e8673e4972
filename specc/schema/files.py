"""Shape of a file: a system, or a description that other files use."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from specc.schema.base import (
    ExprText,
    FieldName,
    GapText,
    PythonPath,
    RateText,
    ReadableName,
    Strict,
    Traced,
    TypeText,
    short_form,
)
from specc.schema.subsystem import Command, Element, SubsystemDef


class TypeDef(Traced):
    """A name for a type, a record of fields, or an opaque type that only operators look into."""

    type: TypeText | None = None
    frames: list[ReadableName] = Field(
        [], description="Frame parameters of a record or opaque type."
    )
    fields: dict[FieldName, TypeText] | None = Field(None, description="Fields of a record.")
    opaque: Literal[True] | None = Field(None, description="Only operators look into its values.")
    python: PythonPath | None = None


class ConstantDef(Traced):
    """A value that never changes."""

    value: ExprText = Field(
        alias="is", description="An expression of constants, operators and numbers."
    )


class OperatorDef(Traced):
    """A primitive function, written in Python."""

    signature: str = Field(
        description="Parameters and result: `(q: vector[6, rad]) -> pose[B, E]`."
    )
    python: PythonPath | None = None


class DeviceDef(Traced):
    """A real effector or receptor: what it accepts (x) and what it reports (y)."""

    x: dict[ReadableName, Command] = Field({}, description="What the device accepts.")
    y: dict[ReadableName, Element] = Field({}, description="What the device reports.")


class AgentDef(Traced):
    """An embodied agent, or the use of one that another file describes."""

    use: str | None = Field(None, description="File that describes the agent.")
    arguments: dict[str, ExprText] = Field({}, alias="with", description="Values of parameters.")
    kind: str | None = Field(None, description="Letters of section 2.2, e.g. CERT.")
    control: SubsystemDef | None = Field(None, description="The control subsystem, called `c`.")
    virtual_effectors: dict[ReadableName, SubsystemDef] = Field(
        {}, description="Subsystems that turn commands into those of real effectors."
    )
    virtual_receptors: dict[ReadableName, SubsystemDef] = Field(
        {}, description="Subsystems that aggregate measurements of real receptors."
    )
    real_effectors: dict[ReadableName, DeviceDef] = Field({}, description="Devices that act.")
    real_receptors: dict[ReadableName, DeviceDef] = Field({}, description="Devices that measure.")


def _as_list(value: object) -> object:
    return value if value is None or isinstance(value, (list, dict)) else [value]


class BindingDef(Strict):
    """What stands behind one element of a device in the plant."""

    joints: list[str] = Field([], description="Joints of the model.")
    sensors: list[str] = Field([], description="Sensors of the model.")
    actuators: list[str] = Field([], description="Actuators of the model.")
    camera: str = Field("", description="Camera of the model.")
    image: Literal["", "rgb", "depth"] = Field("", description="What the camera records.")
    rate: RateText | None = None
    sporadic: bool = Field(False, description="Whether there may be no new sample.")
    max_gap: GapText | None = None
    noise: Annotated[
        list[ExprText], BeforeValidator(_as_list, json_schema_input_type=str | list[str])
    ] = Field([], description="Standard deviation per sensor, or `kinect` for a depth image.")
    through: PythonPath | None = Field(
        None, description="Function between the model and the element, `package.module:name`."
    )


class PlantDef(Strict):
    """What stands behind the devices: a MuJoCo model, or a plant of one's own."""

    model: str = Field("", description="MJCF file, relative to this file.")
    python: PythonPath | None = Field(
        None, description="Function that makes a plant of your own, `package.module:factory`."
    )
    bind: dict[str, BindingDef] = Field(
        {}, description="Element of a device, e.g. `irp.E.m.c_d`, and what is behind it."
    )


class CycleDef(Strict):
    """A transition that counts as one finished cycle."""

    of: str = Field(description="Subsystem, e.g. `irp.c`.")
    source: str = Field(alias="from", description="State that is left.")
    target: str = Field(alias="to", description="State that is entered.")


class TaskDef(Strict):
    """What `specc run` counts and judges."""

    cycle: CycleDef = Field(description="What counts as one cycle.")
    scene: PythonPath | None = Field(None, description="Class that sets the scene up.")
    judge: PythonPath | None = Field(None, description="Class that judges a cycle.")
    watch: list[str] = Field([], description="Memory elements that the judge may see.")


_OF_SYSTEMS = frozenset(("system", "agents", "plant", "task"))
_OF_ALL = frozenset(("specc", *Traced.model_fields))


class SpecFile(Traced):
    """A specification (`system:`), a description to reuse (`subsystem:` or `agent:`), or
    definitions that other files use.
    """

    specc: Literal[1] = Field(description="Version of the language.")
    system: ReadableName | None = Field(
        None, description="Name of the system and of its generated code."
    )
    use: list[str] = Field([], description="Files whose definitions are merged in.")
    parameters: dict[ReadableName, TypeText] = Field(
        {}, description="Parameters of a reusable description; each is a type or `frame`."
    )
    frames: dict[ReadableName, str] = Field(
        {}, description="Coordinate frames, each with a short description."
    )
    types: dict[ReadableName, Annotated[TypeDef, short_form("type", TypeDef)]] = Field(
        {}, description="Names for types."
    )
    constants: dict[ReadableName, Annotated[ConstantDef, short_form("is", ConstantDef)]] = Field(
        {}, description="Values that never change."
    )
    files: dict[ReadableName, str] = Field(
        {}, description="Files, relative to the file that names them."
    )
    operators: dict[ReadableName, OperatorDef] = Field(
        {}, description="Functions written in Python."
    )
    agents: dict[ReadableName, AgentDef] = Field(
        {}, description="The embodied agents of the system."
    )
    subsystem: SubsystemDef | None = Field(None, description="A subsystem to reuse.")
    agent: AgentDef | None = Field(None, description="An agent to reuse.")
    plant: PlantDef | None = Field(None, description="What stands behind the devices.")
    task: TaskDef | None = None

    @property
    def is_part(self) -> bool:
        """Whether the file has definitions or a description for systems to use, and no system."""
        given = self.model_fields_set
        return not given & _OF_SYSTEMS and not given <= _OF_ALL
