"""`specc witness`: writing tests that run into the errors found."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from specc.atomic_files import temporary_folder
from specc.cli import streams
from specc.diagnostics.nearest import suggestion
from specc.refusal import Refused, missing_package, reason_of

if TYPE_CHECKING:
    from specc.pipeline import Result
    from specc.tools.witness.code import Script
    from specc.tools.witness.subject import Refutation


def run_witness(options: argparse.Namespace) -> int:
    """Write tests; 0 if there is no such error, 1 if there is one, 2 for wrong usage."""
    from specc import pipeline

    try:
        import_module("specc.tools.witness")  # steps generated code
    except ModuleNotFoundError as error:
        raise missing_package(error) from error
    result = pipeline.compile_spec(options.spec)
    if result.system is None:
        return streams.print_findings(result, options.spec)
    if fault := _unknown(options, result):
        raise Refused(fault)
    return _write_all(options, result)


def _write_all(options: argparse.Namespace, result: Result) -> int:
    from specc.tools.witness.code import SubsystemCode
    from specc.tools.witness.plan import plan_script
    from specc.tools.witness.subject import refutations

    facts = result.proofs
    every = list(refutations(facts))
    found = [item for item in every if _is_asked(item, options)]
    if every and not found:
        first = every[0]
        state = f", state {first.state}" if first.state else ""
        more = f" and {len(every) - 1} more" if len(every) > 1 else ""
        return _say(
            f"{options.spec}: no error that a run can show is left by `--code`, `--subsystem` and "
            f"`--state`; without these there is {first.code} in {first.subsystem}{state}{more}",
            0,
        )
    if not found:
        others = sum(1 for finding in result.diagnostics if finding.severity == "error")
        hint = "; `specc validate` reports errors of other kinds" if others else ""
        return _say(f"{options.spec}: there is no error that a run can show{hint}", 0)
    codes = []
    with temporary_folder() as scratch:
        generated: dict[str, SubsystemCode] = {}
        for item in found:
            name = item.subsystem
            if name not in generated:
                generated[name] = SubsystemCode(facts.system, name, Path(scratch, name))
            codes.append(_write(item, plan_script(generated[name], facts, item), options))
    return max(codes)


def _write(item: Refutation, script: Script | None, options: argparse.Namespace) -> int:
    from specc.emit import FormatError
    from specc.tools.witness.text import ForeignFileError, file_name, put, scenario

    where = f"{item.code}: {item.subsystem}: {item.words}"
    if script is None:
        return _say(f"{where}: no values were found with which a run shows this", 1)
    path = Path(options.out, file_name(item))
    try:
        spec = os.path.relpath(os.path.realpath(options.spec), os.path.realpath(path.parent))
        put(path, scenario(item, script, spec))
    except ForeignFileError:
        return streams.print_refusal(
            f"{path} is not a test for this specification and is left as it is; see `--out`"
        )
    except FormatError as error:
        return streams.print_refusal(error)
    except OSError as error:
        return streams.print_refusal(f"{path} cannot be written: {reason_of(error)}")
    return _say(f"wrote {path}: {where}", 1)


def _unknown(options: argparse.Namespace, result: Result) -> str:
    """What is wrong with the names in the options; empty if nothing is."""
    from specc.tools.witness.subject import CODES

    assert result.system is not None
    subsystems = [
        s for s in result.system.subsystems if options.subsystem in (None, s.qualified_name)
    ]
    if options.code is not None and options.code.upper() not in CODES:
        return _no("code that a run can show is", options.code, CODES)
    if options.subsystem is not None and not subsystems:
        names = (s.qualified_name for s in result.system.subsystems)
        return _no("subsystem is", options.subsystem, names)
    states = {state.name: None for s in subsystems for state in s.states}
    if options.state is not None and options.state not in states:
        return _no("state is", options.state, states)
    return ""


def _no(what: str, name: str, known: Iterable[str]) -> str:
    return f"no {what} called {name!r}; {suggestion(name, known)}"


def _is_asked(item: Refutation, options: argparse.Namespace) -> bool:
    return (
        options.code in (None, item.code, item.code.lower())
        and options.subsystem in (None, item.subsystem)
        and options.state in (None, item.state)
    )


def _say(words: str, code: int) -> int:
    streams.print_message(f"specc: {words}")
    return code
