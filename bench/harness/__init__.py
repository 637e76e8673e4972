"""What the benchmarks share: building, recording, comparing, timing, printing."""
