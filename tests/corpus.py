"""Every specification that stands in the tree, and the laws that hold for each of them.

A file is read and compiled once for all laws. A law raises an AssertionError, and its name stands
in the traceback; what is not told of a file that has no meaning, it does not ask.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

import jsonschema

from specc import pipeline
from specc.pipeline import Result, read_spec
from specc.read import Document, read_file
from specc.schema.files import json_schema
from specc.tools.diff import compare
from tests.compiled import anew
from tests.tools.fmt.layout import keeps_what_is_written
from tests.tools.graph import laws
from tests.witness.shown import refuted_of, shown

ROOT = Path(__file__).resolve().parents[1]
CASES = sorted((ROOT / "tests/cases").glob("*/*.yaml"))
SPECS = sorted(ROOT.glob("specs/**/*.yaml"))


class Subject:
    """A specification by the name that it is given in its folder, read and compiled once."""

    def __init__(self, name: str) -> None:
        self.name = name

    @cached_property
    def document(self) -> Document:
        return read_file(self.name)

    @cached_property
    def result(self) -> Result:
        with anew():  # it is asked for once, and proofs are large
            return pipeline.compile_spec(self.name)

    @property
    def is_sound(self) -> bool:
        """Whether it is a system that no check calls wrong."""
        found = self.result.diagnostics
        return self.result.system is not None and all(d.severity != "error" for d in found)


def layout_keeps_data_and_comments(subject: Subject) -> None:
    """The formatter changes no data and no comment, and its layout is its own layout."""
    if subject.document.ok:
        keeps_what_is_written(subject.document.source.text)


def the_schema_accepts_what_compiles(subject: Subject) -> None:
    if subject.is_sound:
        assert not [error.message for error in _schema().iter_errors(subject.document.data)]


@cache
def _schema() -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(json_schema())


def nothing_differs_from_itself(subject: Subject) -> None:
    """Read again, the system is the one that was compiled."""
    if subject.is_sound:
        again = read_spec(subject.name).system
        assert again is not None and subject.result.system is not None
        assert compare(subject.result.system, again).changes == ()


def examples_show_what_is_found(subject: Subject) -> None:
    """The values in messages about rows, evaluated, give no row or the rows that are named."""
    if subject.result.proofs is not None:
        for refutation in refuted_of(subject.result.proofs):
            shown(*refutation)


def a_run_is_planned_to_each_error(subject: Subject) -> None:
    """No specification is too odd for `specc witness`."""
    from specc.tools.witness.code import SubsystemCode
    from specc.tools.witness.plan import plan_script
    from specc.tools.witness.subject import refutations

    facts = subject.result.proofs
    for refutation in refutations(facts) if facts is not None else ():
        with TemporaryDirectory() as scratch:
            plan_script(
                SubsystemCode(facts.system, refutation.subsystem, Path(scratch)), facts, refutation
            )


def every_part_is_in_one_picture(subject: Subject) -> None:
    """What is known of a specification can be drawn, also of one with errors."""
    if subject.result.system is not None:
        laws.every_part_is_drawn_once(subject.result.system)


Law = Callable[[Subject], None]
LAWS: tuple[Law, ...] = (
    every_part_is_in_one_picture,
    layout_keeps_data_and_comments,
    the_schema_accepts_what_compiles,
    nothing_differs_from_itself,
    examples_show_what_is_found,
    a_run_is_planned_to_each_error,
)
