"""Parsers of a command line and of the values in it; the nearest name answers a mistyped one."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from math import inf
from pathlib import Path
from types import MappingProxyType
from typing import Any

from specc.diagnostics import nearest


class Parser(argparse.ArgumentParser):
    """Suggests the command or option that a mistyped one is near to, under its own usage."""

    add_options: Callable[[Parser], None] | None = None
    """Adds the options of a command once it is chosen, which takes time."""
    commands: Mapping[str, Parser] = MappingProxyType({})
    alone: Mapping[str, str] = MappingProxyType({})
    """Options that may stand without a value, and what they stand for then. A value needs `=`."""
    is_mixed = False
    """Whether an argument that may be left out may also stand behind options."""
    _parses = False

    def prepare(self) -> None:
        """Add the options of the command."""
        if add_options := self.add_options:
            self.add_options = None
            self.add_argument("-h", "--help", action="help", help="show this help message and exit")
            add_options(self)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse as argparse does, and refuse what is not known."""
        if self._parses:  # for parts of a mixed command line
            return super().parse_known_args(args, namespace)
        self._parses = True
        self.prepare()
        words = [self.alone.get(word, word) for word in (sys.argv[1:] if args is None else args)]
        command = next((word for word in words if not word.startswith("-")), "")
        if self.commands and command and command not in self.commands:
            hint = _suggestion(command, self.commands) or f": {self.prog} --help lists them"
            self.error(f"there is no command {command!r}{hint}")
        if self.commands and not command:
            self._refuse([word for word in words if word not in self._option_string_actions])
        parse = self.parse_known_intermixed_args if self.is_mixed else super().parse_known_args
        found, unknown = parse(words, namespace)
        self._refuse(unknown)
        return found, unknown

    def _refuse(self, unknown: list[str]) -> None:
        if unknown:
            option = next((w for w in unknown if w.startswith("--")), "").partition("=")[0]
            # Without the dashes, which make short names look alike.
            known = re.findall(r"--([a-z][\w-]*)", self.format_help())
            hint = _suggestion(option.removeprefix("--"), known, "--")
            self.error(f"unrecognized arguments: {' '.join(unknown)}{hint}")


def _suggestion(name: str, known: Iterable[str], before: str = "") -> str:
    close = nearest(name, known)
    return f": did you mean {before}{close[0]}?" if close else ""


# Values of arguments.


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

    codes = tuple(code.strip() for code in text.split(","))
    for code in codes:
        if fault := code_fault(code):
            raise argparse.ArgumentTypeError(fault)
    return codes


def warning_list(text: str) -> tuple[str, ...]:
    """Codes as `code_list` takes them, of warnings only."""
    codes = code_list(text)
    for code in codes:
        if not code.startswith("W"):
            raise argparse.ArgumentTypeError(f"{code} is not a warning and cannot be ignored")
    return codes


def formula(text: str) -> str:
    """A formula that is not empty."""
    if not text.strip():
        raise argparse.ArgumentTypeError("the formula is empty")
    return text


_LONGEST_NUMBER = 40


def number_between(
    parse: Callable[[str], int | float | Fraction], low: float, high: float, kind: str = ""
) -> Callable[[str], int | float | Fraction]:
    """Parses a whole number, else seconds if no other kind is named, both ends included."""
    kind = kind or ("a whole number" if parse is int else "a number of seconds")

    def number_of(text: str) -> int | float | Fraction:
        try:
            # Python reads other digits, and `1_0`, too.
            is_plain = text.isascii() and "_" not in text and len(text) <= _LONGEST_NUMBER
            if is_plain and low <= (number := parse(text)) <= high:
                return number
        except (ValueError, ZeroDivisionError):
            pass
        message = f"{text!r} is not {kind} from {low:.12g} to {high:.12g}"
        raise argparse.ArgumentTypeError(message)

    return number_of


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
