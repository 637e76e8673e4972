"""The messages of a recording about steps of subsystems and the ground truth of the plant."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from operator import itemgetter
from typing import Any

from specc_runtime.buffers import AGE, FRESH, LATE
from specc_runtime.forms import Element, Layout, Schema, object_schema
from specc_runtime.recording.cells import BufferCells, Cells, Shelf, Times, getter
from specc_runtime.recording.log import Sinks
from specc_runtime.recording.text import dumped, dumped_each
from specc_runtime.records import StepRecord
from specc_runtime.sampling import PLANT
from specc_runtime.subsystem import Subsystem, Transition

STEP_SCHEMA, TRUTH_SCHEMA = "specc.Step.", "specc.Truth"
Late = tuple[int, float] | tuple[()]
_LATE = b'"skipped":%d,"visible":%b,'
_MOST_PASSAGES = 4096
_ROUNDING_S = 1e-6  # times are multiples of a rounded tick
_BOOLEANS = {"type": "object", "additionalProperties": {"type": "boolean"}}
_NUMBERS = {"type": "object", "additionalProperties": {"type": "number"}}


def topic_of(subsystem: str) -> str:
    """The topic of a subsystem; topics of its images are below: `/irp.k/x/R/I_rgb`."""
    return f"/{subsystem}"


class _Passages(dict[tuple[Any, ...], bytes]):
    """The texts of states, row and fresh inputs; mostly there are few different ones."""

    def __init__(self, table: Sequence[Transition], layout: Layout, flags: Sequence[str]) -> None:
        super().__init__()
        self._table = table
        self._ends = layout.ends
        self._flags = flags

    def __missing__(self, passage: tuple[Any, ...]) -> bytes:
        before, row, state, fresh = passage
        found = passage_of(self._table, self._ends, before, row, state)
        found["fresh"] = dict(zip(self._flags, fresh, strict=True))
        if len(self) >= _MOST_PASSAGES:
            self.clear()
        text = self[passage] = dumped(found)[1:-1]
        return text


class Steps:
    """Writes the steps of one subsystem; notes the inputs of each step before it is made."""

    def __init__(self, subsystem: Subsystem, layout: Layout, shelf: Shelf, log: Sinks) -> None:
        """Note the steps of the subsystem from now on."""
        self.subsystem = subsystem
        self._last_step: tuple[str, BufferCells, tuple[bool, ...], tuple[float, ...]] | None = None
        """State, inputs, freshness and ages of the step that is not committed yet."""
        self._stamp: int | None = None
        """Of the step that was written last."""
        self._shelf = shelf
        brief = not shelf.exact
        topic = topic_of(subsystem.name)
        memory = remembered(layout, shelf.exact)
        self._x = Cells(f"{topic}/x", layout.x)
        self._y = Cells(f"{topic}/y", layout.y, brief=brief)
        self._memory = Cells(f"{topic}/memory", memory, brief=brief)
        flagged = beside(subsystem, layout.x, FRESH)
        self._flags = getter([FRESH + e.attribute for e in flagged])
        names = [".".join(e.name) for e in flagged]
        behind = {kind: beside(subsystem, layout.x, kind) for kind in (AGE, LATE)}
        self._lags = getter([kind + e.attribute for kind in behind for e in behind[kind]])
        self._lag_template = _lag_template(behind)
        self._passages = _Passages(subsystem.transitions, layout, names)
        form = STEP_SCHEMA + subsystem.name, _schema(layout, [k for k in behind if behind[k]])
        every = (*layout.x, *layout.y, *memory)
        is_preceded = any(element.form.is_aside for element in every)
        self._channel = log.channel(topic, *form, self._texts, is_preceded=is_preceded)
        self._step, self._note_before = subsystem.step, subsystem.note_inputs
        vars(subsystem).update(step=self._noted, note_inputs=self._note_inputs)

    def _noted(self) -> int:
        """Replaces the subsystem's own step; may be called in a worker thread."""
        self._note()
        return self._step()

    def _note_inputs(self) -> None:
        """Replaces the subsystem's own: the step is made in another process."""
        self._note_before()
        self._note()

    def _note(self) -> None:
        """Note state and inputs of the step that comes next."""
        subsystem = self.subsystem
        x = subsystem.x
        self._last_step = subsystem.state, self._x.of_buffer(x), self._flags(x), self._lags(x)

    def add(self, record: StepRecord) -> None:
        """Write a committed step."""
        assert self._last_step is not None
        before, (x, inputs), fresh, lags = self._last_step
        _, stamp, time_s, state, row, sent, _, visible_s = record
        memory, values = self._memory.of_buffer(self.subsystem.memory)
        self._last_step = None
        passage = before, row, state, fresh
        late = self._late(stamp, time_s, visible_s)
        kind = x, state, memory, "", bool(late)
        self._channel.add(time_s, (kind, stamp, late, passage, lags, inputs, sent, values))

    def failed(self, stamp: int, time_s: float, message: str) -> None:
        """Write the step that ended in a fault, if any."""
        if self._last_step is not None and stamp >= 0:
            before, (x, inputs), fresh, lags = self._last_step
            state = self.subsystem.state
            passage = before, -1, state, fresh
            late = self._late(stamp, time_s, None)
            kind = x, state, (), message, bool(late)
            self._channel.add(time_s, (kind, stamp, late, passage, lags, inputs, (), ()))

    def memory_text(self, time_s: float, content: tuple[Any, ...]) -> bytes:
        """The text of the memory after a step, from the content of its message."""
        (_, _, memory, _, _), *_, values = content
        columns = [(value,) for value in values]
        texts = self._memory.texts(memory, columns, self._shelf, ((time_s,), (0,)))
        return self._memory.template(memory) % tuple(next(iter(column)) for column in texts)

    def _late(self, stamp: int, time_s: float, visible_s: float | None) -> Late:
        """Of a step that was not on time: the periods skipped before it, and when it was seen."""
        last, self._stamp = self._stamp, stamp
        skipped = 0 if last is None else stamp - last - 1
        period_s = self.subsystem.period_s
        due_s = (stamp + 1) * period_s
        visible_s = due_s if visible_s is None else visible_s
        off_s = abs(visible_s - due_s) + abs(time_s - stamp * period_s)
        return (skipped, visible_s) if skipped or off_s > _ROUNDING_S else ()

    def _texts(
        self, steps: Sequence[Any], times: Sequence[float], dates: Sequence[int]
    ) -> Iterator[bytes]:
        for kind, (alike, at) in _runs(steps, times, dates):
            yield from self._texts_alike(kind, alike, at)

    def _texts_alike(
        self, kind: tuple[Any, ...], rows: Sequence[Any], times: Times
    ) -> Iterator[bytes]:
        """The texts of steps that have values for the same elements: column by column."""
        x, state, memory, fault, is_late = kind
        shelf, names = self._shelf, self.subsystem.sends[state] if not fault else ()
        _, stamps, late, passages, lags, inputs, sent, memories = zip(*rows, strict=True)
        columns = [
            stamps,
            *_late_columns(late if is_late else ()),
            dumped_each(times[0]),
            map(self._passages.__getitem__, passages),
            *map(dumped_each, zip(*lags, strict=True)),
            *self._x.texts(x, zip(*inputs, strict=True), shelf, times),
        ]
        template = b'{"stamp":%%d,%b"time":%%b,%%b,%b"x":%b' % (
            _LATE if is_late else b"",
            self._lag_template,
            self._x.template(x),
        )
        if fault:
            template += b',"fault":%b}' % dumped(fault).replace(b"%", b"%%")
        else:
            values = [list(map(itemgetter(1), column)) for column in zip(*sent, strict=True)]
            columns += self._y.texts(names, values, shelf, times)
            columns += self._memory.texts(memory, zip(*memories, strict=True), shelf, times)
            template += b',"y":%b,"memory":%b}' % (
                self._y.template(names),
                self._memory.template(memory),
            )
        return map(template.__mod__, zip(*columns, strict=True))


