"""One canonical layout of specification files."""

from specc.tools.fmt.layout import LayoutError, formatted

__all__ = ["LayoutError", "formatted"]
