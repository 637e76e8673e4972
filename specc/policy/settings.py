"""Settings of a project: `[tool.specc]` in the nearest pyproject.toml, and the command line.

What the command line says replaces what the file says, key by key.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

from specc.diagnostics import Diagnostic, nearest, rename_fix, sole_correction
from specc.diagnostics.code import all_codes
from specc.read import AllowedPaths
from specc.source import Place, SourceFile

FILE = "pyproject.toml"
KEYS: dict[str, type] = {
    "select": list,
    "ignore": list,
    "strict": bool,
    "exclude": list,
    "allow": list,
}
"""Keys of the section, with the kinds of their values."""

_KNOWN_KEYS = "known keys: " + ", ".join(f"`{known}`" for known in KEYS)
_EXAMPLES = {
    "select": '["W06"]',
    "ignore": '["W0611"]',
    "exclude": '["drafts/*"]',
    "allow": '["../shared"]',
}
_ENCODING = "save the file with the encoding UTF-8"

# Bounds of a file that a stranger may have written.
MAX_BYTES = 200_000
"""Of the file; what other tools say in it is read with it."""
MAX_NESTING = 32
"""Parts of a dotted key, of which the reader of TOML stores each prefix; brackets in brackets."""
MAX_DIGITS = 1_000
"""Of a number."""
MAX_KEYS = 50
"""Of the section."""
MAX_ITEMS = 200
"""Of a list: each file that a specification names is compared with each."""
MAX_LETTERS = 1_000
"""Of an item."""

_TEXT_OR_COMMENT = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+(?:"{3,5}+|\Z)'
    r"|'''(?:[^']|'(?!''))*+(?:'{3,5}+|\Z)"
    r'|"(?:[^"\\\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_LONG_KEY = re.compile(rf"(?<![\w-])[\w-]++(?:[ \t]*+\.[ \t]*+[\w-]++){{{MAX_NESTING}}}")
_LONG_NUMBER = re.compile(rf"(?<!\w)[+-]?\d[\d_]{{{MAX_DIGITS}}}")
_AT = re.compile(r" \(at line (?P<line>\d+), column (?P<column>\d+)\)")
_SECTION = re.compile(r"^[ \t]*\[tool\.specc\][^\n]*$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Settings:
    """What a project asks for.

    `select` and `ignore` are codes or beginnings of codes; an empty `select` means all. `exclude`
    are patterns of paths relative to `base` that are left out when a directory is searched, `allow`
    folders relative to it that specifications may name files of.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    strict: bool = False
    exclude: tuple[str, ...] = ()
    allow: tuple[str, ...] = ()
    base: str = ""

    def shows(self, finding: Diagnostic) -> bool:
        """Whether a finding is reported; errors always are."""
        if not finding.code.startswith("W"):
            return True
        selected = not self.select or finding.code.startswith(self.select)
        return selected and not finding.code.startswith(self.ignore or ("-",))

    def excludes(self, path: Path) -> bool:
        """Whether a file is left out of the search of a directory."""
        name = Path(os.path.relpath(path, self.base or ".")).as_posix()
        return any(
            fnmatchcase(name, pattern) or fnmatchcase(name, f"{pattern.rstrip('/')}/*")
            for pattern in self.exclude
        )


@dataclass(frozen=True, slots=True)
class Overrides:
    """What the command line says; None where it says nothing."""

    select: tuple[str, ...] | None = None
    ignore: tuple[str, ...] | None = None
    strict: bool | None = None

    def applied_to(self, settings: Settings) -> Settings:
        """The settings with what the command line says in place of theirs."""
        said = {"select": self.select, "ignore": self.ignore, "strict": self.strict}
        given: dict[str, Any] = {key: value for key, value in said.items() if value is not None}
        return replace(settings, **given)


@dataclass(frozen=True, slots=True)
class FoundSettings:
    """Settings with findings about the file that has them."""

    settings: Settings = Settings()
    source: SourceFile | None = None
    diagnostics: tuple[Diagnostic, ...] = ()


def settings_for(path: str) -> FoundSettings:
    """Settings of the nearest pyproject.toml at or above `path` that has a `[tool.specc]`."""
    start = Path(os.path.abspath(path))
    for directory in (start, *start.parents):
        found = _settings_in(directory)
        if found is not None:
            return found
    return FoundSettings()


