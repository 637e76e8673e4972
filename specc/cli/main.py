"""The `specc` command: parses arguments, hands them to a command, exits.

Exit codes: 0 clean; 1 the specification has errors, output is stale or the task was not
fulfilled; 2 wrong usage or a file that cannot be read or written; 70 a fault of specc itself;
130 interrupted, 143 by SIGTERM, 129 by SIGHUP; 141 the reader of the output went away.
"""

import gc
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from specc.cli import interruption, streams
from specc.cli.arguments import complete, parser
from specc.refusal import Refused, reason_of

FAULT, BROKEN_PIPE = 70, 141
_NEW_OBJECTS = 100_000
"""Of a command between two collections of garbage: nearly all that it makes stays to its end."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the arguments name (those of the process by default).

    Raises:
        SystemExit: the arguments are wrong, ask for help, or the runtime ended the process.
    """
    whole_process, code = arguments is None, FAULT
    try:
        try:
            if whole_process:
                interruption.install_handlers()
                gc.set_threshold(_NEW_OBJECTS)
            code = _guarded(arguments)
            return code
        finally:
            # No call: Python lets handlers run when one begins.
            interruption.is_finished = whole_process
    except KeyboardInterrupt:
        streams.print_message(interruption.MESSAGE)
        code = interruption.exit_code()
        return code
    finally:
        if whole_process:
            interruption.ignore_signals()
            # Python collects garbage once more at exit: an eighth of the time of a command.
            gc.freeze()
            # A run may have left threads behind, for which Python would wait.
            runtime = sys.modules.get("specc_runtime.main")
            if runtime is not None and runtime.has_threads:
                import_module("specc_runtime.leftovers").leave(code)


def _guarded(arguments: Sequence[str] | None) -> int:
    """The exit code; faults become messages."""
    try:
        streams.prepare()
        code = _run(arguments)
        sys.stdout.flush()
        sys.stderr.flush()
        return code
    except BrokenPipeError:
        streams.discard_buffer(sys.stdout)
        streams.discard_buffer(sys.stderr)
        return BROKEN_PIPE
    except Exception as error:
        if interruption.is_caused_by_interrupt(error):
            raise KeyboardInterrupt from None
        if "SPECC_TRACEBACK" in os.environ:
            raise
        if isinstance(error, OSError) and error.filename is None:
            streams.discard_buffer(sys.stdout)
            if interruption.is_interrupted():  # the terminal is gone that has ended the command
                return interruption.exit_code()
            reason = reason_of(error)
            streams.print_message(f"specc: the output cannot be written: {reason}")
            return streams.USAGE_ERROR
        words = f"{type(error).__name__}: {error}".encode("unicode_escape").decode()
        streams.print_message(
            f"specc: a fault of specc itself, not of your files: {words[:300]}\n"
            "specc: set SPECC_TRACEBACK=1 to see where, and please report it"
        )
        return FAULT


def _run(arguments: Sequence[str] | None) -> int:
    top = parser()
    complete(top)
    try:
        options = top.parse_args(arguments)
    except SystemExit:
        sys.stdout.flush()
        raise
    # What a command needs is imported when it is chosen; `--help` and usage errors need none of it.
    module, _, function = options.run.partition(":")
    try:
        return int(getattr(import_module(f"specc.cli.{module}"), function)(options))
    except Refused as refused:
        streams.print_message(f"specc: {refused}")
        return streams.USAGE_ERROR
