"""Importing: state machines of other tools become specifications that can be checked."""

from specc.tools.importers.fabric import import_fabric
from specc.tools.importers.reading import Notes
from specc.tools.importers.scxml import import_scxml

__all__ = ["Notes", "import_fabric", "import_scxml"]
