"""Parsers of command lines: what is mistyped is told with the nearest name; texts become values.

Shells ask them how a command line may go on.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from math import inf
from pathlib import Path
from types import MappingProxyType
from typing import Any

from specc.cli import streams


class Parser(argparse.ArgumentParser):
    """Names what a mistyped command or option was probably meant to be, under its own usage.

    The options of a command may be known only once it is chosen: `late` adds them.
    """

    add_options: Callable[[Parser], None] | None = None
    commands: Mapping[str, Parser] = MappingProxyType({})
    is_mixed = False
    """Whether an argument that may be left out may also stand behind options."""
    _parses = False

    def add_commands(self, **options: Any) -> Any:
        """Subparsers, one of which must be chosen."""
        made = self.add_subparsers(required=True, parser_class=Parser, **options)
        self.commands = made.choices
        return made

    def prepare(self) -> None:
        """Add the options that are known late, which takes time."""
        if late := self.add_options:
            self.add_options = None
            self.add_argument("-h", "--help", action="help", help="show this help message and exit")
            late(self)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse as argparse does, and refuse what is not known."""
        if self._parses:  # for parts of a mixed command line
            return super().parse_known_args(args, namespace)
        self._parses = True
        self.prepare()
        words = list(sys.argv[1:] if args is None else args)
        command = next((word for word in words if not word.startswith("-")), "")
        if self.commands and command and command not in self.commands:
            meant = _meant(command, self.commands) or f": {self.prog} --help lists them"
            self.error(f"there is no command {command!r}{meant}")
        if self.commands and not command:
            self._refuse([word for word in words if word not in self._option_string_actions])
        parse = self.parse_known_intermixed_args if self.is_mixed else super().parse_known_args
        found, unknown = parse(words, namespace)
        self._refuse(unknown)
        return found, unknown

    def _refuse(self, unknown: list[str]) -> None:
        """Name the option that was probably meant, if there are any that are not known."""
        if unknown:
            option = next((w for w in unknown if w.startswith("--")), "").partition("=")[0]
            # Without the dashes, which make short names look alike.
            meant = _meant(option.removeprefix("--"), _OPTION.findall(self.format_help()), "--")
            self.error(f"unrecognized arguments: {' '.join(unknown)}{meant}")


_OPTION = re.compile(r"--([a-z][\w-]*)")


def _meant(name: str, known: Iterable[str], before: str = "") -> str:
    """A question about the nearest known name, if there is one."""
    from specc.diagnostics.nearest import nearest

    close = nearest(name, known)
    return f": did you mean {before}{close[0]}?" if close else ""


# What arguments are made of.


class CollectValues(argparse.Action):
    """Collects `name=value`, each name once."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,
    ) -> None:
        """See `argparse.Action`."""
        name, sign, text = (part.strip() for part in str(values).partition("="))
        known = getattr(namespace, self.dest)
        if not (name and sign):
            raise argparse.ArgumentError(self, f"{values!r} is not `name=value`")
        if name in known:
            raise argparse.ArgumentError(self, f"`{name}` is given twice")
        setattr(namespace, self.dest, known | {name: text})


def code_list(text: str) -> tuple[str, ...]:
    """Codes of diagnostics, or their beginnings, separated by commas."""
    from specc.policy.settings import code_fault

    named = tuple(code.strip() for code in text.split(","))
    for code in named:
        if fault := code_fault(code):
            raise argparse.ArgumentTypeError(fault)
    return named


def warning_list(text: str) -> tuple[str, ...]:
    """Codes as `codes` takes them, of warnings only."""
    named = code_list(text)
    for code in named:
        if not code.startswith("W"):
            raise argparse.ArgumentTypeError(f"{code} is not a warning and cannot be ignored")
    return named


def formula(text: str) -> str:
    """A formula that is not empty."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the formula is empty")
    return text


_LONGEST_NUMBER = 40


def number_between(
    read: Callable[[str], int | float | Fraction], low: float, high: float
) -> Callable[[str], int | float | Fraction]:
    """Takes the text of a whole number, else of seconds, in a range, both ends included."""
    what = "a whole number" if read is int else "a number of seconds"

    def taken(text: str) -> int | float | Fraction:
        try:
            # Python reads other digits, and `1_0`, too.
            number = (
                read(text)
                if text.isascii() and "_" not in text and len(text) <= _LONGEST_NUMBER
                else -1
            )
        except (ValueError, ZeroDivisionError):
            number = -1
        if not low <= number <= high:
            words = f"{text!r} is not {what} from {low:.12g} to {high:.12g}"
            raise argparse.ArgumentTypeError(words)
        return number

    return taken


def recording_time(text: str) -> tuple[Path, float]:
    """A recording and a time in it, FILE.mcap@SECONDS."""
    file, at, seconds = text.rpartition("@")
    if not (file and at):
        raise argparse.ArgumentTypeError(f"{text!r} is not FILE.mcap@SECONDS")
    return Path(file), float(number_between(float, 0, inf)(seconds))


def connection(text: str) -> tuple[tuple[str, str], tuple[str, str]]:
    """Two buffers that are connected: those of FABRIC."""
    first, equals, second = text.partition("=")
    a, b = first.rpartition("."), second.rpartition(".")
    if not (equals and all((*a, *b))):
        raise argparse.ArgumentTypeError(f"{text!r} is not SUBSYSTEM.BUFFER=SUBSYSTEM.BUFFER")
    return (a[0], a[2]), (b[0], b[2])


# Shells complete commands, options and files.


COMPLETION_VARIABLE = "_ARGCOMPLETE"
"""Is set where a shell asks how a command line may go on."""


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
