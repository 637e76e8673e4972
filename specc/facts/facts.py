"""The shared queries about one system."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from specc.facts.bindings import Bound, bound_elements
from specc.facts.connections import Connections
from specc.facts.presence import Presence, find_presence
from specc.facts.reading import Readings
from specc.facts.steps import CAUSES, Step, find_steps, reached_from
from specc.mjcf import Model, ModelError, read_model
from specc.model.fsm import Cause, State, Transition
from specc.model.system import Subsystem, System
from specc.proof import Prover, RowVerdict


@dataclass(frozen=True, slots=True)
class Decided:
    """The verdict about the rows of one state and cause."""

    state: State
    cause: Cause
    verdict: RowVerdict


class Facts:
    """Answers about a system; a subsystem that is `broken` has errors and is not asked about."""

    def __init__(self, system: System, broken: frozenset[str] = frozenset()) -> None:
        self.system = system
        self.broken = broken
        self.connections = Connections(system)
        self.subsystems = tuple(s for s in system.subsystems if s.qualified_name not in broken)
        self._constants = {c.name: c.value for c in system.constants}
        self._provers: dict[str, Prover] = {}
        self._steps: dict[str, tuple[Step, ...]] = {}
        self._presence: dict[str, Presence] = {}
        self._verdicts: dict[tuple[str, str, Cause, int | None], RowVerdict] = {}
        self._readings: dict[str, Readings] = {}

    def prover(self, subsystem: Subsystem) -> Prover:
        """The prover of a subsystem."""
        name = subsystem.qualified_name
        if name not in self._provers:
            always = self.connections.always_present(subsystem)
            self._provers[name] = Prover(subsystem, self._constants, always)
        return self._provers[name]

    def rows(self, subsystem: Subsystem, state: str) -> tuple[Transition, ...]:
        """The rows of a state, of both causes."""
        verdicts = (self.verdict(subsystem, state, cause) for cause in CAUSES)
        return tuple(row for verdict in verdicts for row in verdict.rows)

    @cached_property
    def consistent_subsystems(self) -> tuple[Subsystem, ...]:
        """The subsystems whose axioms do not contradict each other."""
        return tuple(s for s in self.subsystems if not self.prover(s).contradiction())

    def decided(self) -> Iterator[Decided]:
        """The verdicts about every state and cause of every subsystem."""
        for subsystem in self.consistent_subsystems:
            for state in subsystem.states:
                for cause in CAUSES:
                    yield Decided(state, cause, self.verdict(subsystem, state.name, cause))

    def verdict(
        self, subsystem: Subsystem, state: str, cause: Cause, *, without: int | None = None
    ) -> RowVerdict:
        """The verdict about rows, with what is known of presence; `without` one axiom, if given."""
        key = subsystem.qualified_name, state, cause, without
        if key not in self._verdicts:
            present = self.presence(subsystem).in_conditions(state)
            prover = self.prover(subsystem)
            self._verdicts[key] = prover.prove_rows(state, cause, present=present, without=without)
        return self._verdicts[key]

    def steps(self, subsystem: Subsystem) -> tuple[Step, ...]:
        """The rows of a subsystem that may be taken, in the order of the file.

        Presence follows from them, so they are found without it.
        """
        name = subsystem.qualified_name
        if name not in self._steps:
            self._steps[name] = find_steps(subsystem, self.prover(subsystem))
        return self._steps[name]

    def reached(self, subsystem: Subsystem) -> frozenset[str]:
        """The states of a subsystem that it can enter."""
        return reached_from(subsystem.initial_state, self.steps(subsystem))

    def presence(self, subsystem: Subsystem) -> Presence:
        """Where the inputs of a subsystem surely have values."""
        name = subsystem.qualified_name
        if name not in self._presence:
            arrivals = self.connections.arrivals(subsystem, self.broken)
            self._presence[name] = find_presence(subsystem, self.steps(subsystem), arrivals)
        return self._presence[name]

    def readings(self, subsystem: Subsystem) -> Readings:
        """What the expressions of a subsystem read."""
        name = subsystem.qualified_name
        if name not in self._readings:
            close = self.presence(subsystem).arrivals.close
            self._readings[name] = Readings(subsystem, close)
        return self._readings[name]

    @cached_property
    def bindings(self) -> tuple[Bound, ...]:
        """The bindings of the plant whose device and element exist."""
        return tuple(bound_elements(self.system))

    @cached_property
    def model(self) -> Model | ModelError | None:
        """What the plant's model file declares, or why it cannot be read; None without a plant."""
        plant = self.system.plant
        if plant is None:
            return None
        base = os.path.dirname(plant.place.file)
        try:
            return read_model(os.path.join(base, plant.model))
        except ModelError as error:
            return error
