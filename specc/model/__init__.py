"""The frozen meaning of a specification: units, types, expressions, subsystems, agents, system.

Every reference is an object or a resolved name, every quantity has a unit and a frame. Nothing here
knows how a specification is read, checked or printed.
"""
