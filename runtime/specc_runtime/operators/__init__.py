"""The operators of a specification: pure functions that know nothing of agents."""
