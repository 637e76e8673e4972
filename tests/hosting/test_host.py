"""A real host process with devices that work, fail, hang, flood and report nonsense."""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress
from pathlib import Path
from struct import pack
from typing import Any

import numpy as np
import pytest
from specc_runtime.faults import DeviceFailed
from specc_runtime.hosting.client import HostedPlant, Setup
from specc_runtime.hosting.wire import packed
from specc_runtime.options import UsageError
from specc_runtime.plant import NO_SAMPLE, Sample
from specc_runtime.plants.errors import PlantError

from tests.hosting.rig import DEVICES, HERE, log, plant, system, until

Q, U = "a.E.d.q", "a.E.d.u"


def raised(hosted: HostedPlant, call: Any = None) -> BaseException | None:
    """What the plant raises, once it does."""
    found: list[BaseException] = []

    def attempt() -> bool:
        try:
            (call or (lambda: hosted.advance(0.002)))()
        except (PlantError, DeviceFailed) as error:
            found.append(error)
        return bool(found)

    until(attempt)
    return found[0] if found else None


def test_a_run_from_the_first_sample_to_the_end(tmp_path: Path) -> None:
    hosted = plant(tmp_path, values={Q: "array"})
    hosted.bequeath("a.E.d", {U: [("safe", "safe")]})
    hosted.inherit(lambda: None)
    sample = hosted.sample(Q)
    assert type(sample) is Sample and 0.0 <= sample.age_s < 20.0
    assert (sample.value == np.arange(0x0100, 0x0D00, 0x0202).reshape(2, 3)).all()
    assert not sample.value.flags.writeable
    for value in (1.0, 2.0):
        hosted.actuate(U, value)
        hosted.advance(0.002)
        assert until(lambda value=value: log(tmp_path)[-1][1:] == (U, value))
    hosted.leave()
    hosted.actuate(U, np.float64(3.0))
    assert log(tmp_path)[-1][1:] == (U, 3.0)
    hosted.close()
    assert [entry[1:] for entry in log(tmp_path)] == [
        ("open", None),
        *((U, value) for value in (1.0, 2.0, 3.0)),
        ("close", None),
    ]


def test_a_safe_output_that_cannot_be_sent_leaves_the_next_one(tmp_path: Path) -> None:
    setup = Setup(DEVICES, {"log": str(tmp_path / "log")}, (str(HERE),), wait_s=20.0)
    hosted = HostedPlant(system(), setup, encode={U: lambda value: 1.0 / value})
    hosted.bequeath("a.E.d", {U: [("safe", 0.0), ("otherwise", 0.5)]})
    hosted._host.channel.flush()
    hosted._host.channel.close()  # as if the agent were gone
    assert until(lambda: (U, 2.0) in [entry[1:] for entry in log(tmp_path)])
    hosted._host.close()


def test_a_failure_of_a_device_is_raised_once(tmp_path: Path) -> None:
    hosted = plant(tmp_path, fails={f"send {U}": "error"})
    hosted.actuate(U, 1.0)
    assert isinstance(raised(hosted), DeviceFailed)
    hosted.actuate(U, 2.0)  # by a step that was under way
    hosted.leave()
    with pytest.raises(PlantError, match="does not work"):
        hosted.actuate(U, 3.0)
    hosted.close()


def test_a_host_that_is_killed_ends_the_run(tmp_path: Path) -> None:
    hosted = plant(tmp_path)
    os.kill(hosted._host._process.pid, signal.SIGKILL)
    assert str(raised(hosted)).startswith("the device host ended: killed by SIGKILL")
    hosted.actuate(U, 1.0)
    hosted.leave()
    with pytest.raises(PlantError, match="SIGKILL"):
        hosted.actuate(U, 1.0)
    hosted.close()


@pytest.mark.parametrize("python", ["/nowhere/python3", "py\0thon", "/dev/null"])
def test_a_python_that_does_not_exist(tmp_path: Path, python: str) -> None:
    with pytest.raises(UsageError, match="cannot start"):
        HostedPlant(system(), Setup(DEVICES, {}, python=python))


@pytest.mark.parametrize(
    ("program", "why"),
    [
        ("exit 3", "exit code 3"),
        ("echo 'not a Python' >&2; exit 1", "exit code 1; it said: not a Python"),
        ("kill -9 $$", "killed by SIGKILL"),
    ],
)
def test_a_python_that_is_none(tmp_path: Path, program: str, why: str) -> None:
    python = tmp_path / "python"
    python.write_text(f"#!/bin/sh\n{program}\n")
    python.chmod(0o755)
    with pytest.raises(PlantError) as raised:
        HostedPlant(system(), Setup(DEVICES, {}, python=str(python)))
    assert str(raised.value) == f"the device host ended before it began: {why}"


