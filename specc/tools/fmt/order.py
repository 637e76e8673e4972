"""The order of keys: what a part is, where it comes from, what it is called.

Keys that people choose (names of types, states, buffers, ...) keep their order.
"""

from __future__ import annotations

from dataclasses import field

from specc.frozen import frozen

_TRACE = ("eq", "table", "fig")
_LAST = (*_TRACE, "title")


@frozen
class Kind:
    """A kind of mapping: its keys in order, and the kinds of the values below them.

    `each` is the kind of all values below names that people choose.
    """

    keys: tuple[str, ...] = ()
    below: dict[str, Kind] = field(default_factory=dict)
    each: Kind | None = None
    is_table: bool = False

    def child(self, step: str | int) -> Kind:
        """The kind of a value one step below."""
        if isinstance(step, str) and step in self.keys:
            return self.below.get(step, OTHER)
        return self.each or OTHER

    def rank(self, key: str, place: int) -> tuple[int, int]:
        """Sorts the keys of a mapping; others than `keys` come last, as they stand."""
        return (self.keys.index(key) if key in self.keys else len(self.keys)), place


OTHER = Kind()


def _each(kind: Kind) -> Kind:
    return Kind(each=kind)


TYPE = Kind(("frames", "type", *_LAST, "fields", "opaque", "python"))
CONSTANT = Kind(("is", *_LAST))
OPERATOR = Kind(("signature", "python", "title", *_TRACE))
ELEMENT = Kind(("type", "init", *_LAST))
INPUT = Kind(("type", "init", "max_age", *_LAST))
SAFE = Kind(("is", "otherwise"))
COMMAND = Kind(("type", "init", "max_age", "safe", *_LAST), {"safe": SAFE})
MEMORY = Kind(("type", "init", *_LAST))
LET = Kind(("is", *_LAST))
CONDITION = Kind((*_LAST, "when"))
ASSIGNMENT = Kind(("is", *_LAST))
FUNCTION = Kind(_LAST, each=ASSIGNMENT)
BEHAVIOUR = Kind((*_LAST, "functions", "terminal", "error"))
STATE = Kind(("behaviour", "title", *_TRACE))
ROW = Kind(("from", "cause", "when", "to", *_LAST))
AXIOM = Kind(("that", "because"))
CONDITIONS = Kind(
    ("initial", "terminal", "error"),
    dict.fromkeys(("initial", "terminal", "error"), _each(CONDITION)),
)
SUBSYSTEM = Kind(
    (
        "use", "title", "rate", "with", "uses", *_TRACE, "x", "y", "memory", "let", "conditions",
        "functions", "behaviours", "states", "initial_state", "transitions", "assume",
    ),
    {
        "x": _each(_each(INPUT)),
        "y": _each(_each(ELEMENT)),
        "memory": _each(MEMORY),
        "let": _each(LET),
        "conditions": CONDITIONS,
        "functions": _each(FUNCTION),
        "behaviours": _each(BEHAVIOUR),
        "states": _each(STATE),
        "transitions": Kind(each=ROW, is_table=True),
        "assume": _each(AXIOM),
    },
)  # fmt: skip
DEVICE = Kind(("title", *_TRACE, "x", "y"), {"x": _each(COMMAND), "y": _each(ELEMENT)})
AGENT = Kind(
    (
        "use", "title", "kind", "with", *_TRACE, "real_effectors", "real_receptors",
        "virtual_effectors", "virtual_receptors", "control",
    ),
    {
        "real_effectors": _each(DEVICE),
        "real_receptors": _each(DEVICE),
        "virtual_effectors": _each(SUBSYSTEM),
        "virtual_receptors": _each(SUBSYSTEM),
        "control": SUBSYSTEM,
    },
)  # fmt: skip
BINDING = Kind(
    (
        "actuators", "joints", "sensors", "camera", "image", "rate", "sporadic", "max_gap",
        "through", "noise",
    )
)  # fmt: skip
PLANT = Kind(("model", "python", "bind"), {"bind": _each(BINDING)})
CYCLE = Kind(("of", "from", "to"))
TASK = Kind(("cycle", "scene", "judge", "watch"), {"cycle": CYCLE})
FILE = Kind(
    (
        "specc", "system", "title", *_TRACE, "use", "parameters", "frames", "types", "files",
        "constants", "operators", "agents", "subsystem", "agent", "plant", "task",
    ),
    {
        "types": _each(TYPE),
        "constants": _each(CONSTANT),
        "operators": _each(OPERATOR),
        "agents": _each(AGENT),
        "subsystem": SUBSYSTEM,
        "agent": AGENT,
        "plant": PLANT,
        "task": TASK,
    },
)  # fmt: skip
