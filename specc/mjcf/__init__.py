"""What an MJCF file declares, and which files it is made of."""

from specc.mjcf.model import MAX_BYTES, Model, ModelError, Part, read_model

__all__ = ["MAX_BYTES", "Model", "ModelError", "Part", "read_model"]
