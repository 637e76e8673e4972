"""The commands of `specc` and their arguments; each command names the function that does it."""

from __future__ import annotations

import argparse
from fractions import Fraction
from importlib import import_module
from math import inf
from typing import Any

from specc import __version__
from specc.cli.parsing import Parser, Values, codes, formula, moment, ranged, warnings, wire

FORMATS = ("text", "json", "sarif", "github", "junit")
DIFF_FORMATS = ("text", "markdown", "json")
SHELLS = ("bash", "zsh", "fish")


def parser() -> Parser:
    """The parser of a whole command line."""
    whole = Parser(
        prog="specc", description="Compiler of robot control specifications.", allow_abbrev=False
    )
    whole.add_argument("--version", action="version", version=f"specc {__version__}")
    commands = whole.add_commands(prog="specc", dest="command", metavar="COMMAND")
    for add in (
        _compiling,
        _writing,
        _looking,
        _comparing,
        _importing,
        _editing,
        _replaying,
        _completing,
    ):
        add(commands)
    return whole


def _command(commands: Any, name: str, run: str, words: str) -> Any:
    """A new command; `run` is the module and the function that do it."""
    made = commands.add_parser(name, help=words)
    made.set_defaults(run=run)
    return made


def _compiling(commands: Any) -> None:
    validate = _command(
        commands, "validate", "commands:validate", "report what is wrong with specifications"
    )
    validate.add_argument(
        "specs", metavar="SPEC", nargs="+", help="file, directory, or pattern such as 'specs/**'"
    )
    validate.add_argument("--fix", action="store_true", help="make the repairs that are safe")
    build = _command(commands, "build", "commands:build", "generate code from specifications")
    build.add_argument("specs", metavar="SPEC", nargs="+")
    build.add_argument(
        "--out",
        metavar="DIR",
        help="directory for the output, a directory per system (default: generated beside the "
        "nearest pyproject.toml above the specification, else beside the specification)",
    )
    build.add_argument(
        "--check", action="store_true", help="compare only; exit code 1 if not up to date"
    )
    build.add_argument(
        "--real-time", action="store_true", help="test rows that are proved, for runs in real time"
    )
    run = _command(commands, "run", "run:run", "simulate a specification")
    run.late = _of_run
    words = "run a specification many times: over values of constants, and over seeds"
    sweep = _command(commands, "sweep", "sweep:sweep", words)
    sweep.late = _of_sweep
    for each in (validate, build, run, sweep):
        _add_policy(each)
    for each in (validate, build):
        words = "text goes to standard error, the others to standard output"
        each.add_argument("--format", choices=FORMATS, default="text", help=words)


def _writing(commands: Any) -> None:
    fmt = _command(commands, "fmt", "rewrite:fmt", "put specifications into the canonical layout")
    fmt.add_argument("files", metavar="FILE", nargs="+", help="file, directory or pattern")
    fmt.add_argument(
        "--check", action="store_true", help="write nothing; exit code 1 if a file would change"
    )
    fmt.add_argument(
        "--upgrade", action="store_true", help="write version 1 in the forms of version 1.2"
    )
    fmt.add_argument("--diff", action="store_true", help="print what would change, write nothing")
    status = _command(
        commands, "status", "status:status", "show which steps of the design are done"
    )
    status.add_argument("spec", metavar="SPEC")
    status.add_argument("--format", choices=("text", "json"), default="text")
    init = _command(commands, "init", "skeletons:init", "start a specification that runs at once")
    init.add_argument(
        "directory",
        metavar="DIRECTORY",
        nargs="?",
        default=".",
        help="directory for the files, created if it does not exist (default: here)",
    )
    start = init.add_mutually_exclusive_group()
    start.add_argument("--skeleton", metavar="NAME", help="joint (default), sense-act, two-agents")
    words = "start from this MuJoCo model instead: an agent that holds its pose"
    start.add_argument("--model", metavar="FILE.xml", help=words)
    words = "start from what ROS 2 has here: an agent that looks on (NAME: robot if left out)"
    start.add_argument("--ros2", metavar="NAME|FILE.yaml", nargs="?", const="robot", help=words)
    words = "name of the agent; with a model, DIRECTORY may be a specification that gets it"
    init.add_argument("--agent", metavar="NAME", help=words)
    words = "of a model: one effector for these, `arm=joint1..joint7`; may be repeated"
    init.add_argument("--group", metavar="NAME=JOINTS", action=Values, default={}, help=words)
    words = "of ROS 2: the Python that finds rclpy (default: python3)"
    init.add_argument("--python", metavar="FILE", help=words)
    words = "of ROS 2: how long to look, in seconds (default: 2)"
    init.add_argument("--wait", metavar="S", type=ranged(float, 0.1, 600), help=words)


