"""The runtime of generated robot control systems: work cycle, buffers, operators and plants.

What is listed here is public: docs/your_robot.md describes it, and it keeps its meaning. It is
imported when it is asked for, so that operators do not wait for what they do not need.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from specc_runtime.cycle import Executor
    from specc_runtime.environment import open_judge, open_plant
    from specc_runtime.faults import Fault
    from specc_runtime.loading import load_system
    from specc_runtime.options import UsageError
    from specc_runtime.plant import LOST, NO_SAMPLE, Deferred, Latest, Plant, Sample
    from specc_runtime.plants.errors import PlantError
    from specc_runtime.records import StepRecord
    from specc_runtime.system import System
    from specc_runtime.task import Judge, Scene
    from specc_runtime.timing import Paced, RealTime

__all__ = [
    "LOST",
    "NO_SAMPLE",
    "Deferred",
    "Executor",
    "Fault",
    "Judge",
    "Latest",
    "Paced",
    "Plant",
    "PlantError",
    "RealTime",
    "Sample",
    "Scene",
    "StepRecord",
    "System",
    "UsageError",
    "load_system",
    "open_judge",
    "open_plant",
]
_HOMES = {
    "cycle": ("Executor",),
    "faults": ("Fault",),
    "loading": ("load_system",),
    "options": ("UsageError",),
    "plant": ("LOST", "NO_SAMPLE", "Deferred", "Latest", "Plant", "Sample"),
    "plants.errors": ("PlantError",),
    "records": ("StepRecord",),
    "environment": ("open_judge", "open_plant"),
    "system": ("System",),
    "task": ("Judge", "Scene"),
    "timing": ("Paced", "RealTime"),
}


def __getattr__(name: str) -> object:
    for home, names in _HOMES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *__all__]
