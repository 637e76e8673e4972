"""MuJoCo, as the plants use it: the one that operators import, without a graphics library."""

from specc_runtime.operators.arms.library import GL_VARIABLE, mujoco

__all__ = ["GL_VARIABLE", "mujoco"]