def _late_columns(late: Sequence[Late]) -> Iterator[Sequence[Any]]:
    if late:
        skipped, visible_s = zip(*late, strict=True)
        yield skipped
        yield dumped_each(visible_s)


class Truth:
    """Writes the ground truth of the plant."""

    def __init__(self, layout: Layout, shelf: Shelf, log: Sinks) -> None:
        topic = topic_of(PLANT)
        self._shelf = shelf
        self._y = Cells(f"{topic}/y", layout.y)
        number, counted = {"type": "number"}, {"type": "integer"}
        form = {"stamp": counted, "skipped": counted, "time": number, "y": _of_elements(layout.y)}
        self._channel = log.channel(topic, TRUTH_SCHEMA, object_schema(form), self._texts)
        self._stamp: int | None = None

    def add(self, record: StepRecord) -> None:
        """Write the ground truth at a tick."""
        names, values = (tuple(one[i] for one in record.sent) for i in (0, 1))
        skipped = 0 if self._stamp is None else record.stamp - self._stamp - 1
        self._stamp = record.stamp
        self._channel.add(record.time_s, ((names, skipped), record.stamp, values))

    def _texts(
        self, ticks: Sequence[Any], times: Sequence[float], dates: Sequence[int]
    ) -> Iterator[bytes]:
        for (names, skipped), (alike, at) in _runs(ticks, times, dates):
            _, stamps, values = zip(*alike, strict=True)
            y = self._y.texts(names, zip(*values, strict=True), self._shelf, at)
            late = b'"skipped":%d,' % skipped if skipped else b""
            template = b'{"stamp":%%d,%b"time":%%b,"y":%b}' % (late, self._y.template(names))
            columns = stamps, dumped_each(at[0]), *y
            yield from map(template.__mod__, zip(*columns, strict=True))


