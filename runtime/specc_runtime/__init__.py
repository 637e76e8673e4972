"""The runtime of generated robot control systems: work cycle, buffers, operators and plants."""
