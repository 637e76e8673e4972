"""Rates that meet, readers that keep up, values that are young enough; budgets in real time."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from math import ceil

from specc.analysis import Facts
from specc.analysis.dataflow import AgeChain, InputNode, Measured, Sent, UnboundedAge
from specc.analysis.rates import LONGEST
from specc.analysis.reads import inputs_tested_for_arrival
from specc.diagnostics import Diagnostic, Related
from specc.diagnostics.phrases import in_ms
from specc.mjcf import Model
from specc.model.fsm import State
from specc.model.system import Element, Subsystem
from specc.model.types import Opaque, Type, nested_types
from specc.source import Place

# All periods are whole multiples of a base tick, and the timeline repeats within reason.


def rates_meet(facts: Facts) -> Iterator[Diagnostic]:
    """E0409, at the subsystem whose rate does not fit those of the others."""
    clash = facts.rates.clash
    if clash is None:
        return
    related = [Related(s.place.below("rate"), _rated(s)) for s in clash.others]
    ticks = str(clash.ticks)
    if len(ticks) > 12:
        ticks = f"10^{len(ticks) - 1}"
    yield Diagnostic(
        "E0409",
        f"with {_rate(clash.subsystem)} the timeline repeats only after {ticks} ticks",
        clash.subsystem.place.below("rate"),
        _rated(clash.subsystem),
        tuple(related[:4]),
        f"choose rates that divide one another; at most {LONGEST} ticks are scheduled",
    )


def _rated(subsystem: Subsystem) -> str:
    return f"`{subsystem.qualified_name}`: {_rate(subsystem)}"


def _rate(subsystem: Subsystem) -> str:
    return f"{float(subsystem.rate_hz):g} Hz"


# The simulation of a model goes on by whole time steps, so every base tick has to be some of them.


_WHOLE = Fraction(1, 1_000_000)
"""How far from a whole number of time steps a tick may be, as when a model is run."""


def ticks_stepped(facts: Facts) -> Iterator[Diagnostic]:
    """E0518, at the first subsystem whose period is not a whole number of time steps."""
    plant, model, timed = facts.system.plant, facts.model, facts.rates.timed
    if plant is None or not isinstance(model, Model) or not model.timestep_s or not timed:
        return
    step_s = Fraction(model.timestep_s).limit_denominator(10**9)
    tick_s = facts.rates.tick_s
    if not step_s or _is_stepped(tick_s, step_s):
        return
    odd, *others = [s for s in timed if not _is_stepped(1 / s.rate_hz, step_s)] or timed
    period_s = 1 / odd.rate_hz
    fitting_s = step_s * max(1, round(period_s / step_s))
    finer_s = tick_s / ceil(tick_s / step_s)
    finer = f'; or give the model `<option timestep="{float(finer_s):.12g}"/>`'
    yield Diagnostic(
        "E0518",
        f"{_rate(odd)} does not fit the time step of the model, {in_ms(step_s)}",
        odd.place.below("rate"),
        f"a period of {in_ms(period_s)} has {float(period_s / step_s):.6g} steps",
        (Related(plant.place, "the model"), *(_with_rate(s) for s in others[:4])),
        f"the nearest period that fits is {in_ms(fitting_s)}" + finer * (10 * finer_s > step_s),
    )


def _is_stepped(time_s: Fraction, step_s: Fraction) -> bool:
    steps = time_s / step_s
    return round(steps) > 0 and abs(steps - round(steps)) <= _WHOLE


# A subsystem that asks whether a value has come is fast enough to see every value.


def readers_fast_enough(facts: Facts) -> Iterator[Diagnostic]:
    """W0414, for values that are sent on occasion; a value of every period is a measurement.

    Exploration finds whether the next value overtakes a declared event.
    """
    for reader, node, element in _inputs_tested_for_arrival(facts):
        source = _sending_rate(node, facts) if reader in facts.rates.timed else None
        if source is None or source[0] <= reader.rate_hz or element.event:
            continue
        rate, place = source
        yield Diagnostic(
            "W0414",
            f"`{reader.qualified_name}` can miss values of `{node.short}`",
            element.place,
            f"up to {ceil(rate / reader.rate_hz)} values arrive between two periods of "
            f"{_ms(reader.rate_hz)}; only the last one is seen",
            (
                Related(place, f"sends one every {_ms(rate)}"),
                Related(reader.place.below("rate"), "reads at this rate"),
            ),
            "raise the rate of the reader, or lower that of the sender; where the sender waits for "
            "an answer, `event: true` lets `specc explore` prove that none is missed",
        )


def _inputs_tested_for_arrival(facts: Facts) -> Iterator[tuple[Subsystem, InputNode, Element]]:
    """The elements of which it matters to their readers whether a new value has come."""
    inputs_by_reader = {
        s.qualified_name: (s, inputs_tested_for_arrival(s)) for s in facts.subsystems
    }
    for node, element in facts.inputs():
        reader, names = inputs_by_reader.get(node.reader, (None, ()))
        if reader and (node.peer, node.element) in names:
            yield reader, node, element


def _sending_rate(node: InputNode, facts: Facts) -> tuple[Fraction, Place] | None:
    """The rate at which an element is measured or may be sent, with its place; else None."""
    match facts.ages.sources.origin(node):
        case Sent(sender=sender, silent_state=State()):
            return sender.rate_hz, sender.place.below("rate")
        case Measured(is_sporadic=False, device=device) as measured if measured.period_s:
            unfit = (conflict.bound.binding for conflict in facts.rates.conflicts)
            if (device, node.element) not in ((b.device, b.element) for b in unfit):
                return 1 / measured.period_s, measured.place
    return None


def _ms(rate: Fraction) -> str:
    return f"{float(1000 / rate):g} ms"


# A value of every period comes at regular intervals to a subsystem that asks whether it came.


def rates_divide(facts: Facts) -> Iterator[Diagnostic]:
    """W0418, where the age is not limited either; a sender that is faster is seen in any period."""
    for reader, node, element in _inputs_tested_for_arrival(facts):
        sent = facts.ages.sources.origin(node)
        sender = sent.sender if isinstance(sent, Sent) and sent.silent_state is None else None
        if sender is None or element.max_age_s is not None:
            continue
        ratio = reader.rate_hz / sender.rate_hz
        if ratio > 1 and ratio.denominator != 1:
            few = ratio.numerator // ratio.denominator
            yield Diagnostic(
                "W0418",
                f"`{node.short}` is fresh sometimes after {few} and sometimes "
                f"after {few + 1} periods of `{reader.qualified_name}`",
                element.place,
                f"{_rate(sender)} does not divide {_rate(reader)}",
                tuple(_with_rate(s) for s in (sender, reader)),
                (
                    "choose rates of which one divides the other, or say with "
                    "`max_age` how old the value may be"
                ),
            )


def _with_rate(subsystem: Subsystem) -> Related:
    words = f"`{subsystem.qualified_name}`, {_rate(subsystem)}"
    return Related(subsystem.place.below("rate"), words)


# No value can be older than its reader allows.


def ages_bounded(facts: Facts) -> Iterator[Diagnostic]:
    """E0410, with the whole path of the oldest value."""
    if facts.broken or facts.faulty or facts.rates.clash or facts.rates.conflicts:
        return
    for node, element in _inputs_with_max_age(facts):
        oldest, allowed = facts.ages.oldest(node), element.max_age_s
        if isinstance(oldest, AgeChain) and allowed is not None and oldest.age_s > allowed:
            scale = 1000
            while oldest.age_s * scale < 100 and (oldest.age_s * scale).denominator != 1:
                scale *= 10
            enough = in_ms(Fraction(ceil(oldest.age_s * scale), scale))
            yield Diagnostic(
                "E0410",
                f"`{node.short}` can be {in_ms(oldest.age_s)} old",
                element.place.below("max_age"),
                f"may be at most {in_ms(allowed)} old",
                tuple(_age_path(oldest, facts)),
                f"{_shorten(oldest, facts)}, which adds most, or allow {enough}",
            )


def _inputs_with_max_age(facts: Facts) -> Iterator[tuple[InputNode, Element]]:
    """Yield the inputs whose age their readers limit."""
    for node, element in facts.inputs():
        if element.max_age_s is not None:
            yield node, element


def _age_path(oldest: AgeChain, facts: Facts) -> Iterator[Related]:
    """Yield the path of a value from its origin to the reader, with the time passed since."""
    steps = oldest.steps()
    first = facts.ages.sources.origin(steps[0].node)
    if isinstance(first, Measured):
        often = "sample at least every" if first.is_sporadic else "sample every"
        every = f", a {often} {in_ms(first.period_s)}" if first.period_s else ""
        yield Related(first.place, f"measured by `{first.device}`{every}: 0 ms")
    elif first is not None:
        sender, seen_s = first.sender, 1 / first.sender.rate_hz
        words = f"computed by `{sender.qualified_name}`, {_rate(sender)}: 0 ms; seen from"
        yield Related(sender.place.below("rate"), f"{words} {in_ms(seen_s)} on")
    for step in steps:
        reader = facts.wires.subsystems.get(step.node.reader)
        if reader is None:
            continue
        rate = f"`{reader.qualified_name}`, {_rate(reader)}"
        read_s = step.read_s - oldest.since_s
        words = f"{rate}, reads it after {in_ms(read_s)}"
        if step is not oldest:
            words += f" and sends a result, seen from {in_ms(read_s + 1 / reader.rate_hz)} on"
        yield Related(reader.place.below("rate"), words)


def _shorten(oldest: AgeChain, facts: Facts) -> str:
    """A help text on how to shorten the longest step of the path."""
    steps: list[tuple[Fraction, str]] = []
    for step in oldest.steps():
        source = facts.ages.sources.origin(step.node)
        length_s = step.read_s - (step.before.read_s if step.before else oldest.since_s)
        if isinstance(source, Measured):
            what = "shorten the `max_gap`" if source.is_sporadic else "raise the rate"
            steps.append((length_s, f"{what} of `{source.device}`"))
        elif source is not None:
            steps.append((length_s, f"raise the rate of `{source.sender.qualified_name}`"))
    return max(steps, key=lambda step: step[0])[1]


# Where the age of a value is limited, it is not the age of a measurement that memory keeps.


def ages_known(facts: Facts) -> Iterator[Diagnostic]:
    """W0415, where the age of a value counts from the time at which it comes out of memory."""
    for node, element in _inputs_with_max_age(facts):
        oldest = facts.ages.oldest(node)
        first = oldest.steps()[0].node if isinstance(oldest, AgeChain) else None
        sources = facts.ages.sources.stored_inputs(first) if first else ()
        memory = next((name for name, source in sources if facts.ages.is_measured(source)), "")
        if memory and not facts.ages.is_measured(node):
            yield Diagnostic(
                "W0415",
                f"the age of `{node.short}` does not count from a measurement",
                element.place.below("max_age"),
                f"counts from the time at which `{memory}` is read",
                help="delete it, or set it where the measurement arrives; what comes out of memory "
                "is as new as the step that sends it",
            )


# Where the age of a value is limited, it is sent in every period or read only on arrival.


_WAYS_OUT = {
    Sent: "send it in every state, or read it only where `fresh(...)` of it holds",
    Measured: "say with `max_gap` for how long there may be none, or read it only where "
    "`fresh(...)` of it holds",
}


def ages_limited(facts: Facts) -> Iterator[Diagnostic]:
    """W0416, for an input with `max_age` whose source may be silent for ever."""
    for node, element in _inputs_with_max_age(facts):
        oldest, allowed = facts.ages.oldest(node), element.max_age_s
        if isinstance(oldest, UnboundedAge) and allowed is not None:
            yield Diagnostic(
                "W0416",
                f"nothing limits the age of `{node.short}`",
                element.place.below("max_age"),
                f"may be at most {in_ms(allowed)} old",
                tuple(_silent_source(oldest, node)),
                _WAYS_OUT[type(oldest.source)],
            )


def _silent_source(unbounded: UnboundedAge, node: InputNode) -> Iterator[Related]:
    source = unbounded.source
    if isinstance(source, Measured):
        name = f"{source.device}.{unbounded.node.element}"
        yield Related(source.place, f"`{name}` may have no new sample for an unlimited time")
    elif source.silent_state is not None:
        sender = source.sender.qualified_name
        whose = (
            "it" if unbounded.node == node else f"`{unbounded.node}`, from which it is computed,"
        )
        yield Related(source.silent_state.place, f"`{sender}` does not send {whose} in this state")


# The rate of a sensor goes with the timeline and with the rates of its readers.


def sensors_in_time(facts: Facts) -> Iterator[Diagnostic]:
    """E0505, for a sensor whose rate fits neither its readers nor the base tick."""
    for conflict in facts.rates.conflicts:
        rate, tick = conflict.rate_hz, conflict.tick_s
        place = conflict.bound.binding.place.below("rate")
        if not conflict.readers and tick is not None:
            message = f"its period is not a whole number of base ticks of {float(tick):g} s"
            ticks = max(1, round(1 / rate / tick))
            yield Diagnostic(
                "E0505",
                message,
                place,
                help=f"the nearest period that fits is {float(1000 * ticks * tick):g} ms",
            )
        for reader in conflict.readers:
            yield Diagnostic(
                "E0505",
                f"{float(rate):g} Hz does not fit the {_rate(reader)} of `{reader.qualified_name}`",
                place,
                related=(Related(reader.place.below("rate"), "reads it at this rate"),),
                help="make one rate a whole multiple of the other",
            )


# A step is over before the next one is due.


def budgets_fit(facts: Facts) -> Iterator[Diagnostic]:
    """E0414, for a budget that is longer than the period."""
    for subsystem in facts.rates.timed:
        budget_s, period_s = subsystem.budget_s, 1 / subsystem.rate_hz
        if budget_s is not None and budget_s > period_s:
            yield Diagnostic(
                "E0414",
                f"steps of `{subsystem.qualified_name}` may take longer than its period",
                subsystem.place.below("budget"),
                f"{in_ms(budget_s)}, and the next one is due after {in_ms(period_s)}",
                (Related(subsystem.place.below("rate"), "its rate"),),
                f"choose a period of at least {in_ms(budget_s)}, or make the steps shorter",
            )


# A subsystem that computes in a process of its own gets and gives values that can cross.


def values_cross(facts: Facts) -> Iterator[Diagnostic]:
    """W0419, for each type without a codec, where it crosses first."""
    for subsystem in facts.rates.timed:
        if subsystem.budget_s is None or subsystem.budget_s <= facts.rates.tick_s:
            continue
        first: dict[str, tuple[str, Place]] = {}
        for name, type_, place in _process_values(subsystem, facts):
            for part in nested_types([type_]):
                if isinstance(part, Opaque) and not part.codec:
                    first.setdefault(part.name, (name, place))
        words = "computes in a process of its own in real time"
        for opaque, (name, place) in first.items():
            yield Diagnostic(
                "W0419",
                f"values of `{opaque}` cannot cross to the process of `{subsystem.qualified_name}`",
                place,
                f"`{name}` has values of an opaque type without a codec",
                (Related(subsystem.place.below("budget"), words),),
                f"give `{opaque}` a `codec`, or the subsystem no `budget`",
            )


def _process_values(subsystem: Subsystem, facts: Facts) -> Iterator[tuple[str, Type, Place]]:
    """Yield what a subsystem in a process of its own exchanges: names, types and places."""
    for port in subsystem.ports:
        for element in port.elements:
            name = f"{port.direction}.{port.peer}.{element.name}"
            yield name, element.type, port.place_of(element)
    watched = facts.watched(subsystem)
    for memory in subsystem.memory:
        if memory.name in watched:
            yield memory.name, memory.type, memory.place


# An agent may be silent for some time before a device gets its safe outputs.


def silences_are_borne(facts: Facts) -> Iterator[Diagnostic]:
    """E0415, for a silence that is too short or has no safe output."""
    for device in facts.system.devices:
        if device.silence_s is None or device.qualified_name in facts.broken:
            continue
        if device.safe:
            assert device.silence_s is not None
            for subsystem in (
                wire.subsystem for wire in facts.wires.wires_to(device.qualified_name, "y")
            ):
                period_s = 1 / subsystem.rate_hz
                if device.silence_s <= period_s:
                    yield Diagnostic(
                        "E0415",
                        f"a silence of {in_ms(device.silence_s)} is not longer than the period of "
                        f"`{subsystem.qualified_name}`, {in_ms(period_s)}",
                        device.place.below("silence"),
                        related=(
                            Related(subsystem.place.below("rate"), "which commands the device"),
                        ),
                        help=f"`silence: {in_ms(2 * period_s)}` bears one period that is skipped",
                    )
        else:
            yield Diagnostic(
                "E0415",
                f"`{device.qualified_name}` has no safe output that it could get after a silence",
                device.place.below("silence"),
                help="declare one, `x: {u: {type: ..., safe: ...}}`, or delete `silence`",
            )
