"""The shape of the YAML, in pydantic. References are still text; meaning comes in `specc.resolve`."""

from specc.schema.files import SpecFile
from specc.schema.subsystem import SubsystemDef

__all__ = ["SpecFile", "SubsystemDef"]
