"""E03xx: texts of expressions, types and signatures, and the types of what they say."""

from specc.diagnostics.code import Code

_TOP = "specc: 1\nsystem: demo\n"
_FRAMES = _TOP + "frames: {B: robot base, E: end-effector, K: camera}\n"
_POSES = (
    _FRAMES
    + "operators:\n"
    + '  grip: {signature: "() -> pose[B, E]", python: "tool:grip"}\n'
    + '  look: {signature: "(width: real[m]) -> pose[B, K]", python: "tool:look"}\n'
)


def _constant(value: str) -> str:
    return f'{_TOP}constants: {{a: "{value}"}}\n'


def _pose(value: str) -> str:
    return f'{_POSES}constants: {{X: "{value}"}}\n'


def _middle(value: str) -> str:
    signature = "(span: vector[2, m]) -> real[m]"
    operators = f'operators: {{mid: {{signature: "{signature}", python: "tool:mid"}}}}\n'
    return f'{_TOP}{operators}constants: {{a: "{value}"}}\n'


def _pulled(type: str, value: str) -> str:
    kept = "partial[vector[2, N]]"
    return (
        f"{_TOP}operators:\n"
        f'  held: {{signature: "(F: {kept}) -> {kept}", python: "tool:held"}}\n'
        f'  pull: {{signature: "(F: {type}) -> real[N]", python: "tool:pull"}}\n'
        f'constants: {{a: "{value}"}}\n'
    )


def _operator(signature: str) -> str:
    return f'{_FRAMES}operators: {{turn: {{signature: "{signature}", python: "tool:turn"}}}}\n'


