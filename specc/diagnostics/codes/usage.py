"""W0240, W0412 to W0414 and W0615: what is defined, sent or remembered for nothing."""

from specc.diagnostics.code import Code

_SYSTEM = """\
specc: 1
system: pair
agents:
  tells:
    control:
      rate: %s
      memory: {n: {type: int, init: 0}}
      y: {hears: {k: int}}
      functions: {count: {n: n + 1}, tell: {y.hears.k: %s}}
      behaviours:
        wait: {functions: [count], terminal: always}
        tell: {functions: [%s], terminal: always}
      states: {S0: wait, S1: tell}
      initial_state: S0
      transitions: [[S0, terminal, always, S1], [S1, terminal, always, S0]]
  hears:
    control:
      rate: 10 Hz
      x: {tells: {k: {type: int, init: 0}}}
      conditions: {terminal: {told: %s}}
      behaviours: {wait: {terminal: told}}
      states: {S0: wait}
      initial_state: S0
      transitions: [[S0, terminal, always, S0]]
"""
_GOOD = _SYSTEM % ("10 Hz", "n", "tell", "fresh(x.tells.k)")

CODES = (
    Code(
        "W0240",
        "definition that is not used",
        "Nothing in any agent refers to this operator, constant, file or type of the main "
        "file, neither directly nor through other definitions. A file that others use may define "
        "more than one of them needs, and is left alone.",
        'constants: {limit: "0.2[m]"}\n',
        "{}\n",
        "file",
    ),
    Code(
        "W0412",
        "element that nobody reads",
        "The element arrives and no expression of the subsystem asks for its value. Either "
        "something was forgotten, or both ends carry it for nothing.",
        _GOOD.replace("told: fresh(x.tells.k)", "told: 'elapsed > 1[s]'"),
        _GOOD,
    ),
    Code(
        "W0413",
        "element that nobody writes",
        "No behaviour of a state writes this element of the output buffer, so that its reader "
        "never gets a value.",
        _SYSTEM % ("10 Hz", "n", "count", "x.tells.k > 3"),
        _GOOD,
    ),
    Code(
        "W0414",
        "reader that can miss values",
        "The subsystem asks whether a value has come, but values can come faster than its periods. "
        "Of those that come in between it sees the last one only. A value that the sender writes "
        "in every period is taken for a measurement, of which the last one is all that matters.",
        _SYSTEM % ("100 Hz", "n", "tell", "fresh(x.tells.k)"),
        _GOOD,
    ),
    Code(
        "W0615",
        "memory that is not read",
        "Functions write this memory element and no expression asks for its value. If it is there "
        "for the judge of a task, the task has to watch it.",
        "memory: {n: {type: int, init: 0}}\n"
        "functions: {keep: {n: 1}}\n"
        "behaviours: {idle: {functions: [hold, sense, keep], terminal: always}}\n",
        "memory: {n: {type: int, init: 0}}\n"
        "functions: {keep: {n: n + 1}}\n"
        "behaviours: {idle: {functions: [hold, sense, keep], terminal: always}}\n",
        "subsystem",
    ),
)
