"""E07xx: what is read although there may be nothing."""

from specc.diagnostics.code import Code

_RULES = (
    "An element of a buffer has no value before the first one arrives. It surely has one if a "
    "device reports it, if it declares an `init`, after the first period if the first period of a "
    "sender that is fast enough sends it, behind rows whose condition implies `fresh` or "
    "`present` of it (or of something that is always sent together with it), and beside a test "
    "in the same expression."
)
_REMEMBER = (
    'memory: {v_p: {type: "real[rad/s]", init: 0}}\n'
    "functions: {remember: {v_p: %s}}\n"
    "behaviours: {idle: {functions: [hold, sense, remember]}}\n"
)
_FAST = (
    'conditions: {terminal: {fast: "%s"}}\n'
    "behaviours: {idle: {terminal: fast}}\n"
    "transitions:\n  - [S0, terminal, always, S0]\n"
)
_MEMORY = 'memory: {v_p: {type: "real[rad/s]", init: %s}}\n'
_ASSUME = 'assume:\n  - {that: "%s", because: the control subsystem asks for no more}\n'
_SPEEDS = (
    "memory:\n"
    '  v_p: {type: "real[rad/s]", init: 0}\n'
    '  speeds: {type: "list[real[rad/s]]", init: "[]"}\n'
    "behaviours: {idle: {functions: [hold, sense, remember]}}\n"
)

CODES = (
    Code(
        "E0701",
        "function reads what may have no value",
        _RULES,
        _REMEMBER % "x.c.v",
        _REMEMBER % "x.c.v if present(x.c.v) else v_p",
        "subsystem",
    ),
    Code(
        "E0702",
        "condition reads what may have no value",
        _RULES,
        _FAST % "x.c.v > 1[rad/s]",
        _FAST % "present(x.c.v) and x.c.v > 1[rad/s]",
        "subsystem",
    ),
    Code(
        "E0703",
        "memory starts from what has no value",
        "Initial values of memory are computed in the first period, when only measurements of "
        "devices and elements with an `init` have a value.",
        _MEMORY % "x.c.v",
        _MEMORY % "0",
        "subsystem",
    ),
    Code(
        "E0704",
        "assumption reads what may have no value",
        "Assumptions are watched in every period in which conditions are evaluated, all but the "
        "first, so they read only what has a value from the second period on.",
        _ASSUME % "x.c.v < 5[rad/s]",
        _ASSUME % "not present(x.c.v) or x.c.v < 5[rad/s]",
        "subsystem",
    ),
    Code(
        "E0705",
        "value taken for granted may be None or empty",
        "A value of type `optional[T]` serves as a `T`, and a list as one that has an item, as "
        "`argmax` needs one, only behind a test: in the same expression, or in a state that is "
        "entered only by rows whose conditions imply it, as long as its behaviour does not write "
        "what was tested.",
        _SPEEDS + "functions: {remember: {v_p: argmax(v for v in speeds)}}\n",
        _SPEEDS + "functions:\n"
        '  remember: {v_p: "argmax(v for v in speeds) if len(speeds) > 0 else v_p"}\n',
        "subsystem",
    ),
)
