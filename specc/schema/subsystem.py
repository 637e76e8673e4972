"""Shape of a subsystem: buffers, memory, conditions, functions, behaviours, tables (2.3, 2.4)."""

import re
from typing import Annotated, Any, Literal

from specc.limits import MAX_ASSUMPTIONS
from specc.schema.keys import (
    OF_EACH,
    OTHERS,
    ArgumentText,
    BudgetText,
    ConstantText,
    Denoted,
    DurationText,
    ExprText,
    FilePath,
    InitialText,
    InterfaceText,
    ListForm,
    Name,
    ParametersText,
    RangeText,
    RateText,
    ReadableName,
    Role,
    SpecModel,
    StateName,
    Text,
    Traced,
    WrittenType,
    key,
)


class ElementDef(Denoted, short="type"):
    """An element of a communication buffer."""

    type: WrittenType
    init: ConstantText | None = key(None, "Value before the first one arrives.")


class ReceivedDef(ElementDef):
    """An element that somebody receives."""

    max_age: DurationText | None = None


class InputDef(ReceivedDef):
    """An element of an input buffer."""

    event: bool = key(False, "Whether none of its values may be missed.")


class RefinedInputDef(InputDef):
    """An element of an input buffer, or what is different about one that `is` gives."""

    type: WrittenType | None = key(  # type: ignore[assignment]  # is never written to
        None, "Its type; left out for an element that `is` gives."
    )


class BufferDef(SpecModel, short="is", first="for is"):
    """The elements of a buffer: those of an interface, and further ones."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    interface: InterfaceText | None = key(
        None,
        "Interface that names the elements, e.g. `Report[W]`, or `same`: those of the other end.",
        alias="is",
    )
    elements: dict[ReadableName, ElementDef] = key({}, alias=OTHERS, defines="element")

    @property
    def own(self) -> dict[str, ElementDef]:
        """The elements that have a type here; the others are those of `is`, with more said."""
        return {n: item for n, item in self.elements.items() if "type" in item.model_fields_set}


class InputBufferDef(BufferDef, first="for is"):
    """The elements of an input buffer: those of an interface, and further ones."""

    elements: dict[ReadableName, RefinedInputDef] = key(  # type: ignore[assignment]  # is never written to
        {}, alias=OTHERS, defines="element"
    )


class InterfaceDef(Traced, first="frames types"):
    """A named set of elements, which one end of a connection has as input, the other as output."""

    frames: list[ReadableName] = key([], "Frame parameters.")
    types: list[ReadableName] = key([], "Type parameters.")
    elements: dict[ReadableName, InputDef] = key({}, alias=OTHERS, defines="element")


class SafeDef(SpecModel, short="is"):
    """What an element of a device gets when a run ends."""

    value: ConstantText = key(
        about="An expression of constants, operators and what the device reported last.",
        alias="is",
    )
    otherwise: ConstantText | None = key(None, "A constant that is sent if the expression fails.")


class CommandDef(ReceivedDef):
    """An element that a device accepts."""

    safe: SafeDef | None = None


class CommandBufferDef(BufferDef, first="for is"):
    """What a device accepts: the elements of an interface, and further ones."""

    elements: dict[ReadableName, CommandDef] = key(  # type: ignore[assignment]  # is never written to
        {}, alias=OTHERS, defines="element"
    )


class MemoryDef(Denoted, first="for type"):
    """A value that a subsystem keeps from period to period."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    type: WrittenType
    init: InitialText | None = key(None, "Value in the first period.")


