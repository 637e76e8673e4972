"""What stops a run: one record for every fault, whatever failed.

A fault blames the one who did wrong: the operator that raised, the device that gave no value, the
subsystem that sent what a device cannot take; never the one who merely met it.
"""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable, Mapping, Sequence
from types import FrameType, TracebackType

from specc_runtime import interruption
from specc_runtime.origin import Origin, called, origin_of_line
from specc_runtime.plants.errors import PlantError
from specc_runtime.wrong import Blamed

LONGEST_TEXT = 400
"""Characters of a value in a record."""
_OWN = "specc_runtime"


class Fault(Exception):
    """Why a run cannot go on. Every kind has the same record; what does not apply is empty.

    `culprit` is who is to blame; `subsystem`, `state`, `modes` (those around the state, the
    innermost first), `stamp` (-1 outside of steps) and `time_s` are of the step that failed,
    `origin` is what was being computed, `inputs` what that was given and `place` where an exception
    was raised; `device` is the element of a device in question.
    """

    def __init__(self, subsystem: str, state: str, message: str, culprit: str = "") -> None:
        super().__init__(message)
        self.subsystem = subsystem
        self.state = state
        self.modes: tuple[str, ...] = ()
        self.message = message
        self.culprit = culprit or (f"subsystem {subsystem}" if subsystem else "")
        self.stamp = -1
        self.time_s = 0.0
        self.row = ""
        self.device = ""
        self.origin = Origin()
        self.inputs: Mapping[str, object] = {}
        self.place = ""

    def __str__(self) -> str:
        if not self.subsystem:
            names_it = self.message.startswith(self.culprit)
            return self.message if names_it else f"{self.culprit}: {self.message}"
        state = " in ".join((self.state, *self.modes)) or "its first period"
        where = f"{self.subsystem} in {state}"
        at = f" at {self.time_s:.4f} s (stamp {self.stamp})" if self.stamp >= 0 else ""
        return f"{where}{at}: {self.message}"

    def as_data(self) -> dict[str, object]:
        """Plain values for a report."""
        return {
            "fault": type(self).__name__,
            "culprit": self.culprit,
            "subsystem": self.subsystem,
            "state": self.state,
            **({"modes": list(self.modes)} if self.modes else {}),
            "stamp": self.stamp,
            "time_s": self.time_s,
            "message": self.message,
            "row": self.row,
            "condition": self.origin.condition,
            "equations": list(self.origin.equations),
            "inputs": {name: text_of(value) for name, value in self.inputs.items()},
            "place": self.place,
            "line": self.origin.line,
        }


class UndecidedTransition(Fault):
    """None or several rows of the transition table hold where exactly one must (2.4).

    `rows` are the texts of the rows that hold, `equations` the numbers of those in question,
    `inputs` the input buffers as they were read.
    """

    def __init__(
        self,
        subsystem: str,
        state: str,
        cause: str,
        rows: Sequence[str],
        inputs: Mapping[str, object],
        equations: Sequence[int] = (),
    ) -> None:
        enabled = "; ".join(rows) if rows else "none"
        applying = (
            f"{len(rows)} of its rows apply: {enabled}" if rows else "none of its rows applies"
        )
        is_named = cause not in ("terminal", "error")
        condition = f"error condition {cause}" if is_named else f"{cause} condition"
        super().__init__(subsystem, state, f"{condition} holds; {applying}")
        self.cause = cause
        self.rows = tuple(rows)
        self.row = enabled
        self.origin = Origin(equations=tuple(equations))
        self.inputs = dict(inputs)

    def as_data(self) -> dict[str, object]:
        """Adds the cause and the rows that held."""
        return super().as_data() | {"cause": self.cause, "rows": list(self.rows)}


class AxiomViolated(Fault):
    """An assumption that the proofs rely on does not hold.

    Rows that were proved under it are no longer checked, so the run cannot go on.
    """

    def __init__(self, subsystem: str, state: str, axioms: Sequence[str]) -> None:
        super().__init__(subsystem, state, f"assumption does not hold: {'; '.join(axioms)}")
        self.axioms = tuple(axioms)

    def as_data(self) -> dict[str, object]:
        """Adds the axioms."""
        return super().as_data() | {"axioms": list(self.axioms)}


class StepFailed(Fault):
    """An operator raised an exception, or an expression has no value; it is `__cause__`.

    `module` is the name of the generated one, whose line tells what was being computed.
    """

    def __init__(self, subsystem: str, state: str, error: BaseException, module: str = "") -> None:
        super().__init__(subsystem, state, error_text(error))
        self.__cause__ = error
        self.place = place_of(error.__traceback__)
        self.origin, operator = computed_at(_frames(error.__traceback__), module)
        if isinstance(error, Blamed):
            self.culprit = error.origin
            self.origin = self.origin.and_of(getattr(error, "trace", ""))
        elif operator:
            self.culprit = f"operator {operator}"


class StepAbandoned(StepFailed):
    """A step was still computing when an interrupted run could wait no longer."""


