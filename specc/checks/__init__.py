"""What is checked of a resolved system, in order: one fact about it per module."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from specc.checks import (
    actuators_driven_once,
    agent_kind,
    ages_bounded,
    ages_held,
    ages_known,
    axioms_consistent,
    axioms_needed,
    bindings_agree,
    bindings_fit,
    bindings_known,
    buffers_match,
    causes_have_rows,
    conditions_in_time,
    conditions_vary,
    constants_have_values,
    definitions_used,
    devices_bound,
    devices_owned,
    devices_simulated,
    devices_used,
    elements_read,
    elements_written,
    expressions_meant,
    memory_read,
    model_names_known,
    model_readable,
    names_distinct,
    noise_fits,
    one_writer,
    parts_used,
    presence_in_axioms,
    presence_in_conditions,
    presence_in_functions,
    presence_in_memory,
    rates_divide,
    rates_meet,
    readers_fast_enough,
    rows_can_apply,
    rows_complete,
    rows_exclusive,
    rows_proved,
    sensors_in_time,
    sizes_match,
    states_end,
    states_left,
    states_reached,
    subsystems_distinct,
    values_there,
    waits_end,
)
from specc.diagnostics import Diagnostic, stops
from specc.facts import Facts, Proofs
from specc.model.system import System

Check = Callable[[System, Facts], Iterator[Diagnostic]]

CHECKS: tuple[Check, ...] = (
    # structure and buffers
    subsystems_distinct.check,
    buffers_match.check,
    devices_owned.check,
    devices_used.check,
    agent_kind.check,
    rates_meet.check,
    readers_fast_enough.check,
    ages_bounded.check,
    # plant
    model_readable.check,
    bindings_known.check,
    devices_simulated.check,
    devices_bound.check,
    bindings_fit.check,
    model_names_known.check,
    sizes_match.check,
    bindings_agree.check,
    noise_fits.check,
    actuators_driven_once.check,
    sensors_in_time.check,
    # machines
    constants_have_values.check,
    expressions_meant.check,
    names_distinct.check,
    one_writer.check,
    axioms_consistent.check,
    rows_complete.check,
    rows_exclusive.check,
    causes_have_rows.check,
    conditions_vary.check,
    conditions_in_time.check,
    rows_can_apply.check,
    states_end.check,
    rows_proved.check,
    states_reached.check,
    states_left.check,
    axioms_needed.check,
    parts_used.check,
    # presence
    presence_in_functions.check,
    presence_in_conditions.check,
    presence_in_memory.check,
    presence_in_axioms.check,
    values_there.check,
)

USES: tuple[Check, ...] = (
    definitions_used.check,
    elements_read.check,
    elements_written.check,
    ages_known.check,
    ages_held.check,
    memory_read.check,
    waits_end.check,
    rates_divide.check,
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
