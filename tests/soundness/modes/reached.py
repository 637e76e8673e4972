"""Which rules of modes a run of the interpreter has come by."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from tests.soundness.modes.hierarchical import ERROR, TERMINAL, Failure, Step, Written

RULES = (
    "resume", "first resume", "resume of a mode with modes", "resume into an inner mode",
    "resume of an inner mode from outside", "entry by name", "entry by name from inside",
    "entry by name through an inner mode", "entry of a state inside", "row inside a mode",
    "row that leaves several modes", "row of a mode", "otherwise beside a row of a mode",
    "error of a mode", "named cause", "unnamed cause beside a named one", "error of a behaviour",
)  # fmt: skip


def rules_of(written: Written, steps: Sequence[Step | Failure]) -> Iterator[str]:
    """The rules, each as often as it decided something."""
    left: set[str] = set()
    for before, step in pairwise(steps):
        if isinstance(step, Failure) or isinstance(before, Failure) or not step.row:
            continue
        yield from _of_row(written, before, step, left)
        left |= {name for name, _ in step.left}


def _of_row(written: Written, before: Step, step: Step, left: set[str]) -> Iterator[str]:
    row = next(row for row in written.rows if row.text == step.row)
    inside, after = set(before.active), set(step.active)
    if row.resumes:
        yield "resume" if row.target in left else "first resume"
        if any(member in written.modes for member in written.modes[row.target].members):
            yield "resume of a mode with modes"
        if row.target in left and step.active[-1] != row.target:
            yield "resume into an inner mode"
        if row.target in left and set(written.modes_of(row.target)) - inside:
            yield "resume of an inner mode from outside"
    elif row.target in written.modes:
        yield "entry by name"
        if row.target in inside:
            yield "entry by name from inside"
        if step.active[-1] != row.target:
            yield "entry by name through an inner mode"
    elif after - inside:
        yield "entry of a state inside"
    if inside & after and row.target not in written.modes:
        yield "row inside a mode"
    if len(inside - after) > 1:
        yield "row that leaves several modes"
    if set(row.sources) & inside:
        yield "row of a mode"
    yield from _of_cause(written, before, step)


def _of_cause(written: Written, before: Step, step: Step) -> Iterator[str]:
    here = {before.state, *before.active}
    rows = [row for row in written.rows if here.intersection(row.sources)]
    row = next(row for row in rows if row.text == step.row)
    beside = [each for each in rows if each.cause == row.cause and each is not row]
    if row.when == "otherwise" and any(set(each.sources) & set(before.active) for each in beside):
        yield "otherwise beside a row of a mode"
    if step.cause == TERMINAL:
        return
    of_modes = {name for mode in before.active for name, _ in written.modes[mode].errors}
    yield "error of a mode" if step.cause in of_modes else "error of a behaviour"
    if row.cause != ERROR:
        yield "named cause"
    elif any(each.cause not in (TERMINAL, ERROR) for each in rows):
        yield "unnamed cause beside a named one"
