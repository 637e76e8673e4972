"""W0417: states that may wait for ever because the sender does not send on every way."""

from specc.diagnostics.code import Code

_SYSTEM = """\
specc: 1
system: pair
agents:
  tells:
    control:
      rate: 10 Hz
      memory: {n: {type: int, init: 0}}
      y: {hears: {k: int}}
      functions: {count: {n: n + 1}, tell: {y.hears.k: n}}
      behaviours:
        tell: {functions: [tell], terminal: always}
        wait: {functions: [count], terminal: always}
      states: {S0: tell, S1: wait, S2: %s}
      initial_state: S0
      transitions:
        - [S0, terminal, always, S1]
        - [S1, terminal, always, S2]
        - [S2, terminal, always, S1]
  hears:
    control:
      rate: 10 Hz
      x: {tells: {k: {type: int, init: 0}}}
      conditions: {terminal: {told: fresh(x.tells.k)}}
      behaviours: {wait: {terminal: told}}
      states: {S0: wait}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
"""

CODES = (
    Code(
        "W0417",
        "state that may wait in vain",
        "Nothing but a new value of certain elements ends the state, and their sender can come to "
        "states from which it never sends them: because it works on without ever coming back to "
        "those that do, or because it takes up a request and goes back to rest without an answer. "
        "A sender that stops in a state with `terminal: never` says that it is meant to.",
        _SYSTEM % "wait",
        _SYSTEM % "tell",
    ),
)
