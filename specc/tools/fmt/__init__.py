"""One canonical layout of specification files."""

from specc.tools.fmt.layout import LayoutError, format_text
from specc.tools.fmt.upgrade import upgrade

__all__ = ["LayoutError", "format_text", "upgrade"]
