"""The `specc` command: parses arguments, hands them to a command, exits.

Exit codes: 0 clean; 1 the specification has errors, output is stale or the task was not
fulfilled; 2 wrong usage or a file that cannot be read or written; 70 a fault of specc itself;
130 interrupted; 141 the reader of the output went away; 143 a run ended by SIGTERM.
"""

import argparse
import gc
import os
import sys
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any

from specc import __version__
from specc.cli import interruption, streams
from specc.cli.ages import add_ages
from specc.cli.differing import add_diff
from specc.cli.importing import add_import
from specc.cli.witness import add_witness

FORMATS = ("text", "json", "sarif", "github", "junit")
UNWRITTEN, FAULT, BROKEN_PIPE = 2, 70, 141
_NEW_OBJECTS = 50_000
"""Of a command between two collections of garbage: nearly all that it makes stays to its end."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the arguments name (those of the process by default).

    Raises:
        SystemExit: the arguments are wrong, ask for help, or the runtime ended the process.
    """
    whole_process = arguments is None
    if whole_process:
        interruption.raise_again()
        gc.set_threshold(_NEW_OBJECTS)
    try:
        return _guarded(arguments)
    except KeyboardInterrupt:
        if whole_process:
            interruption.no_more()
        streams.say(interruption.MESSAGE)
        return interruption.INTERRUPTED
    finally:
        if whole_process:
            interruption.no_more()


def _guarded(arguments: Sequence[str] | None) -> int:
    """The exit code; faults become messages."""
    try:
        streams.prepare()
        code = _dispatch(_parsed(arguments))
        sys.stdout.flush()
        sys.stderr.flush()
    except BrokenPipeError:
        streams.abandon(sys.stdout)
        streams.abandon(sys.stderr)
        return BROKEN_PIPE
    except Exception as error:
        if interruption.is_behind(error):
            raise KeyboardInterrupt from None
        if "SPECC_TRACEBACK" in os.environ:
            raise
        if isinstance(error, OSError) and error.filename is None:
            streams.abandon(sys.stdout)
            streams.say(f"specc: the output cannot be written: {(error.strerror or '').lower()}")
            return UNWRITTEN
        streams.say(_fault(error))
        return FAULT
    return code


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    try:
        return _parser().parse_args(arguments)
    except SystemExit:
        sys.stdout.flush()
        raise


def _dispatch(options: argparse.Namespace) -> int:
    # `--version`, `--help` and usage errors need none of it.
    from specc.cli import commands

    return int(getattr(commands, options.command)(options))


def _fault(error: Exception) -> str:
    words = f"{type(error).__name__}: {error}".encode("unicode_escape").decode()
    return (
        f"specc: a fault of specc itself, not of your files: {words[:300]}\n"
        "specc: set SPECC_TRACEBACK=1 to see where, and please report it"
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="specc",
        description="Compiler of robot control specifications.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"specc {__version__}")
    commands = parser.add_subparsers(
        dest="command", metavar="COMMAND", required=True, parser_class=_Command
    )

    validate = commands.add_parser("validate", help="report what is wrong with specifications")
    validate.add_argument(
        "specs", metavar="SPEC", nargs="+", help="file, directory, or pattern such as 'specs/**'"
    )
    validate.add_argument("--fix", action="store_true", help="make the repairs that are safe")
    _add_policy(validate)
    _add_format(validate)

    build = commands.add_parser("build", help="generate code from specifications")
    build.add_argument("specs", metavar="SPEC", nargs="+")
    build.add_argument(
        "--out",
        metavar="DIR",
        default="generated",
        help="directory for the output, a directory per system",
    )
    build.add_argument(
        "--check", action="store_true", help="compare only; exit code 1 if not up to date"
    )
    _add_policy(build)
    _add_format(build)

    run = commands.add_parser("run", help="simulate a specification")
    _add_policy(run)
    run.late = _add_run

    fmt = commands.add_parser("fmt", help="put specifications into the canonical layout")
    fmt.add_argument("files", metavar="FILE", nargs="+", help="file, directory or pattern")
    fmt.add_argument(
        "--check", action="store_true", help="write nothing; exit code 1 if a file would change"
    )
    fmt.add_argument("--diff", action="store_true", help="print what would change, write nothing")

    status = commands.add_parser("status", help="show which steps of the design are done")
    status.add_argument("spec", metavar="SPEC")
    status.add_argument("--format", choices=("text", "json"), default="text")

    init = commands.add_parser("init", help="start a specification that runs at once")
    init.add_argument(
        "directory",
        metavar="DIRECTORY",
        nargs="?",
        default=".",
        help="directory for the files, created if it does not exist (default: here)",
    )
    init.add_argument(
        "--skeleton", metavar="NAME", default="joint", help="joint (default), sense-act, two-agents"
    )

    explain = commands.add_parser("explain", help="say what a code of a diagnostic means")
    explain.add_argument("code", metavar="CODE", nargs="?", help="without it, all codes are listed")

    add_ages(commands)
    add_diff(commands)
    add_witness(commands)
    add_import(commands)

    commands.add_parser("schema", help="print the JSON Schema of specifications")
    lsp = commands.add_parser("lsp", help="serve an editor: the Language Server Protocol")
    lsp.add_argument(
        "--stdio",
        action="store_true",
        help="accepted; the server always uses standard input and output",
    )
    return parser


def _add_format(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--format",
        choices=FORMATS,
        default="text",
        help="text goes to standard error, the others to standard output",
    )


def _add_policy(parser: argparse.ArgumentParser) -> None:
    """Options that stand in place of what `[tool.specc]` of pyproject.toml says."""
    codes = "codes or their beginnings, separated by commas"
    parser.add_argument(
        "--select", metavar="CODES", type=_codes, help=f"warn of these only: {codes}"
    )
    parser.add_argument(
        "--ignore", metavar="CODES", type=_warnings, help=f"do not warn of: {codes}"
    )
    parser.add_argument(
        "--strict",
        action=argparse.BooleanOptionalAction,
        help="count warnings and open points as errors",
    )


def _add_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("spec", metavar="SPEC")
    parser.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action=_Values,
        default={},
        help="take this value for a constant; may be repeated",
    )
    try:
        import_module("specc_runtime.options").add_arguments(parser)
    except ModuleNotFoundError:
        parser.error("the runtime (package specc_runtime) is not installed")


class _Command(argparse.ArgumentParser):
    """A command whose options are known only once it is chosen."""

    late: Callable[[argparse.ArgumentParser], None] | None = None

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        if late := self.late:
            self.late = None
            late(self)
        return super().parse_known_args(args, namespace)


class _Values(argparse.Action):
    """Collects `name=value`, each name once."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        name, sign, text = (part.strip() for part in str(values).partition("="))
        known = getattr(namespace, self.dest)
        if not (name and sign):
            raise argparse.ArgumentError(self, f"{values!r} is not `name=value`")
        if name in known:
            raise argparse.ArgumentError(self, f"`{name}` is given twice")
        setattr(namespace, self.dest, known | {name: text})


def _codes(text: str) -> tuple[str, ...]:
    from specc.policy.settings import code_fault

    codes = tuple(code.strip() for code in text.split(","))
    for code in codes:
        if fault := code_fault(code):
            raise argparse.ArgumentTypeError(fault)
    return codes


def _warnings(text: str) -> tuple[str, ...]:
    codes = _codes(text)
    for code in codes:
        if not code.startswith("W"):
            raise argparse.ArgumentTypeError(f"{code} is not a warning and cannot be ignored")
    return codes
