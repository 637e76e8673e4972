"""A file of YAML as data with places; faults are findings."""

from __future__ import annotations

import os
import re
import stat
import unicodedata
from dataclasses import dataclass, replace
from typing import Any

from specc.diagnostics import Diagnostic, nearest
from specc.limits import MAX_BYTES
from specc.read.compose import compose
from specc.read.permitted import claims_to_be_specification
from specc.refusal import reason_of
from specc.resources import is_library_part, library_parts, on_disk
from specc.source import Place, SourceFile

# Characters that a specification may not contain, found before a parser sees them.


# What YAML 1.2 forbids (5.1), and the line breaks of YAML 1.1 that editors do not show as lines.
_FORBIDDEN = re.compile(
    "[\0-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\ufffe\uffff]"
)


def forbidden_characters(path: str, text: str) -> tuple[Diagnostic, ...]:
    """One finding, at the first forbidden character, or none."""
    found = _FORBIDDEN.search(text)
    if found is None:
        return ()
    char = found.group()
    name = "NUL" if char == "\0" else unicodedata.name(char, "a control character")
    return (
        Diagnostic(
            "E0006",
            f"the file contains U+{ord(char):04X} ({name})",
            Place(path, (), "text", found.start(), found.end()),
            help=f'delete it, or write "\\U{ord(char):08X}" inside double quotes',
        ),
    )


# From a path to characters: existence, permission, size and encoding.


_UTF8_MARK = b"\xef\xbb\xbf"
_OTHER_MARKS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}


class UnreadableFileError(Exception):
    """A file that gives no text, with the finding that says why and what could be decoded."""

    def __init__(self, diagnostic: Diagnostic, text: str = "") -> None:
        super().__init__(diagnostic.message)
        self.diagnostic = diagnostic
        self.text = text


def load_text(path: str) -> tuple[str, bool]:
    """Text of a file and whether a byte order mark was taken off it.

    Raises:
        UnreadableFileError: there is no such file, or it is no text in UTF-8 of a bearable size.
    """
    raw = _load_bytes(path)
    marked = raw.startswith(_UTF8_MARK)
    if marked:
        raw = raw[len(_UTF8_MARK) :]
    try:
        return raw.decode("utf-8"), marked
    except UnicodeDecodeError as error:
        raise _not_utf8(path, raw, error) from None


def _load_bytes(path: str) -> bytes:
    if is_library_part(path) and path not in library_parts():
        raise _no_part(path)
    place = on_disk(path)
    try:
        # A FIFO would block in open() and a device may never end.
        if not stat.S_ISREG(os.stat(place).st_mode):
            raise _no_file(path)
        with open(place, "rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise _refusal("E0001", path, "no such file", "check the path") from None
    except ValueError:
        hint = "check the path: a file name cannot contain a NUL character"
        raise _refusal("E0001", path, "no such file", hint) from None
    except OSError as error:
        message = f"the file cannot be read: {reason_of(error)}"
        hint = "check the path and the permissions of the file"
        raise _refusal("E0003", path, message, hint) from None
    if len(raw) > MAX_BYTES:
        message = f"the file is larger than {MAX_BYTES // 1_000_000} MB"
        hint = "a specification is text of some hundred lines; is this the right file?"
        raise _refusal("E0004", path, message, hint)
    return raw


def _no_part(path: str) -> UnreadableFileError:
    close = nearest(path.removesuffix(".yaml"), library_parts())
    meant = f"did you mean {' or '.join(f'`{name}`' for name in close)}? " if close else ""
    message = "the library has no such part"
    return _refusal("E0001", path, message, f"{meant}`specc lib` lists all parts")


def _no_file(path: str) -> UnreadableFileError:
    if os.path.isdir(path):
        hint = "name a file in it: specc reads one specification file at a time"
        return _refusal("E0002", path, "this is a directory", hint)
    return _refusal("E0002", path, "this is not a regular file", "save the text in a file first")


def _not_utf8(path: str, raw: bytes, error: UnicodeDecodeError) -> UnreadableFileError:
    text = raw[: error.start].decode("utf-8")
    encoding = _OTHER_MARKS.get(raw[:2])
    message = f"byte 0x{raw[error.start]:02x} is not UTF-8 text"
    if encoding:
        message += f" (the file looks like {encoding})"
    place = Place(path, (), "text", len(text), len(text))
    hint = "save the file with the encoding UTF-8"
    return UnreadableFileError(Diagnostic("E0005", message, place, help=hint), text)


def _refusal(code: str, path: str, message: str, hint: str) -> UnreadableFileError:
    return UnreadableFileError(Diagnostic(code, message, Place(path), help=hint))


# Reading a specification file: its data, its text with places, and what is wrong with it.


@dataclass(frozen=True, slots=True)
class Document:
    """A file that was read.

    `data` consists of dict (keys are str), list, str, int, float, bool and None. It is None when
    an error kept the file from being understood; parts reached by an alias are shared objects.
    """

    data: Any
    source: SourceFile
    diagnostics: tuple[Diagnostic, ...] = ()
    size: int = 0
    """Number of values, aliases written out."""

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong with the file as YAML."""
        return all(finding.severity != "error" for finding in self.diagnostics)


def read_file(path: str, row_keys: tuple[str, ...] = ()) -> Document:
    """Read a file; whatever is wrong with it becomes a diagnostic, never an exception.

    `row_keys` are the keys that the items of a list stand for where a row may be a mapping.
    """
    try:
        text, marked = load_text(path)
    except UnreadableFileError as refusal:
        return Document(None, SourceFile(path, refusal.text), (refusal.diagnostic,))
    document = read_text(path, text, row_keys)
    if not marked:
        return document
    warning = Diagnostic(
        "W0001",
        "the file starts with a byte order mark",
        Place(path, (), "text", 0, 0),
        help="save the file as UTF-8 without a byte order mark",
    )
    return replace(document, diagnostics=(warning, *document.diagnostics))


def specification(document: Document) -> Document:
    """The document; of one that does not say that it is a specification nothing is kept."""
    source = document.source
    if not source.text.strip() or claims_to_be_specification(source.text):
        return document
    hint = "a specification has `specc: 1`"
    finding = Diagnostic("E0022", "not a specification", Place(source.path), help=hint)
    return Document(None, SourceFile(source.path, ""), (finding,))


def read_text(path: str, text: str, row_keys: tuple[str, ...] = ()) -> Document:
    """Read the text of a file; `path` only names it."""
    forbidden = forbidden_characters(path, text)
    if forbidden:
        return Document(None, SourceFile(path, text), forbidden)
    root, diagnostics = compose(path, text)
    if root is None:
        return Document(None, SourceFile(path, text), diagnostics)
    source = SourceFile(path, text, root.node, row_keys)
    return Document(root.data, source, diagnostics, root.size)
