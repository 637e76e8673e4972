"""E0201 to E0204, E0209 and E023x: names in expressions and types that stand for nothing there."""

from specc.diagnostics.code import Code

_TOP = "specc: 1\nsystem: demo\n"
_EYE = (
    _TOP
    + """agents:
  robot:
    real_receptors: {eye: {y: {d: "real[m]"}}}
    virtual_receptors:
      eye:
        rate: 10 Hz
        x: {R: {d: "real[m]"}}
        y: {c: {seen: bool}}
        functions: {look: {y.c.seen: %s}}
        behaviours: {look: {functions: [look], terminal: never}}
        states: {S0: look}
        initial_state: S0
    control:
      rate: 10 Hz
      x: {eye: {seen: bool}}
      behaviours: {wait: {terminal: never}}
      states: {S0: wait}
      initial_state: S0
"""
)


def _constants(text: str, rest: str = "") -> str:
    return f"{_TOP}{rest}constants: {{{text}}}\n"


CODES = (
    Code(
        "E0201",
        "unknown name",
        "A name in an expression stands for nothing: no memory, `let`, constant, parameter, file "
        "or member of an enum is called so where the expression stands. An expression sees only "
        "what its own subsystem and file define; values of others come through buffers, as "
        "`x.peer.element`.",
        _constants('width: "0.1[m]", half: widht / 2'),
        _constants('width: "0.1[m]", half: width / 2'),
    ),
    Code(
        "E0202",
        "unknown operator",
        "What is called is neither declared under `operators:` nor a function of the language. "
        "Operators are the only functions: whatever the language cannot say is one of them, "
        "with a signature that says what it takes and gives.",
        _constants(
            "half: half_off(2)",
            'operators: {half_of: {signature: "(a: real) -> real", python: "tool:half_of"}}\n',
        ),
        _constants(
            "half: half_of(2)",
            'operators: {half_of: {signature: "(a: real) -> real", python: "tool:half_of"}}\n',
        ),
    ),
    Code(
        "E0203",
        "unknown buffer element",
        "An expression reads an element that the input buffer does not have, or a whole buffer. "
        "One element is read at a time, as `x.peer.element`.",
        _EYE % '"x.R.dd < 1[m]"',
        _EYE % '"x.R.d < 1[m]"',
    ),
    Code(
        "E0204",
        "unknown peer",
        "An expression reads from a subsystem or device that has no input buffer here. Peers are "
        "the keys under `x:`: `c` for the control subsystem of the agent, `E` or `R` for the only "
        "real effector or receptor, else a name.",
        _EYE % '"x.R_.d < 1[m]"',
        _EYE % '"x.R.d < 1[m]"',
    ),
    Code(
        "E0209",
        "unknown frame",
        "A type names a coordinate frame that is not declared under `frames:`. Frames are declared "
        "so that a typing error cannot make a new one, in which nothing would meet anything.",
        _TOP + 'frames: {Base: robot base, Tip: its tool}\ntypes: {Grasp: "pose[Bace, Tip]"}\n',
        _TOP + 'frames: {Base: robot base, Tip: its tool}\ntypes: {Grasp: "pose[Base, Tip]"}\n',
    ),
    Code(
        "E0230",
        "value not available here",
        "The name has a value only while a subsystem runs. A constant is computed before any, so "
        "it refers to constants and operators; the initial value of memory also to inputs, but "
        "not to memory or to the clock.",
        _constants("late: elapsed"),
        _constants('late: "2[s]"'),
    ),
    Code(
        "E0231",
        "ambiguous name",
        "The name is a member of several enums, or of an enum and a value of that enum, and where "
        "it stands either could be meant. The expected type decides where there is one: in an "
        "assignment, an argument, or a comparison with a value of the enum.",
        _constants("first: fast", "types: {Gear: 'enum[slow, fast]', Belt: 'enum[fast, off]'}\n"),
        _constants("first: off", "types: {Gear: 'enum[slow, fast]', Belt: 'enum[fast, off]'}\n"),
    ),
    Code(
        "E0232",
        "variable hides a name",
        "The variable of `all` or `any` is called like something that the expression could refer "
        "to. Inside the quantifier nobody could tell which is meant.",
        _constants('d: "1[m]", near_by: "all(d > 0 for d in [1[m], 2[m]])"'),
        _constants('d: "1[m]", near_by: "all(v > 0 for v in [1[m], 2[m]])"'),
    ),
    Code(
        "E0233",
        "unknown type",
        "The text of a type names a type that is neither of the language nor declared under "
        "`types:`.",
        _TOP + 'types: {Motors: "vectr[6, rad]"}\n',
        _TOP + 'types: {Motors: "vector[6, rad]"}\n',
    ),
    Code(
        "E0234",
        "no such part",
        "A value has no field or component of that name or number. Records have their fields, of "
        "which the name is a slip; spatial vectors and vectors of six have x, y, z, ax, ay, az; "
        "vectors of three have x, y, z; every vector has [0], [1] and so on. Components of a pose "
        "are reached through position(X).",
        _constants('p: "[1[m], 2[m]]", last: "p[2]"'),
        _constants('p: "[1[m], 2[m]]", last: "p[1]"'),
    ),
    Code(
        "E0235",
        "output read",
        "An expression refers to an output buffer. Outputs are written only: what a subsystem "
        "computes for others becomes visible to them, not to itself. A value that is needed twice "
        "is named under `let:`; one that is needed in the next period is kept in memory.",
        _EYE % '"y.c.seen"',
        _EYE % '"x.R.d < 1[m]"',
    ),
)
