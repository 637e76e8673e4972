"""What an MJCF file declares, and which files it is made of."""

from specc.mjcf.model import Model, ModelError
from specc.mjcf.reader import read_model

__all__ = ["Model", "ModelError", "read_model"]
