"""Identifiers: any name of a specification becomes a safe and unique name of Python."""

from __future__ import annotations

import builtins
import keyword
import re
from collections.abc import Iterable

_AMBIGUOUS = frozenset("lOI")
"""Letters that fonts do not tell from digits; linters refuse them as names."""
BUILTINS = frozenset(dir(builtins))
_VALUES = ("Depth", "Pose", "Rgb", "Spatial", "Vector")
_IN_TYPES = ("Any", "Literal", "annotations", "dataclass")
_IN_SUBSYSTEMS = (
    "Callable", "ClassVar", "Equations", "Final", "Inputs", "Mapping", "Memory", "Outputs",
    "PERIOD", "SafeOutputs", "Samples", "Subsystem", "Transition", "holds", "memory", "nan", "row",
    "self", "sqrt", "x", "y",
    # functions of the language
    "argmax", "argmin", "finite", "identity", "inverse", "near", "near_pose", "norm", "pose",
    "position", "read_only", "some", "translation", "vector",
)  # fmt: skip
_CONTRACTS = (
    "as_any", "as_bool", "as_depth", "as_instance", "as_int", "as_list", "as_member", "as_optional",
    "as_partial", "as_pose", "as_real", "as_record", "as_rgb", "as_text", "as_tuple", "as_vector",
    "operator",
)  # fmt: skip
_IN_SYSTEM = (
    "ActuatorBinding", "Connection", "PlantInput", "PlantOutput", "PlantSpec", "Scheduled",
    "SensorBinding", "System", "Task", "base", "build", "files", "join",
)  # fmt: skip
OWN_NAMES = frozenset((*BUILTINS, *_VALUES, *_IN_TYPES, *_IN_SUBSYSTEMS, *_CONTRACTS))
"""What the modules of types and subsystems have without any name of a specification."""
ALL_OWN_NAMES = OWN_NAMES | frozenset(_IN_SYSTEM)
"""The same of all generated modules."""
OWN_ATTRIBUTES = ("abc_impl", "files", "periods", "start", "work")
"""Private attributes that every generated class may have, without their underscore."""
_WORD = re.compile(r"[A-Za-z0-9]+")


def identifier(text: str) -> str:
    """`text` as an ASCII identifier that is no keyword and does not start with an underscore.

    Names with a leading underscore are private to classes, with two they are mangled.
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    stripped = name.lstrip("_")
    name = stripped + "_" * (len(name) - len(stripped)) if stripped else "unnamed"
    if name[0].isdigit():
        name = f"n{name}"
    if keyword.iskeyword(name) or name in _AMBIGUOUS:
        name = f"{name}_"
    return name


class Names:
    """Hands out names that differ from each other and from those already taken."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._taken = set(taken)

    def new(self, wanted: str) -> str:
        """`wanted` made safe, with a number behind it if that name is taken."""
        base = identifier(wanted)
        name, count = base, 1
        while name in self._taken:
            count += 1
            name = f"{base}_{count}"
        self._taken.add(name)
        return name

    def inner(self) -> Names:
        """Names of an inner scope, which must not hide those of this one."""
        return Names(self._taken)


def joined(
    pairs: Iterable[tuple[str, str]], taken: Iterable[str] = ()
) -> dict[tuple[str, str], str]:
    """A name for every pair, `<first>_<second>`.

    Pairs that would share a name (`a, b_c` and `a_b, c`) get two underscores in the middle instead,
    so that the name of a pair does not depend on the order of the pairs.
    """
    short = {pair: identifier("_".join(pair)) for pair in pairs}
    uses = list(short.values())
    names = Names(taken)
    return {
        pair: names.new(name if uses.count(name) == 1 else "__".join(pair))
        for pair, name in short.items()
    }


def class_name(name: str) -> str:
    """`irp m` -> `IrpM`."""
    return identifier("".join(word[0].upper() + word[1:] for word in _WORD.findall(name)))
