"""From a path to characters: existence, permission, size and encoding."""

import os
import stat

from specc.diagnostics import Diagnostic
from specc.limits import MAX_BYTES
from specc.source import Place

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
    try:
        # A FIFO would block in open() and a device may never end.
        if not stat.S_ISREG(os.stat(path).st_mode):
            raise _no_file(path)
        with open(path, "rb") as file:
            raw = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise _refusal("E0001", path, "no such file", "check the path") from None
    except ValueError:
        hint = "check the path: a file name cannot contain a NUL character"
        raise _refusal("E0001", path, "no such file", hint) from None
    except OSError as error:
        reason = (error.strerror or "unknown reason").lower()
        message = f"the file cannot be read: {reason}"
        hint = "check the path and the permissions of the file"
        raise _refusal("E0003", path, message, hint) from None
    if len(raw) > MAX_BYTES:
        message = f"the file is larger than {MAX_BYTES // 1_000_000} MB"
        hint = "a specification is text of some hundred lines; is this the right file?"
        raise _refusal("E0004", path, message, hint)
    return raw


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
