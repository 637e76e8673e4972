"""E01xx: the file is YAML, but not of the shape of a specification."""

from specc.diagnostics.code import Code

CODES = (
    Code(
        "E0101",
        "unknown key",
        "The mapping has a key that has no meaning at that place. It is refused rather than "
        "ignored, because it is most often a known key with a typing error.",
        "specc: 1\nsystem: demo\nagentz: {}\n",
        "specc: 1\nsystem: demo\nagents: {}\n",
    ),
    Code(
        "E0102",
        "missing key",
        "The mapping lacks a key without which it has no meaning.",
        "system: demo\n",
        "specc: 1\nsystem: demo\n",
    ),
    Code(
        "E0103",
        "wrong kind of value",
        "A value is of another kind than its key takes: a list instead of a mapping, text "
        "instead of a number.",
        "specc: 1\nsystem: demo\nframes: [B, E]\n",
        "specc: 1\nsystem: demo\nframes: {B: robot base, E: end-effector}\n",
    ),
    Code(
        "E0104",
        "invalid value",
        "A value is of the right kind, but not one that its key takes: a word that is none of "
        "the possible ones, a number outside its range, a name with forbidden characters.",
        "transitions:\n  - [S0, end, always, S0]\n",
        "transitions:\n  - [S0, terminal, always, S0]\n",
        "subsystem",
    ),
    Code(
        "E0105",
        "unsupported version of the language",
        "The key `specc` names the version of the specification language. This compiler reads "
        "version 1; nothing else in the file is checked.",
        "specc: 2\nsystem: demo\n",
        "specc: 1\nsystem: demo\n",
    ),
    Code(
        "E0106",
        "not a rate",
        "A rate is a number of periods per second with its unit, or a period with its unit. It is "
        "read exactly, so that periods can be compared without rounding.",
        "rate: 100\n",
        "rate: 100 Hz\n",
        "subsystem",
    ),
    Code(
        "E0107",
        "not a length of time",
        "A length of time is a number with its unit, like a period. Where it says how old a value "
        "may be, it is more than nothing.",
        "x: {c: {v: {type: 'real[rad/s]', max_age: 20}}}\n",
        "x: {c: {v: {type: 'real[rad/s]', max_age: 20 ms}}}\n",
        "subsystem",
    ),
)
