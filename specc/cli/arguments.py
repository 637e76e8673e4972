"""The command line of `specc`: commands, one row each, with their options, help and completion."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from importlib import import_module
from itertools import starmap
from math import inf
from pathlib import Path

from specc import __version__
from specc.cli import streams
from specc.cli.parsing import (
    CollectValues,
    Parser,
    code_list,
    connection,
    formula,
    number_between,
    recording_time,
    warning_list,
)

# The options of each command.


def _add_format(command: Parser, name: str, help: str | None = None) -> None:
    formats = streams.FORMATS[name]
    default = formats[0] if "text" in formats else None
    command.add_argument("--format", choices=formats, default=default, help=help)


def _add_report(command: Parser) -> None:
    _add_policy(command)
    _add_format(command, "validate", "text goes to standard error, the others to standard output")


def _validate(command: Parser) -> None:
    add = command.add_argument
    add("specs", metavar="SPEC", nargs="+", help="file, directory, or pattern such as 'specs/**'")
    add("--fix", action="store_true", help="make the repairs that are safe")
    _add_report(command)


def _build(command: Parser) -> None:
    add = command.add_argument
    add("specs", metavar="SPEC", nargs="+")
    place = command.add_mutually_exclusive_group()
    place.add_argument(
        "--out",
        metavar="DIR",
        help="directory for the output, a directory per system (default: generated beside the "
        "nearest pyproject.toml above the specification, else beside the specification)",
    )
    words = "make this directory a package of ROS 2, which colcon builds and ros2 launch starts"
    place.add_argument("--ament", metavar="DIR", help=words)
    add("--check", action="store_true", help="compare only; exit code 1 if not up to date")
    add("--real-time", action="store_true", help="test rows that are proved, for runs in real time")
    _add_report(command)


def _fmt(command: Parser) -> None:
    add = command.add_argument
    add("files", metavar="FILE", nargs="+", help="file, directory or pattern")
    add("--check", action="store_true", help="write nothing; exit code 1 if a file would change")
    add("--upgrade", action="store_true", help="write older forms in the newest ones")
    add("--diff", action="store_true", help="print what would change, write nothing")


def _spec_and_format(command: Parser) -> None:
    command.add_argument("spec", metavar="SPEC")
    _add_format(command, "status")


def _init(command: Parser) -> None:
    add = command.add_argument
    words = "directory for the files, created if it does not exist (default: here)"
    add("directory", metavar="DIRECTORY", nargs="?", default=".", help=words)
    start = command.add_mutually_exclusive_group()
    words = "joint (default), arm, sense-act, two-agents"
    start.add_argument("--skeleton", metavar="NAME", help=words)
    words = "start from this MuJoCo model instead: an agent that holds its pose"
    start.add_argument("--model", metavar="FILE.xml", help=words)
    words = "start from what ROS 2 has here: an agent that looks on (NAME: robot if left out)"
    start.add_argument("--ros2", metavar="NAME|FILE.yaml", nargs="?", const="robot", help=words)
    words = "name of the agent; with a model, DIRECTORY may be a specification that gets it"
    add("--agent", metavar="NAME", help=words)
    words = "of a model: one effector for these, `arm=joint1..joint7`; may be repeated"
    add("--group", metavar="NAME=JOINTS", action=CollectValues, default={}, help=words)
    words = "of a model outside: copy files that it uses from this folder, too; may be repeated"
    add("--assets", metavar="FOLDER", action="append", default=[], help=words)
    add("--python", metavar="FILE", help="of ROS 2: the Python that finds rclpy (default: python3)")
    words = "of ROS 2: how long to look, in seconds (default: 2)"
    add("--wait", metavar="S", type=number_between(float, 0.1, 600), help=words)


def _explore(command: Parser) -> None:
    add = command.add_argument
    _spec_and_format(command)
    words = "of single machines, in all ways that are followed (default: 700000)"
    steps = number_between(int, 1, 99_999_999)
    add("--budget", metavar="STEPS", type=steps, default=700_000, help=words)
    words = "treat this memory as unknown: irp.m.tries; may be repeated"
    add("--forget", metavar="NAME", default=[], action="append", help=words)
    words = "directory for recordings of what was found, which `specc replay` runs"
    add("--traces", metavar="DIR", help=words)
    _add_policy(command)


def _diff(command: Parser) -> None:
    add = command.add_argument
    add("old", metavar="OLD")
    add("new", metavar="NEW")
    _add_format(command, "diff")


def _witness(command: Parser) -> None:
    add = command.add_argument
    add("spec", metavar="SPEC")
    add("--code", metavar="CODE", help="findings with this code only")
    add("--subsystem", metavar="NAME", help="of this subsystem only: irp.m")
    add("--state", metavar="NAME", help="of this state only")
    words = "directory for the tests, a file per finding"
    add("--out", metavar="DIR", default="witnesses", help=words)


def _fabric(command: Parser) -> None:
    add = command.add_argument
    add("files", metavar="FILE.xml", nargs="+")
    words = "buffer b of subsystem A is connected with buffer d of subsystem C"
    add("--connect", metavar="A.b=C.d", type=connection, action="append", default=[], help=words)
    _add_import(command)


def _scxml(command: Parser) -> None:
    command.add_argument("files", metavar="FILE.scxml", nargs=1)
    _add_import(command)


def _add_import(command: Parser) -> None:
    add = command.add_argument
    add("--name", metavar="NAME", default="", help="name of the system")
    add(
        "--period", metavar="S", type=number_between(Fraction, 1e-7, 3600), help="period in seconds"
    )
    add("--out", metavar="FILE.yaml", help="file to write (default: standard output)")
    _add_force(command)


def _add_force(command: Parser) -> None:
    command.add_argument("--force", action="store_true", help="replace the file of --out")


def _add_spec(command: Parser) -> None:
    words = "the specification, which is never taken from the file"
    command.add_argument("--spec", metavar="SPEC", help=words)


def _replay(command: Parser) -> None:
    add = command.add_argument
    add("file", metavar="FILE.mcap", help="the recording; with --bag, the specification")
    _add_spec(command)
    add("--subsystem", metavar="NAME", help="this subsystem only: irp.m")
    seconds, words = number_between(float, 0, inf), "simulated time to compare"
    add("--until", metavar="S", type=seconds, default=inf, help=words)
    add("--check", action="store_true", help="exit code 1 also if something cannot be compared")
    words = "run the specification on this bag of ROS 2, a folder or a file, and print its states"
    add("--bag", metavar="BAG", type=Path, help=words)
    words = "with --bag: record every step"
    add("--record", metavar="FILE.mcap", type=Path, help=words)
    words = "with --bag: take this value for a constant or for a parameter; may be repeated"
    add("--set", metavar="NAME=VALUE", action=CollectValues, default={}, help=words)
    words = "with --bag: the rest says how topics are called there, -r OLD:=NEW"
    add("--ros-args", nargs=argparse.REMAINDER, default=(), help=words)


def _why(command: Parser) -> None:
    add = command.add_argument
    add("moment", metavar="FILE.mcap@S", type=recording_time)
    words = "all about this one: irp.m (default: a line for each)"
    add("subsystem", metavar="SUBSYSTEM", nargs="?", help=words)
    _add_spec(command)


def _coverage(command: Parser) -> None:
    add = command.add_argument
    words = "recordings of one specification, or a folder with them"
    add("files", metavar="FILE.mcap", nargs="+", help=words)
    words = "the specification, of which `specc explore` says which rows can be taken"
    add("--spec", metavar="SPEC", help=words)
    words = "steps of exploring for rows that no run takes, 0 for none (default: 100000)"
    steps = number_between(int, 0, 99_999_999)
    add("--budget", metavar="STEPS", type=steps, default=100_000, help=words)
    words = "exit code 1 if less than this percentage is covered"
    percent = number_between(float, 0, 100, "a percentage")
    add("--fail-under", metavar="PERCENT", type=percent, help=words)
    _add_format(command, "coverage")


def _view(command: Parser) -> None:
    add = command.add_argument
    add("file", metavar="FILE.mcap", type=Path)
    _add_spec(command)
    words = "port of the page on this machine (default: one that is free)"
    add("--port", metavar="N", type=number_between(int, 0, 65535), default=0, help=words)


def _report(command: Parser) -> None:
    add = command.add_argument
    words = "recordings, results.json of `specc test`, or the folder of a sweep"
    add("files", metavar="FILE.mcap", nargs="+", help=words)
    words = "show this signal: irp.m.x.c.T_d, plant.gap; may be repeated (default: the usual ones)"
    add("--signal", metavar="NAME", dest="signals", action="append", default=[], help=words)
    _add_spec(command)
    words = "file to write, .html (default: FILE-report.html in the working directory)"
    add("--out", metavar="FILE", help=words)
    _add_force(command)


def _recover(command: Parser) -> None:
    add = command.add_argument
    add("file", metavar="FILE.mcap")
    add("--out", metavar="FILE.mcap", help="file to write (default: in place of the old one)")


def _explain(command: Parser) -> None:
    command.add_argument("code", metavar="CODE", nargs="?", help="without it, all codes are listed")


def _lib(command: Parser) -> None:
    words = "a part, `pose_tracker` or `specc:pose_tracker`; without any, all are shown"
    command.add_argument("parts", metavar="PART", nargs="*", help=words)


def _lsp(command: Parser) -> None:
    words = "accepted; the server always uses standard input and output"
    command.add_argument("--stdio", action="store_true", help=words)


def _completion(command: Parser) -> None:
    shells = ("bash", "zsh", "fish")
    command.add_argument("shell", metavar="SHELL", choices=shells, help=", ".join(shells))


def _add_policy(command: Parser) -> None:
    """Options that stand in place of what `[tool.specc]` of pyproject.toml says."""
    add = command.add_argument
    words = "codes or their beginnings, separated by commas"
    add("--select", metavar="CODES", type=code_list, help=f"warn of these only: {words}")
    add("--ignore", metavar="CODES", type=warning_list, help=f"do not warn of: {words}")
    words, yes_or_no = "count warnings and open points as errors", argparse.BooleanOptionalAction
    add("--strict", action=yes_or_no, help=words)


def _graph(command: Parser) -> None:
    from specc.tools.graph import FORMATS

    add = command.add_argument
    add("spec", metavar="SPEC")
    words = "agent, subsystem, function or behaviour: irp, irp.m, irp.m.p2p (default: the system)"
    add("place", metavar="PLACE", nargs="?", default="", help=words)
    words = "structure of a system or agent, states of a subsystem, flow of a function by default"
    add("--of", choices=("structure", "inside", "states", "frames", "flow"), help=words)
    texts = " and ".join(name for name, form in FORMATS.items() if form.is_text)
    words = f"{next(iter(FORMATS))} by default, or what the name of the file says; "
    add("--format", choices=tuple(FORMATS), help=f"{words}{texts} goes to standard output")
    words = "file to write (default: SPEC-PLACE-KIND.FORMAT in the working directory)"
    add("--out", metavar="FILE", help=words)
    _add_force(command)


def _doc(command: Parser) -> None:
    add = command.add_argument
    add("spec", metavar="SPEC")
    words = "folder for the files SYSTEM.html and SYSTEM.pdf (default: SYSTEM-doc)"
    add("--out", metavar="DIR", help=words)
    words = "tables of what differs from a publication: where, what is wrong, what was chosen"
    add("--departures", metavar="FILE.md", help=words)


def _plot(command: Parser) -> None:
    add = command.add_argument
    add("file", metavar="FILE.mcap")
    words = (
        "irp.m.x.c.T_d, irp.m.q_p[2], plant.gap; irp.m is the state of a machine; A,B stand in one "
        "panel; FILE.mcap is a further recording (default: the states of all machines)"
    )
    add("signals", metavar="SIGNAL", nargs="*", help=words)
    seconds = number_between(float, 0, inf)
    words = "simulated time from which on it is drawn"
    add("--since", metavar="S", type=seconds, default=0.0, help=words)
    words = "simulated time until which it is drawn"
    add("--until", metavar="S", type=seconds, default=inf, help=words)
    words = "file to write: .svg, .png, .pdf or .csv (default: FILE-plot.svg, FILE-timeline.svg)"
    add("--out", metavar="FILE", help=words)
    words = "the numbers as a table, on standard output without --out"
    add("--csv", action="store_true", help=words)
    _add_force(command)


def _run(command: Parser) -> None:
    add = command.add_argument
    add("spec", metavar="SPEC")
    words = "take this value for a constant or for a parameter, `arm.hand.force`; may be repeated"
    add("--set", metavar="NAME=VALUE", action=CollectValues, default={}, help=words)
    words = "make a run of this scenario of the specification, as `specc test` does"
    add("--scenario", metavar="NAME", help=words)
    _add_policy(command)
    _add_stop(command)
    words = "let others in ROS watch this: `irp.m`, `irp.m.y.c.T_c`, `diagnostics`; may be repeated"
    add("--publish", metavar="NAME", action="append", default=[], help=words)
    words = (
        "show the run in a page of this machine, --ui=PORT at that port; not faster than --speed 1"
    )
    add("--ui", metavar="PORT", type=number_between(int, 0, 65535), help=words)
    command.alone = {"--ui": "--ui=0"}
    _add_from_runtime(command, "add_arguments")


def _test(command: Parser) -> None:
    add = command.add_argument
    add("specs", metavar="SPEC", nargs="+", help="file, directory or pattern")
    words = "only scenarios with this text in their names; may be repeated"
    add("-k", metavar="TEXT", dest="names", action="append", default=[], help=words)
    add("--fail-fast", action="store_true", help="end once a scenario fails, whatever is left")
    words = "only the scenarios that did not pass the last time; all if there are none"
    add("--last-failed", action="store_true", help=words)
    words = "runs at once (default: one for each core)"
    add("--jobs", metavar="N", type=number_between(int, 1, 9999), help=words)
    words = "wall time after which a run is ended (default: %(default)g s)"
    add("--limit", metavar="S", type=number_between(float, 1e-3, 1e7), default=600.0, help=words)
    words = "steps of the exploration; 0 for none (default: %(default)s)"
    steps = number_between(int, 0, 99_999_999)
    add("--budget", metavar="STEPS", type=steps, default=200_000, help=words)
    words = "failures of a scenario that are recorded (default: %(default)s)"
    add("--recordings", metavar="N", type=number_between(int, 0, 9999), default=10, help=words)
    words = "folder for results and recordings (default: specc-test, if something fails)"
    add("--out", metavar="DIR", help=words)
    add("--junit", metavar="FILE.xml", help="write the results as JUnit's XML, too")
    _add_policy(command)


def _sweep(command: Parser) -> None:
    add = command.add_argument
    add("spec", metavar="SPEC")
    words = "values of a constant or parameter: FROM:TO:COUNT, or A,B,C; may be repeated"
    add("--set", metavar="NAME=VALUES", action=CollectValues, default={}, help=words)
    words = "FROM:TO without TO, or A,B,C (default: %(default)s)"
    add("--seeds", metavar="SEEDS", default="0:10", help=words)
    words = "address of a Dask cluster (default: processes of this machine)"
    add("--scheduler", metavar="HOST:PORT", help=words)
    words = "runs at once on this machine (default: one for each core)"
    add("--workers", metavar="N", type=number_between(int, 1, 9999), help=words)
    words = "wall time after which a run is ended (default: %(default)g s)"
    add("--limit", metavar="S", type=number_between(float, 1e-3, 1e7), default=600.0, help=words)
    words = "folder for the table, to which later runs are added (default: sweeps/SPEC)"
    add("--out", metavar="DIR", help=words)
    _add_policy(command)
    _add_stop(command)
    _add_from_runtime(command, "add_extent")


def _add_stop(command: Parser) -> None:
    words = "end the run once this formula holds; exit code 1 if it never does"
    command.add_argument("--stop-when", metavar="FORMULA", type=formula, help=words)


def _add_from_runtime(command: Parser, function: str) -> None:
    try:
        getattr(import_module("specc_runtime.options"), function)(command)
    except ModuleNotFoundError:
        command.error("the runtime (package specc_runtime) is not installed")


@dataclass(frozen=True, slots=True)
class Command:
    """A command; its `handler` is a `module:function` of `specc.cli`, the rest as in `Parser`."""

    name: str
    handler: str
    help: str
    add_options: Callable[[Parser], None]
    is_mixed: bool = False


def _import(command: Parser) -> None:
    _add_commands(command, IMPORTERS, "specc import", "source", "FORMAT")


_IMPORT = "commands:run_import"
IMPORTERS = (
    Command("fabric", _IMPORT, "subsystem definitions of FABRIC", _fabric),
    Command("scxml", _IMPORT, "a state chart", _scxml),
)
COMMANDS = tuple(starmap(Command, (
    ("validate", "commands:validate", "report what is wrong with specifications", _validate),
    ("build", "commands:build", "generate code from specifications", _build),
    ("run", "run:run", "simulate a specification", _run),
    ("sweep", "sweep:sweep",
     "run a specification many times: over values of constants, and over seeds", _sweep),
    ("test", "test:run_test",
     "validate specifications, explore them and run their scenarios", _test),
    ("fmt", "commands:fmt", "put specifications into the canonical layout", _fmt),
    ("status", "show:status", "show which steps of the design are done", _spec_and_format),
    ("init", "init:init", "start a specification that runs at once", _init),
    ("lib", "commands:lib", "show the parts of the library: parameters, inputs, outputs", _lib),
    ("explain", "commands:explain", "say what a code of a diagnostic means", _explain),
    ("ages", "show:ages", "show how old values are where they are read", _spec_and_format),
    ("graph", "show:graph", "draw the structure, a state machine, frames or a data flow", _graph,
     True),
    ("doc", "doc:doc", "write a document in the notation of the paper, as HTML and PDF", _doc),
    ("explore", "explore:run_explore",
     "step all machines together and show where they cannot go on", _explore),
    ("diff", "commands:diff", "say what changed in what a specification means", _diff),
    ("witness", "witness:run_witness",
     "write tests that run into the errors that proofs found, and fail until they are repaired",
     _witness),
    ("import", _IMPORT, "make a specification from state machines of other tools", _import),
    ("schema", "commands:schema", "print the JSON Schema of specifications", lambda _: None),
    ("lsp", "commands:lsp", "serve an editor: the Language Server Protocol", _lsp),
    ("replay", "bags:replay",
     "compare a recorded run with what the specification does now", _replay),
    ("why", "why:why",
     "say where machines were at a moment of a recorded run, and what they waited for", _why),
    ("plot", "plot:plot",
     "draw signals of recorded runs, and the states of machines, over time", _plot, True),
    ("coverage", "coverage:coverage",
     "say what recorded runs tried of their specification, and what none of them did", _coverage),
    ("view", "view:view", "show a recorded run in the browser: a page to scrub through it", _view),
    ("report", "report:report",
     "write recorded runs, tests and sweeps into one file of HTML that opens from disk", _report),
    ("recover", "recordings:recover", "make a clean file of a recording that was cut", _recover),
    ("completion", "arguments:completion",
     "print what makes a shell complete the commands of specc", _completion),
)))  # fmt: skip


def parser() -> Parser:
    """The parser of a whole command line."""
    top = Parser(
        prog="specc", description="Compiler of robot control specifications.", allow_abbrev=False
    )
    top.add_argument("--version", action="version", version=f"specc {__version__}")
    _add_commands(top, COMMANDS, "specc", "command", "COMMAND")
    return top


def _add_commands(
    parser: Parser, commands: tuple[Command, ...], prog: str, dest: str, metavar: str
) -> None:
    parsers = parser.add_subparsers(
        required=True, parser_class=Parser, prog=prog, dest=dest, metavar=metavar
    )
    parser.commands = parsers.choices
    for each in commands:
        added = parsers.add_parser(each.name, help=each.help, add_help=False)
        added.set_defaults(run=each.handler)
        added.add_options, added.is_mixed = each.add_options, each.is_mixed


# Shells ask how a command line may go on.


COMPLETION_VARIABLE = "_ARGCOMPLETE"
"""Is set where a shell asks."""


def completion(options: argparse.Namespace) -> int:
    """Print the lines that a shell reads when it starts."""
    from argcomplete.shell_integration import shellcode

    streams.print_output(shellcode(["specc"], shell=options.shell) + "\n")
    return 0


def complete(parser: Parser) -> None:
    """End the process with the ways to go on, if that is what a shell asks."""
    if COMPLETION_VARIABLE in os.environ:
        import argcomplete

        chosen = parser
        for word in os.environ.get("COMP_LINE", "").split():
            if word in chosen.commands:
                chosen = chosen.commands[word]
                chosen.prepare()
        argcomplete.autocomplete(parser)
