"""What a run goes on in: its plant, with the scene set, and the judge of its task."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from specc_runtime.faults import PlantFailed, SceneFailed
from specc_runtime.loading import is_simulated, made
from specc_runtime.options import Options, RendererName, UsageError
from specc_runtime.plant import Plant
from specc_runtime.system import PlantSpec, System, Task
from specc_runtime.task import Judge, Scene, drawn


def open_plant(
    system: System, base: str | Path = ".", seed: int = 0, renderer: RendererName = "auto"
) -> Any:
    """The system's plant, reset with the seed and its scene set; None if it needs none.

    Raises PlantError for a model that does not fit, UsageError for a plant or a scene that is not
    there or is not what the run needs, SceneFailed for a scene that raises.
    """
    if not system.needs_plant:
        return None
    plant = _made(system, Path(base), renderer)
    try:
        prepare(plant, system.task, seed)
    except BaseException:
        with suppress(BaseException):  # whatever the user's class raises
            plant.close()
        raise
    return plant


def prepare(plant: Any, task: Task | None, seed: int) -> None:
    """Reset the plant and set the scene, if there is one."""
    path = task.scene if task else ""
    scene: Scene | None = made("scene", path, Scene) if path else None
    try:
        plant.reset(seed)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # whatever the user's class raises
        raise PlantFailed(error) from error
    if task is not None and task.starts:
        plant.truth.place(drawn(task.starts, seed))
    if scene is not None:
        try:
            scene.place(plant, np.random.default_rng(seed))
        except KeyboardInterrupt:
            raise
        except BaseException as error:  # as above
            raise SceneFailed(path, error) from error


def open_judge(system: System, plant: Any) -> Judge | None:
    """The judge of the system's task, if it has one; the scene is set.

    Raises UsageError for a judge that is not there or is not what the run needs.
    """
    task = system.task
    if task is None or not task.judge:
        return None
    but = "" if task.watch else "watch"
    judge: Judge = made("judge", task.judge, Judge, but, plant=plant)
    return judge


def made_plant(system: System, options: Options) -> Any:
    """The plant of a run; in real time, one that is not simulated is in the device host.

    Raises as `open_plant` does, but for the scene.
    """
    spec = system.plant
    assert spec is not None
    if options.bag is not None:
        from specc_runtime.ros2.bags.plant import BagPlant

        return BagPlant(system, options.bag, options.ros_args)
    is_hosted = options.real_time and bool(spec.python) and not is_simulated(spec.python)
    if is_hosted and spec.ros2 is not None:
        raise UsageError(
            f"the plant {spec.python!r} has ROS 2 beside it, so it has to simulate: if it does, "
            "say so: `simulated = True` in its class"
        )
    if is_hosted:
        from specc_runtime.hosting.python_plant import hosted

        return hosted(system, options.seed)
    is_recorded = options.profile is not None
    return _made(system, Path(options.base), options.renderer, options.ros_args, is_recorded)


def decoders(spec: PlantSpec) -> Mapping[str, Callable[[Any], Any]]:
    """What makes values of what a plant in the device host tells of its elements."""
    if spec.ros2 is not None:
        from specc_runtime.ros2.plant import conversions

        return conversions(spec)[0]
    from specc_runtime.hosting.python_plant import loaded

    return {binding.name: loaded for binding in spec.sensors}


def _made(
    system: System,
    base: Path,
    renderer: RendererName,
    ros_args: Sequence[str] = (),
    is_recorded: bool = False,
) -> Any:
    spec = system.plant
    assert spec is not None
    if spec.ros2 is None:
        return _simulation(spec, base, renderer)
    from specc_runtime.ros2.plant import ros2_plant

    node = partial(ros2_plant, system, ros_args, is_recorded=is_recorded)
    if not spec.is_simulated:
        return node()
    from specc_runtime.ros2.cell import simulated_cell

    return simulated_cell(_simulation(spec, base, renderer), node, spec.ros2.elements)


def _simulation(spec: PlantSpec, base: Path, renderer: RendererName) -> Any:
    if spec.python:
        return made("plant", spec.python, Plant)
    if not spec.model:
        names = [a.name for a in spec.actuators] + [s.name for s in spec.measured]
        raise UsageError(
            f"there is no plant behind {', '.join(names)}; add `plant:` to the specification, or "
            "run the system from Python with a plant (docs/your_robot.md)"
        )
    from specc_runtime.plants.mujoco import MujocoPlant

    others = spec.ros2.elements if spec.ros2 is not None else ()
    sensors = [each for each in (*spec.measured, *spec.observed) if each.name not in others]
    actuators = [each for each in spec.actuators if each.name not in others]
    return MujocoPlant(str(base / spec.model), sensors, actuators, renderer=renderer)
