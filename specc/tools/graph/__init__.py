"""Pictures of a specification: structure, inner structure, state machines, frames and data flow."""

from specc.tools.graph.diagram import Diagram
from specc.tools.graph.dot import as_dot
from specc.tools.graph.picture import Kind, NoPicture, picture

__all__ = ["Diagram", "Kind", "NoPicture", "as_dot", "picture"]
