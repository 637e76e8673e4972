"""What is checked of a resolved system, in order: one fact about it per module."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from specc.analysis import Facts, Proofs
from specc.checks import (
    assumptions,
    bindings,
    constancy,
    expressions,
    plant,
    presence,
    rows,
    states,
    structure,
    timing,
    usage,
    values,
    waiting,
)
from specc.diagnostics import Diagnostic, stops
from specc.model.system import System

Check = Callable[[System, Facts], Iterator[Diagnostic]]

CHECKS: tuple[Check, ...] = (
    # structure and buffers
    structure.subsystems_distinct,
    structure.buffers_match,
    structure.devices_owned,
    structure.devices_used,
    structure.agent_kind,
    timing.rates_meet,
    timing.readers_fast_enough,
    timing.ages_bounded,
    # plant
    bindings.model_readable,
    bindings.bindings_known,
    bindings.records_made,
    bindings.devices_simulated,
    bindings.devices_bound,
    bindings.bindings_fit,
    bindings.model_names_known,
    plant.sizes_match,
    plant.bindings_agree,
    plant.noise_fits,
    bindings.actuators_driven_once,
    plant.sensors_in_time,
    # machines
    expressions.constants_have_values,
    expressions.expressions_meant,
    expressions.names_distinct,
    expressions.one_writer,
    assumptions.axioms_consistent,
    rows.rows_complete,
    rows.rows_exclusive,
    rows.causes_have_rows,
    constancy.conditions_vary,
    constancy.conditions_in_time,
    rows.rows_can_apply,
    states.states_end,
    rows.rows_proved,
    states.states_reached,
    states.states_left,
    assumptions.axioms_needed,
    usage.parts_used,
    # presence
    presence.presence_in_functions,
    presence.presence_in_conditions,
    presence.presence_in_memory,
    presence.presence_in_axioms,
    values.values_there,
)

USES: tuple[Check, ...] = (
    usage.definitions_used,
    usage.elements_read,
    usage.elements_written,
    timing.ages_known,
    timing.ages_held,
    usage.memory_read,
    waiting.waits_end,
    timing.rates_divide,
)
"""What is not used is said once nothing is wrong: what has errors counts as using nothing."""


def run_checks(
    system: System,
    broken: frozenset[str] = frozenset(),
    faulty: frozenset[str] = frozenset(),
    *,
    sound: bool = True,
) -> tuple[list[Diagnostic], Proofs]:
    """All findings about a system, and what was proved on the way.

    `broken` names the subsystems and devices with errors of their own; they are left out;
    `faulty` those with unknowns in them, about which less is said. The system is not `sound` if
    anything else was wrong before.
    """
    facts = Facts(system, broken, faulty)
    found = [finding for check in CHECKS for finding in check(system, facts)]
    sound = sound and not broken and not faulty
    if sound and not any(stops(finding.code, "build") for finding in found):
        found += [finding for check in USES for finding in check(system, facts)]
    return found, Proofs(facts)