CODES = (
    Code(
        "E0301",
        "not an expression",
        "The text is not an expression. Expressions have the syntax of Python: `and`, `or`, `not`, "
        "`==`, and round brackets for calls. A unit stands in square brackets behind its number.",
        _constant("2 + 0.1 m"),
        _constant("2[m] + 0.1[m]"),
    ),
    Code(
        "E0302",
        "not in the language",
        "The text is an expression of Python that the specification language leaves out. What is "
        "left out is either a statement in disguise, or belongs into an operator.",
        _constant("7 // 2"),
        _constant("7 / 2"),
    ),
    Code(
        "E0303",
        "too long or too deep",
        "The text has more than 10 000 characters or is nested more than 64 deep. Nobody could "
        "review it; name its parts under `let:`.",
        _constant("-" * 70 + "1"),
        _constant("-1"),
    ),
    Code(
        "E0304",
        "no such number or unit",
        "What stands in brackets behind a number is not a unit, or the number is too large. Units "
        "are products of powers of the names in the reference of the language, such as m/s or "
        "kg*m**2; case matters.",
        _constant("2[metre]"),
        _constant("2[m]"),
    ),
    Code(
        "E0305",
        "unit of a type is not SI",
        "A type names a unit with a scale, such as mm. Values are SI numbers everywhere, so that "
        "no conversion can be forgotten; only literals have other units, and are converted.",
        _TOP + 'types: {Width: "real[mm]"}\n',
        _TOP + 'types: {Width: "real[m]"}\n',
    ),
    Code(
        "E0306",
        "not a type",
        "The text does not spell a type: a bracket is missing, or what stands in brackets is not "
        "what the type takes.",
        _TOP + 'types: {Motors: "vector[rad, 6]"}\n',
        _TOP + 'types: {Motors: "vector[6, rad]"}\n',
    ),
    Code(
        "E0307",
        "not a signature",
        "The signature of an operator is its named parameters in round brackets, an arrow, and "
        "the type of its result.",
        _operator("pose[B, E] -> pose[E, B]"),
        _operator("(X: pose[B, E]) -> pose[E, B]"),
    ),
    Code(
        "E0308",
        "frame of a result is open",
        "A frame in the result of an operator is neither declared under `frames:` nor named by a "
        "parameter. A frame that only parameters name is a variable, bound by the arguments of a "
        "call; nothing would bind this one.",
        _operator("(X: pose[B, Y]) -> pose[Z, Y]"),
        _operator("(X: pose[Z, Y]) -> pose[Y, Z]"),
    ),
    Code(
        "E0310",
        "wrong type",
        "An expression is not of the type that its place asks for: another kind of value, another "
        "unit, or another frame. Nothing is converted silently, except that an int serves as a "
        "dimensionless real, and 0 fits any unit.",
        _constant("sqrt(4[m**2]) if 1 else 0[m]"),
        _constant("sqrt(4[m**2]) if True else 0[m]"),
    ),
    Code(
        "E0311",
        "units differ",
        "Two quantities of different units are added, subtracted or compared. Radians are a unit "
        "of their own here, and so are torques: rad is not 1, and N*m is not J.",
        _constant("1[m] + 1[s]"),
        _constant("1[m] + 1[s] * 1[m/s]"),
    ),
    Code(
        "E0312",
        "frames differ",
        "Two poses or spatial vectors do not meet in a frame. `pose[A, B] @ pose[B, C]` is "
        "`pose[A, C]`; sums and comparisons need the same frames on both sides.",
        _pose("grip() @ look(0)"),
        _pose("inverse(grip()) @ look(0)"),
    ),
    Code(
        "E0313",
        "operator does not apply",
        "The values on both sides of a sign are not of kinds that it takes: for example a pose "
        "that is multiplied with `*`, or a list that is negated.",
        _pose("grip() * 2"),
        _pose("grip() @ inverse(grip())"),
    ),
    Code(
        "E0314",
        "wrong number of arguments",
        "A call has more or fewer arguments than its operator or function takes. Arguments are "
        "given by position, all of them.",
        _pose("look()"),
        _pose("look(0.1[m])"),
    ),
    Code(
        "E0315",
        "argument does not fit",
        "An argument of a call is not of the type that the operator or function takes there. "
        "Frame variables of a signature stand for one frame throughout a call.",
        _pose("look(0.1[s])"),
        _pose("look(0.1[m])"),
    ),
    Code(
        "E0316",
        "wrong number of items",
        "A vector is written with more or fewer components than its type has.",
        _middle("mid([0, 1[m], 2[m]])"),
        _middle("mid([0, 1[m]])"),
    ),
    Code(
        "E0317",
        "type not known here",
        "An empty list, a vector of unused components only, or a pose made of numbers has no type "
        "of its own: items or frames follow from the place where it stands. Here nothing says "
        "them. Memory has a declared type; so has an argument of an operator.",
        _pose("identity()"),
        _pose("grip()"),
    ),
    Code(
        "E0318",
        "missing component out of place",
        "`_` is the paper's dash: a component that the chosen mode does not use. It is no number, "
        "and stands only where a type says that one may be missing: `partial[T]` of a vector of "
        "reals or of a spatial vector T.",
        _pulled("vector[2, N]", "pull([1[N], _])"),
        _pulled("partial[vector[2, N]]", "pull([1[N], _])"),
    ),
    Code(
        "E0319",
        "reals compared exactly",
        "Two reals, vectors or poses are compared with == or !=. After any computation or "
        "measurement two of them are hardly ever equal to the last digit, so such a condition "
        "would never hold. near(a, b, tolerance) says how close is close enough.",
        _constant("0.1[m] == 100[mm]"),
        _constant("near(0.1[m], 100[mm], 1[mm])"),
    ),
    Code(
        "E0320",
        "no such member",
        "The set behind `in` names something that is not a member of the enum it is asked of.",
        _TOP + "types: {Mode: 'enum[free, held]'}\nconstants: {a: 'free in {free, hold}'}\n",
        _TOP + "types: {Mode: 'enum[free, held]'}\nconstants: {a: 'free in {free, held}'}\n",
    ),
    Code(
        "E0321",
        "components may be missing",
        "A value of type `partial[T]` is compared, computed with, taken apart, or stands where a "
        "whole T is asked for. Some of its components may be no numbers. It is kept and sent as it "
        "is, and given to operators whose signatures take `partial[T]`; their other arguments tell "
        "them which components are there. A T serves as a `partial[T]`.",
        _pulled("partial[vector[2, N]]", "pull(held([1[N], _])[0] * [1, 1])"),
        _pulled("partial[vector[2, N]]", "pull(held([1[N], _]))"),
    ),
)
