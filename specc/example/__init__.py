"""Values that give the answers of a witness: a proof speaks of facts, people and runs of values."""
