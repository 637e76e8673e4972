"""E06xx and W06xx: states, rows, functions and assumptions of a subsystem (2.3, 2.4)."""

from specc.diagnostics.code import Code

_FRESH = "commanded: fresh(x.c.v), not_commanded: not fresh(x.c.v)"
_SIZES = (
    'conditions: {initial: {small: "x.c.d < 2[rad]", large: "x.c.d %s"}}\n'
    "transitions:\n"
    "  - [S0, terminal, small, S0]\n"
    "  - [S0, terminal, large, S0]\n"
)
_CALLED = (
    f"conditions: {{terminal: {{called: fresh(x.c.v)}}, initial: {{{_FRESH}}}}}\n"
    "behaviours: {idle: {terminal: called}}\n"
    "transitions:\n"
)
_FAILING = (
    "conditions: {error: {stopped: fresh(x.c.v)}}\n"
    "behaviours: {idle: {terminal: always, error: stopped}}\ntransitions:\n"
)
_ENDED = "conditions: {terminal: {ended: %s}}\nbehaviours: {idle: {terminal: ended}}\n"
_TIMED = (
    'conditions: {terminal: {called: fresh(x.c.v)}, error: {late: "elapsed %s 2[s]"}}\n'
    "behaviours: {idle: {terminal: called, error: late}}\n"
    "transitions: [[S0, terminal, always, S0], [S0, error, always, S0]]\n"
)
_STATES = "states: {S0: idle, S1: idle}\ninitial_state: S0\ntransitions:\n"
_ASSUME = "assume:\n  - {that: fresh(x.c.v), because: both are sent in every period}\n"


def _sums(second: str) -> str:
    return (
        "memory: {a: {type: real, init: 0}, b: {type: real, init: 0}, c: {type: real, init: 0}}\n"
        f"conditions: {{initial: {{less: a + b < c, more: {second}}}}}\n"
        "transitions:\n  - [S0, terminal, less, S0]\n  - [S0, terminal, more, S0]\n"
    )