def allowed_paths(path: str) -> AllowedPaths:
    """What a file may name: its folder, or that of the pyproject.toml above it, and `allow`."""
    settings = settings_for(os.path.dirname(os.path.abspath(path))).settings
    allowed = (os.path.join(settings.base, folder) for folder in settings.allow)
    return AllowedPaths(tuple(os.path.realpath(folder) for folder in (project_of(path), *allowed)))


def project_of(path: str) -> str:
    """The folder of the nearest pyproject.toml above a file, or that of the file."""
    start = Path(os.path.abspath(path)).parent
    return str(next((d for d in (start, *start.parents) if (d / FILE).is_file()), start))


def clear_cache() -> None:
    """Read settings again the next time that they are needed: a file may have changed."""
    _settings_in.cache_clear()


def code_fault(code: str) -> str:
    """Why a code or the beginning of one cannot be selected or ignored; empty if it can."""
    if not code:
        return "a code is missing: an empty text would stand for all codes"
    if not any(known.startswith(code) for known in all_codes()):
        close = nearest(code, all_codes())
        return f"no code is called `{code}`" + (f"; did you mean `{close[0]}`?" if close else "")
    return ""


@cache
def _settings_in(directory: Path) -> FoundSettings | None:
    path = directory / FILE
    try:
        with path.open("rb") if path.is_file() else BytesIO() as file:
            content = file.read(MAX_BYTES + 1)
    except (OSError, ValueError):
        return None
    if len(content) > MAX_BYTES:
        return _too_large(str(path))
    if b"specc" not in content:
        return None
    try:
        return _parsed(str(path), content.decode())
    except UnicodeDecodeError:
        fault = Diagnostic("E0905", "the file is not UTF-8 text", Place(str(path)), help=_ENCODING)
        return FoundSettings(Settings(), None, (fault,))


def _parsed(path: str, text: str) -> FoundSettings | None:
    # Most projects have no settings, and a start of the command need not read TOML for them.
    import tomllib

    source = SourceFile(path, text)
    if excess := _excess(source):
        return FoundSettings(Settings(), source, (excess,))
    try:
        tool = tomllib.loads(text).get("tool", {})
    except tomllib.TOMLDecodeError as error:
        return FoundSettings(Settings(), source, (_not_toml(source, str(error)),))
    table = tool.get("specc") if isinstance(tool, dict) else None
    if table is None:
        return None
    if not isinstance(table, dict):
        place = Place(path, (), "text", 0, 0)
        fault = Diagnostic("E0905", "`tool.specc` is not a table", place, help="write [tool.specc]")
        return FoundSettings(Settings(), source, (fault,))
    return _checked(source, table)


def _too_large(path: str) -> FoundSettings:
    message = f"the file has more than {MAX_BYTES:,} bytes"
    fault = Diagnostic("E0905", message, Place(path), help="keep settings in a smaller file")
    return FoundSettings(Settings(), None, (fault,))


def _excess(source: SourceFile) -> Diagnostic | None:
    """What of a text would take the reader of TOML too many steps, or too much memory."""
    # Texts and comments become words and blanks of the same length.
    bare = _TEXT_OR_COMMENT.sub(
        lambda found: (" " if found[0][0] == "#" else "s") * len(found[0]), source.text
    )
    if found := _LONG_KEY.search(bare):
        message, span = f"a key has more than {MAX_NESTING} parts", found.span()
    elif found := _LONG_NUMBER.search(bare):
        message, span = f"a number has more than {MAX_DIGITS:,} digits", found.span()
    elif (deep := _too_deep(bare)) is not None:
        message, span = f"brackets are nested more than {MAX_NESTING} deep", (deep, deep + 1)
    else:
        return None
    place = Place(source.path, (), "text", *span)
    return Diagnostic("E0905", message, place, help=f"shorten it; {_WITHOUT_EFFECT}")


def _too_deep(text: str) -> int | None:
    """Where brackets are nested too deep."""
    depth = 0
    for bracket in re.finditer(r"[\[\]{}]", text):
        depth += 1 if bracket[0] in "[{" else -1
        if depth > MAX_NESTING:
            return bracket.start()
    return None