class TooOld(Fault):
    """What was read, or was to take effect, is older than its `max_age`."""


class UnrecordableValue(Fault):
    """A value of `element` has no stable encoding; `__cause__` says which type it is of."""

    def __init__(self, subsystem: str, state: str, element: str, error: TypeError) -> None:
        super().__init__(subsystem, state, f"{element}: {error}")
        self.__cause__ = error
        self.element = element


class PartFailed(Fault):
    """Something outside of the subsystems failed. `part` is its name; the error is `__cause__`."""

    kind = "part"

    def __init__(
        self, part: str, error: BaseException, inputs: Mapping[str, object] | None = None
    ) -> None:
        known = isinstance(error, PlantError | Blamed)
        message = str(error) if known else error_text(error)
        super().__init__("", "", message, " ".join((self.kind, part)).strip())
        self.__cause__ = error
        self.part = part
        self.place = place_of(error.__traceback__)
        self.inputs = dict(inputs or {})


class DeviceFailed(PartFailed):
    """An element of a device gave no sample or took no command; blames `through`, if given."""

    kind = "device"

    def __init__(
        self,
        part: str,
        error: BaseException,
        inputs: Mapping[str, object] | None = None,
        through: Callable[..., object] | None = None,
    ) -> None:
        super().__init__(part, error, inputs)
        self.device = part
        self.culprit = device_at_fault(part, through)


def device_at_fault(part: str, through: Callable[..., object] | None) -> str:
    """Who is to blame for an element of a device: the function of `through`, if it has one."""
    if through is None:
        return f"device {part}"
    home, name = getattr(through, "__module__", ""), getattr(through, "__qualname__", "")
    return f"device {part}, through {home}:{name}"


class PlantFailed(PartFailed):
    """The plant could not go on; `part` is the joint or actuator at fault, if it is known."""

    kind = "plant"

    def __init__(self, error: BaseException) -> None:
        super().__init__(getattr(error, "part", ""), error)
        self.device = getattr(error, "device", "")


class SceneFailed(PartFailed):
    """The scene of the task could not be set up."""

    kind = "scene"


class JudgeFailed(PartFailed):
    """The judge of the task raised an exception."""

    kind = "judge"


def error_text(error: BaseException) -> str:
    """Class and message of an exception, whatever its `__str__` does."""
    if isinstance(error, Blamed):
        return str(error)
    name = type(error).__name__
    try:
        message = str(error)
        return f"{name}: {message}" if message else name
    except BaseException as raised:  # noqa: BLE001  # a message must not hide the fault it tells of
        return f"{name}, whose message raises {type(raised).__name__}"


def text_of(value: object) -> str:
    """A value as text of bounded length, whatever its `__repr__` does."""
    try:
        text = repr(value)
    except BaseException as raised:  # noqa: BLE001  # as above
        return f"<{type(value).__name__}, whose repr raises {type(raised).__name__}>"
    return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 3]}..."


_PACKAGE = os.path.dirname(__file__) + os.sep
_OF_DEVICES = (os.path.join(_PACKAGE, "hosting", ""), os.path.join(_PACKAGE, "ros2", ""))
"""Folders of what stands between devices and the functions of users: no place to look at."""


def place_of(trace: TracebackType | None) -> str:
    """`function (module.py:line)` where an exception was raised; empty if only devices know."""
    found = traceback.extract_tb(trace)
    # The handler that abandons something is not where that was.
    frames = [frame for frame in found if frame.filename != interruption.__file__]
    own = [frame.filename.startswith(_PACKAGE) for frame in frames]
    while frames and frames[-1].filename.startswith(_OF_DEVICES):
        frames.pop()
    if not frames or (len(frames) < len(own) and own[len(frames) - 1]):
        return ""
    last = frames[-1]
    file = last.filename.rsplit("/", 1)[-1]
    return f"{last.name} ({file}:{last.lineno})"


Frames = Sequence[tuple[FrameType, int]]
"""Frames with the line that each is at, from the outermost to the innermost."""


def computed_at(frames: Frames, module: str) -> tuple[Origin, str]:
    """What the innermost line of a module was computing, and the operator that it had called."""
    inside = [i for i, (frame, _) in enumerate(frames) if frame.f_globals.get("__name__") == module]
    if not inside:
        return Origin(), ""
    frame, line = frames[inside[-1]]
    origin = origin_of_line(frame.f_code.co_filename, line, frame.f_globals)
    for callee, _ in frames[inside[-1] + 1 :]:
        home = str(callee.f_globals.get("__name__", ""))
        if home.startswith(_OWN) and not home.startswith(f"{_OWN}.operators"):
            continue  # the language's own functions, and checks around an operator
        name = called(callee.f_code, frame.f_globals)
        python = f"{home}:{callee.f_code.co_qualname}"
        if not name:
            return origin, python
        trace = getattr(frame.f_globals[name], "trace", "")
        return origin.and_of(trace), f"{name} ({python})"
    return origin, ""


def _frames(trace: TracebackType | None) -> Frames:
    return list(traceback.walk_tb(trace))
