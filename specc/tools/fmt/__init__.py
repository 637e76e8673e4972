"""One canonical layout of specification files."""

from specc.tools.fmt.layout import LayoutError, formatted
from specc.tools.fmt.upgrade import upgrade

__all__ = ["LayoutError", "formatted", "upgrade"]
