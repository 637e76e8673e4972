"""E0410, W0415 and W0416: how old the measurements behind a value are where it is read."""

from specc.diagnostics.code import Code

_RULE = (
    "What a subsystem computes is seen by others one of its periods later, so that a value grows "
    "older with every subsystem that it passes through. "
)
_EYE = """\
specc: 1
system: eye
agents:
  eye:
    real_receptors: {eye: {y: {d: "real[m]"}}}
    virtual_receptors:
      eye:
        rate: %s
        x: {R: {d: "real[m]"}}
        y: {c: {d: "real[m]"}}
        memory: {d_p: {type: "real[m]", init: x.R.d}}
        functions: {look: {y.c.d: %s, d_p: x.R.d}}
        behaviours: {look: {functions: [look], terminal: always}, rest: {terminal: always}}
        states: {S0: look, S1: %s}
        initial_state: S0
        transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
    control:
      rate: 10 Hz
      x: {eye: {d: {type: "real[m]", init: 0, max_age: 60 ms}}}
      conditions: {terminal: {near_by: "x.eye.d < 0.1[m]"}}
      behaviours: {wait: {terminal: near_by}}
      states: {S0: wait}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
"""
_GOOD = _EYE % ("20 Hz", "x.R.d", "look")

CODES = (
    Code(
        "E0410",
        "value older than it may be",
        f"{_RULE}The reader says with `max_age` how long ago the measurements behind it may have "
        "been made, and in the timeline that follows from the rates it is longer. The places "
        "shown are the way of the oldest value. Memory is not followed: what is remembered has no "
        "age.",
        _EYE % ("10 Hz", "x.R.d", "look"),
        _GOOD,
    ),
    Code(
        "W0415",
        "limit of age without a measurement",
        f"{_RULE}Here no measurement is on the way within one work cycle: the value is made of "
        "constants or comes out of memory, so that `max_age` limits nothing.",
        _EYE % ("20 Hz", "d_p", "look"),
        _GOOD,
    ),
    Code(
        "W0416",
        "age that nothing limits",
        "A buffer keeps its last value. In some state of the sender none is sent, or a sporadic "
        "device may have no new sample, so that the value grows older for as long as that lasts, "
        "and the reader uses it also when it is not fresh.",
        _EYE % ("20 Hz", "x.R.d", "rest"),
        _GOOD,
    ),
)
