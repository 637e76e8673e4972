"""Compiler of robot control specifications."""

__version__ = "0.1.0"
