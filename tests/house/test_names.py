"""Names are terms of the field: a participle that could stand for anything says nothing."""

import pytest

from tests.house.tree import modules

BANNED = {
    "told", "said", "asked", "kept", "held", "settled", "lasting", "misfit", "misfits", "vague",
    "meant", "spelt", "spelled", "taken",
}  # fmt: skip
"""Words that are no names by themselves, private ones included; as part of a name they may do."""
OF_GENERATED_CODE = {
    "specc_runtime.ages": {"asked", "held"},
    "specc_runtime.requirement": {"asked"},
}
"""Arguments that packages give that people have built already."""


@pytest.mark.parametrize(("root", "package"), [("runtime", "specc_runtime"), (".", "specc")])
def test_no_name_is_a_bare_participle(root: str, package: str) -> None:
    found = [
        f"{module.name}:{line}: {name}"
        for module in modules(root, package)
        for name, line in module.defined()
        if name.lower().strip("_") in BANNED and name not in OF_GENERATED_CODE.get(module.name, ())
    ]
    assert found == []
