"""Settings of a project: `[tool.specc]` in the nearest pyproject.toml, and the command line.

What the command line says replaces what the file says, key by key.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

from specc.diagnostics import Diagnostic, nearest, rename_fix, sole_correction
from specc.diagnostics.code import MERGED, all_codes
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
        every = {"select": self.select, "ignore": self.ignore, "strict": self.strict}
        values: dict[str, Any] = {key: value for key, value in every.items() if value is not None}
        return replace(settings, **values)


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
    """Why a text is neither a code nor the beginning of one; empty if it is."""
    if not code:
        return "a code is missing: an empty text would stand for all codes"
    if not any(known.startswith(code) for known in (*all_codes(), *MERGED)):
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
    place = Place(str(path))
    if len(content) > MAX_BYTES:
        message = f"the file has more than {MAX_BYTES:,} bytes"
        return _refused(message, place, "keep settings in a smaller file")
    # Most projects have no settings, and a start of the command need not read TOML for them.
    if b"specc" not in content:
        return None
    try:
        source = SourceFile(str(path), content.decode())
    except UnicodeDecodeError:
        hint = "save the file with the encoding UTF-8"
        return _refused("the file is not UTF-8 text", place, hint)
    return _too_complex(source) or _parsed(source)


def _refused(
    message: str, place: Place, hint: str, source: SourceFile | None = None
) -> FoundSettings:
    """No settings, and the finding about a file that has none which can be used."""
    return FoundSettings(Settings(), source, (Diagnostic("E0905", message, place, help=hint),))


def _text(source: SourceFile, start: int, end: int) -> Place:
    return Place(source.path, (), "text", start, end)


def _parsed(source: SourceFile) -> FoundSettings | None:
    import tomllib

    try:
        tool = tomllib.loads(source.text).get("tool", {})
    except tomllib.TOMLDecodeError as error:
        return _not_toml(source, str(error))
    table = tool.get("specc") if isinstance(tool, dict) else None
    if table is None:
        return None
    if not isinstance(table, dict):
        message = "`tool.specc` is not a table"
        return _refused(message, _text(source, 0, 0), "write [tool.specc]", source)
    if len(table) > MAX_KEYS:
        message = f"the section has more than {MAX_KEYS} keys"
        return _refused(message, _key_place(source, next(iter(table))), _KNOWN_KEYS, source)
    faults = {
        key: _setting_fault(_key_place(source, key), key, value) for key, value in table.items()
    }
    values: dict[str, Any] = {
        key: tuple(value) if isinstance(value, list) else value
        for key, value in table.items()
        if faults[key] is None
    }
    settings = Settings(**values, base=str(Path(source.path).parent))
    return FoundSettings(settings, source, tuple(filter(None, faults.values())))


_WITHOUT_EFFECT = "until then no setting takes effect"


def _too_complex(source: SourceFile) -> FoundSettings | None:
    """The refusal of a text that would cost the TOML reader too many steps or too much memory.

    None if it is fine.
    """
    # Texts and comments become words and blanks of the same length.
    bare = _TEXT_OR_COMMENT.sub(
        lambda found: (" " if found[0][0] == "#" else "s") * len(found[0]), source.text
    )
    if found := _LONG_KEY.search(bare):
        message, span = f"a key has more than {MAX_NESTING} parts", found.span()
    elif found := _LONG_NUMBER.search(bare):
        message, span = f"a number has more than {MAX_DIGITS:,} digits", found.span()
    else:
        depth = 0
        for bracket in re.finditer(r"[\[\]{}]", bare):
            depth += 1 if bracket[0] in "[{" else -1
            if depth > MAX_NESTING:
                message = f"brackets are nested more than {MAX_NESTING} deep"
                span = bracket.span()
                break
        else:
            return None
    return _refused(message, _text(source, *span), f"shorten it; {_WITHOUT_EFFECT}", source)


def _not_toml(source: SourceFile, error: str) -> FoundSettings:
    """The finding about a text that is not TOML, where its reader says that it is not."""
    at = _AT.search(error)
    line, column = (int(at["line"]), int(at["column"])) if at else (len(source.lines), 1)
    starts = source.line_starts
    offset = min(starts[min(line, len(starts)) - 1] + column - 1, len(source.text))
    what = error[: at.start()] if at else error.removesuffix(" (at end of document)")
    message = f"this is not TOML: {what[:1].lower()}{what[1:]}"
    hint = f"correct the line; {_WITHOUT_EFFECT}"
    return _refused(message, _text(source, offset, offset), hint, source)


def _setting_fault(place: Place, key: str, value: Any) -> Diagnostic | None:
    """What is wrong with a setting."""
    if key not in KEYS:
        close = nearest(key, KEYS)
        hint = f"did you mean `{close[0]}`?" if close else _KNOWN_KEYS
        fix = rename_fix(place, key, sole_correction(key, close))
        return Diagnostic("E0905", f"unknown key `{key}`", place, help=hint, fix=fix)
    wrong = hint = ""
    if KEYS[key] is bool:
        hint = f"write `{key} = true` or `{key} = false`"
        wrong = "" if isinstance(value, bool) else "takes true or false"
    else:
        hint = f"write e.g. `{key} = {_EXAMPLES[key]}`"
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            wrong = "takes a list of texts"
        elif len(value) > MAX_ITEMS:
            wrong = f"has more than {MAX_ITEMS} items"
        elif any(len(item) > MAX_LETTERS for item in value):
            wrong = f"has an item of more than {MAX_LETTERS:,} letters"
        elif any("\0" in item for item in value):
            # Neither a path nor a pattern of paths nor a code has one.
            wrong = "has an item with a NUL character"
    if wrong:
        return Diagnostic("E0905", f"`{key}` {wrong}", place, help=hint)
    for code in value if key in ("select", "ignore") else ():
        if wrong := code_fault(code):
            wrong, _, hint = wrong.partition("; ")
            return Diagnostic("E0905", wrong, place, help=hint or "`specc explain` lists all codes")
        if key == "ignore" and not code.startswith("W"):
            message = f"{code} is not a warning and cannot be ignored"
            return Diagnostic("E0903", message, place, help="correct what it reports")
    return None


def _key_place(source: SourceFile, key: str) -> Place:
    """Where a key stands in the section; tomllib does not give places."""
    section = _SECTION.search(source.text)
    pattern = re.compile(rf"^[ \t]*({re.escape(key)})[ \t]*=", re.MULTILINE)
    if found := pattern.search(source.text, section.end() if section else 0):
        return _text(source, *found.span(1))
    return _text(source, *(section.span() if section else (0, 0)))
