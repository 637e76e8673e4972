"""Shape of a subsystem: buffers, memory, conditions, functions, behaviours, tables (2.3, 2.4)."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from specc.schema.base import ExprText, Strict, Traced, TypeText, row_form, short_form

ROW_KEYS = ("from", "cause", "when", "to")
"""What the items of a row of the transition table stand for."""


class ElementDef(Traced):
    """An element of a communication buffer."""

    type: TypeText
    init: ExprText | None = Field(None, description="Value before the first one arrives.")


Element = Annotated[ElementDef, short_form("type")]
BufferDef = dict[str, dict[str, Element]]


class MemoryDef(Traced):
    type: TypeText
    init: ExprText = Field(description="Value in the first period.")


class LetDef(Traced):
    """A named subexpression, computed at most once a period."""

    value: ExprText = Field(alias="is")


class ConditionDef(Traced):
    when: ExprText


class AssignmentDef(Traced):
    value: ExprText = Field(alias="is")


class FunctionDef(Traced):
    """A transition function: targets (`y.peer.element` or a memory element) and their values."""

    model_config = ConfigDict(extra="allow", frozen=True)
    __pydantic_extra__: dict[str, Annotated[AssignmentDef, short_form("is")]]


class ConditionsDef(Strict):
    initial: dict[str, Annotated[ConditionDef, short_form("when")]] = {}
    terminal: dict[str, Annotated[ConditionDef, short_form("when")]] = {}
    error: dict[str, Annotated[ConditionDef, short_form("when")]] = {}


class BehaviourDef(Traced):
    functions: list[str] = []
    terminal: str = Field(description="A terminal condition, `always` or `never`.")
    error: str = Field("never", description="An error condition, or `never`.")


class StateDef(Traced):
    behaviour: str


class TransitionDef(Traced):
    source: str = Field(alias="from")
    cause: Literal["terminal", "error"]
    when: str = Field(description="An initial condition, or `always`.")
    target: str = Field(alias="to")


class AxiomDef(Strict):
    that: ExprText
    because: str = Field(min_length=1)


class SubsystemDef(Traced):
    """A control subsystem, virtual effector or virtual receptor, or the use of one."""

    use: str | None = Field(None, description="File that describes the subsystem.")
    arguments: dict[str, ExprText] = Field({}, alias="with", description="Values of parameters.")
    rate: str | None = Field(None, description="Periods per second, e.g. `500 Hz`.")
    uses: list[str] | None = Field(None, description="Real effectors or receptors it works with.")
    x: BufferDef = Field({}, description="Input buffers, by the peer at the other end.")
    y: BufferDef = Field({}, description="Output buffers, by the peer at the other end.")
    memory: dict[str, MemoryDef] = {}
    let: dict[str, Annotated[LetDef, short_form("is")]] = {}
    conditions: ConditionsDef = ConditionsDef()
    functions: dict[str, FunctionDef] = {}
    behaviours: dict[str, BehaviourDef] = {}
    states: dict[str, Annotated[StateDef, short_form("behaviour")]] = {}
    initial_state: str | None = None
    transitions: list[Annotated[TransitionDef, row_form(ROW_KEYS)]] = []
    assume: list[AxiomDef] = []
