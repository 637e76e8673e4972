"""E0330 to W0333: expressions that are well typed and cannot be meant."""

from specc.diagnostics.code import Code


def _near(tolerance: str) -> str:
    return f'constants: {{tolerance: "{tolerance}"}}\nagents:\n' + _AGENT % (
        '"near(x.c.d, 1[rad], tolerance)"'
    )


_AGENT = """\
  irp:
    virtual_effectors:
      m:
        conditions: {terminal: {reached: %s}}
        behaviours: {idle: {functions: [hold, sense], terminal: reached}}
"""


def _quaternion(text: str) -> str:
    return f'memory: {{X: {{type: "pose[B, E]", init: "pose([0, 0, 0], [{text}])"}}}}\n'


def _sent(text: str) -> str:
    return f'functions: {{sense: {{y.c.q: "{text}"}}}}\n'


CODES = (
    Code(
        "E0334",
        "constant without a value",
        "The arithmetic of a constant, or of a parameter's value, has no result: a division by "
        "zero, the root of a negative number, or a number too large for a float.",
        'constants: {step: "1[m] / 0"}\n',
        'constants: {step: "1[m] / 10"}\n',
        "file",
    ),
    Code(
        "E0330",
        "not a tolerance",
        "The tolerance of `near` is zero or negative, so that nothing is ever near, or an angle of "
        "pi or more, within which all orientations are. It may be a constant or a parameter: then "
        "the finding is where its number is written.",
        _near("-1[mrad]"),
        _near("1[mrad]"),
        "file",
    ),
    Code(
        "E0331",
        "quaternion of another length than 1",
        "The length of a quaternion is 1; this one is off by more than 0.001. `pose` would make it "
        "1, but which component is wrong nobody knows. The order is x, y, z, w.",
        _quaternion("0, 0, 0.7071, 0.07071"),
        _quaternion("0, 0, 0.7071, 0.7071"),
        "subsystem",
    ),
    Code(
        "W0332",
        "bounds the wrong way round",
        "A number is limited from below by more than from above, so that the result is always the "
        "same: `min(max(a, 2), 1)` is 1. The mirrored form is `max(min(a, 1), 2)`.",
        _sent("min(max(x.E.m_m[0], 1[rad]), -1[rad])"),
        _sent("min(max(x.E.m_m[0], -1[rad]), 1[rad])"),
        "subsystem",
    ),
    Code(
        "W0333",
        "the same thing twice",
        "Two sides of a comparison, of a difference or of `near`, or two arguments of `min` or "
        "`max`, are the same: by their texts, or by the lets that they name. Usually one of them "
        "should be another.",
        _sent("x.E.m_m[0] - x.E.m_m[0]"),
        _sent("x.E.m_m[0] - x.E.m_m[1]"),
        "subsystem",
    ),
)