def _runs(
    contents: Sequence[Any], times: Sequence[float], dates: Sequence[int]
) -> Iterator[tuple[Any, tuple[list[Any], Times]]]:
    """Runs of successive contents with the same beginning: it, the contents and their times."""
    begin = 0
    for kind, alike in groupby(contents, itemgetter(0)):
        rows = list(alike)
        end = begin + len(rows)
        yield kind, (rows, (times[begin:end], dates[begin:end]))
        begin = end


def remembered(layout: Layout, exact: bool) -> Sequence[Element]:
    """The memory elements that are written."""
    return [element for element in layout.memory if exact or not element.form.is_opaque]


def passage_of(
    table: Sequence[Transition],
    ends: Mapping[str, tuple[str, str | Mapping[str, str], str]],
    before: str,
    row: int,
    state: str,
) -> dict[str, Any]:
    """States, cause and row of a step, with the evaluated conditions and their values.

    Error conditions come first, then the terminal condition, up to the one that holds; then the
    initial conditions of the rows, of which exactly one holds; rows that resume a mode share it.
    """
    cause, row_text = (table[row].cause, str(table[row])) if row >= 0 else ("", "")
    conditions = {}
    if before:
        terminal, error, _ = ends[before]
        errors = {"error": error} if isinstance(error, str) else error
        for ending, condition in (*errors.items(), ("terminal", terminal)):
            conditions[condition] = cause == ending
            if cause == ending:
                break
    if row >= 0:
        conditions |= {
            other.condition: other.condition == table[row].condition
            for other in table
            if (other.source, other.cause) == (before, cause)
        }
    return {
        "before": before,
        "state": state,
        "cause": cause,
        "row": row,
        "transition": row_text,
        "conditions": conditions,
    }


def beside(subsystem: Subsystem, elements: Sequence[Element], kind: str) -> list[Element]:
    """The inputs with a slot of a kind, such as `FRESH`, beside that of their value."""
    return [e for e in elements if hasattr(type(subsystem.x), kind + e.attribute)]


def _lag_template(behind: Mapping[str, Sequence[Element]]) -> bytes:
    """How far behind inputs are, for the texts of numbers; empty if nothing asks."""
    found = b""
    for kind, elements in behind.items():
        if elements:
            names = (dumped(".".join(e.name)).replace(b"%", b"%%") for e in elements)
            inside = b",".join(name + b":%b" for name in names)
            found += b'"%b":{%b},' % (lag_name(kind).encode(), inside)
    return found


def lag_name(kind: str) -> str:
    """What messages call `AGE` and `LATE`."""
    return kind.removesuffix("_")


def _schema(layout: Layout, lags: Iterable[str]) -> Schema:
    texts = {name: {"type": "string"} for name in ("before", "state", "cause", "transition")}
    return object_schema(
        {
            "stamp": {"type": "integer"},
            "skipped": {"type": "integer"},
            "visible": {"type": "number"},
            "time": {"type": "number"},
            "row": {"type": "integer"},
            **texts,
            "conditions": _BOOLEANS,
            "x": _of_elements(layout.x),
            "fresh": _BOOLEANS,
            **{lag_name(kind): _NUMBERS for kind in lags},
            "y": _of_elements(layout.y),
            "memory": _of_elements(layout.memory),
            "fault": {"type": "string"},
        }
    )


def _of_elements(elements: Sequence[Element]) -> Schema:
    groups: dict[str, dict[str, Schema]] = {}
    alone: dict[str, Schema] = {}
    for element in elements:
        schema = element.form.schema
        if schema:
            within = alone if len(element.name) == 1 else groups.setdefault(element.name[0], {})
            within[element.name[-1]] = schema | {"description": element.title}
    return object_schema({n: object_schema(group) for n, group in groups.items()} | alone)
