"""`specc witness`: writing tests that run into the errors found."""

from __future__ import annotations

import os
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from specc.atomic_files import temporary_folder
from specc.cli import streams
from specc.diagnostics.nearest import suggestion
from specc.refusal import Refused, missing_package, reason_of

if TYPE_CHECKING:
    from specc.model.system import System
    from specc.pipeline import Result
    from specc.tools.witness.code import Script
    from specc.tools.witness.subject import Refutation


def run_witness(options: Namespace) -> int:
    """Write tests; 0 if there is no such error, 1 if there is one, 2 for wrong usage."""
    from specc import pipeline

    try:
        # These step generated code.
        from specc.tools.witness.code import SubsystemCode
        from specc.tools.witness.plan import plan_script
        from specc.tools.witness.subject import refutations
    except ModuleNotFoundError as error:
        raise missing_package(error) from error
    result = pipeline.compile_spec(options.spec)
    if result.system is None:
        return streams.print_findings(result, options.spec)
    _refuse_unknown(options, result.system)
    facts = result.proofs
    every = list(refutations(facts))
    chosen = [
        item
        for item in every
        if options.code in (None, item.code, item.code.lower())
        and options.subsystem in (None, item.subsystem)
        and options.state in (None, item.state)
    ]
    if not chosen:
        message = _nothing_found(every, result)
        streams.print_message(f"specc: {options.spec}: {message}")
        return 0
    codes = []
    with temporary_folder() as scratch:
        generated: dict[str, SubsystemCode] = {}
        for item in chosen:
            name = item.subsystem
            if name not in generated:
                generated[name] = SubsystemCode(facts.system, name, Path(scratch, name))
            codes.append(_write(item, plan_script(generated[name], facts, item), options))
    return max(codes)


def _refuse_unknown(options: Namespace, system: System) -> None:
    """Raise Refused if a name in the options is not known."""
    from specc.tools.witness.subject import CODES

    subsystems = {s.qualified_name: s for s in system.subsystems}
    chosen = [s for name, s in subsystems.items() if options.subsystem in (None, name)]
    states = {state.name: None for s in chosen for state in s.states}
    code = options.code and options.code.upper()
    for what, name, known, is_known in (
        ("code that a run can show is", options.code, CODES, code in CODES),
        ("subsystem is", options.subsystem, subsystems, bool(chosen)),
        ("state is", options.state, states, options.state in states),
    ):
        if name is not None and not is_known:
            raise Refused(f"no {what} called {name!r}; {suggestion(name, known)}")


def _nothing_found(every: Sequence[Refutation], result: Result) -> str:
    if every:
        first = every[0]
        state = f", state {first.state}" if first.state else ""
        more = f" and {len(every) - 1} more" if len(every) > 1 else ""
        return (
            "no error that a run can show is left by `--code`, `--subsystem` and `--state`; "
            f"without these there is {first.code} in {first.subsystem}{state}{more}"
        )
    has_errors = any(finding.severity == "error" for finding in result.diagnostics)
    hint = "; `specc validate` reports errors of other kinds" if has_errors else ""
    return f"there is no error that a run can show{hint}"


def _write(item: Refutation, script: Script | None, options: Namespace) -> int:
    from specc.emit import FormatError
    from specc.tools.witness.text import ForeignFileError, file_name, scenario, write_scenario

    where = f"{item.code}: {item.subsystem}: {item.words}"
    if script is None:
        message = f"{where}: no values were found with which a run shows this"
        streams.print_message(f"specc: {message}")
        return 1
    path, code = Path(options.out, file_name(item)), streams.USAGE_ERROR
    try:
        spec = os.path.relpath(os.path.realpath(options.spec), os.path.realpath(path.parent))
        write_scenario(path, scenario(item, script, spec))
        message, code = f"wrote {path}: {where}", 1
    except ForeignFileError:
        message = f"{path} is not a test for this specification and is left as it is; see `--out`"
    except FormatError as error:
        message = str(error)
    except OSError as error:
        message = f"{path} cannot be written: {reason_of(error)}"
    streams.print_message(f"specc: {message}")
    return code
