"""The fleet of specs/rovers.yaml: four rovers of one description and their dispatcher."""

from __future__ import annotations

from tests.scenarios.runs import SPECS, run


def test_all_rovers_go_to_and_fro_and_wait_for_the_slowest() -> None:
    code, report = run(SPECS / "rovers.yaml", "--cycles", "3")
    assert code == 0
    assert [cycle["ended"] for cycle in report["cycles"]] == ["completed"] * 3
    rovers = [report["subsystems"][f"rovers_{i}.c"] for i in range(1, 5)]
    for rover in rovers:
        assert rover["transitions_taken"]["going terminal always -> finishing"] == 3
    on_the_way = [rover["states_visited"]["going"] for rover in rovers]
    slowest, fastest = on_the_way[0], on_the_way[-1]
    assert slowest == max(on_the_way) > fastest
