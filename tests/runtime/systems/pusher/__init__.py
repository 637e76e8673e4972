"""A hand-written system in the shape of generated ones: an agent that pushes a cart to and fro."""
