"""Shape of a file: a system, or a description that other files use."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import create_model

from specc.limits import MAX_DISTURBANCES, MAX_REQUIREMENTS
from specc.model.task import OF_PANEL, VERBS
from specc.reachable import reachable
from specc.schema.keys import (
    OF_EACH,
    OTHERS,
    SCALARS,
    AnswerText,
    ArgumentText,
    ConstantText,
    Denoted,
    FieldName,
    FieldPath,
    FilePath,
    GapText,
    ListForm,
    LiteralKind,
    MessageName,
    Name,
    NodeName,
    PanelKey,
    PythonPath,
    RangeText,
    RateText,
    ReadableName,
    Role,
    SeedText,
    SilenceText,
    SpecModel,
    SuccessText,
    Text,
    TopicName,
    Traced,
    WaitText,
    WrittenType,
    key,
)
from specc.schema.subsystem import BufferDef, CommandBufferDef, InterfaceDef, SubsystemDef


class CodecDef(SpecModel):
    """The bytes of a value of an opaque type: in recordings, and between processes."""

    encode: PythonPath = key(about="Function that makes bytes of a value, `package.module:name`.")
    decode: PythonPath = key(about="Function that makes the value of those bytes.")


class TypeDef(Traced, short="type", first="frames type eq table fig title"):
    """A name for a type, a record of fields, or an opaque type that only operators look into."""

    type: WrittenType | None = None
    frames: list[ReadableName] = key([], "Frame parameters of a record or opaque type.")
    fields: dict[FieldName, WrittenType] | None = key(None, "Fields of a record.", defines="field")
    opaque: Literal[True] | None = key(None, "Only operators look into its values.")
    python: PythonPath | None = None
    codec: CodecDef | None = key(None, "How a value of an opaque type becomes bytes.")


class ConstantDef(Denoted, short="is", first="type is range live"):
    """A value that never changes, or only as the range says."""

    type: WrittenType | None = key(None, "What the expression must be a value of.")
    value: ConstantText = key(
        about="An expression of constants, operators and numbers.", alias="is"
    )
    range: Annotated[
        list[ConstantText],
        ListForm(min_length=2, max_length=2, help="write the least and the greatest value"),
    ] = key([], "The least and the greatest value: `[0, 0.5]`, in the unit of the constant.")
    live: bool = key(False, "Whether it may change within the range while something runs.")


class OperatorDef(Denoted, first="signature python title"):
    """A primitive function, written in Python."""

    signature: Annotated[str, Text(Role("signature"))] = key(
        about="Parameters and result: `(q: vector[6, rad]) -> pose[B, E]`."
    )
    python: PythonPath | None = None


class ContractDef(SpecModel, short="that"):
    """What a device does with commands."""

    that: Annotated[str, Text(Role("formula"), filled=True)] = key(
        about="A formula of temporal logic over what the device accepts, `y.E.device.element`, and "
        "reports, `x.E.device.element`."
    )
    because: Annotated[str, Text()] = key("", "Why it can be relied on.")


class DeviceDef(Traced, first="for title eq table fig"):
    """A real effector or receptor: what it accepts (x) and what it reports (y)."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    x: CommandBufferDef = key(CommandBufferDef, "What the device accepts.", step="buffers")
    y: BufferDef = key(BufferDef, "What the device reports.", step="buffers")
    silence: SilenceText | None = None
    through: RateText | None = key(
        None,
        "Rate of a virtual effector or receptor of its name that passes everything on: `50 Hz`.",
    )
    contracts: dict[ReadableName, ContractDef] = key(
        {}, "What the device does with commands, by name."
    )


class AgentDef(
    Traced,
    first="for use title kind with eq table fig real_effectors real_receptors "
    "virtual_effectors virtual_receptors",
):
    """An embodied agent, or the use of one that another file describes."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    use: FilePath | None = key(None, "File that describes the agent.")
    arguments: dict[str, ArgumentText] = key({}, "Values of parameters.", alias="with")
    kind: str | None = key(None, "Letters of section 2.2, e.g. CERT.", step="control")
    control: SubsystemDef | None = key(
        None, "The control subsystem, called `c`.", defines="subsystem"
    )
    virtual_effectors: dict[ReadableName, SubsystemDef] = key(
        {}, "Subsystems that turn commands into those of real effectors.", defines="subsystem"
    )
    virtual_receptors: dict[ReadableName, SubsystemDef] = key(
        {}, "Subsystems that aggregate measurements of real receptors.", defines="subsystem"
    )
    real_effectors: dict[ReadableName, DeviceDef] = key(
        {}, "Devices that act.", defines="device", step="devices"
    )
    real_receptors: dict[ReadableName, DeviceDef] = key(
        {}, "Devices that measure.", defines="device", step="devices"
    )


class ReadingDef(SpecModel):
    """What is read of the plant."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    joints: list[str] = key([], "Joints of the model.")
    sensors: list[str] = key([], "Sensors of the model.")
    actuators: list[str] = key([], "Actuators of the model.")
    through: PythonPath | None = key(
        None, "Function between the model and the element, `package.module:name`."
    )


