"""The benchmark of the compiler, and the systems that it makes up."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench import compile_time
from bench.harness import building
from bench.harness.synthetic import ring
from bench.harness.tables import table
from tests.compiled import anew


@pytest.mark.long
def test_tables_of_processes(tmp_path: Path) -> None:
    text = compile_time.processes(tmp_path, repeats=1)
    assert text.splitlines()[-1].startswith("specc build")
    assert (tmp_path / "build_1" / "irp_picking" / "system.py").is_file()


@pytest.mark.long
def test_tables_of_phases(tmp_path: Path) -> None:
    with anew():
        lines = compile_time.phases(tmp_path, sizes=[4], repeats=1).splitlines()
    assert lines[1].split() == ["phase", "flagship", "4", "states"]
    assert [line.split()[0] for line in lines[3:6]] == ["read", "shape", "resolve"]
    # Every phase is one that the compiler goes through: none was left without time.
    assert all(float(cell) > 0.0 for line in lines[3:] for cell in line.split()[-2:])


@pytest.mark.parametrize("n", [2, 5])
def test_a_ring_of_states_goes_round(n: int, tmp_path: Path) -> None:
    spec = tmp_path / "ring.yaml"
    spec.write_text(ring(n), encoding="utf-8")
    machine = building.fresh(building.generate(spec, tmp_path), tmp_path, "ring.motor")
    machine.x.E_go, machine.x.E_fault = True, False
    states = []
    for _ in range(2 * n):
        machine.step()
        states.append(machine.state)
    assert states == [f"S{i}" for i in range(n)] * 2
    machine.x.E_go, machine.x.E_fault = False, True
    machine.step()
    assert machine.state == "S0"


def test_columns_are_as_wide_as_their_texts() -> None:
    assert table("Title", ("a", "long head"), [("first", "1"), ("2nd", "10")]) == (
        "Title\na      long head\n-----  ---------\nfirst          1\n2nd           10\n"
    )
