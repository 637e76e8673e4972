"""Images go from the device host to the process that reads them, and not through the run's own."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from specc_runtime.blocks import Block
from specc_runtime.contracts import as_rgb
from specc_runtime.cycle import Executor
from specc_runtime.environment import decoders
from specc_runtime.hosting import client
from specc_runtime.hosting.client import HostedPlant, Setup
from specc_runtime.hosting.devices import Array
from specc_runtime.hosting.memory import SLOTS, Memory
from specc_runtime.hosting.views import Views
from specc_runtime.hosting.wire import parts_of
from specc_runtime.loading import load_system
from specc_runtime.options import Options
from specc_runtime.plant import Deferred
from specc_runtime.plants.binding import SensorBinding
from specc_runtime.processes.worker import Processes
from specc_runtime.records import StepRecord
from specc_runtime.ros2.binding import Ros2, Ros2Topic
from specc_runtime.system import PlantInput, PlantSpec

from specc import output, pipeline
from tests.commands import forgotten
from tests.hosting.rig import until
from tests.hosting.seeing import NOTE, SIZE
from tests.runtime.apart import children

SPEC = """\
specc: 1
system: seeing
types: {Image: "image[64, 128, 3]"}
operators:
  BLACK: {signature: "() -> Image", python: "tests.hosting.seeing:black"}
  LOOK: {signature: "(i: Image, before: Image) -> int", python: "tests.hosting.seeing:look"}
agents:
  eye:
    real_receptors: {cam: {y: {I: Image}}}
    virtual_receptors:
      cam:
        rate: 10 Hz
        budget: 80 ms
        x: {R: {I: Image}}
        y: {c: {n: int}}
        memory: {before: {type: Image, init: BLACK()}}
        functions: {look: {y.c.n: "LOOK(x.R.I, before)", before: x.R.I}}
        behaviours: {look: {functions: [look], terminal: never}}
        states: {S0: look}
        initial_state: S0
    control:
      rate: 50 Hz
      x: {cam: {n: {type: int, init: 0}}}
      memory: {n: {type: int, init: 0}}
      functions: {note: {n: x.cam.n}}
      behaviours: {note: {functions: [note], terminal: never}}
      states: {S0: note}
      initial_state: S0
plant: {python: "tests.hosting.seeing:Camera", bind: {eye.R.cam.I: {}}}
"""
CAM = "eye.cam"


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("seeing")
    spec = folder / "seeing.yaml"
    spec.write_text(SPEC)
    built = pipeline.build(str(spec), is_read=False)
    assert built.files, built.result.diagnostics
    with forgotten(folder):
        made = folder / "generated" / built.system
        assert not [*output.write(made, built.files)]
        yield made


class Host:
    """Stands for a host: the test itself writes into its memory."""

    memory: Memory

    def __init__(self, python: str, elements: int) -> None:
        block = Block.of_bytes(Memory.size(elements))
        self.memory = Memory(block, elements)
        Host.memory = Memory(Block(os.dup(block.descriptor)), elements)
        Host.write(0)

    @classmethod
    def write(cls, number: int, shape: tuple[int, ...] = SIZE) -> None:
        """An image that is full of a number."""
        image = np.full(shape, number, np.uint8)
        parts = parts_of(Array(image.dtype.str, image.shape, image.data))
        cls.memory.write(0, 0.0, parts[0], *parts[1])

    def open(self, wanted: Any, until_s: float) -> bool:
        return False

    class channel:  # noqa: N801  # an attribute of the real one
        is_over = False
        send = staticmethod(lambda *_: True)
        flush = staticmethod(lambda: True)
        received = staticmethod(lambda: ())

    def close(self) -> None:
        self.memory.close()


class Run:
    """A run with the reader of the camera here or `apart`, up to a step of it."""

    def __init__(self, package: Path, *apart: str) -> None:
        base = package.parent.parent
        options = Options(package, base, apart=apart)
        self.system = load_system(package, base)
        self.processes = Processes()
        self.processes.begin(self.system, options)
        self.records: list[StepRecord] = []
        self.plant = HostedPlant(self.system, Setup("none", {}))
        self.processes.wait()
        self.executor = Executor(
            self.system, self.plant, (self.records.append,), processes=self.processes
        )

    def step(self) -> None:
        """To the next period of the reader."""
        for _ in range(5):
            self.executor.advance()

    @property
    def seen(self) -> list[int]:
        return [record.sent[0][1] for record in self.records if record.subsystem == CAM]


@contextmanager
def run(package: Path, *apart: str) -> Iterator[Run]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(client, "Host", Host)
        made = Run(package, *apart)
        try:
            yield made
        finally:
            made.executor.close()


def test_images_are_read_where_the_host_has_put_them(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And stay as they are, the one of the step before as well, however fast the host goes on."""
    before = children()
    with run(package, CAM) as made:
        monkeypatch.setattr(client, "value_of", lambda *_: pytest.fail("read by the run"))
        for number in range(1, 9):
            made.step()
            for again in range(2 * SLOTS):
                Host.write(number if again else 99)
        made.executor.finish()
        x = made.system.scheduled(CAM).subsystem.x
        assert type(x.R_I) is Deferred
        (child,) = children() - before
        maps = Path(f"/proc/{child}/maps").read_text()
        assert "/dev/shm/" not in maps
    assert not made.executor.faults
    assert made.seen == [0, *(1000 * n + n - 1 for n in range(1, 8))]
    assert children() == before


