"""Recordings of runs: MCAP files that viewers open and that replay (docs/runs.md)."""
