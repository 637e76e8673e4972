"""Faults as data, so that they can be told by one process to another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from specc_runtime.faults import Fault, error_text


@dataclass(frozen=True, slots=True)
class FaultData:
    """A fault without what belongs to its process: frames, exceptions, inputs."""

    kind: type[Fault]
    own: Mapping[str, Any]
    cause: FaultData | str


def fault_data(fault: Fault) -> FaultData:
    """What another process can know of a fault."""
    kind = next(k for k in type(fault).__mro__ if k.__module__.startswith("specc_runtime."))
    own = {name: value for name, value in vars(fault).items() if name != "inputs"}
    cause = fault.__cause__
    return FaultData(
        kind,
        own,
        fault_data(cause) if isinstance(cause, Fault) else error_text(cause) if cause else "",
    )


def fault_of(data: FaultData, inputs: Mapping[str, object]) -> Fault:
    """The fault, with the inputs of the step that it ended."""
    fault = data.kind.__new__(data.kind, data.own["message"])
    vars(fault).update(data.own, inputs=inputs)
    if isinstance(data.cause, FaultData):
        fault.__cause__ = fault_of(data.cause, inputs)
    elif data.cause:
        fault.__cause__ = RuntimeError(data.cause)
    return fault
