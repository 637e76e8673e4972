"""The file of a report: the drawing code of the page, its style, and data, in one document.

Nothing is loaded, from nowhere: the policy of the document allows its own script and style, by
their digests, and pictures that are in it.
"""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from hashlib import sha256
from html import escape
from pathlib import Path

from specc.diagnostics.visible import visible
from specc.tools.page.messages import Message, json_text

STATIC = Path(__file__).with_name("static")
_PAGE = STATIC.parents[1] / "page" / "static"
_ENTRY = "report.js"
_IMPORT = re.compile(
    r'^import (?:\{(?P<names>[^}]*)\} from )?"\./(?P<file>[\w.]+)";\n', re.MULTILINE
)
_EXPORT = re.compile(
    r"^export (?P<what>(?:async )?function|const|class) (?P<name>\w+)", re.MULTILINE
)
_PLACE = re.compile(r"\{\{(\w+)\}\}")
_FOR_SCRIPTS = {"<": "\\u003c", "\u2028": "\\u2028", "\u2029": "\\u2029"}
"""What would end a script, or a line of it, as JSON writes it too."""


def document(title: str, about: Message, runs: Sequence[str]) -> str:
    """The whole file: `about` has the tables, each of the runs is the JSON of an excerpt."""
    script, style = bundled(), _file("page.css") + _file("report.css")
    data = [_data_element("about", json_text(about))]
    data += [_data_element(f"run-{number}", text) for number, text in enumerate(runs)]
    policy = (
        f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; "
        "img-src data:; base-uri 'none'; form-action 'none'"
    )
    parts = {
        "policy": policy,
        "title": escape(visible(title)),
        "style": style,
        "data": "\n".join(data),
        "script": script,
    }
    return _PLACE.sub(lambda found: parts[found[1]], _file("report.html"))


def bundled() -> str:
    """The modules of a report as one script, each in a function of its own, after what it uses."""
    sources: dict[str, str] = {}
    _collect(_ENTRY, sources)
    return "".join(("\n", *(_as_function(name, text) for name, text in sources.items())))


def _collect(name: str, sources: dict[str, str]) -> None:
    """Add a module after those that it imports; no two import each other."""
    text = _file(name)
    for found in _IMPORT.finditer(text):
        if found["file"] not in sources:
            _collect(found["file"], sources)
    sources[name] = text


def _as_function(name: str, text: str) -> str:
    exported = ", ".join(found["name"] for found in _EXPORT.finditer(text))
    body = _EXPORT.sub(r"\g<what> \g<name>", _IMPORT.sub(_as_constants, text))
    return f"const {_variable(name)} = (() => {{\n{body}return {{ {exported} }};\n}})();\n"


def _as_constants(found: re.Match[str]) -> str:
    names = found["names"]
    return f"const {{{names}}} = {_variable(found['file'])};\n" if names else ""


def _variable(name: str) -> str:
    return f"module_{name.removesuffix('.js')}"


def _file(name: str) -> str:
    own = STATIC / name
    return (own if own.exists() else _PAGE / name).read_text(encoding="utf-8")


def _digest(text: str) -> str:
    return f"sha256-{b64encode(sha256(text.encode()).digest()).decode()}"


def _data_element(name: str, text: str) -> str:
    for char, escaped in _FOR_SCRIPTS.items():
        text = text.replace(char, escaped)
    return f'<script type="application/json" id="{name}">{text}</script>'


def table(
    title: str, columns: Sequence[str], rows: Sequence[Message], notes: Sequence[str] = ()
) -> Message:
    """A table of a report; each of its rows is made by `row`."""
    return {"title": title, "columns": columns, "rows": rows, "notes": notes}


def row(cells: Sequence[object], *, is_bad: bool = False, run: int | None = None) -> Message:
    """A row; `run` is the number of the section that its first cell leads to."""
    return {"cells": [visible(str(cell)) for cell in cells], "is_bad": is_bad, "run": run}
