"""The shape of the YAML. References are still text; meaning comes in `specc.resolve`."""

from specc.schema.desugar import desugar
from specc.schema.files import SpecFile
from specc.schema.shape import shape
from specc.schema.subsystem import ROW_KEYS, SubsystemDef

__all__ = ["ROW_KEYS", "SpecFile", "SubsystemDef", "desugar", "shape"]
