"""Classes of faults, seeded into specifications by editing their texts."""
