"""What stops a run: one base class, every fault with its data."""

from __future__ import annotations

import linecache
import traceback
from collections.abc import Mapping, Sequence
from types import TracebackType


class Fault(Exception):
    """A subsystem cannot go on. `stamp` and `time_s` are of the step that failed."""

    def __init__(self, subsystem: str, state: str, message: str) -> None:
        super().__init__(message)
        self.subsystem = subsystem
        self.state = state
        self.message = message
        self.stamp = -1
        self.time_s = 0.0

    def __str__(self) -> str:
        where = f"{self.subsystem} in {self.state or 'its first period'}"
        at = f" at {self.time_s:.4f} s (stamp {self.stamp})" if self.stamp >= 0 else ""
        return f"{where}{at}: {self.message}"

    def as_data(self) -> dict[str, object]:
        """Plain values for a report."""
        return {
            "fault": type(self).__name__,
            "subsystem": self.subsystem,
            "state": self.state,
            "stamp": self.stamp,
            "time_s": self.time_s,
            "message": self.message,
        }


class UndecidedTransition(Fault):
    """None or several rows of the transition table hold where exactly one must (2.4).

    `rows` are the texts of the rows that hold, `inputs` the input buffers as they were read.
    """

    def __init__(
        self,
        subsystem: str,
        state: str,
        cause: str,
        rows: Sequence[str],
        inputs: Mapping[str, object],
    ) -> None:
        held = "; ".join(rows) if rows else "none"
        super().__init__(
            subsystem, state, f"{cause} condition holds, and of its rows {len(rows)}: {held}"
        )
        self.cause = cause
        self.rows = tuple(rows)
        self.inputs = dict(inputs)

    def as_data(self) -> dict[str, object]:
        """Adds the cause, the rows that held and the inputs as text."""
        data = super().as_data()
        inputs = {name: repr(value) for name, value in self.inputs.items()}
        return data | {"cause": self.cause, "rows": list(self.rows), "inputs": inputs}


class AxiomViolated(Fault):
    """What the designer told the proofs to take for granted is not so.

    Rows that were proved under it are no longer checked, so the run cannot go on.
    """

    def __init__(self, subsystem: str, state: str, axioms: Sequence[str]) -> None:
        super().__init__(subsystem, state, f"assumption does not hold: {'; '.join(axioms)}")
        self.axioms = tuple(axioms)

    def as_data(self) -> dict[str, object]:
        """Adds the axioms."""
        return super().as_data() | {"axioms": list(self.axioms)}


class StepFailed(Fault):
    """An operator raised an exception, or gave what cannot be used; it is `__cause__`.

    `line` is the text of the line of `module`, the generated one, that was being executed.
    """

    def __init__(self, subsystem: str, state: str, error: BaseException, module: str = "") -> None:
        super().__init__(subsystem, state, f"{type(error).__name__}: {error}")
        self.__cause__ = error
        self.place = _place(error.__traceback__)
        self.line = _line(error.__traceback__, module)

    def as_data(self) -> dict[str, object]:
        """Adds where the exception was raised, and the generated line."""
        return super().as_data() | {"place": self.place, "line": self.line}


class UnrecordableValue(Fault):
    """A value of `element` has no stable encoding; `__cause__` says which type it is of."""

    def __init__(self, subsystem: str, state: str, element: str, error: TypeError) -> None:
        super().__init__(subsystem, state, f"{element}: {error}")
        self.__cause__ = error
        self.element = element


def _place(trace: TracebackType | None) -> str:
    """`function (module.py:line)` where the exception was raised."""
    frames = traceback.extract_tb(trace)
    if not frames:
        return ""
    last = frames[-1]
    file = last.filename.rsplit("/", 1)[-1]
    return f"{last.name} ({file}:{last.lineno})"


def _line(trace: TracebackType | None, module: str) -> str:
    """The text of the innermost line of a module that led to the exception."""
    found = ""
    for frame, number in traceback.walk_tb(trace):
        if frame.f_globals.get("__name__") == module:
            found = linecache.getline(frame.f_code.co_filename, number, frame.f_globals).strip()
    return found
