"""E07xx: inputs that are read before anything need have arrived."""

from specc.diagnostics.code import Code

_RULES = (
    "An element of a buffer has no value before the first one arrives. It surely has one if a "
    "device reports it, if it declares an `init`, after the first period if the first period of a "
    "sender that is fast enough sends it, behind rows whose condition implies `fresh` or "
    "`present` of it (or of something that is always sent together with it), and beside a test "
    "in the same expression."
)

CODES = (
    Code(
        "E0701",
        "function reads what may have no value",
        _RULES,
        "transitions: [[S0, terminal, always, S1]]    # S1 reads x.c.T_d\n",
        "transitions: [[S0, terminal, commanded, S1]]    # commanded: fresh(x.c.T_d)\n",
    ),
    Code(
        "E0702",
        "condition reads what may have no value",
        _RULES,
        "conditions: {terminal: {large: x.c.d > 1}}\n",
        "conditions: {terminal: {large: present(x.c.d) and x.c.d > 1}}\n",
    ),
    Code(
        "E0703",
        "memory starts from what has no value",
        "Initial values of memory are computed in the first period, when only measurements of "
        "devices and elements with an `init` have a value.",
        "memory: {d_p: {type: real, init: x.c.d_d}}\n",
        "memory: {d_p: {type: real, init: 0}}\n",
    ),
    Code(
        "E0704",
        "assumption reads what may have no value",
        "Assumptions are watched in every period, the first one included, so they read only what "
        "has a value then.",
        "assume: [{that: x.c.n < 5, because: ...}]\n",
        "assume: [{that: not present(x.c.n) or x.c.n < 5, because: ...}]\n",
    ),
)
