"""The graph of states: components, steps, what is reached, and what must hold on every way."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass
from typing import Generic, TypeVar

from specc.model.fsm import Transition
from specc.model.system import Subsystem
from specc.proof import InputName, RowVerdict
from specc.reachable import fixpoint, grouped, reachable

# What a transition graph falls into. The only door to networkx, which is imported when asked.


N = TypeVar("N", bound=Hashable)


@dataclass(frozen=True, slots=True)
class StrongComponent(Generic[N]):
    """Strongly connected nodes, in the order in which they were given.

    `has_entry` and `has_exit` say whether edges come from, and go to, other components.
    """

    states: tuple[N, ...]
    has_entry: bool
    has_exit: bool


def components(states: Sequence[N], edges: Iterable[tuple[N, N]]) -> tuple[StrongComponent[N], ...]:
    """The strongly connected components of a graph, each before those that it leads to.

    Edges from or to other states are left out.
    """
    import networkx

    order = {name: index for index, name in enumerate(states)}
    graph = networkx.DiGraph()
    graph.add_nodes_from(states)
    graph.add_edges_from((a, b) for a, b in edges if a in order and b in order)
    condensed = networkx.condensation(graph)
    return tuple(
        StrongComponent(
            tuple(sorted(condensed.nodes[node]["members"], key=order.__getitem__)),
            condensed.in_degree(node) > 0,
            condensed.out_degree(node) > 0,
        )
        for node in networkx.topological_sort(condensed)
    )


def last_components(following: Mapping[int, Set[int]]) -> list[frozenset[int]]:
    """The components of a graph of numbers that no edge leaves, by their smallest number."""
    import networkx

    graph = networkx.DiGraph()
    graph.add_nodes_from(following)
    graph.add_edges_from((here, there) for here, out in following.items() for there in out)
    found = networkx.strongly_connected_components(graph)
    # networkx has `attracting_components`, which makes a second graph, of all components.
    last = (members for members in found if all(following[each] <= members for each in members))
    return sorted(map(frozenset, last), key=min)


def all_lead_to(goal: str, edges: Iterable[tuple[str, str]], states: frozenset[str]) -> bool:
    """Whether `goal` can be reached from each of the states."""
    sources = grouped((target, source) for source, target in edges)
    return states <= reachable([goal], lambda state: sources.get(state, ())).keys()


# The transition graph of a machine without the rows that can never be taken.


@dataclass(frozen=True, slots=True)
class RowEdge:
    """A row that can be taken, and the inputs that have a value whenever it is."""

    row: Transition
    ensures: frozenset[InputName]


def find_edges(subsystem: Subsystem, verdicts: Iterable[RowVerdict]) -> tuple[RowEdge, ...]:
    """The rows whose cause and condition can hold together, in the order of the file."""
    found: dict[int, RowEdge] = {}
    for verdict in verdicts:
        decision = verdict.decision
        of_rows = zip(verdict.rows, decision.satisfiable, decision.ensures, strict=True)
        for row, possible, ensures in of_rows:
            if possible:
                found[id(row)] = RowEdge(row, ensures)
    return tuple([found[id(row)] for row in subsystem.transitions if id(row) in found])


def reachable_from(start: str, leaving: Mapping[str, Iterable[RowEdge]]) -> frozenset[str]:
    """The states that edges lead to from `start`, itself included; `leaving` has them by source."""
    return frozenset(
        reachable([start], lambda state: [step.row.target for step in leaving.get(state, ())])
    )


# Ways through the transition table of a machine.


MOST_PATHS = 6
"""Ways to a state that are tried, and ways through every other one."""

TransitionPath = tuple[Transition, ...]


def paths(rows: Iterable[Transition], start: str, end: str) -> Iterator[TransitionPath]:
    """Ways from a state to another one, the shortest first.

    They enter no state twice, but by a row that resumes a mode, and that row once.
    """
    rows = list(rows)
    is_resumed = any(row.is_return and row.target == end for row in rows)
    leaving = grouped((row.source, row) for row in rows)
    open_: deque[TransitionPath] = deque([()])
    visits: Counter[str] = Counter()
    while open_:
        path = open_.popleft()
        here = path[-1].target if path else start
        visits[here] += 1
        if visits[here] > MOST_PATHS:
            continue
        if here == end:
            yield path
            if not is_resumed:
                continue
        been = {start, *(row.target for row in path)}
        open_ += [
            (*path, row)
            for row in leaving.get(here, ())
            if row.target not in been or (row.is_return and row not in path)
        ]


# The flow equations of a machine.


T = TypeVar("T")
W = TypeVar("W")
FactsByState = dict[str, frozenset[T]]
"""What holds in each state whenever its functions are executed."""


def must_hold(
    initial: FactsByState[T],
    edges: Mapping[str, Sequence[tuple[str, W]]],
    transfer: Callable[[frozenset[T], str, frozenset[T], W], frozenset[T]],
) -> FactsByState[T]:
    """The greatest solution of the forward flow equations: facts that hold on every path.

    `initial` has the largest possible set of each state, `edges` the targets of each state with
    labels. `transfer` gives the facts of a target that hold after an edge; its arguments are the
    facts, the source, the facts of the source, and the label.
    """
    facts = dict(initial)

    def narrow(state: str) -> Iterator[str]:
        for target, way in edges.get(state, ()):
            now = transfer(facts[target], state, facts[state], way)
            if now != facts[target]:
                facts[target] = now
                yield target

    fixpoint(facts, narrow)
    return facts
