"""The checks of a resolved system: one list, top to bottom."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator

from specc.analysis import Facts
from specc.checks import (
    assumptions,
    bindings,
    conditions,
    disturbances,
    expressions,
    formulas,
    holding,
    memory,
    panel,
    plant,
    presence,
    python,
    rows,
    scenes,
    states,
    structure,
    timing,
    topics,
    usage,
)
from specc.diagnostics import Diagnostic, blocks
from specc.limits import is_used_up
from specc.model.expr import ParameterRef, walk
from specc.model.system import System
from specc.source import Place, Route

CheckFunction = Callable[[Facts], Iterator[Diagnostic]]

CHECKS: tuple[CheckFunction, ...] = (
    structure.subsystems_distinct,
    structure.devices_owned,
    structure.devices_used,
    structure.agent_kind,
    structure.buffers_match,
    structure.one_buffer_each,
    timing.rates_meet,
    timing.ticks_stepped,
    timing.readers_fast_enough,
    timing.ages_bounded,
    timing.sensors_in_time,
    timing.budgets_fit,
    timing.silences_are_borne,
    plant.model_readable,
    plant.bindings_known,
    plant.records_have_classes,
    plant.devices_simulated,
    plant.devices_bound,
    plant.sizes_match,
    plant.actuators_driven_once,
    plant.effectors_measured_apart,
    plant.sensors_read_once,
    bindings.bindings_fit,
    bindings.losses_answered,
    bindings.model_names_known,
    bindings.bindings_agree,
    bindings.distances_bounded,
    bindings.noise_fits,
    bindings.joints_like_actuators,
    bindings.elements_in_one_order,
    bindings.poses_measured,
    bindings.quaternions_ordered,
    plant.commands_obeyed,
    panel.panel_fits,
    panel.presses_arrive,
    topics.topics_fit,
    topics.messages_fit,
    topics.joints_counted,
    topics.frames_named,
    topics.calls_given_back,
    topics.calls_whole,
    topics.requests_passed_once,
    topics.published_known,
    scenes.starts_fit,
    scenes.disturbances_fit,
    scenes.silences_fit,
    scenes.adjustments_fit,
    disturbances.draws_vary,
    disturbances.disturbances_do,
    disturbances.repetitions_are_apart,
    disturbances.disturbances_last_ticks,
    disturbances.disturbances_differ,
    disturbances.errors_fit,
    panel.operation_fits,
    expressions.constants_have_values,
    expressions.lateness_of_subsystems,
    expressions.expressions_meant,
    expressions.names_distinct,
    expressions.one_writer,
    rows.rows_complete,
    rows.rows_exclusive,
    rows.causes_have_rows,
    rows.rows_can_apply,
    rows.rows_proved,
    conditions.conditions_vary,
    conditions.conditions_in_time,
    conditions.conditions_differ,
    memory.lists_end,
    formulas.formulas_vary,
    formulas.lets_are_not_aliases,
    formulas.windows_reach,
    formulas.requirements_differ,
    states.states_end,
    states.states_reached,
    states.states_can_be_left,
    assumptions.axioms_consistent,
    assumptions.axioms_needed,
    assumptions.axioms_hold,
    presence.inputs_present,
    presence.values_there,
    python.names_defined,
    usage.parts_used,
)
"""All checks, in the order in which they run."""

USES: tuple[CheckFunction, ...] = (
    timing.ages_known,
    timing.ages_limited,
    timing.rates_divide,
    timing.values_cross,
    conditions.memory_is_written,
    memory.counters_set_back,
    holding.commands_sent,
    holding.held_outputs_sent,
    usage.definitions_used,
    usage.observed_used,
    usage.formula_lets_used,
    usage.elements_read,
    usage.elements_written,
    usage.members_heard,
    usage.memory_read,
    states.waits_end,
)
"""Unused parts are reported only when nothing is wrong: parts with errors use nothing."""


def run_checks(
    system: System,
    broken: frozenset[str] = frozenset(),
    faulty: frozenset[str] = frozenset(),
    *,
    sound: bool = True,
) -> tuple[list[Diagnostic], Facts]:
    """Run all checks; returns the findings and the facts about the system.

    `broken` names the subsystems and devices with errors of their own; they are left out;
    `faulty` those with unknowns in them, about which less is said. The system is not `sound` if
    anything else was wrong before. Nothing is found of a system that is refused for its size,
    which the caller reports: the rest was not read.
    """
    facts = Facts(system, broken, faulty)
    if is_used_up("parts"):
        return [], facts
    found = [finding for check in CHECKS for finding in check(facts)]
    sound = sound and not broken and not faulty
    if sound and not any(blocks(finding.code, "build") for finding in found):
        found += [finding for check in USES for finding in check(facts)]
    found = _dead_in_all_uses(found, facts)
    return _whatever_arguments_are(found, facts), facts


_OF_DEAD_PARTS = ("W0604", "W0605", "W0607", "W0614")


def _dead_in_all_uses(found: list[Diagnostic], facts: Facts) -> list[Diagnostic]:
    """Drop findings about dead parts that are alive in another use of their description.

    A row that one value of a parameter excludes is there for the other values.
    """
    keys = [(finding.code, finding.primary, finding.message) for finding in found]
    dead = Counter(key for key in keys if key[0] in _OF_DEAD_PARTS)
    uses: Counter[Place] = Counter()
    for machine in facts.machines if dead else ():
        uses.update({state.place for state in machine.subsystem.states})
        uses.update({row.place for row in machine.subsystem.transitions})
    pairs = zip(found, keys, strict=True)
    return [finding for finding, key in pairs if key not in dead or dead[key] >= uses[key[1]]]


_OF_EXPRESSIONS = ("W0333", "W0338", "W0613", "W0617")


def _whatever_arguments_are(found: list[Diagnostic], facts: Facts) -> list[Diagnostic]:
    """Drop findings about expressions with parameters that one call makes odd.

    They are there for the arguments of other calls.
    """
    spans: dict[tuple[str, Route], list[tuple[int, int]]] = {}
    for generic in (g for machine in facts.machines for g in machine.subsystem.generics):
        for place, expr in generic.exprs:
            named = [node.span for node in walk(expr) if isinstance(node, ParameterRef)]
            spans.setdefault((place.file, place.route), []).extend(named)

    def has_parameter(at: Place) -> bool:
        named = [*spans.get((at.file, at.route), ()), *spans.get((at.file, at.route[:-1]), ())]
        return any(
            at.start is None or (at.start <= start and end <= (at.end or 0)) for start, end in named
        )

    return [f for f in found if f.code not in _OF_EXPRESSIONS or not has_parameter(f.primary)]
