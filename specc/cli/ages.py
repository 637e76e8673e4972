"""`specc ages`: its arguments, and how old the values are that subsystems and devices receive."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING, Any

from specc.diagnostics.render.visible import visible

if TYPE_CHECKING:
    from specc.analysis import Facts
    from specc.analysis.ages import Ages, Held, Trail
    from specc.analysis.dataflow import Node
    from specc.model.system import Element

VERSION = 1


def add_ages(commands: Any) -> None:
    """Add the command to the parser's subcommands."""
    parser = commands.add_parser("ages", help="show how old values are where they are read")
    parser.add_argument("spec", metavar="SPEC")
    parser.add_argument("--format", choices=("text", "json"), default="text")


def run_ages(options: argparse.Namespace) -> int:
    """Print the greatest age of every value that is received; 1 if the specification has errors."""
    from specc import pipeline
    from specc.cli import streams
    from specc.cli.streams import tell
    from specc.diagnostics.report import report, resolve

    result = pipeline.compile_spec(options.spec)
    if not result.ok or result.system is None:
        found = report(resolve(result.diagnostics, result.sources), [options.spec])
        return tell(found) or 1
    shown = _as_json if options.format == "json" else _as_text
    streams.show(shown(result.proofs), options.format)
    return 0


def _as_text(facts: Facts) -> str:
    """A table: reader, element, greatest age, what is allowed, and the path of the oldest value."""
    rows: list[tuple[str, ...]] = [
        ("reader", "element", "age", "allowed", "path of the oldest value")
    ]
    for node, element, oldest, ages in _found(facts):
        limit = element.max_age_s
        allowed = "" if limit is None else _ms(limit)
        age, way = _age(oldest, ages)
        rows.append(tuple(map(visible, (node.reader, _name(node), age, allowed, way))))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in rows)
    return "".join(f"{line.rstrip()}\n" for line in lines)


def _as_json(facts: Facts) -> str:
    """An object with `version`, `system` and `values`; ages in s, null where none is known."""
    from specc.analysis.ages import Trail

    values = []
    for node, element, oldest, ages in _found(facts):
        limit = element.max_age_s
        values.append(
            {
                "reader": node.reader,
                "element": _name(node),
                "age_s": float(oldest.age_s) if isinstance(oldest, Trail) else None,
                "max_age_s": None if limit is None else float(limit),
                "way": _age(oldest, ages)[1],
            }
        )
    return (
        json.dumps({"version": VERSION, "system": facts.system.name, "values": values}, indent=2)
        + "\n"
    )


def _name(node: Node) -> str:
    return node.short if node.peer else node.element


def _found(facts: Facts) -> list[tuple[Node, Element, Trail | Held | None, Ages]]:
    ages = facts.ages
    return [(node, element, ages.oldest(node), ages) for node, element in facts.received()]


def _age(oldest: Trail | Held | None, ages: Ages) -> tuple[str, str]:
    """The age in words, and how it comes about."""
    from specc.analysis.ages import Held
    from specc.analysis.dataflow import Measured

    if oldest is None:
        return "-", "no measurement"
    if isinstance(oldest, Held):
        silent = oldest.source
        if isinstance(silent, Measured):
            return "any", f"`{silent.device}.{oldest.node.element}` may have no new sample"
        state = silent.silent.name if silent.silent else ""
        return "any", f"`{silent.sender.qualified_name}` is silent in `{state}`"
    hops = oldest.hops()
    source = ages.sources.of(hops[0].node)
    start = f"{source.device}.{hops[0].node.element}" if isinstance(source, Measured) else ""
    steps = [f"{hop.node.reader} after {_ms(hop.read_s - oldest.measured_s)}" for hop in hops]
    when = ", used only when fresh" if ages.sources.only_on_arrival(oldest.node) else ""
    return _ms(oldest.age_s), " -> ".join((start, *steps)) + when


def _ms(seconds: Any) -> str:
    from specc.diagnostics.phrases import ms

    return ms(seconds)