@pytest.mark.parametrize(
    ("fails", "why"),
    [
        ({"open": "error"}, "cannot open the devices: open does not work"),
        ({"open": "no such port"}, "cannot open the devices: RuntimeError: no such port (fail, "),
        ({"poll": "error"}, f"{Q}: poll does not work"),
    ],
)
@pytest.mark.long
def test_devices_that_cannot_be_opened(tmp_path: Path, fails: dict[str, str], why: str) -> None:
    with pytest.raises(PlantError) as raised:
        plant(tmp_path, fails=fails)
    assert str(raised.value).startswith(why)
    assert until(lambda: log(tmp_path)[-1][1] == "close")


@pytest.mark.long
def test_what_the_driver_said_is_told(tmp_path: Path) -> None:
    with pytest.raises(PlantError, match=r"it said: the driver says hello$"):
        plant(tmp_path, fails={"open": "error"})


@pytest.mark.long
@pytest.mark.parametrize(("values", "fails"), [({}, {}), ({Q: 1.0}, {"poll": "hang"})])
def test_devices_without_a_first_value_are_named(
    tmp_path: Path, values: dict[str, Any], fails: dict[str, str]
) -> None:
    setup = Setup(
        DEVICES,
        {"log": str(tmp_path / "log"), "values": values, "fails": fails},
        (str(HERE),),
        wait_s=1.0,
    )
    with pytest.raises(PlantError, match=r"no value within 1 s: a\.E\.d\.q, b\.E\.d\.q"):
        HostedPlant(system("a.E.d", "b.E.d"), setup)


@pytest.mark.long
@pytest.mark.parametrize("devices", ["stub_devices:None", "nowhere:Devices", "os:path", "x"])
def test_devices_that_are_none(tmp_path: Path, devices: str) -> None:
    with pytest.raises(PlantError, match=f"cannot load {devices}"):
        HostedPlant(system(), Setup(devices, {}, (str(HERE),), wait_s=20.0))


@pytest.mark.long
@pytest.mark.parametrize(
    ("value", "why"),
    [
        ("misfit", "a value that cannot be read: "),
        ("objects", "a value that cannot be read: "),
        ("code", "a value that cannot be read: NotPlain: threading.Thread is no plain data"),
        ("lock", "a value that is no plain data"),
        ("deep", "a value that is no plain data: RecursionError"),
    ],
)
def test_hostile_values_are_faults_of_their_element(tmp_path: Path, value: str, why: str) -> None:
    def read() -> None:
        hosted = plant(tmp_path, values={Q: value})
        try:
            hosted.sample(Q)
        finally:
            hosted.close()

    with pytest.raises(PlantError) as raised:
        read()
    assert why in str(raised.value)


@pytest.mark.long
def test_a_value_for_an_unknown_element_is_a_fault(tmp_path: Path) -> None:
    hosted = plant(tmp_path, values={Q: 1.0})
    hosted.close()
    with pytest.raises(PlantError, match=r"'b\.E\.x', which is no element that is read"):
        plant(tmp_path, values={"b.E.x": 1.0})


@pytest.mark.long
@pytest.mark.parametrize(
    ("fails", "why"),
    [
        ("error", "send a.E.d.u does not work"),
        ("out of range", "RuntimeError: out of range (fail, "),
    ],
)
def test_an_output_that_fails_is_the_fault_of_its_element(
    tmp_path: Path, fails: str, why: str
) -> None:
    hosted = plant(tmp_path, fails={f"send {U}": fails})
    hosted.actuate(U, 1.0)
    fault = raised(hosted)
    assert isinstance(fault, DeviceFailed)
    assert (fault.device, fault.culprit) == (U, f"device {U}") and fault.message.startswith(why)
    hosted.leave()
    with pytest.raises(PlantError):
        hosted.actuate(U, 1.0)
    hosted.actuate(U, "safe")
    hosted.close()
    assert log(tmp_path)[-2][1:] == (U, "safe")


