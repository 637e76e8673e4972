"""Pictures of a specification: structure, inner structure, state machines, frames and data flow."""

from specc.tools.graph.diagram import Diagram
from specc.tools.graph.dot import as_dot
from specc.tools.graph.picture import NoPicture, PictureKind, picture

__all__ = ["Diagram", "NoPicture", "PictureKind", "as_dot", "picture"]