class LetDef(Denoted, short="is", first="for type is"):
    """A named subexpression, computed at most once a period."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    type: WrittenType | None = key(None, "What the expression must be a value of.")
    value: ExprText = key(about="The expression that the name stands for.", alias="is")


class ConditionDef(Traced, short="when", first="eq table fig title"):
    """A named condition."""

    when: ExprText | None = key(None, "A Boolean expression, e.g. `fresh(x.c.T_d)`.")


class TerminalDef(ConditionDef, short="condition", first="eq table fig title"):
    """What ends a behaviour: the name of a condition, or one that stands in place."""

    condition: Annotated[str, Text(Role("name", "terminal condition"))] | None = key(
        None, "A terminal condition that is declared, `always` or `never`."
    )


class ErrorDef(ConditionDef, short="condition", first="eq table fig title"):
    """What aborts a behaviour: the name of a condition, one that stands in place, or several
    with names.
    """

    condition: Annotated[str, Text(Role("name", "error condition"))] | None = key(
        None, "An error condition that is declared, or `never`."
    )
    named: dict[Name, ConditionDef] = key({}, alias=OTHERS, defines="error condition")


class AssignmentDef(Traced, short="is", first="for is"):
    """The value of one target of a transition function."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    value: ExprText = key(about="What the target gets in the next period.", alias="is")


class FunctionDef(Traced):
    """A transition function: targets (`y.peer.element` or a memory element) and their values."""

    targets: dict[str, AssignmentDef] = key({}, alias=OTHERS)


class DeclaredFunctionDef(FunctionDef, first="signature"):
    """A transition function with a name, and with parameters if it has a signature."""

    signature: ParametersText | None = None

    @classmethod
    def is_key(cls, name: Any, value: Any = None) -> bool:
        """As of any mapping; `signature` may be memory, whose value is no list of parameters."""
        is_other = name == "signature" and value is not None
        is_target = is_other and not _PARAMETERS.search(str(value))
        return super().is_key(name) and not is_target


_PARAMETERS = re.compile(r"^\s*\(\s*\)|->|^[^\[{]*\w\s*:")


class UsedFunctionDef(FunctionDef, short="function"):
    """A function of a behaviour: the name of one that is declared, or one that stands in place."""

    function: Annotated[str, Text(Role("name", "function"))] | None = key(
        None, "Name of a function that is declared, with arguments if it has parameters."
    )


class ThroughDef(FunctionDef, short="rule"):
    """What a subsystem with one state does in every period: targets and their values, or
    `identity`, where every output gets the input of its name on the other side.
    """

    rule: Literal["identity"] | None = key(None, "What targets get that are not named.")


class ConditionsDef(SpecModel):
    """The conditions of a subsystem by their use."""

    initial: dict[Name, ConditionDef] = key(
        {},
        "Conditions of rows of the transition table.",
        defines="initial condition",
        step="fsm",
    )
    terminal: dict[Name, ConditionDef] = key(
        {}, "Conditions that end a behaviour.", defines="terminal condition", step="ends"
    )
    error: dict[Name, ConditionDef] = key(
        {}, "Conditions that abort a behaviour.", defines="error condition", step="ends"
    )


class BehaviourDef(Traced, first="eq table fig title"):
    """Transition functions, repeated every period until a condition holds."""

    functions: list[UsedFunctionDef] = key(
        [], "Transition functions that are executed in every period, by name or in place."
    )
    terminal: TerminalDef | None = key(
        None, "A terminal condition, by name or in place, `always` or `never`.", step="ends"
    )
    error: ErrorDef | None = key(
        None, "Error conditions, by name or in place; `never` if left out.", step="ends"
    )


class DeclaredBehaviourDef(BehaviourDef, first="signature eq table fig title"):
    """A behaviour with a name, and with parameters if it has a signature."""

    signature: ParametersText | None = None


class StateDef(BehaviourDef, short="behaviour", first="behaviour title"):
    """A state of the subsystem's machine, with the name of its behaviour or with a behaviour."""

    behaviour: Annotated[str, Text(Role("name", "behaviour"))] | None = key(
        None, "The behaviour that runs in this state, with arguments if it has parameters."
    )
    ignores: list[Annotated[str, Text()]] = key(
        [], "Events that may come in this state without being looked at, `x.peer.element`."
    )
    holds: list[Annotated[str, Text()]] = key(
        [], "Outputs that keep their last value in this state on purpose, `y.peer.element`."
    )