CODES = (
    Code(
        "E0601",
        "no row applies",
        "When a state ends by a cause, exactly one of its rows with that cause must apply (2.4). "
        "There are situations in which none does; the message says which, and leaves out what "
        "does not matter. Values that lead there are an example. Where several states ask the "
        "same conditions and fail alike, it is said once, for all of them. `specc witness` writes "
        "a test for each that runs into it.",
        f"conditions: {{initial: {{{_FRESH}}}}}\ntransitions:\n  - [S0, terminal, commanded, S0]\n",
        f"conditions: {{initial: {{{_FRESH}}}}}\n"
        "transitions:\n"
        "  - [S0, terminal, commanded, S0]\n"
        "  - [S0, terminal, not_commanded, S0]\n",
        "subsystem",
    ),
    Code(
        "E0602",
        "several rows apply",
        "When a state ends by a cause, exactly one of its rows with that cause must apply (2.4). "
        "There are situations in which two do; the message says which, of all rows together, and "
        "beside each two rows it says where these do. Values that lead there are an example. Rows "
        "have no order of precedence. The row that could ask for less is one that applies where no "
        "other row does: it keeps that, so that no two rows come to ask the same. Where several "
        "states ask the same conditions and fail alike, it is said once, for all of them. "
        "`specc witness` writes a test for each that runs into it.",
        _SIZES % "> 1[rad]",
        _SIZES % ">= 2[rad]",
        "subsystem",
    ),
    Code(
        "E0603",
        "cause without rows",
        "The terminal or the error condition of a state can hold, but the transition table has no "
        "row for that, although it has rows for the other: there would be no next state.",
        f"{_FAILING}  - [S0, terminal, always, S0]\n",
        f"{_FAILING}  - [S0, terminal, always, S0]\n  - [S0, error, always, S0]\n",
        "subsystem",
    ),
    Code(
        "W0604",
        "row for a cause that never occurs",
        "The terminal or error condition of the state can never hold, so the row can never be "
        "taken.",
        "behaviours: {idle: {terminal: never}}\ntransitions:\n  - [S0, terminal, always, S0]\n",
        "behaviours: {idle: {terminal: never}}\ntransitions: []\n",
        "subsystem",
    ),
    Code(
        "W0605",
        "row that never applies",
        "The condition of the row contradicts the cause of its state or the assumptions, so the "
        "row can never be taken.",
        f"{_CALLED}  - [S0, terminal, commanded, S0]\n  - [S0, terminal, not_commanded, S0]\n",
        f"{_CALLED}  - [S0, terminal, commanded, S0]\n",
        "subsystem",
    ),
    Code(
        "W0606",
        "rows not proved",
        "That exactly one row applies is not proved. Either it holds of exact numbers, but those "
        "of a run are rounded; or the rows ask too much for a table of all answers, and the solver "
        "(installed by `specc[proof]`) does not decide it either. It is then checked in every run, "
        "and a run in which it is not so ends with a fault.",
        _sums("a >= c - b"),
        _sums("not (a + b < c)"),
        "subsystem",
    ),
    Code(
        "W0607",
        "state that cannot be reached",
        "No sequence of rows leads from the initial state to this one, or only with a row that can "
        "never be taken.",
        f"{_STATES}  - [S0, terminal, always, S0]\n  - [S1, terminal, always, S0]\n",
        f"{_STATES}  - [S0, terminal, always, S1]\n  - [S1, terminal, always, S0]\n",
        "subsystem",
    ),
    Code(
        "E0608",
        "target written twice",
        "All functions of a behaviour take effect at once, so a target has one writer per "
        "behaviour; an order in which one would win does not exist.",
        'functions: {hold: {y.E.c_d: "[0, 0]"}, push: {y.E.c_d: "[1[A], 0]"}}\n'
        "behaviours: {idle: {functions: [hold, push, sense], terminal: always}}\n",
        'functions: {hold: {y.E.c_d: "[0, 0]"}, push: {y.E.c_d: "[1[A], 0]"}}\n'
        "behaviours: {idle: {functions: [hold, sense], terminal: always}}\n",
        "subsystem",
    ),
    Code(
        "E0609",
        "assumptions contradict each other",
        "From assumptions that cannot all be true anything follows, so every proof would be "
        "worthless. Nothing else is proved of the subsystem until they are mended.",
        f"{_ASSUME}  - {{that: not fresh(x.c.v), because: the control subsystem is slow}}\n",
        _ASSUME,
        "subsystem",
    ),
    Code(
        "W0610",
        "assumption that nothing needs",
        "All proofs succeed without this assumption. It is watched in every run like the others, "
        "but it only looks like an argument.",
        "assume:\n  - {that: fresh(x.c.v) or not fresh(x.c.d), because: both are sent together}\n",
        "conditions: {initial: {commanded: fresh(x.c.v)}}\n"
        "transitions:\n  - [S0, terminal, commanded, S0]\n"
        "assume:\n  - {that: fresh(x.c.v), because: the control subsystem is fast}\n",
        "subsystem",
    ),
    Code(
        "W0611",
        "part that is not used",
        "A behaviour that no state has, a function that no behaviour has, a condition that nothing "
        "asks, a let that no expression refers to, or a memory element that is neither read, "
        "written nor watched.",
        'let: {q_c: "x.E.m_m[0]"}\n',
        'let: {q_c: "x.E.m_m[0]"}\nfunctions: {sense: {y.c.q: q_c}}\n',
        "subsystem",
    ),
    Code(
        "W0617",
        "part of a condition that is constant",
        "A part of a condition always holds, or never does, by what its own subsystem says: its "
        "parts contradict each other or cover everything, time settles it, or functions always "
        "assign the same to the memory that it asks. `entered` never holds in "
        "conditions. What is settled by a literal `True` or `False`, or by constants or parameters "
        "alone, is taken to be meant, and so is what peers happen to send.",
        _ENDED % '"fresh(x.c.v) or x.c.d > 2[rad] and x.c.d < 1[rad]"',
        _ENDED % '"fresh(x.c.v) or x.c.d > 1[rad] and x.c.d < 2[rad]"',
        "subsystem",
    ),
    Code(
        "W0618",
        "condition that comes too late",
        "Some time after its start a state is over for certain, and this condition can hold only "
        "later. If an error condition holds in every case when it is first asked, the terminal "
        "condition never has its turn: an error is asked first.",
        _TIMED % "<",
        _TIMED % ">",
        "subsystem",
    ),
)
