"""Subsystems of specifications as an engineer would write them by hand, without the compiler."""