StateNames = Annotated[list[StateName], ListForm(single=(str,), min_length=1)]


class ModeDef(Traced, first="title states initial error"):
    """A group of states that share rows, error conditions and a timer."""

    states: StateNames = key(about="The states and modes in it.")
    initial: StateName | None = key(
        None, "The state or mode inside that is entered where a row names the mode."
    )
    error: ErrorDef | None = key(
        None, "Error conditions with names, evaluated in each of its states.", step="ends"
    )


class TransitionDef(Traced, row="from cause when to"):
    """A row of the transition table."""

    sources: StateNames = key(
        about="State whose behaviour ended, a mode, or a list of them that each have the row.",
        alias="from",
    )
    cause: Annotated[str, Text(Role("name", "error condition"), examples=("terminal", "error"))] = (
        key(about="Which condition ended it: `terminal`, `error`, or the name of one.")
    )
    when: Annotated[str, Text(Role("name", "initial condition"))] = key(
        about="An initial condition, `always` or `otherwise`."
    )
    target: StateName = key(about="State or mode that is entered, or `resume(mode)`.", alias="to")


ROW_KEYS = TransitionDef.row
"""What the items of a row of the transition table stand for."""


class AxiomDef(SpecModel):
    """What the proofs may take for granted."""

    that: ExprText = key(about="A Boolean expression that always holds.")
    because: Annotated[str, Text(filled=True)] = key(
        about="Why it holds; the reader must be convinced."
    )


class SubsystemDef(Traced, first="for use title rate budget with uses eq table fig"):
    """A control subsystem, virtual effector or virtual receptor, or the use of one."""

    each: dict[Name, RangeText] = key({}, OF_EACH, alias="for")
    use: FilePath | None = key(None, "File that describes the subsystem.")
    arguments: dict[str, ArgumentText] = key({}, "Values of parameters.", alias="with")
    rate: RateText | None = key(None, step="role")
    budget: BudgetText | None = None
    uses: list[Annotated[str, Text(Role("name", "device"))]] | None = key(
        None, "Real effectors or receptors it works with.", step="buffers"
    )
    x: dict[str, InputBufferDef] = key(
        {}, "Input buffers, by the peer at the other end.", step="buffers"
    )
    y: dict[str, BufferDef] = key(
        {}, "Output buffers, by the peer at the other end.", step="buffers"
    )
    memory: dict[ReadableName, MemoryDef] = key(
        {}, "Values kept from period to period.", defines="memory", step="buffers"
    )
    let: dict[ReadableName, LetDef] = key(
        {}, "Named subexpressions, each computed at most once a period.", defines="let"
    )
    through: ThroughDef | None = key(
        None, "All that it does in every period, if it has one state only.", step="ends"
    )
    conditions: ConditionsDef = key(ConditionsDef, "Initial, terminal and error conditions.")
    functions: dict[Name, DeclaredFunctionDef] = key(
        {}, "Transition functions.", defines="function"
    )
    behaviours: dict[Name, DeclaredBehaviourDef] = key(
        {}, "What can run in a state.", defines="behaviour"
    )
    states: dict[Name, StateDef] = key(
        {}, "States, each with its behaviour.", defines="state", step="fsm"
    )
    modes: dict[ReadableName, ModeDef] = key(
        {}, "Groups of states that share rows, errors and a timer.", defines="mode", step="fsm"
    )
    initial_state: StateName | None = key(None, "State of the first period.", step="fsm")
    transitions: list[TransitionDef] = key(
        [], "Transition table; a row is `[from, cause, when, to]`.", step="fsm"
    )
    assume: Annotated[list[AxiomDef], ListForm(max_length=MAX_ASSUMPTIONS)] = key(
        [], "Assumptions that the proofs may use.", step="fsm"
    )
