"""Makes the runs of scenarios and says which of them pass."""
