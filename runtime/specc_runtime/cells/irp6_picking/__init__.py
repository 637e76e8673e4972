"""The cell in which an IRp-6 picks boxes: its devices, its scene, and what a run made of them."""

from specc_runtime.cells.irp6_picking.judge import PickJudge
from specc_runtime.cells.irp6_picking.scene import CrowdedScene, PickingScene

__all__ = ["CrowdedScene", "PickJudge", "PickingScene"]
