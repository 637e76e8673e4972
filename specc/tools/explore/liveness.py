"""Live values: which memory and which inputs a machine may still read, for each state.

Two configurations that differ only in values that are written before they are read again have the
same runs. So values that are not live are not tracked. Liveness is strong: a value that is read
only to compute memory that is not live does not live itself.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import replace

from specc.model import expr as m
from specc.proof import InputName
from specc.reachable import reachable
from specc.tools.explore.cone import Cone, ConeState
from specc.tools.explore.partial import KnownValues, residual


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


def live_inputs(cone: Cone) -> dict[str, frozenset[InputName]]:
    """By state, the inputs of which a machine in it may read a value that is not fresh."""
    static = cone.static_values
    read: dict[str, set[InputName]] = {}
    for state in cone.states:
        exprs = [*cone.axioms, *state.expressions]
        read[state.name] = {
            each.key for each in cone.inputs if _reads_stale(cone, exprs, each.key, static)
        }
    return {
        name: frozenset().union(*(read[each] for each in reachable([name], _targets(cone))))
        for name in read
    }


def _targets(cone: Cone) -> Callable[[str], Iterable[str]]:
    return lambda name: [target for target, _ in _steps(cone.state[name])]


def _reads_stale(cone: Cone, exprs: Iterable[m.Expr], key: InputName, static: KnownValues) -> bool:
    """Whether some expression reads an input that is not fresh."""
    known = replace(static, fresh={key: False}, _residuals={})
    reading = (expr for expr in exprs if key in cone.dependences.of(expr).values)
    return any(key in cone.dependences.of(residual(expr, known)).values for expr in reading)


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
