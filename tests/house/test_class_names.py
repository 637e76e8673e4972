"""A class name stands for one thing: whoever reads `Finding` knows which one is meant."""

import re
from collections import defaultdict

import pytest

from tests.house.tree import modules

SAME = {
    "specc": {
        "Behaviour": "what a state does: in a file of FABRIC, and in a system",
        "Junction": "`and`, `or`: of formulas, and of what is left of them in a run",
        "Text": "a text: a value in a file, and the type of values in a run",
        "Transition": "from one state to the next: in a file of SCXML, and in a system",
        "Truth": "true or false: a value in a file, and an expression",
    },
    "specc_runtime": {"Arm": "what operators know of an arm: of any, and of the flagship's"},
}
"""Names that several classes have, since they are the same in two layers."""
CLASS = re.compile(r"^class (\w+)", re.MULTILINE)


@pytest.mark.parametrize(("root", "package"), [(".", "specc"), ("runtime", "specc_runtime")])
def test_a_class_name_stands_for_one_thing(root: str, package: str) -> None:
    found: defaultdict[str, list[str]] = defaultdict(list)
    for module in modules(root, package):
        for name in CLASS.findall(module.path.read_text(encoding="utf-8")):
            found[name].append(module.name)
    several = {name: where for name, where in found.items() if len(where) > 1}
    known = SAME[package].keys()
    assert {name: where for name, where in several.items() if name not in known} == {}
    assert several.keys() >= known, "it is not needed any more"
