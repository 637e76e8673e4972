"""W0612 to W0614: machines that cannot go on as they seem to."""

from specc.diagnostics.code import Code

_STATES = "states: {S0: idle, S1: idle}\ntransitions:\n  - [S0, terminal, always, S1]\n"

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
)
