"""From a file to plain data with places: the only door to ruamel.yaml."""

from specc.read.document import (
    ANYWHERE,
    AllowedPaths,
    Document,
    claims_to_be_specification,
    read_file,
    read_text,
    refuse_other_yaml,
)

__all__ = [
    "ANYWHERE",
    "AllowedPaths",
    "Document",
    "claims_to_be_specification",
    "read_file",
    "read_text",
    "refuse_other_yaml",
]