@pytest.mark.long
def test_a_wrong_image_is_the_same_fault(package: Path) -> None:
    found = []
    for apart in ((), (CAM,)):
        with run(package, *apart) as made:
            made.step()
            Host.write(1, (64, 128, 4))
            made.step()
            made.executor.finish()
        (fault,) = made.executor.faults
        found.append(fault.as_data())
    assert found[0] == found[1]
    assert found[0]["culprit"] == "device eye.R.cam.I"


def test_what_the_run_itself_looks_at_it_reads_there(package: Path) -> None:
    with run(package, CAM) as made:
        worker = made.processes.get(CAM)
        assert worker is not None
        worker.observed = {"R_I"}
        made.step()
        x = made.system.scheduled(CAM).subsystem.x
        assert x.R_I.shape == SIZE and not x.R_I.any()
        Host.write(3)
        made.step()
        made.executor.finish()
    assert made.seen == [0, 3000]


@pytest.mark.long
def test_what_is_distorted_crosses_by_its_value(package: Path) -> None:
    """And the same sample by its place again, once it is not distorted any more."""
    with run(package, CAM) as made:
        made.plant._readings["eye.R.cam.I"].kept_s = math.inf
        more: Any = SimpleNamespace(value=lambda image: image + np.uint8(5))
        for distortion in (None, more, None):
            made.executor.distort("eye.R.cam.I", distortion)
            made.step()
        made.step()
    assert made.seen == [0, 5000, 5]


def test_more_images_than_there_are_places_for_are_copied(package: Path) -> None:
    with run(package) as made:
        kept = []
        for number in range(1, 3 * SLOTS):
            Host.write(number)
            kept.append(made.plant.sample("eye.R.cam.I").value)
        values = [each.value() if type(each) is Deferred else each for each in kept]
        assert [value[0, 0, 0] for value in values] == list(range(1, 3 * SLOTS))


def test_messages_of_ros_are_read_there_too() -> None:
    """Of an image in another order of colours; its place is free as soon as it is read."""
    spec = PlantSpec(
        sensors=(SensorBinding("a.R.cam.I", contract=as_rgb(4, 6)),),
        inputs=(PlantInput("a.R.cam.I", "a.cam", "R_I"),),
        ros2=Ros2("a", (Ros2Topic("a.R.cam.I", "/image", "sensor_msgs/Image", "image"),)),
    )
    image = np.random.default_rng(1).integers(0, 256, (4, 6, 3), np.uint8)
    told = {"height": 4, "width": 6, "step": 18, "encoding": "bgr8", "is_bigendian": 0}
    kind, parts = parts_of(told | {"data": image[:, :, ::-1].tobytes()})
    memory = Memory(Block.of_bytes(Memory.size(1)), 1)
    memory.write(0, 0.0, kind, *parts)
    raw = memory.read(0)
    assert raw is not None
    views = Views(spec, "a.cam", decoders(spec), os.dup(raw.descriptor))
    assert (views.value("R_I", raw.extent) == image).all()
    assert not views.extents_in_use()
    memory.close()


@pytest.mark.long
@pytest.mark.parametrize("recorded", [False, True])
def test_a_run_in_real_time(package: Path, tmp_path: Path, recorded: bool) -> None:
    """With a host that writes as fast as it can; one that is recorded can be repeated."""
    (tmp_path / "seeing.yaml").write_text(SPEC)
    more = ["--record", "r.mcap"] if recorded else []
    _specc(tmp_path, "run", "seeing.yaml", "--real-time", "--duration", "3", *more)
    if recorded:
        _specc(tmp_path, "replay", "r.mcap", "--spec", "seeing.yaml")


@pytest.mark.long
@pytest.mark.parametrize("which", ["run", "host", "worker"])
def test_nothing_is_left_of_whom_is_killed(tmp_path: Path, which: str) -> None:
    (tmp_path / "seeing.yaml").write_text(SPEC)
    command = [sys.executable, "-m", "specc", "run", "seeing.yaml", "--real-time"]
    with subprocess.Popen(
        [*command, "--duration", "60"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": os.getcwd(), NOTE: str(tmp_path / "looked")},
        stderr=subprocess.PIPE,
    ) as process:
        pids: dict[str, int] = {"run": process.pid}

        def is_under_way() -> bool:
            for pid in _children(process.pid):
                told = Path(f"/proc/{pid}/cmdline").read_bytes()
                pids["host" if b"hosting/host.py" in told else "worker"] = pid
            return len(pids) == 3 and (tmp_path / "looked").exists()

        assert until(is_under_way)
        os.kill(pids[which], signal.SIGKILL)
        process.communicate(timeout=60)
        assert until(lambda: not any(Path(f"/proc/{pid}").exists() for pid in pids.values()))
    assert not [name for name in os.listdir("/dev/shm") if "specc" in name or "psm_" in name]


def _children(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for task in tasks for child in task.read_text().split()]


def _specc(folder: Path, *arguments: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "specc", *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": os.getcwd()},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    assert done.returncode == 0, done.stdout + done.stderr
