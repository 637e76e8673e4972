"""A name of a class or of a type stands for one thing: who reads `Finding` knows which is meant."""

import re
from collections import defaultdict

import pytest

from tests.house.tree import modules

SAME = {
    "specc": {
        "Behaviour": "what a state does: in a file of FABRIC, and in a system",
        "BoolOp": "`and`, `or`: of formulas, and of their obligations in a run",
        "Text": "a text: a value in a file, and the type of values in a run",
        "Transition": "from a state to the next: in a file of SCXML, a system, and its abstraction",
    },
    "specc_runtime": {"Arm": "what operators know of an arm: of any, and of the flagship's"},
}
"""Names that several classes have, since they are the same in two layers."""
CLASS = r"class (\w+)"
ALIAS = r"(_?[A-Z]\w*[a-z]\w*)(?:: .+)? = (?!TypeVar\()"
"""Another name of a type, for all modules. A variable of types means nothing elsewhere."""


@pytest.mark.parametrize(
    ("root", "package", "kinds"),
    [(".", "specc", (CLASS, ALIAS)), ("runtime", "specc_runtime", (CLASS,))],
)
def test_a_name_stands_for_one_thing(root: str, package: str, kinds: tuple[str, ...]) -> None:
    found: defaultdict[str, list[str]] = defaultdict(list)
    for module in modules(root, package):
        text = module.path.read_text(encoding="utf-8")
        for kind in kinds:
            for name in re.findall(f"^{kind}", text, re.MULTILINE):
                found[name].append(module.name)
    several = {name: where for name, where in found.items() if len(where) > 1}
    known = SAME[package].keys()
    assert {name: where for name, where in several.items() if name not in known} == {}
    assert several.keys() >= known, "it is not needed any more"
