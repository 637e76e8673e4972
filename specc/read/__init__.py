"""From a file to plain data with places: the only door to ruamel.yaml."""

from specc.read.document import Document, read_file, read_text

__all__ = ["Document", "read_file", "read_text"]
