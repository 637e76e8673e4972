"""W0418: values of every period that come at irregular intervals."""

from specc.diagnostics.code import Code

_SYSTEM = """\
specc: 1
system: pair
agents:
  tells:
    control:
      rate: %s
      y: {hears: {k: int}}
      functions: {tell: {y.hears.k: 1}}
      behaviours: {tell: {functions: [tell], terminal: never}}
      states: {S0: tell}
      initial_state: S0
  hears:
    control:
      rate: 100 Hz
      x: {tells: {k: {type: int, init: 0}}}
      conditions: {terminal: {told: fresh(x.tells.k) and x.tells.k > 0}}
      behaviours: {wait: {terminal: told}}
      states: {S0: wait}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
"""

CODES = (
    Code(
        "W0418",
        "rates that do not divide",
        "The sender sends in every one of its periods, and the reader, which is faster, asks "
        "whether a value has come. As the rate of the sender does not divide that of the reader, "
        "the values come now after so many periods of the reader and now after one more. Where "
        "that does not matter, `max_age` says how old the value may be.",
        _SYSTEM % "30 Hz",
        _SYSTEM % "25 Hz",
    ),
)
