"""What whoever uses a part of the library has to know: its parameters, inputs and outputs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from specc.model.system import Element
from specc.pipeline import check_spec
from specc.read.document import comments_of
from specc.source import SourceFile


@dataclass(frozen=True, slots=True)
class PartEntry:
    """A parameter, or an element of a buffer: its type, and what the part says of it."""

    name: str
    type: str
    words: str


@dataclass(frozen=True, slots=True)
class PartSummary:
    """A description that others use, as it is seen from outside."""

    name: str
    title: str
    about: str
    parameters: tuple[PartEntry, ...]
    inputs: tuple[PartEntry, ...]
    outputs: tuple[PartEntry, ...]


def summary_of(path: str) -> PartSummary | None:
    """The summary of a described subsystem; None of any other file."""
    result = check_spec(path)
    source = result.sources.get(path)
    subsystems = result.system.subsystems if result.system else ()
    if source is None or len(subsystems) != 1:
        return None
    (subsystem,) = subsystems
    title = source.node(("title",))
    return PartSummary(
        path,
        (title.scalar or "") if title else subsystem.title,
        _about(source),
        tuple(_parameters(source)),
        tuple(_elements("x", subsystem.inputs)),
        tuple(_elements("y", subsystem.outputs)),
    )


def _about(source: SourceFile) -> str:
    """The comment above the first key."""
    top = source.spans
    first = min((key.start for key in top.keys.values()), default=0) if top else 0
    above = (c.text for c in comments_of(source) if c.is_whole_line and c.start < first)
    return " ".join(text.lstrip("# ") for text in above)


def _parameters(source: SourceFile) -> Iterator[PartEntry]:
    """The parameters, each with the comment behind it."""
    node = source.node(("parameters",))
    behind = {
        source.text.count("\n", 0, c.start): c for c in comments_of(source) if not c.is_whole_line
    }
    for name, value in node.values.items() if node else ():
        comment = behind.get(source.text.count("\n", 0, value.end))
        words = comment.text.lstrip("# ") if comment else ""
        yield PartEntry(str(name), value.scalar or "", words)


def _elements(direction: str, elements: dict[tuple[str, str], Element]) -> Iterator[PartEntry]:
    for (peer, name), element in elements.items():
        words = [element.title, "an event" if element.event else ""]
        type_ = str(element.type)
        yield PartEntry(f"{direction}.{peer}.{name}", type_, ", ".join(filter(None, words)))


def as_text(part: PartSummary) -> str:
    """A summary for a terminal."""
    lines = [f"{part.name}: {part.title}"]
    width = max((len(each.name) for _, each in _all(part)), default=0)
    types = max((len(each.type) for _, each in _all(part)), default=0)
    for kind, each in _all(part):
        lines.append(
            f"  {kind:<9}  {each.name:<{width}}  {each.type:<{types}}  {each.words}".rstrip()
        )
    return "\n".join(lines) + "\n"


def as_markdown(part: PartSummary) -> str:
    """A summary for an editor."""
    rows = [
        f"- {kind} `{each.name}: {each.type}`" + (f", {each.words}" if each.words else "")
        for kind, each in _all(part)
    ]
    head = f"**part** `{part.name}`: {part.title}"
    return "\n\n".join(filter(None, (head, part.about, "\n".join(rows))))


def _all(part: PartSummary) -> Iterable[tuple[str, PartEntry]]:
    yield from (("parameter", each) for each in part.parameters)
    yield from (("input", each) for each in part.inputs)
    yield from (("output", each) for each in part.outputs)
