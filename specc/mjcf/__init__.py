"""What an MJCF file declares, and which files it is made of."""

from specc.mjcf.model import Model, ModelError, ModelFiles
from specc.mjcf.reader import read_model

__all__ = ["Model", "ModelError", "ModelFiles", "read_model"]
