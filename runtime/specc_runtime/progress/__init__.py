"""What people see of a run: progress while it lasts and a summary at its end. The door to rich."""
