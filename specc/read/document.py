"""A file of YAML as data with places; faults are findings."""

from __future__ import annotations

import os
import re
import stat
import unicodedata
from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

from specc.diagnostics import Diagnostic, nearest
from specc.limits import MAX_BYTES, MAX_ENTRIES
from specc.reachable import reachable
from specc.read.compose import compose
from specc.refusal import reason_of
from specc.resources import is_library_part, library_parts, on_disk
from specc.source import Place, SourceFile

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
    """Read the text of a file; also returns whether it had a byte order mark, which is removed.

    Raises:
        UnreadableFileError: there is no such file, or it is no text in UTF-8 of a bearable size.
    """
    raw = _load_bytes(path)
    marked = raw.startswith(_UTF8_MARK)
    raw = raw.removeprefix(_UTF8_MARK)
    try:
        return raw.decode("utf-8"), marked
    except UnicodeDecodeError as error:
        text = raw[: error.start].decode("utf-8")
        message = f"byte 0x{raw[error.start]:02x} is not UTF-8 text"
        if encoding := _OTHER_MARKS.get(raw[:2]):
            message += f" (the file looks like {encoding})"
        place = Place(path, (), "text", len(text), len(text))
        hint = "save the file with the encoding UTF-8"
        raise UnreadableFileError(Diagnostic("E0005", message, place, help=hint), text) from None


