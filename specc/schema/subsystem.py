"""Shape of a subsystem: buffers, memory, conditions, functions, behaviours, tables (2.3, 2.4)."""

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from specc.limits import MAX_ASSUMPTIONS
from specc.schema.base import (
    DurationText,
    ExprText,
    Name,
    RateText,
    ReadableName,
    Strict,
    Traced,
    TypeText,
    row_form,
    short_form,
)

ROW_KEYS = ("from", "cause", "when", "to")
"""What the items of a row of the transition table stand for."""


Cause = Literal["terminal", "error"]


class ElementDef(Traced):
    """An element of a communication buffer."""

    type: TypeText
    init: ExprText | None = Field(None, description="Value before the first one arrives.")


class InputDef(ElementDef):
    """An element of an input buffer."""

    max_age: DurationText | None = None


class SafeDef(Strict):
    """What an element of a device gets when a run ends."""

    value: ExprText = Field(
        alias="is",
        description="An expression of constants, operators and what the device reported last.",
    )
    otherwise: ExprText | None = Field(
        None, description="A constant that is sent if the expression fails."
    )


class CommandDef(InputDef):
    """An element that a device accepts."""

    safe: Annotated[SafeDef, short_form("is", SafeDef)] | None = None


Element = Annotated[ElementDef, short_form("type", ElementDef)]
Input = Annotated[InputDef, short_form("type", InputDef)]
Command = Annotated[CommandDef, short_form("type", CommandDef)]
InputBufferDef = dict[str, dict[ReadableName, Input]]
OutputBufferDef = dict[str, dict[ReadableName, Element]]


class MemoryDef(Traced):
    """A value that a subsystem keeps from period to period."""

    type: TypeText
    init: ExprText | None = Field(None, description="Value in the first period.")


class LetDef(Traced):
    """A named subexpression, computed at most once a period."""

    value: ExprText = Field(alias="is", description="The expression that the name stands for.")


class ConditionDef(Traced):
    """A named condition."""

    when: ExprText | None = Field(None, description="A Boolean expression, e.g. `fresh(x.c.T_d)`.")


class AssignmentDef(Traced):
    """The value of one target of a transition function."""

    value: ExprText = Field(alias="is", description="What the target gets in the next period.")


class FunctionDef(Traced):
    """A transition function: targets (`y.peer.element` or a memory element) and their values."""

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, Annotated[AssignmentDef, short_form("is", AssignmentDef)]]


_Conditions = dict[Name, Annotated[ConditionDef, short_form("when", ConditionDef)]]


class ConditionsDef(Strict):
    """The conditions of a subsystem by their use."""

    initial: _Conditions = Field(
        default={}, description="Conditions of rows of the transition table."
    )
    terminal: _Conditions = Field(default={}, description="Conditions that end a behaviour.")
    error: _Conditions = Field(default={}, description="Conditions that abort a behaviour.")


class BehaviourDef(Traced):
    """Transition functions, repeated every period until a condition holds."""

    functions: list[str] = Field(
        [], description="Transition functions that are executed in every period."
    )
    terminal: str | None = Field(None, description="A terminal condition, `always` or `never`.")
    error: str = Field("never", description="An error condition, or `never`.")


class StateDef(Traced):
    """A state of the subsystem's machine."""

    behaviour: str | None = Field(None, description="The behaviour that runs in this state.")


class TransitionDef(Traced):
    """A row of the transition table."""

    source: str = Field(alias="from", description="State whose behaviour ended.")
    cause: Cause = Field(description="Which condition ended it: `terminal` or `error`.")
    when: str = Field(description="An initial condition, or `always`.")
    target: str = Field(alias="to", description="State that is entered.")


class AxiomDef(Strict):
    """What the proofs may take for granted."""

    that: ExprText = Field(description="A Boolean expression that always holds.")
    because: str = Field(min_length=1, description="Why it holds; the reader must be convinced.")


Row = tuple[str, Cause, str, str] | TransitionDef
"""The two ways to write a row of the transition table."""


class SubsystemDef(Traced):
    """A control subsystem, virtual effector or virtual receptor, or the use of one."""

    use: str | None = Field(None, description="File that describes the subsystem.")
    arguments: dict[str, ExprText] = Field({}, alias="with", description="Values of parameters.")
    rate: RateText | None = None
    uses: list[str] | None = Field(None, description="Real effectors or receptors it works with.")
    x: InputBufferDef = Field({}, description="Input buffers, by the peer at the other end.")
    y: OutputBufferDef = Field({}, description="Output buffers, by the peer at the other end.")
    memory: dict[ReadableName, MemoryDef] = Field(
        {}, description="Values kept from period to period."
    )
    let: dict[ReadableName, Annotated[LetDef, short_form("is", LetDef)]] = Field(
        {}, description="Named subexpressions, each computed at most once a period."
    )
    conditions: ConditionsDef = Field(
        ConditionsDef(), description="Initial, terminal and error conditions."
    )
    functions: dict[Name, FunctionDef] = Field({}, description="Transition functions.")
    behaviours: dict[Name, BehaviourDef] = Field({}, description="What can run in a state.")
    states: dict[Name, Annotated[StateDef, short_form("behaviour", StateDef)]] = Field(
        {}, description="States, each with its behaviour."
    )
    initial_state: str | None = Field(None, description="State of the first period.")
    transitions: list[Annotated[TransitionDef, row_form(ROW_KEYS, Row)]] = Field(
        [], description="Transition table; a row is `[from, cause, when, to]`."
    )
    assume: list[AxiomDef] = Field(
        [], max_length=MAX_ASSUMPTIONS, description="Assumptions that the proofs may use."
    )
