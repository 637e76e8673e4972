"""Importing: state machines of other tools become specifications that can be checked."""

from specc.importers.carried import Imported
from specc.importers.fabric import import_fabric
from specc.importers.scxml import import_scxml

__all__ = ["Imported", "import_fabric", "import_scxml"]
