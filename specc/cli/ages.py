"""`specc ages`: how old the values are that subsystems and devices receive."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterator
from fractions import Fraction

from specc.analysis import Facts
from specc.analysis.dataflow import AgeChain, Ages, Measured, UnboundedAge
from specc.cli import streams
from specc.diagnostics.phrases import in_ms

VERSION = 1


def ages(options: Namespace) -> int:
    """Print the greatest age of every value that is received; 1 if the specification has errors."""
    from specc import pipeline

    result = pipeline.compile_spec(options.spec)
    if not result.ok or result.system is None:
        return streams.print_findings(result, options.spec, options.format) or 1
    shown = _as_json if options.format == "json" else _as_text
    streams.print_output(shown(result.proofs), options.format)
    return 0


def _as_text(facts: Facts) -> str:
    """A table: reader, element, greatest age, what is allowed, and the path of the oldest value."""
    rows = [("reader", "element", "age", "allowed", "path of the oldest value")]
    for reader, name, limit, oldest in _found(facts):
        age, way = _age(oldest, facts.ages)
        rows.append((reader, name, age, "" if limit is None else in_ms(limit), way))
    return streams.format_table(rows)


def _as_json(facts: Facts) -> str:
    """An object with `version`, `system` and `values`; ages in s, null where none is known."""
    values = [
        {
            "reader": reader,
            "element": name,
            "age_s": float(oldest.age_s) if isinstance(oldest, AgeChain) else None,
            "max_age_s": None if limit is None else float(limit),
            "way": _age(oldest, facts.ages)[1],
        }
        for reader, name, limit, oldest in _found(facts)
    ]
    return streams.as_json(VERSION, facts.system.name, values=values)


def _found(
    facts: Facts,
) -> Iterator[tuple[str, str, Fraction | None, AgeChain | UnboundedAge | None]]:
    """Reader, element, how old it may be, and what its oldest value comes from."""
    for node, element in facts.inputs():
        name = node.short if node.peer else node.element
        yield node.reader, name, element.max_age_s, facts.ages.oldest(node)


def _age(oldest: AgeChain | UnboundedAge | None, ages: Ages) -> tuple[str, str]:
    """The age in words, and how it comes about."""
    if oldest is None:
        return "-", "source not known"
    if isinstance(oldest, UnboundedAge):
        silent = oldest.source
        if isinstance(silent, Measured):
            return "any", f"`{silent.device}.{oldest.node.element}` may have no new sample"
        state = silent.silent_state.name if silent.silent_state else ""
        return "any", f"`{silent.sender.qualified_name}` is silent in `{state}`"
    hops = oldest.steps()
    source = ages.sources.origin(hops[0].node)
    if isinstance(source, Measured):
        start = f"{source.device}.{hops[0].node.element}"
    else:
        start = f"computed by {source.sender.qualified_name}" if source else ""
    steps = [f"{hop.node.reader} after {in_ms(hop.read_s - oldest.since_s)}" for hop in hops]
    when = ", used only when fresh" if ages.sources.only_on_arrival(oldest.node) else ""
    return in_ms(oldest.age_s), " -> ".join((start, *steps)) + when
