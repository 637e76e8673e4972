"""Stands in for control_msgs, of which no wheels are there."""