def _looking(commands: Any) -> None:
    explain = _command(
        commands, "explain", "commands:explain", "say what a code of a diagnostic means"
    )
    explain.add_argument("code", metavar="CODE", nargs="?", help="without it, all codes are listed")
    ages = _command(commands, "ages", "ages:ages", "show how old values are where they are read")
    ages.add_argument("spec", metavar="SPEC")
    ages.add_argument("--format", choices=("text", "json"), default="text")
    words = "draw the structure, a state machine, frames or a data flow"
    graph = _command(commands, "graph", "graph:graph", words)
    graph.late, graph.is_mixed = _of_graph, True
    words = "step all machines together and show where they cannot go on"
    explore = _command(commands, "explore", "explore:run_explore", words)
    explore.add_argument("spec", metavar="SPEC")
    explore.add_argument(
        "--budget",
        metavar="STEPS",
        type=ranged(int, 1, 99_999_999),
        default=700_000,
        help="of single machines, in all ways that are followed (default: 700000)",
    )
    words = "directory for recordings of what was found, which `specc replay` runs"
    explore.add_argument("--traces", metavar="DIR", help=words)
    explore.add_argument("--format", choices=("text", "json"), default="text")
    _add_policy(explore)


def _comparing(commands: Any) -> None:
    diff = _command(
        commands, "diff", "commands:diff", "say what changed in what a specification means"
    )
    diff.add_argument("old", metavar="OLD")
    diff.add_argument("new", metavar="NEW")
    diff.add_argument("--format", choices=DIFF_FORMATS, default="text")
    words = (
        "write tests that run into the errors that proofs found, and fail until they are repaired"
    )
    witness = _command(commands, "witness", "witness:run_witness", words)
    witness.add_argument("spec", metavar="SPEC")
    witness.add_argument("--code", metavar="CODE", help="findings with this code only")
    witness.add_argument("--subsystem", metavar="NAME", help="of this subsystem only: irp.m")
    witness.add_argument("--state", metavar="NAME", help="of this state only")
    words = "directory for the tests, a file per finding"
    witness.add_argument("--out", metavar="DIR", default="witnesses", help=words)


def _importing(commands: Any) -> None:
    words = "make a specification from state machines of other tools"
    formats = commands.add_parser("import", help=words).add_commands(
        prog="specc import", dest="source", metavar="FORMAT"
    )
    run = "importing:run_import"
    fabric = _command(formats, "fabric", run, "subsystem definitions of FABRIC")
    fabric.add_argument("files", metavar="FILE.xml", nargs="+")
    fabric.add_argument(
        "--connect",
        metavar="A.b=C.d",
        type=wire,
        action="append",
        default=[],
        help="buffer b of subsystem A is connected with buffer d of subsystem C",
    )
    scxml = _command(formats, "scxml", run, "a flat state chart")
    scxml.add_argument("files", metavar="FILE.scxml", nargs=1)
    for each in (fabric, scxml):
        each.add_argument("--name", metavar="NAME", default="", help="name of the system")
        period = ranged(Fraction, 1e-7, 3600)
        each.add_argument("--period", metavar="S", type=period, help="period in seconds")
        each.add_argument(
            "--out", metavar="FILE.yaml", help="file to write (default: standard output)"
        )
        each.add_argument("--force", action="store_true", help="replace the file of --out")


def _editing(commands: Any) -> None:
    _command(commands, "schema", "commands:schema", "print the JSON Schema of specifications")
    lsp = _command(commands, "lsp", "commands:lsp", "serve an editor: the Language Server Protocol")
    lsp.add_argument(
        "--stdio",
        action="store_true",
        help="accepted; the server always uses standard input and output",
    )


def _completing(commands: Any) -> None:
    words = "print what makes a shell complete the commands of specc"
    completion = _command(commands, "completion", "completing:completion", words)
    completion.add_argument("shell", metavar="SHELL", choices=SHELLS, help=", ".join(SHELLS))


def _replaying(commands: Any) -> None:
    words = "compare a recorded run with what the specification does now"
    replay = _command(commands, "replay", "recordings:replay", words)
    replay.add_argument("file", metavar="FILE.mcap")
    words = "the specification, which is never taken from the file"
    replay.add_argument("--spec", metavar="SPEC", help=words)
    replay.add_argument("--subsystem", metavar="NAME", help="this subsystem only: irp.m")
    replay.add_argument(
        "--until",
        metavar="S",
        type=ranged(float, 0, inf),
        default=inf,
        help="simulated time to compare",
    )
    words = "exit code 1 also if something cannot be compared"
    replay.add_argument("--check", action="store_true", help=words)
    words = "say where machines were at a moment of a recorded run, and what they waited for"
    why = _command(commands, "why", "why:why", words)
    why.add_argument("moment", metavar="FILE.mcap@S", type=moment)
    words = "all about this one: irp.m (default: a line for each)"
    why.add_argument("subsystem", metavar="SUBSYSTEM", nargs="?", help=words)
    words = "the specification, which is never taken from the file"
    why.add_argument("--spec", metavar="SPEC", help=words)
    words = "draw signals of recorded runs, and the states of machines, over time"
    plot = _command(commands, "plot", "plot:plot", words)
    plot.late, plot.is_mixed = _of_plot, True
    words = "make a clean file of a recording that was cut"
    recover = _command(commands, "recover", "recordings:recover", words)
    recover.add_argument("file", metavar="FILE.mcap")
    recover.add_argument(
        "--out", metavar="FILE.mcap", help="file to write (default: in place of the old one)"
    )


