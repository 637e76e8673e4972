"""From a file to plain data with places: the only door to ruamel.yaml."""

from specc.read.document import Document, read_file, read_text, specification
from specc.read.permitted import ANYWHERE, AllowedPaths, claims_to_be_specification

__all__ = [
    "ANYWHERE",
    "AllowedPaths",
    "Document",
    "claims_to_be_specification",
    "read_file",
    "read_text",
    "specification",
]
