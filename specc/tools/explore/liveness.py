"""Live memory: which values a machine may still read, for each state.

Two configurations that differ only in memory that is written before it is read again have the same
runs. So memory that is not live is not tracked. Liveness is strong: a value that is read only to
compute memory that is not live does not live itself.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator

from specc.tools.explore.cone import Cone, ConeState


def live_memory(cone: Cone, observed: Collection[str] = ()) -> dict[str, frozenset[str]]:
    """By state, the memory that a machine in it may still read; `observed` is read at any time."""
    always = cone.dependences.all(cone.axioms).memory | set(observed)
    live = {
        state.name: always | cone.dependences.all(state.conditions).memory for state in cone.states
    }
    before = None
    while before != live:
        before = live
        live = {
            state.name: live[state.name].union(
                *(
                    _read_by_functions(cone, cone.state[target], live[target])
                    - cone.row_sets[row].keys()
                    for target, row in _steps(state)
                )
            )
            for state in cone.states
        }
    return live


def _steps(state: ConeState) -> Iterator[tuple[str, int]]:
    """The states that follow a state, each with the row that leads there, -1 for none."""
    yield state.name, -1
    for end in state.endings:
        yield from ((row.target, row.index) for row in end.rows)


def _read_by_functions(cone: Cone, state: ConeState, live: frozenset[str]) -> frozenset[str]:
    """The memory behind what the functions of a state send, and behind live memory."""
    assigned = dict(state.assignments)
    needed = [value for (peer, name), value in assigned.items() if peer or name in live]
    rests = cone.dependences.all([*needed, *state.failing])
    return rests.memory | {name for name in live if ("", name) not in assigned}
