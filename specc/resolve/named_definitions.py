"""Which types, interfaces and constants of the main file its other parts name.

Frames are left out: section 3 of the paper has them described before anything is given in them.
"""

from __future__ import annotations

from collections.abc import Mapping

from specc.model.expr import constants_in
from specc.model.system import Definition
from specc.resolve.context import Findings
from specc.resolve.library import Loaded
from specc.resolve.uses import uses_in_type
from specc.source import Place

_SECTIONS = ("types", "interfaces", "files", "constants", "operators")
Named = Mapping[tuple[str | int, ...], set[str]]
"""Section and name of a definition -> the types and interfaces that its texts name: `type Mode`."""


def types_named(findings: Findings, file: Loaded) -> Named:
    """What the texts of types in a file name, of the definitions there."""
    found: dict[tuple[str | int, ...], set[str]] = {}
    texts = [text for text in findings.types if text.where.file == file.path]
    # Most texts stand many times in a part, and name the same there.
    for text in {(text.where.route[:2], text.form, text.text): text for text in texts}.values():
        labels = found.setdefault(text.where.route[:2], set())
        labels.update(_label(use.of) for use in uses_in_type(text) if use.of.file == file.path)
    return found


def definitions_of(file: Loaded, named: Named) -> tuple[Definition, ...]:
    """The definitions in a file, in its order, with the types that each one names."""
    return tuple(
        Definition(
            section[:-1],
            name,
            file.top[section][name].key,
            frozenset(named.get((section, name), ())),
        )
        for section in _SECTIONS
        for name in getattr(file.spec, section)
    )


def named_in_agents(named: Named, findings: Findings, file: Loaded) -> frozenset[str]:
    """The types and interfaces that agents and the plant name, e.g. `type Mode`.

    And the constants of arguments: descriptions get their values, without their names.
    """
    parts = [labels for route, labels in named.items() if route[0] not in _SECTIONS]
    constants = {
        f"constant {name}"
        for meaning in findings.meanings
        if meaning.where.route[2:3] == ("with",) and meaning.where.file == file.path
        for name in (constants_in(meaning.expr) if meaning.expr else ())
    }
    return frozenset(constants.union(*parts))


def _label(of: Place) -> str:
    return f"{str(of.route[0]).removesuffix('s')} {of.route[1]}"
