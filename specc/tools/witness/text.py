"""Scripts as tests, written where they belong."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from textwrap import wrap
from zlib import crc32

from specc import atomic_files
from specc.emit import emit
from specc.lang.values import literal_of
from specc.lower import FilePlan
from specc.tools.witness.code import Periods, Placed, Script, ScriptValues, input_text
from specc.tools.witness.subject import Refutation

# A script as the text of a test.


MARK = "# Written by `specc witness`. It replaces this file only while this line is in it."
_HELPERS = ("Fields", "Token", "Trial", "translation")
_WIDTH = 92


def file_name(refutation: Refutation) -> str:
    """The file of a test; a refutation always has the same one."""
    return f"test_{_identifier(refutation)}.py"


def scenario(refutation: Refutation, script: Script, spec: str) -> str:
    """The text of a test; `spec` is the path of the specification from its directory.

    Raises:
        FormatError: the formatter is missing.
    """
    lines = tuple(_lines(refutation, script))
    used = " ".join(line for line in lines if not line.startswith("#"))
    ended = f", ended by its {refutation.cause} condition" if refutation.cause else ""
    about = f"{refutation.code} in {refutation.subsystem}, state {refutation.state}{ended}."
    parts = {
        "mark": MARK,
        "title": _docstring_text(about),
        "about": tuple(map(_docstring_text, _about(refutation, script))),
        "imports": ", ".join(name for name in _HELPERS if name == "Trial" or f"{name}(" in used),
        "spec": repr(spec.replace(os.sep, "/")),
        "name": f"test_{_identifier(refutation)}",
        "subsystem": repr(refutation.subsystem),
        "lines": lines,
    }
    return emit({"scenario.py": FilePlan("scenario.py.j2", parts)})["scenario.py"]


def _identifier(refutation: Refutation) -> str:
    """Names with two underscores between them; names that have such themselves get a number."""
    about = (refutation.cause or "", *(refutation.absent or ()))
    whole = ".".join((refutation.subsystem, refutation.state, *filter(None, about)))
    unclear = any("__" in f"_{name}_" for name in whole.split("."))
    number = f"__{crc32(whole.encode()):08x}" if unclear else ""
    return f"{whole.replace('.', '__')}__{refutation.code}{number}"


def _about(refutation: Refutation, script: Script) -> Iterator[str]:
    words = refutation.words[0].upper() + refutation.words[1:]
    yield from wrap(f"{words}.", _WIDTH)
    yield "This test fails until the specification is repaired, and passes from then on."
    if script.answers:
        names = ", ".join(dict.fromkeys(name for name, _, _ in script.answers))
        yield ""
        yield from wrap(
            f"It depends on operators. Proofs know only that they return the same value for the "
            f"same arguments: {names}.",
            _WIDTH,
        )


def _lines(refutation: Refutation, script: Script) -> Iterator[str]:
    for operator, args, result in script.answers:
        given = [repr(operator), *map(literal_of, args), f"gives={literal_of(result)}"]
        yield f"trial.operator({', '.join(given)})"
    for step in script.steps:
        into = [repr(step.into), *_inputs(step)]
        if step.periods != 1:
            into.append(f"periods={step.periods}")
        yield f"# {_comment_text(step.way)}"
        yield f"trial.step({', '.join(into)})"
    if script.placed is not None:
        yield from _place(script.placed)
    ended = f"{refutation.state} {refutation.cause} "
    rows = " and ".join(row.removeprefix(ended) for row in script.rows) or "none"
    last = f"{refutation.cause} condition holds; rows that apply: {rows}"
    if refutation.absent is not None:
        last = f"{input_text(refutation.absent)} has not arrived, and is read"
    yield from (f"# {line}" for line in wrap(_comment_text(last), _WIDTH))
    yield f"trial.decide({', '.join(_inputs(script.last))})"


def _place(placed: Placed) -> Iterator[str]:
    arguments = []
    if placed.state is not None:
        arguments.append(f"state={placed.state!r}")
        yield "# No inputs were found that lead to this state, so it is set directly."
    else:
        yield "# No inputs were found that lead to these values, so they are set directly."
    if placed.memory:
        arguments.append(f"memory={_values_text(placed.memory)}")
    if placed.periods is not None:
        arguments.append(f"periods={placed.periods}")
    yield f"trial.place({', '.join(arguments)})"


def _inputs(step: Periods) -> Iterator[str]:
    if step.arrives:
        yield f"arrives={_values_text(step.arrives)}"
    if step.stale:
        yield f"there={_values_text(step.stale)}"
    if step.absent:
        yield f"absent={list(step.absent)!r}"


def _values_text(values: ScriptValues) -> str:
    return f"{{{', '.join(f'{name!r}: {literal_of(value)}' for name, value in values.items())}}}"


def _docstring_text(text: str) -> str:
    """A text for the inside of a docstring."""
    return text.replace("\\", "\\\\").replace('"', "'")


def _comment_text(text: str) -> str:
    """A text for a comment of one line, without instructions to linters."""
    return " ".join(text.replace("#", "").split())


# Writing scenarios: one file for each, never over a file that somebody else wrote.


class ForeignFileError(Exception):
    """There is a file that was not written of this specification; the message names it."""


def write_scenario(path: Path, text: str) -> None:
    """Write the text of a scenario, whole or not at all.

    Raises:
        ForeignFileError: what is there is not a scenario of the same specification.
        OSError: the system refuses.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    if os.path.lexists(path):
        old = path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""
        if not old.startswith(f"{MARK}\n") or _specification(old) != _specification(text):
            raise ForeignFileError(str(path))
    atomic_files.write_atomically(path, text)


def _specification(text: str) -> str:
    """The statement of a scenario that names its specification."""
    return text.partition("\nSPEC = ")[2].partition("\n\n")[0]
