"""W0612 to W0614 and W0616: machines that cannot go on as they seem to."""

from specc.diagnostics.code import Code

_STATES = "states: {S0: idle, S1: idle}\ntransitions:\n  - [S0, terminal, always, S1]\n"
_UNUSED = (
    'memory: {n: {type: "vector[2]", init: "[1, _]"}}\n'
    'conditions: {initial: {small: "n[0] < 2", large: "%s"}}\n'
    "transitions: [[S0, terminal, small, S0], [S0, terminal, large, S0]]\n"
)

CODES = (
    Code(
        "W0612",
        "states that are never left",
        "Once the machine is in one of these states, its rows lead to no other one, although "
        "there are others. A single state is taken for the end if its behaviour says `terminal: "
        "never`; several are taken for the work if the other states only lead to them.",
        _STATES + "  - [S1, terminal, always, S1]\n",
        _STATES + "  - [S1, terminal, always, S0]\n",
        "subsystem",
    ),
    Code(
        "W0613",
        "condition that is constant",
        "The condition has the same truth value in every situation that the assumptions leave, so "
        "that asking for it decides nothing. `always` and `never` say so in the open. Conditions "
        "that depend on a parameter of a reused description are left alone.",
        'conditions: {terminal: {high: "x.c.d > 2[rad] and x.c.d < 1[rad]"}}\n'
        "behaviours: {idle: {terminal: high}}\n",
        'conditions: {terminal: {high: "x.c.d > 1[rad] and x.c.d < 2[rad]"}}\n'
        "behaviours: {idle: {terminal: high}}\n",
        "subsystem",
    ),
    Code(
        "W0614",
        "terminal condition that never ends a state",
        "An error condition goes before a terminal one (2.4). Here the error condition holds "
        "whenever the terminal condition does, so that this never ends a state.",
        "conditions:\n"
        '  terminal: {high: "x.c.d > 2[rad]"}\n'
        '  error: {too_high: "x.c.d > 1[rad]"}\n'
        "behaviours: {idle: {terminal: high, error: too_high}}\n"
        "transitions: [[S0, error, always, S0]]\n",
        "conditions:\n"
        '  terminal: {high: "x.c.d > 1[rad]"}\n'
        '  error: {too_high: "x.c.d > 2[rad]"}\n'
        "behaviours: {idle: {terminal: high, error: too_high}}\n"
        "transitions: [[S0, terminal, always, S0], [S0, error, always, S0]]\n",
        "subsystem",
    ),
    Code(
        "W0616",
        "rows proved for numbers only",
        "Every comparison with NaN but `!=` is false: neither `a < b` nor `a >= b` holds. The rows "
        "are complete and exclusive for numbers, and what they compare may be NaN: a component "
        "that is not used (`_`), the result of an operator, which is not known, or that of a "
        "division by zero. In generated code the rows are checked in every run.",
        _UNUSED % "n[0] >= 2",
        _UNUSED % "not n[0] < 2",
        "subsystem",
    ),
)
