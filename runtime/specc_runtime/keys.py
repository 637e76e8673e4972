"""The keys of a terminal operate the panel: `specc run --keys`.

Each element has a letter, the one that the specification says or a free one. A terminal does not
tell when a key is released, so that there must be no button that has to be held.
"""

from __future__ import annotations

import codecs
import os
import re
import select
import string
import termios
import threading
import tty
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

from specc_runtime.changes import KEYS
from specc_runtime.companion import View
from specc_runtime.options import UsageError
from specc_runtime.panel import Panel, PanelElement, PanelValue
from specc_runtime.printing import say

_KEY = re.compile(r"\x1b[\[O][0-9;]*[@-~]|(?P<rest>\x1b(?:[\[O][0-9;]*)?\Z)|.", re.DOTALL)
"""What a terminal sends for a key, or the beginning of it."""
_STEPS = {"\x1b[A": 1, "\x1b[C": 1, "\x1bOA": 1, "\x1bOC": 1} | {
    "\x1b[B": -1, "\x1b[D": -1, "\x1bOB": -1, "\x1bOD": -1
}  # fmt: skip
"""What arrows do: up and right, down and left."""
_PARTS = 20
"""Steps from one end of a range to the other, if its numbers are not whole."""
_LETTERS = string.ascii_lowercase + string.digits + string.ascii_uppercase
_TERMINAL = 0
"""The descriptor of standard input."""
_CLOSING_S = 1.0


def keys_of(elements: Sequence[PanelElement]) -> dict[str, PanelElement]:
    """The key of each element: its own, else the first free one of its name and of all letters.

    The order is that of the specification. Raises UsageError if there is no panel, or if keys
    cannot operate it.
    """
    if not elements:
        raise UsageError(
            "--keys: there is no panel; bind elements of a real receptor with `panel:`"
        )
    if buttons := [element.name for element in elements if element.hold]:
        raise UsageError(
            f"--keys: {', '.join(buttons)} has to be held, and a terminal does not tell when a key "
            "is released; operate the panel in the page (--ui)"
        )
    keys = {element.key: element for element in elements if element.key}
    for element in elements:
        own = element.name.rpartition(".")[2].lower()
        free = [key for key in own + _LETTERS if key in _LETTERS and key not in keys]
        if not element.key and free:
            keys[free[0]] = element
    if lacking := [element.name for element in elements if element not in keys.values()]:
        raise UsageError(f"--keys: there are no keys left for {', '.join(lacking)}")
    order = {element.name: place for place, element in enumerate(elements)}
    return dict(sorted(keys.items(), key=lambda item: order[item[1].name]))


def check_terminal() -> None:
    """Raises UsageError unless standard input is a terminal that this process may read."""
    if not os.isatty(_TERMINAL):
        raise UsageError("--keys: standard input is no terminal; run it in one, without a pipe")
    try:
        is_in_front = os.tcgetpgrp(_TERMINAL) == os.getpgrp()
    except OSError:  # it is not the one that controls the process
        return
    if not is_in_front:
        raise UsageError("--keys: the run is in the background, where it gets no keys")


def legend(keys: Mapping[str, PanelElement], values: Mapping[str, PanelValue]) -> Iterator[str]:
    """Lines that tell what each key does."""
    yield "keys operate the panel:"
    for key, element in keys.items():
        title = f" ({element.title})" if element.title else ""
        yield f"  {key}  {_deed(element, f'{element.name}{title}', values[element.name])}"
    if any(element.least is not None for element in keys.values()):
        yield "  arrows up and down change the number that was chosen last"


def _deed(element: PanelElement, called: str, value: PanelValue) -> str:
    match element.kind:
        case "button":
            return f"presses {called}"
        case "switch":
            return f"switches {called}: {_text(element, value)}"
        case "choice":
            return f"{called}: the next of {', '.join(element.choices)}; {value}"
    least, greatest = element.least or 0.0, element.greatest or 0.0
    bounds = f"{least:g} to {_text(element, greatest)} in steps of {_step(element):g}"
    return f"chooses {called}: {bounds}; {_text(element, value)}"


