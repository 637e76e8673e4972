"""From a file to plain data with places: the only door to ruamel.yaml."""

from specc.read.document import Document, read_file, read_text, specification
from specc.read.permitted import ANYWHERE, Reach, claims_to_be_one

__all__ = [
    "ANYWHERE",
    "Document",
    "Reach",
    "claims_to_be_one",
    "read_file",
    "read_text",
    "specification",
]
