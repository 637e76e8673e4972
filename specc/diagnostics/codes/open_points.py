"""Oxxxx: what is not there yet. Section 3 is iterated; a specification is mostly incomplete."""

from specc.diagnostics.code import Code

_VIRTUAL = (
    "agents:\n  two:\n    control: {%sx: {m: {n: int}}, behaviours: {w: {terminal: never}}, "
    "states: {S0: w}%s}\n"
    "    virtual_effectors:\n      m: {rate: 10 Hz, y: {c: {n: int}}, "
    "functions: {f: {y.c.n: 1}}, behaviours: {w: {functions: [f], terminal: never}}, "
    "states: {S0: w}, initial_state: S0}\n"
)
_WHOLE = _VIRTUAL % ("rate: 10 Hz, ", ", initial_state: S0")
_IDLE = "rate: 5 Hz, behaviours: {wait: {terminal: never}}, states: {S0: wait}, initial_state: S0"
_EYE = "real_receptors: {eye: {y: {d: int}}}\n"
_GRIPPER = (
    "virtual_effectors:\n  g:\n    rate: 10 Hz\n    y: {c: {closed: bool}}\n"
    "    functions: {tell: {y.c.closed: True}}\n"
    "    behaviours: {wait: {functions: [tell], terminal: never}}\n"
    "    states: {S0: wait}\n    initial_state: S0\n"
)
_ASKS = "conditions:\n  initial: {commanded: %s}\ntransitions: [[S0, terminal, commanded, S0]]\n"
_RESTED = "behaviours: {rest: {%s}}\nstates: {S0: idle, S1: rest}\n"
_ROWS = "transitions:\n  - [S0, terminal, always, S1]\n"