def _add_policy(command: Any) -> None:
    """Options that stand in place of what `[tool.specc]` of pyproject.toml says."""
    words = "codes or their beginnings, separated by commas"
    command.add_argument(
        "--select", metavar="CODES", type=codes, help=f"warn of these only: {words}"
    )
    command.add_argument(
        "--ignore", metavar="CODES", type=warnings, help=f"do not warn of: {words}"
    )
    command.add_argument(
        "--strict",
        action=argparse.BooleanOptionalAction,
        help="count warnings and open points as errors",
    )


def _of_graph(command: argparse.ArgumentParser) -> None:
    command.add_argument("spec", metavar="SPEC")
    words = "agent, subsystem, function or behaviour: irp, irp.m, irp.m.p2p (default: the system)"
    command.add_argument("place", metavar="PLACE", nargs="?", default="", help=words)
    kinds = ("structure", "inside", "states", "frames", "flow")
    words = "structure of a system or agent, states of a subsystem, flow of a function by default"
    command.add_argument("--of", choices=kinds, help=words)
    words = "svg by default, or what the name of the file says; dot goes to standard output"
    command.add_argument("--format", choices=("svg", "png", "dot"), help=words)
    words = "file to write (default: SPEC-PLACE-KIND.FORMAT in the working directory)"
    command.add_argument("--out", metavar="FILE", help=words)


def _of_plot(command: argparse.ArgumentParser) -> None:
    command.add_argument("file", metavar="FILE.mcap")
    words = (
        "irp.m.x.c.T_d, irp.m.q_p[2], plant.gap; irp.m is the state of a machine; A,B stand in one "
        "panel; FILE.mcap is a further recording (default: the states of all machines)"
    )
    command.add_argument("signals", metavar="SIGNAL", nargs="*", help=words)
    seconds = ranged(float, 0, inf)
    words = "simulated time from which on it is drawn"
    command.add_argument("--since", metavar="S", type=seconds, default=0.0, help=words)
    words = "simulated time until which it is drawn"
    command.add_argument("--until", metavar="S", type=seconds, default=inf, help=words)
    words = "file to write: .svg, .png, .pdf or .csv (default: FILE-plot.svg, FILE-timeline.svg)"
    command.add_argument("--out", metavar="FILE", help=words)
    words = "the numbers as a table, on standard output without --out"
    command.add_argument("--csv", action="store_true", help=words)


def _of_run(command: argparse.ArgumentParser) -> None:
    command.add_argument("spec", metavar="SPEC")
    command.add_argument(
        "--set",
        metavar="NAME=VALUE",
        action=Values,
        default={},
        help="take this value for a constant or for a parameter, `arm.hand.force`; may be repeated",
    )
    _add_stop(command)
    words = "let others in ROS watch this: `irp.m`, `irp.m.y.c.T_c`; may be repeated"
    command.add_argument("--publish", metavar="NAME", action="append", default=[], help=words)
    _add_from_runtime(command, "add_arguments")


def _of_sweep(command: argparse.ArgumentParser) -> None:
    command.add_argument("spec", metavar="SPEC")
    command.add_argument(
        "--set",
        metavar="NAME=VALUES",
        action=Values,
        default={},
        help="values of a constant or parameter: FROM:TO:COUNT, or A,B,C; may be repeated",
    )
    words = "FROM:TO without TO, or A,B,C (default: %(default)s)"
    command.add_argument("--seeds", metavar="SEEDS", default="0:10", help=words)
    words = "address of a Dask cluster (default: processes of this machine)"
    command.add_argument("--scheduler", metavar="HOST:PORT", help=words)
    words = "runs at once on this machine (default: one for each core)"
    command.add_argument("--workers", metavar="N", type=ranged(int, 1, 9999), help=words)
    words = "wall time after which a run is ended (default: %(default)g s)"
    limit = ranged(float, 1e-3, 1e7)
    command.add_argument("--limit", metavar="S", type=limit, default=600.0, help=words)
    words = "folder for the table, to which later runs are added (default: sweeps/SPEC)"
    command.add_argument("--out", metavar="DIR", help=words)
    _add_stop(command)
    _add_from_runtime(command, "add_extent")


def _add_stop(command: argparse.ArgumentParser) -> None:
    words = "end the run once this formula holds; exit code 1 if it never does"
    command.add_argument("--stop-when", metavar="FORMULA", type=formula, help=words)


def _add_from_runtime(command: argparse.ArgumentParser, function: str) -> None:
    try:
        getattr(import_module("specc_runtime.options"), function)(command)
    except ModuleNotFoundError:
        command.error("the runtime (package specc_runtime) is not installed")
