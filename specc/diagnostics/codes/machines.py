"""E06xx and W06xx: states, rows, functions and assumptions of a subsystem (2.3, 2.4)."""

from specc.diagnostics.code import Code

_ROWS = "states: {S0: idle}    # ends always\ntransitions:\n"

CODES = (
    Code(
        "E0601",
        "no row applies",
        "When a state ends by a cause, exactly one of its rows with that cause must apply (2.4). "
        "There is a situation in which none does; the message says which, and leaves out what "
        "does not matter.",
        _ROWS + "  - [S0, terminal, commanded, S0]    # fresh(x.c.d)\n",
        _ROWS + "  - [S0, terminal, commanded, S0]    # fresh(x.c.d)\n"
        "  - [S0, terminal, not_commanded, S0]    # not fresh(x.c.d)\n",
    ),
    Code(
        "E0602",
        "several rows apply",
        "When a state ends by a cause, exactly one of its rows with that cause must apply (2.4). "
        "There is a situation in which two do. Rows have no order of precedence.",
        _ROWS + "  - [S0, terminal, small, S0]    # x.c.d < 2\n"
        "  - [S0, terminal, large, S1]    # x.c.d > 1\n",
        _ROWS + "  - [S0, terminal, small, S0]    # x.c.d < 2\n"
        "  - [S0, terminal, large, S1]    # x.c.d >= 2\n",
    ),
    Code(
        "E0603",
        "cause without rows",
        "The terminal or the error condition of a state can hold, but the transition table has no "
        "row for that: there would be no next state.",
        "states: {S0: idle}    # ends always\ntransitions: []\n",
        _ROWS + "  - [S0, terminal, always, S0]\n",
    ),
    Code(
        "W0604",
        "row for a cause that never occurs",
        "The terminal or error condition of the state can never hold, so the row can never be "
        "taken.",
        "behaviours: {idle: {terminal: never}}\n" + _ROWS + "  - [S0, terminal, always, S0]\n",
        "behaviours: {idle: {terminal: never}}\ntransitions: []\n",
    ),
    Code(
        "W0605",
        "row that never applies",
        "The condition of the row contradicts the cause of its state or the assumptions, so the "
        "row can never be taken.",
        "terminal: {called: fresh(x.c.d)}\ninitial: {quiet: not fresh(x.c.d)}\n"
        "transitions: [[S0, terminal, quiet, S0]]\n",
        "terminal: {called: fresh(x.c.d)}\ntransitions: [[S0, terminal, always, S0]]\n",
    ),
    Code(
        "W0606",
        "rows not proved",
        "The conditions of the rows ask too many independent questions for a table of all "
        "answers. That exactly one row applies is then checked in every run, and a run in which it "
        "is not so ends with a fault.",
        "a row that asks 20 predicates, and another that asks them the other way round\n",
        "the same rows over a few lets or memory elements\n",
    ),
    Code(
        "W0607",
        "state that cannot be reached",
        "No sequence of rows leads from the initial state to this one, or only with a row that can "
        "never be taken.",
        "states: {S0: idle, S1: move}\ninitial_state: S0\n"
        "transitions: [[S0, terminal, always, S0]]\n",
        "states: {S0: idle, S1: move}\ninitial_state: S0\n"
        "transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]\n",
    ),
    Code(
        "E0608",
        "target written twice",
        "All functions of a behaviour take effect at once, so a target has one writer per "
        "behaviour; an order in which one would win does not exist.",
        "functions: {a: {m: 1}, b: {m: 2}}\nbehaviours: {idle: {functions: [a, b]}}\n",
        "functions: {a: {m: 1}, b: {n: 2}}\nbehaviours: {idle: {functions: [a, b]}}\n",
    ),
    Code(
        "E0609",
        "assumptions contradict each other",
        "From assumptions that cannot all be true anything follows, so every proof would be "
        "worthless. Nothing else is proved of the subsystem until they are mended.",
        "assume:\n"
        "  - {that: fresh(x.c.d), because: ...}\n  - {that: not fresh(x.c.d), because: ...}\n",
        "assume:\n  - {that: fresh(x.c.d), because: ...}\n",
    ),
    Code(
        "W0610",
        "assumption that nothing needs",
        "All proofs succeed without this assumption. It is watched in every run like the others, "
        "but it only looks like an argument.",
        "assume: [{that: x.c.n < 5, because: ...}]    # no condition asks for n\n",
        "assume: []\n",
    ),
    Code(
        "W0611",
        "part that is not used",
        "A behaviour that no state has, a function that no behaviour has, a condition that nothing "
        "asks, a let that no expression refers to, or a memory element that is neither read, "
        "written nor watched.",
        "let: {q_c: MJ(x.E.m_m)}    # and no expression refers to q_c\n",
        "let: {q_c: MJ(x.E.m_m)}\nfunctions: {sense: {y.c.q: q_c}}\n",
    ),
)
