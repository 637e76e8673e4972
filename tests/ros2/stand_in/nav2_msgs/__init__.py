"""Stands in for nav2_msgs, of which no wheels are there."""