def _text(element: PanelElement, value: PanelValue) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, str):
        return value
    return f"{value:g} {element.unit}".strip()


def _step(element: PanelElement) -> float:
    assert element.least is not None and element.greatest is not None, "it is a number"
    return 1 if element.is_whole else (element.greatest - element.least) / _PARTS


class Keys:
    """Operates a panel by the keys of the terminal at standard input; a companion.

    The terminal is as it was once it is closed.
    """

    period_s = 1.0

    def __init__(self, panel: Panel, keys: Mapping[str, PanelElement], *, quiet: bool) -> None:
        self._panel = panel
        self._keys = keys
        self._quiet = quiet
        self._chosen: PanelElement | None = None
        self._rest = ""
        self._thread = threading.Thread(target=self._read, name="specc-keys", daemon=True)
        self._before: Any = None
        self._woken, self._wake = os.pipe()

    def begin(self) -> None:
        """Take keys from now on, and none that came earlier, and tell what they do."""
        self._before = termios.tcgetattr(_TERMINAL)
        tty.setcbreak(_TERMINAL)
        if not self._quiet:
            for line in legend(self._keys, self._panel.values):
                say(line)
        self._thread.start()

    def tick(self, view: View) -> None:
        """See `Companion`."""

    def close(self) -> None:
        """See `Companion`."""
        self.restore()
        if self._thread.is_alive():
            os.write(self._wake, b".")
            self._thread.join(_CLOSING_S)
        for end in (self._woken, self._wake):
            os.close(end)

    def restore(self) -> None:
        """Leave the terminal as it was, without keys that nobody has read."""
        before, self._before = self._before, None
        if before is not None:
            with suppress(termios.error):  # the terminal is gone
                termios.tcflush(_TERMINAL, termios.TCIFLUSH)
                termios.tcsetattr(_TERMINAL, termios.TCSANOW, before)

    def _read(self) -> None:
        decoder = codecs.getincrementaldecoder("utf-8")("replace")
        with suppress(OSError):  # the terminal is gone: a signal ends the run
            while True:
                readable, _, _ = select.select([_TERMINAL, self._woken], [], [])
                if self._woken in readable or not (data := os.read(_TERMINAL, 1024)):
                    return
                self.take(decoder.decode(data))

    def take(self, text: str) -> None:
        """Do what the keys say; `text` is what the terminal has sent."""
        matches = list(_KEY.finditer(self._rest + text))
        self._rest = matches[-1]["rest"] or "" if matches else ""
        for key in matches:
            if key["rest"] is None:
                self._press(key[0])

    def _press(self, key: str) -> None:
        """Do what one key says."""
        step = _STEPS.get(key)
        element = self._keys.get(key) if step is None else self._chosen
        if element is None:
            return
        if step is None and element.least is not None:
            self._chosen = element
            self._tell(element, self._panel.requests[element.name], " (arrows change it)")
            return
        value = self._next(element, step or 0)
        self._panel.operate(element.name, value, KEYS)
        self._tell(element, value)

    def _next(self, element: PanelElement, step: int) -> PanelValue:
        value = self._panel.requests[element.name]
        if element.kind == "choice":
            place = element.choices.index(str(value)) + 1
            return element.choices[place % len(element.choices)]
        if element.least is None or element.greatest is None:
            return True if element.kind == "button" else not value
        width = _step(element)
        number = element.least + width * (round((float(value) - element.least) / width) + step)
        number = min(max(number, element.least), element.greatest)
        return round(number) if element.is_whole else number

    def _tell(self, element: PanelElement, value: PanelValue, more: str = "") -> None:
        if not self._quiet:
            words = "pressed" if element.kind == "button" else f"{_text(element, value)}{more}"
            say(f"{element.title or element.name}: {words}")
