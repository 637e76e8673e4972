"""Plan to files: templates, then the formatter. The only door to jinja2."""

from specc.emit.format import FormatError
from specc.emit.render import emit, filled

__all__ = ["FormatError", "emit", "filled"]