CODES = (
    Code(
        "O0201",
        "operator without a Python function",
        "The signature of the operator is known, which is enough for all checks. Its function is "
        "not written yet; code cannot be generated before.",
        'operators: {DK: {signature: "(q: real[rad]) -> pose[B, E]"}}\n',
        'operators: {DK: {signature: "(q: real[rad]) -> pose[B, E]", python: "arm.chain:pose"}}\n',
        "file",
    ),
    Code(
        "O0202",
        "condition without a text",
        "The condition has a name and is used, but nothing says yet when it holds. Proofs leave "
        "it open: what is proved holds whatever it will be.",
        _ASKS % "{title: a speed has come}",
        _ASKS % "{title: a speed has come, when: present(x.c.v) or True}",
        "subsystem",
    ),
    Code(
        "O0203",
        "memory without an initial value",
        "The element has a type, but nothing says what it holds in the first period.",
        "memory: {n: {type: int}}\n",
        "memory: {n: {type: int, init: 0}}\n",
        "subsystem",
    ),
    Code(
        "O0204",
        "function without targets",
        "A transition function that assigns nothing yet: executing it would have no effect.",
        "functions: {wait: {eq: 14}}\nbehaviours: {idle: {functions: [hold, sense, wait]}}\n",
        "functions: {sense: {eq: 14, y.c.q: 0}}\nbehaviours: {idle: {functions: [hold, sense]}}\n",
        "subsystem",
    ),
    Code(
        "O0205",
        "part that is referred to and not there yet",
        "Something refers to a part that nothing defines: a name in an expression, a condition, "
        "function, behaviour or state, a buffer element, a field, a device, a type, a frame. Its "
        "name is not one letter away from that of another part, so it may well be still to come; "
        "else it would be an error (E02xx). Each part is told once, with the places that need it. "
        "A signal needs a buffer: an element under `x:` where it is read and the same under `y:` "
        "where it is sent. "
        "As a slip cannot be excluded, this is the one open point with which `specc validate` "
        "fails.",
        "functions: {sense: {y.c.q: current}}\n",
        'let: {current: "x.E.m_m[0]"}\nfunctions: {sense: {y.c.q: current}}\n',
        "subsystem",
    ),
    Code(
        "O0401",
        "system without agents",
        "The system has a name, but no embodied agents yet (section 3, structure).",
        "specc: 1\nsystem: demo\n",
        f"specc: 1\nsystem: demo\n{_WHOLE}",
    ),
    Code(
        "O0402",
        "agent without a control subsystem",
        "Every agent has exactly one control subsystem; it is what makes the others an agent "
        "(2.1).",
        "agents: {two: {title: not thought about yet}}\n",
        _WHOLE,
        "file",
    ),
    Code(
        "O0403",
        "buffer without another end",
        "A buffer is one end of a connection. The subsystem or device at the other end has no "
        "buffer yet that faces this one.",
        _GRIPPER,
        f"{_GRIPPER}control: {{x: {{g: {{closed: bool}}}}}}\n",
        "agent",
    ),
    Code(
        "O0404",
        "device that nobody uses",
        "The device is selected, but no subsystem has a buffer to or from it yet. A virtual "
        "effector or receptor uses the device of its own name, or those listed under `uses:`.",
        _EYE,
        f"{_EYE}virtual_receptors:\n  eye: {{x: {{R: {{d: int}}}}, {_IDLE}}}\n",
        "agent",
    ),
    Code(
        "O0501",
        "devices without a plant",
        "There is a task to simulate, but no plant: nothing stands behind the devices. Code can "
        "be generated, but not run.",
        "task: {cycle: {of: irp.m, from: S0, to: S0}}\n",
        "{}\n",
        "file",
    ),
    Code(
        "O0502",
        "element without a binding",
        "Nothing in the plant stands behind this element of a device yet. Code can be generated, "
        "but not run.",
        "plant: {model: plants/arm.xml}\n",
        "{}\n",
        "file",
    ),
    Code(
        "O0503",
        "plant without a task",
        "There is a plant, but nothing says what a run counts and judges. A run takes a duration "
        "in place of a number of cycles.",
        "plant: {model: plants/arm.xml}\n",
        "{}\n",
        "file",
    ),
    Code(
        "O0601",
        "subsystem without a rate",
        "Section 3 asks for the sampling rates along with the roles of subsystems. Until then the "
        "proofs that depend on rates are left out.",
        f"{_VIRTUAL % ('', ', initial_state: S0')}",
        _WHOLE,
        "file",
    ),
    Code(
        "O0602",
        "subsystem without an initial state",
        "There are states, but none is said to be that of the first period.",
        f"{_VIRTUAL % ('rate: 10 Hz, ', '')}",
        _WHOLE,
        "file",
    ),
    Code(
        "O0603",
        "subsystem without behaviours",
        "Nothing says yet what the subsystem does.",
        "agents: {two: {control: {rate: 10 Hz}}}\n",
        _WHOLE,
        "file",
    ),
    Code(
        "O0604",
        "subsystem without states",
        "There are behaviours, but no states that execute them.",
        "agents: {two: {control: {rate: 10 Hz, behaviours: {w: {terminal: never}}}}}\n",
        _WHOLE,
        "file",
    ),
    Code(
        "O0605",
        "state without rows",
        "The behaviour of the state can end, but no row says what comes next.",
        f"{_RESTED % 'terminal: always'}{_ROWS}",
        f"{_RESTED % 'terminal: always'}{_ROWS}  - [S1, terminal, always, S0]\n",
        "subsystem",
    ),
    Code(
        "O0606",
        "behaviour without a terminal condition",
        "Nothing says when the behaviour ends: a terminal condition, `always` or `never`.",
        f"{_RESTED % 'title: rest'}{_ROWS}",
        f"{_RESTED % 'title: rest, terminal: never'}{_ROWS}",
        "subsystem",
    ),
    Code(
        "O0607",
        "state without a behaviour",
        "The state has a name and a place in the graph, but no behaviour yet.",
        f"behaviours: {{rest: {{terminal: never}}}}\nstates: {{S0: idle, S1: {{title: rest}}}}\n"
        f"{_ROWS}",
        f"behaviours: {{rest: {{terminal: never}}}}\nstates: {{S0: idle, S1: rest}}\n{_ROWS}",
        "subsystem",
    ),
)