class ObservedDef(ReadingDef, first="for type actuators joints sensors through"):
    """A value of the plant as it really is, which only requirements see."""

    type: WrittenType


class QosDef(SpecModel):
    """Quality of service of a topic, where it is not the usual one."""

    reliability: Literal["", "reliable", "best_effort"] = key(
        "", "Whether messages are sent again until they arrive."
    )
    durability: Literal["", "volatile", "transient_local"] = key(
        "", "Whether the last messages are kept for those who come late."
    )
    depth: int | None = key(None, "How many messages are kept; one, where nothing is said.")


class TfDef(SpecModel):
    """A transform of tf2, between frames as the specification or ROS calls them."""

    parent: ReadableName = key(about="Frame in which the other one is.", alias="from")
    child: ReadableName = key(about="Frame whose pose it is.", alias="to")


class BindingDef(
    ReadingDef,
    first="for topic tf action action_server service service_server type part field when_busy "
    "answer_within actuators joints sensors camera image rate sporadic "
    "max_gap on_loss through panel hold range init key",
):
    """What stands behind one element of a device in the plant."""

    topic: TopicName = key("", "Topic of ROS 2, e.g. `/joint_states`.")
    tf: TfDef | None = key(None, "Transform of tf2, e.g. `{from: B, to: E}`.")
    action: TopicName = key("", "Action of ROS 2, e.g. `/gripper/grasp`.")
    action_server: TopicName = key("", "Action that others call, e.g. `/pick`.")
    service: TopicName = key("", "Service of ROS 2, e.g. `/lamp/switch`.")
    service_server: TopicName = key("", "Service that others call, e.g. `~/pause`.")
    type: MessageName = key("", "Type of its messages, e.g. `sensor_msgs/JointState`.")
    part: Literal["", "goal", "status", "feedback", "result", "request", "cancel", "response"] = (
        key("", "What of an action or a service the element is.")
    )
    field: FieldPath = key("", "Field of the message that is the value, e.g. `pose.position`.")
    when_busy: Literal["", "reject", "queue", "preempt"] = key(
        "", "What becomes of a goal that comes while another one is pursued; `reject` if left out."
    )
    answer_within: AnswerText | None = None
    qos: QosDef = key(QosDef, "Quality of service of the topic.")
    camera: str = key("", "Camera of the model.")
    image: Literal["", "rgb", "depth"] = key("", "What the camera records.")
    rate: RateText | None = None
    sporadic: bool = key(False, "Whether there may be no new sample.")
    max_gap: GapText | None = None
    on_loss: ConstantText | None = key(
        None, "The value, instead of a fault, after `max_gap` or once the action has no server."
    )
    noise: Annotated[list[ConstantText], ListForm(single=(str, int, float, bool))] = key(
        [], "Standard deviation per sensor, or `kinect` for a depth image."
    )
    panel: Literal["", "button", "switch", "slider", "choice", "number"] = key(
        "", "What of the operator's panel sets the element."
    )
    hold: bool = key(False, "Whether a button is true while it is held.")
    range: Annotated[
        list[ConstantText],
        ListForm(min_length=2, max_length=2, help="write the least and the greatest value"),
    ] = key([], "The least and the greatest value of a slider or a number of the panel.")
    init: ConstantText | None = key(
        None, "The value until the operator, or a first message, gives another one."
    )
    key: PanelKey = key("", "Key of a terminal that operates it, e.g. `s`.")


class Ros2Def(SpecModel, first="node python wait use_sim_time frames"):
    """The node behind which the devices are."""

    node: NodeName = key(about="Name of the node, e.g. `irp` or `/cell/irp`.")
    python: str = key("python3", "Python of your ROS, that has rclpy, e.g. `/usr/bin/python3`.")
    wait: WaitText | None = None
    use_sim_time: bool = key(False, "Whether the time is that of `/clock`.")
    frames: dict[ReadableName, str] = key(
        {}, "Frames of this specification, and what ROS calls them: `{E: tool0}`."
    )


