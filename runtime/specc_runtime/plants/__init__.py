"""Plants: what stands behind the real effectors and receptors of a system."""
