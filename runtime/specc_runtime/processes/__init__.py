"""Steps that are computed in a process of their own, with the records of a run in one process."""
