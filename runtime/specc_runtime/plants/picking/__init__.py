"""The picking task: boxes put on the table, and what a run made of them; never for agents."""

from specc_runtime.plants.picking.judge import PickJudge
from specc_runtime.plants.picking.scene import PickingScene

__all__ = ["PickJudge", "PickingScene"]
