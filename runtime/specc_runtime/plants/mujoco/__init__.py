"""The door to MuJoCo."""

from specc_runtime.plants.mujoco.plant import MujocoPlant
from specc_runtime.plants.mujoco.truth import GroundTruth

__all__ = ["GroundTruth", "MujocoPlant"]