class PlantDef(SpecModel, first="model python ros2"):
    """What stands behind the devices: a MuJoCo model, a plant of one's own, or ROS 2."""

    model: str = key("", "MJCF file, relative to this file.")
    python: PythonPath | None = key(
        None, "Function that makes a plant of your own, `package.module:factory`."
    )
    ros2: Ros2Def | None = key(
        None, "Node that reads and writes topics of ROS 2; it may be beside a simulation."
    )
    publish: list[str] = key(
        [],
        "What others in ROS can watch: `irp.m`, a state, `irp.m.y.c.T_c`, what is sent, or"
        " `diagnostics`.",
    )
    bind: dict[str, BindingDef] = key(
        {}, "Element of a device, e.g. `irp.E.m.c_d`, and what is behind it."
    )
    observe: dict[ReadableName, ObservedDef] = key(
        {}, "What is really so, for requirements: `plant.NAME`.", defines="element"
    )

    def frame(self, name: str) -> str:
        """The frame of that name in the specification, or else in ROS."""
        frames = self.ros2.frames if self.ros2 else {}
        of_ros = {ros.removeprefix("/"): frame for frame, ros in frames.items()}
        return name if name in frames else of_ros.get(name, name)


class CycleDef(SpecModel):
    """A transition that counts as one finished cycle."""

    of: Annotated[str, Text(Role("task", "subsystem"))] = key(about="Subsystem, e.g. `irp.c`.")
    source: Annotated[str, Text(Role("task", "state"))] = key(
        about="State that is left.", alias="from"
    )
    target: Annotated[str, Text(Role("task", "state"))] = key(
        about="State that is entered.", alias="to"
    )