_WITHOUT_EFFECT = "until then no setting takes effect"


def _not_toml(source: SourceFile, error: str) -> Diagnostic:
    """The finding about a text that is not TOML, where its reader says that it is not."""
    at = _AT.search(error)
    line, column = (int(at["line"]), int(at["column"])) if at else (len(source.lines), 1)
    starts = source.line_starts
    offset = min(starts[min(line, len(starts)) - 1] + column - 1, len(source.text))
    what = error[: at.start()] if at else error.removesuffix(" (at end of document)")
    message = f"this is not TOML: {what[:1].lower()}{what[1:]}"
    place = Place(source.path, (), "text", offset, offset)
    return Diagnostic("E0905", message, place, help=f"correct the line; {_WITHOUT_EFFECT}")


def _checked(source: SourceFile, table: Mapping[str, Any]) -> FoundSettings:
    values: dict[str, Any] = {}
    findings: list[Diagnostic] = []
    if len(table) > MAX_KEYS:
        message = f"the section has more than {MAX_KEYS} keys"
        place = _key_place(source, next(iter(table)))
        fault = Diagnostic("E0905", message, place, help=_KNOWN_KEYS)
        return FoundSettings(Settings(), source, (fault,))
    for key, value in table.items():
        if wrong := _fault(source, key, value):
            findings.append(wrong)
        else:
            values[key] = tuple(value) if isinstance(value, list) else value
    settings = Settings(**values, base=str(Path(source.path).parent))
    return FoundSettings(settings, source, tuple(findings))


def _fault(source: SourceFile, key: str, value: Any) -> Diagnostic | None:
    place = _key_place(source, key)
    if key not in KEYS:
        return _unknown(key, place)
    if KEYS[key] is bool:
        wrong = f"`{key}` takes true or false"
        hint = f"write `{key} = true` or `{key} = false`"
        return None if isinstance(value, bool) else Diagnostic("E0905", wrong, place, help=hint)
    if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
        hint = f"write e.g. `{key} = {_EXAMPLES[key]}`"
        return Diagnostic("E0905", f"`{key}` takes a list of texts", place, help=hint)
    if wrong := _bad_item(value):
        hint = f"write e.g. `{key} = {_EXAMPLES[key]}`"
        return Diagnostic("E0905", f"`{key}` {wrong}", place, help=hint)
    for code in value if key in ("select", "ignore") else ():
        if wrong := code_fault(code):
            wrong, _, hint = wrong.partition("; ")
            return Diagnostic("E0905", wrong, place, help=hint or "`specc explain` lists all codes")
        if key == "ignore" and not code.startswith("W"):
            message = f"{code} is not a warning and cannot be ignored"
            return Diagnostic("E0904", message, place, help="correct what it reports")
    return None


def _bad_item(items: list[str]) -> str:
    """What no list of settings has; empty if this one does not either."""
    if len(items) > MAX_ITEMS:
        return f"has more than {MAX_ITEMS} items"
    if any(len(item) > MAX_LETTERS for item in items):
        return f"has an item of more than {MAX_LETTERS:,} letters"
    # Neither a path nor a pattern of paths nor a code has one.
    return "has an item with a NUL character" if any("\0" in item for item in items) else ""


def _unknown(key: str, place: Place) -> Diagnostic:
    close = nearest(key, KEYS)
    hint = f"did you mean `{close[0]}`?" if close else _KNOWN_KEYS
    meant = sole_correction(key, close)
    fix = rename_fix(place, key, meant)
    return Diagnostic("E0905", f"unknown key `{key}`", place, help=hint, fix=fix)


def _key_place(source: SourceFile, key: str) -> Place:
    """Where a key stands in the section; tomllib does not give places."""
    section = _SECTION.search(source.text)
    start = section.end() if section else 0
    found = re.compile(rf"^[ \t]*({re.escape(key)})[ \t]*=", re.MULTILINE).search(
        source.text, start
    )
    span = found.span(1) if found else (section.span() if section else (0, 0))
    return Place(source.path, (), "text", *span)