def _load_bytes(path: str) -> bytes:
    if is_library_part(path) and path not in library_parts():
        close = nearest(path.removesuffix(".yaml"), library_parts())
        suggestion = f"did you mean {' or '.join(f'`{name}`' for name in close)}? " if close else ""
        hint = f"{suggestion}`specc lib` lists all parts"
        raise _refusal("E0001", path, "the library has no such part", hint)
    disk_path = on_disk(path)
    try:
        # A FIFO would block in open() and a device may never end.
        if not stat.S_ISREG(os.stat(disk_path).st_mode):
            message, hint = "this is not a regular file", "save the text in a file first"
            if os.path.isdir(path):
                message = "this is a directory"
                hint = "name a file in it: specc reads one specification file at a time"
            raise _refusal("E0001", path, message, hint)
        with open(disk_path, "rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise _refusal("E0001", path, "no such file", "check the path") from None
    except ValueError:
        hint = "check the path: a file name cannot contain a NUL character"
        raise _refusal("E0001", path, "no such file", hint) from None
    except OSError as error:
        message = f"the file cannot be read: {reason_of(error)}"
        hint = "check the path and the permissions of the file"
        raise _refusal("E0001", path, message, hint) from None
    if len(raw) > MAX_BYTES:
        message = f"the file is larger than {MAX_BYTES // 1_000_000} MB"
        hint = "a specification is text of some hundred lines; is this the right file?"
        raise _refusal("E0004", path, message, hint)
    return raw


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


def refuse_other_yaml(document: Document) -> Document:
    """The document, or an empty one with E0022 if its text does not claim to be a specification."""
    source = document.source
    if not source.text.strip() or claims_to_be_specification(source.text):
        return document
    hint = "a specification has `specc: 1`"
    finding = Diagnostic("E0022", "not a specification", Place(source.path), help=hint)
    return Document(None, SourceFile(source.path, ""), (finding,))


# What YAML 1.2 forbids (5.1), and the line breaks of YAML 1.1 that editors do not show as lines.
_FORBIDDEN = re.compile(
    "[\0-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\ufffe\uffff]"
)


def read_text(path: str, text: str, row_keys: tuple[str, ...] = ()) -> Document:
    """Read the text of a file; `path` only names it."""
    if found := _FORBIDDEN.search(text):
        char = found.group()
        name = "NUL" if char == "\0" else unicodedata.name(char, "a control character")
        message = f"the file contains U+{ord(char):04X} ({name})"
        place = Place(path, (), "text", *found.span())
        hint = f'delete it, or write "\\U{ord(char):08X}" inside double quotes'
        finding = Diagnostic("E0006", message, place, help=hint)
        return Document(None, SourceFile(path, text), (finding,))
    root, diagnostics = compose(path, text)
    if root is None:
        return Document(None, SourceFile(path, text), diagnostics)
    source = SourceFile(path, text, root.node, row_keys)
    return Document(root.data, source, diagnostics, root.size)


# Which files a specification may name: those inside its project.


_CLAIM = re.compile(r"""(?:^|[\r{,])\ufeff?[ \t]*(["']?)specc\1[ \t]*:""", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class AllowedPaths:
    """Folders, by their real paths, of which the first is the project; without any, everything."""

    folders: tuple[str, ...] = ()

    def contains(self, path: str) -> bool:
        """Whether a file lies inside, wherever links lead, or is a part of the library."""
        if is_library_part(path):
            return True
        try:
            real = os.path.realpath(path)
        except ValueError:  # not a valid file name, which reading it will report
            return True
        return not self.folders or any(
            os.path.commonpath((real, folder)) == folder for folder in self.folders
        )

    def hint_to_allow(self, path: str) -> str:
        """A help text for a file that lies outside."""
        real = os.path.realpath(path)
        folder = real if os.path.isdir(real) else os.path.dirname(real)
        beyond = os.path.relpath(folder, self.folders[0])
        return (
            "move it below the folder of the specification or of the pyproject.toml above it, or "
            f'allow its folder in that file: `[tool.specc]` with `allow = ["{beyond}"]`'
        )

    def escaping_link(self, folder: str) -> str | None:
        """A link below a folder that leads outside; None if there is none.

        Raises:
            OverflowError: there is more below it than `MAX_ENTRIES`.
        """
        seen, waiting = {os.path.realpath(folder)}, [folder]
        count = 0
        while waiting and self.folders:
            current = waiting.pop()
            try:
                names = sorted(os.listdir(current))
            except OSError:  # a folder that cannot be listed is not read either
                continue
            for path in (os.path.join(current, name) for name in names):
                count += 1
                if count > MAX_ENTRIES:
                    raise OverflowError(f"the folder has more than {MAX_ENTRIES} files")
                if os.path.islink(path) and not self.contains(path):
                    return path
                if os.path.isdir(path) and (real := os.path.realpath(path)) not in seen:
                    seen.add(real)
                    waiting.append(path)
        return None

    def link_finding(self, path: str) -> Diagnostic:
        """The finding about a path that the command line gives, and that lies outside."""
        message = "a symbolic link leads out of the project"
        return Diagnostic("E0021", message, Place(path), help=self.hint_to_allow(path))


ANYWHERE = AllowedPaths()


def claims_to_be_specification(text: str) -> bool:
    """Whether a text claims to be a specification; any other must not be shown."""
    return _CLAIM.search(text) is not None


# The comments of a YAML text: what follows a `#` that stands outside all scalars.


_MARK = re.compile(r"(?:^|(?<=[ \t]))#[^\r\n]*", re.MULTILINE)
_LINE_END = re.compile(r"\r|\n|$")


@dataclass(frozen=True, slots=True)
class Comment:
    """A comment with its `#`, by offsets into the text.

    If it `is_whole_line`, only white space stands before it on its line.
    """

    start: int
    end: int
    text: str
    is_whole_line: bool


def comments_of(source: SourceFile) -> list[Comment]:
    """The comments of a file in order; none if the file was not understood."""
    if source.spans is None:
        return []
    # What an alias stands for is the same node again.
    nodes = reachable([source.spans], lambda node: (*node.keys.values(), *node.values.values()))
    scalars = ((node.start, node.end) for node in nodes if node.scalar is not None)
    return comments_in(source.text, scalars)


def comments_in(text: str, scalars: Iterable[tuple[int, int]]) -> list[Comment]:
    """The comments of a text whose scalars stand at these offsets."""
    spans = []
    for start, end in scalars:
        # The header of a block scalar may still be followed by a comment.
        if text[start:end][:1] in ("|", ">") and (line_end := _LINE_END.search(text, start)):
            start = min(line_end.start(), end)
        spans.append((start, end))
    spans.sort()
    starts = [start for start, _ in spans]
    found = []
    mark = _MARK.search(text)
    while mark is not None:
        before = bisect_right(starts, mark.start()) - 1
        end = mark.end()
        if before >= 0 and mark.start() < spans[before][1]:
            end = spans[before][1]
        else:
            start = mark.start()
            while start > 0 and text[start - 1] in " \t":
                start -= 1
            is_whole_line = start == 0 or text[start - 1] in "\r\n"
            found.append(Comment(mark.start(), end, mark[0].rstrip(), is_whole_line))
        mark = _MARK.search(text, end)
    return found