@pytest.mark.long
def test_a_device_that_hangs_keeps_no_other_from_its_outputs(tmp_path: Path) -> None:
    built = system("a.E.d", "b.E.d")
    values = {Q: 1.0, "b.E.d.q": 2.0}
    hosted = plant(tmp_path, built, values=values, fails={f"send {U}": "hang", "close": "hang"})
    hosted.actuate(U, 1.0)
    hosted.actuate("b.E.d.u", 2.0)
    assert until(lambda: log(tmp_path)[-1][1:] == ("b.E.d.u", 2.0))
    hosted.leave()
    with pytest.raises(PlantError, match="has not taken it within"):
        hosted.actuate(U, 0.0)
    hosted.actuate("b.E.d.u", 3.0)
    with pytest.raises(PlantError, match="still closing"):
        hosted.close()
    assert hosted._host._process.returncode == 0


@pytest.mark.long
def test_a_device_that_floods_is_read(tmp_path: Path) -> None:
    hosted = plant(tmp_path, floods=True)
    for value in range(100):
        assert type(hosted.sample(Q)) is Sample
        hosted.actuate(U, value)
        hosted.advance(0.002)
    assert until(lambda: log(tmp_path)[-1][1:] == (U, 99))
    hosted.close()


@pytest.mark.long
def test_a_sporadic_element_has_a_sample_once(tmp_path: Path) -> None:
    hosted = plant(tmp_path, system(sporadic=True), fails={})
    os.kill(hosted._host._process.pid, signal.SIGSTOP)
    assert type(hosted.sample(Q)) is Sample
    assert hosted.sample(Q) is NO_SAMPLE
    os.kill(hosted._host._process.pid, signal.SIGCONT)
    assert until(lambda: hosted.sample(Q) is not NO_SAMPLE)
    hosted.close()


@pytest.mark.long
def test_an_element_that_is_not_renewed_is_a_fault(tmp_path: Path) -> None:
    hosted = plant(tmp_path)
    os.kill(hosted._host._process.pid, signal.SIGSTOP)
    first, again = hosted.sample(Q), hosted.sample(Q)
    assert again.value is first.value and again.age_s > first.age_s
    why = raised(hosted, lambda: hosted.sample(Q))
    os.kill(hosted._host._process.pid, signal.SIGCONT)
    hosted.close()
    assert str(why).startswith("there has been no new value for ")


@pytest.mark.parametrize(
    "words",
    [
        pack("<I", 7) + b"garbage",
        pack("<I", 0xFFFFFFFF),
        pack("<I", len(packed(1))) + packed(1),
        pack("<I", len(packed(()))) + packed(()),
        pack("<I", len(packed(("failed",)))) + packed(("failed",)),
        pack("<I", len(packed(("asked", "x")))) + packed(("asked", "x")),
    ],
)
def test_a_host_that_sends_no_message_ends_the_run(words: bytes, tmp_path: Path) -> None:
    hosted = plant(tmp_path)
    hosted._host.channel._incoming += words
    assert "the device host sent what is no message (" in str(raised(hosted))
    with suppress(PlantError):
        hosted.close()
    assert hosted._host._process.poll() is not None


@pytest.mark.long
def test_a_host_that_is_asked_to_end_ends_the_run_which_gives_safe_outputs(tmp_path: Path) -> None:
    hosted = plant(tmp_path)
    os.kill(hosted._host._process.pid, signal.SIGTERM)
    assert str(raised(hosted)) == "the device host was asked to end by SIGTERM"
    hosted.leave()
    hosted.actuate(U, "safe")
    hosted.close()
    assert [entry[1:] for entry in log(tmp_path)][-2:] == [(U, "safe"), ("close", None)]


@pytest.mark.long
def test_a_folder_of_ones_own_shadows_nothing_of_the_host(tmp_path: Path) -> None:
    """The folder of `host.py` is not searched, nor is the one that the runtime is installed in."""
    (tmp_path / "probe.py").write_text(
        "import sys\nclass Devices:\n"
        "    def open(self, config):\n        raise RuntimeError(sys.path)\n"
    )
    with pytest.raises(PlantError) as raised:
        HostedPlant(system(), Setup("probe:Devices", {}, (str(tmp_path),), sys.executable))
    assert "specc_runtime/hosting'" not in str(raised.value)


def test_an_element_for_which_there_was_no_safe_output_is_named(tmp_path: Path) -> None:
    made = plant(tmp_path, system(silence_s=1.0))
    told = made._silent("a.E.d", 2.0, {"a.E.d.u": ("", "value: no number"), "a.E.d.v": ("v", "")})
    assert "but none for a.E.d.u: the run was silent for 2 s" in told
    made.close()
