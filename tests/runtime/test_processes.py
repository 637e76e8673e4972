"""A subsystem in a process of its own: the same records, the same faults, and nothing is left."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from specc_runtime.faults import StepFailed
from specc_runtime.interruption import Abandoned
from specc_runtime.loading import load_system
from specc_runtime.options import UsageError
from specc_runtime.processes import channel
from specc_runtime.track import outcome_of

from tests.commands import forgotten
from tests.runtime.apart import FAR, SPEC, Run, built, children, misdeed
from tests.runtime.misdeeds import BABBLE
from tests.seeds import short


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("apart")
    with forgotten(folder):
        yield built(folder)


def test_an_input_without_a_value_is_named_as_in_the_specification(package: Path) -> None:
    near = load_system(package).scheduled("near.c").subsystem
    for attribute, name in (("far_n", "x.far.n"), ("far_m", "input far_m")):
        fault = outcome_of(near, (), lambda attribute=attribute: getattr(near.x, attribute))
        assert isinstance(fault, StepFailed)
        assert fault.message == f"LookupError: {name} has no value"


def _memory(run: Run) -> list[object]:
    memory = run.system.scheduled(FAR).subsystem.memory
    return [getattr(memory, name, None) for name in type(memory).__slots__]


def test_the_records_are_those_of_one_process(package: Path) -> None:
    """Opaque values by their codecs, arrays by the memory of both, what does not change once."""
    with Run(package) as alone:
        alone.to(120).executor.finish()
    before = children()
    with Run(package, FAR, record=Path("told")) as apart:
        apart.to(120).executor.finish()
        (child,) = children() - before
        maps = Path(f"/proc/{child}/maps").read_text()
        assert "/memfd:" in maps, "the memory of both has no name that could be left behind"
        assert "/dev/shm/" not in maps
        assert apart.executor.busy_s[FAR] > 0.0
    assert children() == before
    assert not alone.faults
    assert not apart.faults
    assert len(alone.records) == len(apart.records) == 144
    assert apart.digest.hexdigest() == alone.digest.hexdigest()
    assert _memory(apart) == _memory(alone)


def test_a_process_that_ends_is_a_fault(package: Path) -> None:
    with misdeed("leave"), Run(package, FAR) as run:
        run.to(200)
    (fault,) = run.faults
    assert (fault["fault"], fault["subsystem"], fault["culprit"]) == (
        "ProcessEnded",
        FAR,
        f"subsystem {FAR}",
    )
    assert fault["message"] == "its process ended with exit code 3"
    assert "near_n" in fault["inputs"]


@pytest.mark.parametrize("number", short(range(len(BABBLE)), 0, 5))
def test_a_process_that_sends_no_message_is_a_fault(number: int, package: Path) -> None:
    """The watchdog, which has a socket of its own, gets no answer either."""
    before = children()
    with misdeed(f"babble {number}"), Run(package, FAR) as run:
        run.to(200)
        assert run.processes.under_way() == []
    assert children() == before
    (fault,) = run.faults
    assert (fault["fault"], fault["culprit"]) == ("ProcessEnded", f"subsystem {FAR}")
    assert "its process was ended: it sent what is no message (" in str(fault["message"])
    assert "near_n" in fault["inputs"]


def test_what_is_too_large_to_cross_is_a_fault(package: Path) -> None:
    """An array goes by the memory of both, which does not grow for ever."""
    with misdeed("crowd"), Run(package, FAR) as run:
        run.to(200)
    (fault,) = run.faults
    assert (fault["fault"], fault["culprit"]) == ("StepFailed", f"subsystem {FAR}")
    assert re.search(r"too large .*\(0\.0 MB, and at most 0\.0 MB may cross", fault["message"])
    assert "give it no `budget`" in fault["message"]


def test_what_is_too_large_to_be_given_is_a_fault(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(channel, "LARGEST_BYTES", 1000)
    with Run(package, FAR) as run:
        run.to(200)
    (fault,) = run.faults
    assert (fault["fault"], fault["culprit"]) == ("StepFailed", f"subsystem {FAR}")
    assert "at most 0.0 MB may cross at once" in fault["message"]


def test_a_step_that_hangs_is_told_and_left(package: Path) -> None:
    """With the operator, the line and the place: those of the process that computes it."""
    before = children()
    with misdeed("hang"), Run(package, FAR) as run:
        _to_the_misdeed(run)
        while not (words := run.processes.under_way()):
            pass
        assert words[0].startswith("operator ACT (tests.runtime.misdeeds:act) in far.c ")
        run.executor.abandon(Abandoned("still computing"))
    assert children() == before
    (fault,) = run.faults
    assert fault["fault"] == "StepAbandoned"
    assert fault["message"] == "Abandoned: still computing"
    assert fault["culprit"] == "operator ACT (tests.runtime.misdeeds:act)"
    assert str(fault["place"]).startswith("_hang (misdeeds.py:")
    assert "ACT(" in str(fault["line"])


def _to_the_misdeed(run: Run) -> None:
    """To the step that is not waited for here: it ends when the next one is due."""
    with Run(run.options.directory) as other, misdeed("raise"):
        other.to(1000)
    (fault,) = other.faults
    run.to(round(float(fault["time_s"]) / 0.02) + 1)


@pytest.mark.parametrize(
    "name",
    ["raise", *(pytest.param(n, marks=pytest.mark.long) for n in ("exit", "interrupt", "recurse"))],
)
def test_what_an_operator_raises_is_the_same_fault(name: str, package: Path) -> None:
    with misdeed(name):
        found = []
        for names in ((), (FAR,)):
            with Run(package, *names) as run:
                run.to(1000)
            found.append((run.faults, run.executor.tick, run.digest.hexdigest()))
    assert found[0] == found[1]
    assert found[0][0][0]["culprit"] == "operator ACT (tests.runtime.misdeeds:act)"


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("die", "its process was ended by SIGKILL, as the system does when memory is short"),
        ("segfault", "its process was ended by SIGSEGV"),
    ],
)
def test_a_process_that_is_killed_is_a_fault(name: str, words: str, package: Path) -> None:
    with misdeed(name), Run(package, FAR) as run:
        run.to(1000)
    assert [fault["message"] for fault in run.faults] == [words]


@pytest.mark.long
def test_what_an_operator_prints_is_seen(package: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with misdeed("print"), Run(package, FAR) as run:
        run.to(200)
    assert "from an operator\n" in capfd.readouterr().out


@pytest.mark.long
def test_nobody_is_asked(package: Path) -> None:
    with misdeed("ask"), Run(package, FAR) as run:
        run.to(200)
    assert "EOFError" in str(run.faults[0]["message"])


def test_values_that_cannot_cross_are_named(tmp_path: Path) -> None:
    text = re.sub(" +codec: .*\n", "", SPEC)
    with forgotten(tmp_path), pytest.raises(UsageError) as refused:
        Run(built(tmp_path, text), FAR)
    assert "far.c cannot compute in a process of its own" in str(refused.value)
    assert "near.blob (Blob)" in str(refused.value)
    assert "codec" in str(refused.value)
