"""Reading a specification file: its data, its text with places, and what is wrong with it."""

from dataclasses import dataclass, replace
from typing import Any

from specc.diagnostics import Diagnostic
from specc.read.compose import compose
from specc.read.load import UnreadableFileError, load_text
from specc.read.reach import claims_to_be_one
from specc.read.unsafe import forbidden_characters
from specc.source import Place, SourceFile


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
    if not source.text.strip() or claims_to_be_one(source.text):
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