class DrawDef(SpecModel, short="is", row="from to"):
    """A number that the seed of a run decides: this one, one between two, or one of several."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    fixed: ConstantText | None = key(None, "The number.", alias="is")
    least: ConstantText | None = key(None, "The least number.", alias="from")
    greatest: ConstantText | None = key(None, "The greatest number.", alias="to")
    one_of: list[ConstantText] = key([], "Numbers, one of which is drawn.")


class SceneDef(SpecModel, short="is"):
    """What the plant is like when a run begins; what is drawn follows from the seed."""

    scene_class: PythonPath | None = key(None, "Class that sets the scene up.", alias="is")
    starts: dict[str, DrawDef] = key({}, "Where joints of the model are.", alias=OTHERS)


class MomentDef(SpecModel):
    """When something happens while a run goes on, how often and for how long."""

    at: DrawDef | None = key(None, "When it begins, or from when on `when` is asked, e.g. `4[s]`.")
    when: Annotated[str, Text(Role("formula"))] | None = key(
        None, "A formula like those of `require`; it begins once that first holds."
    )
    delay: DrawDef | None = key(None, "The time from then until it begins, e.g. `0.3[s]`.")
    every: DrawDef | None = key(None, "The time from one repetition to the next, e.g. `5[s]`.")
    probability: DrawDef | None = key(
        None, "How probable it is that it happens, drawn for each repetition: 0 to 1."
    )
    lasts: DrawDef | None = key(None, "For how long; to the end of the run if left out.")


class TimedDef(MomentDef):
    """What happens to the plant while a run goes on; no agent is told."""

    because: Annotated[str, Text(filled=True)] = key(
        about="What stands for it in the world; told in the report."
    )


_SUBJECTS = {
    "none": Annotated[list[str], ListForm(single=(str,))],
    "one": dict[str, DrawDef],
    "force": dict[str, Annotated[list[DrawDef], ListForm(min_length=3, max_length=3)]],
    "each": dict[
        str, Annotated[list[DrawDef], ListForm(single=(str, int, float, dict), min_length=1)]
    ],
}
"""Of verbs, by their numbers."""
_VERBS: dict[str, Any] = {
    verb.name: (
        _SUBJECTS[verb.numbers],
        key([] if verb.numbers == "none" else {}, verb.description),
    )
    for verb in VERBS.values()
}
_FIRST = "at every when delay probability lasts"
DisturbanceDef = create_model(
    "DisturbanceDef",
    __base__=TimedDef,
    __doc__=TimedDef.__doc__,
    __cls_kwargs__={"first": _FIRST},
    **_VERBS,
)
"""With a key for each verb."""


class PanelMomentDef(MomentDef):
    """What the operator does at the panel while a run goes on."""

    because: str = key("", "What stands for it in the world, if not what the scenario is for.")


OperationDef = create_model(
    "OperationDef",
    __base__=PanelMomentDef,
    __doc__=PanelMomentDef.__doc__,
    __cls_kwargs__={"first": _FIRST},
    **{verb.name: _VERBS[verb.name] for verb in VERBS.values() if verb.subject in OF_PANEL},
)
"""With a key for each verb about the panel."""


class TaskDef(SpecModel):
    """What `specc run` counts and judges, and what it puts the system through."""

    cycle: CycleDef = key(about="What counts as one cycle.")
    scene: SceneDef | None = None
    judge: PythonPath | None = key(None, "Class that judges a cycle.")
    watch: list[Annotated[str, Text(Role("task", "memory"))]] = key(
        [], "Memory elements that the judge may see."
    )
    disturb: Annotated[
        list[DisturbanceDef],  # type: ignore[valid-type]  # made of the verbs
        ListForm(max_length=MAX_DISTURBANCES),
    ] = key([], "What happens to the plant while a run goes on.")


class FormulaLetDef(SpecModel, short="is"):
    """A name for a part of formulas."""

    value: Annotated[str, Text(Role("formula"), filled=True)] = key(
        about="A formula, or a value in one, that the name stands for.", alias="is"
    )


class RequirementDef(SpecModel, first="name let"):
    """What every run is watched for."""

    name: ReadableName | None = key(None, "What it is called in reports, tables and plots.")
    let: dict[ReadableName, FormulaLetDef] = key({}, "Names for parts of it.", defines="let")
    that: Annotated[str, Text(Role("formula"), filled=True)] = key(
        about="A formula of temporal logic over states, memory and buffers."
    )
    because: Annotated[str, Text(filled=True)] = key(about="Why it is required.")


class ScenarioDef(
    SpecModel,
    first="because panel disturb undisturbed scene set seeds duration cycles expect success",
):
    """Runs that are put through something, and what is expected of them."""

    because: Annotated[str, Text(filled=True)] = key(about="What is tried, or what it is for.")
    panel: Annotated[
        list[OperationDef],  # type: ignore[valid-type]  # made of the verbs
        ListForm(max_length=MAX_DISTURBANCES),
    ] = key([], "What the operator does meanwhile.")
    disturb: Annotated[
        list[DisturbanceDef],  # type: ignore[valid-type]  # made of the verbs
        ListForm(max_length=MAX_DISTURBANCES),
    ] = key([], "What happens meanwhile, besides the disturbances of the task.")
    undisturbed: bool = key(False, "Whether the disturbances of the task do not happen.")
    scene: dict[str, DrawDef] = key({}, "Where joints are, in place of what the task says.")
    settings: dict[str, ConstantText] = key(
        {}, "Constants and parameters, with the values that they get.", alias="set"
    )
    seeds: Annotated[list[SeedText], ListForm(single=(str, int), min_length=1)] = key(
        ["0"], "Seeds of the runs, e.g. `0..9`; 0 if left out."
    )
    duration: ConstantText | None = key(
        None, "How long a run is, e.g. `8[s]`; that of `specc run` if left out."
    )
    cycles: int | None = key(None, "How many cycles of the task end a run.")
    expect: Annotated[
        list[Annotated[str, Text(Role("formula"), filled=True)]],
        ListForm(single=(str,), min_length=1, max_length=MAX_REQUIREMENTS),
    ] = key(about="Formulas like those of `require`, which hold in a run that passes.")
    success: SuccessText | None = None


VERSIONS = (1, 1.1, 1.2, 1.3)
"""Of the language, the newest one last."""
_OF_SYSTEMS = frozenset(("system", "agents", "plant", "task", "let", "require", "scenarios"))
_OF_ALL = frozenset(("specc", *Traced.keys))


class SpecFile(
    Traced, first="specc system title eq table fig use parameters frames types interfaces files"
):
    """A specification (`system:`), a description to reuse (`subsystem:` or `agent:`), or
    definitions that other files use.
    """

    specc: Annotated[float, LiteralKind(VERSIONS)] = key(about="Version of the language.")
    system: ReadableName | None = key(
        None, "Name of the system and of its generated code.", step="structure"
    )
    use: list[FilePath] = key([], "Files whose definitions are merged in.")
    parameters: dict[ReadableName, WrittenType] = key(
        {},
        "Parameters of a reusable description; each is a type, `frame` or `agent`.",
        defines="parameter",
    )
    frames: dict[ReadableName, str] = key(
        {}, "Coordinate frames, each with a short description.", defines="frame"
    )
    types: dict[ReadableName, TypeDef] = key({}, "Names for types.", defines="type")
    interfaces: dict[ReadableName, InterfaceDef] = key(
        {}, "Named sets of elements, each for both ends of connections.", defines="interface"
    )
    constants: dict[ReadableName, ConstantDef] = key({}, "Named values.", defines="constant")
    files: dict[ReadableName, str] = key(
        {}, "Files, relative to the file that names them.", defines="file"
    )
    operators: dict[ReadableName, OperatorDef] = key(
        {}, "Functions written in Python.", defines="operator"
    )
    agents: dict[ReadableName, AgentDef] = key(
        {}, "The embodied agents of the system.", defines="agent", step="structure"
    )
    subsystem: SubsystemDef | None = key(None, "A subsystem to reuse.", defines="subsystem")
    agent: AgentDef | None = key(None, "An agent to reuse.")
    plant: PlantDef | None = key(None, "What stands behind the devices.", step="simulation")
    task: TaskDef | None = key(None, step="simulation")
    let: dict[ReadableName, FormulaLetDef] = key(
        {}, "Names for parts of the formulas of `require` and of disturbances.", defines="let"
    )
    require: Annotated[list[RequirementDef], ListForm(max_length=MAX_REQUIREMENTS)] = key(
        [], "What every run of the system is watched for."
    )
    scenarios: dict[ReadableName, ScenarioDef] = key(
        {}, "What `specc test` puts the system through, and expects of it."
    )

    @property
    def is_part(self) -> bool:
        """Whether the file has definitions or a description for systems to use, and no system."""
        return not self.given_keys & _OF_SYSTEMS and not self.given_keys <= _OF_ALL


_DIALECT = "https://json-schema.org/draft/2020-12/schema"
_EMPTY: tuple[object, ...] = (None, "", [], {})

Schema = dict[str, Any]


def json_schema() -> Schema:
    """JSON Schema (draft 2020-12) of a specification file."""
    schema = _tidied(SpecFile.model_json_schema())
    forms = {}
    for part in reachable([SpecModel], lambda part: part.__subclasses__()):
        if part.__name__ in schema["$defs"]:
            forms[f"#/$defs/{part.__name__}"] = _short_forms(part, schema["$defs"][part.__name__])
    return {"$schema": _DIALECT, "title": "specc specification", **_expanded(schema, forms)}


def _tidied(schema: Any) -> Any:
    """A schema without what pydantic makes up: titles, empty defaults, null for a missing value."""
    if isinstance(schema, list):
        return [_tidied(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    tidied = {
        name: _tidied(value)
        for name, value in schema.items()
        if not name.startswith("x-")
        and not (name == "title" and isinstance(value, str))
        and not (name == "default" and (value in _EMPTY or isinstance(value, dict)))
    }
    if others := tidied.get("properties", {}).pop(OTHERS, None):
        tidied["additionalProperties"] = others["additionalProperties"]
    if not isinstance(tidied.get("anyOf"), list):
        return tidied
    # Editors report what is wrong inside a value only if the value has one meaning.
    members = [member for member in tidied.pop("anyOf") if member != {"type": "null"}]
    return {**members[0], **tidied} if len(members) == 1 else {**tidied, "anyOf": members}


def _short_forms(part: type[SpecModel], schema: Schema) -> list[Schema]:
    """What may stand in place of a mapping."""
    scalars = SCALARS if part.short else []
    if not part.row:
        return scalars
    items = [
        {name: value for name, value in schema["properties"][key].items() if name != "description"}
        for key in part.row
    ]
    size = len(items)
    return [*scalars, {"type": "array", "prefixItems": items, "minItems": size, "maxItems": size}]


def _expanded(schema: Any, forms: dict[str, list[Schema]]) -> Any:
    """A schema where all that is written in several forms may have each of them."""
    if isinstance(schema, list):
        return [_expanded(item, forms) for item in schema]
    if not isinstance(schema, dict):
        return schema
    found = {name: _expanded(value, forms) for name, value in schema.items()}
    if not (shorter := forms.get(found.get("$ref", ""))):
        return found
    return {"anyOf": [*shorter, {"$ref": found.pop("$ref")}], **found}
