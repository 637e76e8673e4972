"""What a state waits for is sent, however the sender goes on."""

from __future__ import annotations

from collections.abc import Iterator

from specc.diagnostics import Diagnostic, Related
from specc.facts import Facts
from specc.facts.waiting import Rest, Waiting
from specc.facts.ways import Way
from specc.facts.words import listed
from specc.model.fsm import State
from specc.model.system import System


def check(system: System, facts: Facts) -> Iterator[Diagnostic]:
    """W0417, once for each sender that a state may wait for in vain."""
    waiting = Waiting(facts)
    for subsystem in facts.whole_subsystems:
        reached = facts.reached(subsystem)
        for state in subsystem.states:
            if state.name in reached:
                for needed, rest in waiting.in_vain(subsystem, state):
                    if facts.ways_are_known(rest.sender):
                        yield _finding(state, needed, rest)


def _finding(state: State, needed: Way, rest: Rest) -> Diagnostic:
    names = [f"`x.{peer}.{element}`" for peer, element in sorted(needed)]
    sender = f"`{rest.sender.qualified_name}`"
    related = [Related(rest.state.place, f"from here {sender} sends it no more")]
    if rest.row is not None:
        words = f"here {sender} takes up what it was sent before"
        where = f"may come to `{rest.state.name}` without an answer"
        related = [Related(rest.row.place, words), Related(rest.state.place, where)]
    return Diagnostic(
        "W0417",
        f"state `{state.name}` may wait for {listed(names, 'or')} in vain",
        state.place,
        "nothing else ends it",
        tuple(related),
        f"let {sender} send it on every way, or leave `{state.name}` after some time, with "
        "`elapsed`; if the sender is meant to end there, say so by `terminal: never`",
    )
