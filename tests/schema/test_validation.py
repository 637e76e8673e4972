"""Laws of validation: a model or findings, never both and never neither."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from specc.read import read_file
from specc.schema.desugar import desugar
from specc.schema.files import SpecFile
from specc.schema.shape import shape
from tests.corpus import CASES, SPECS
from tests.schema.test_shape import File
from tests.seeds import how_many

SCALARS = st.sampled_from((None, True, 1, 2, 0.5, "", "a", "two words", "circle", "p.q:r", "1"))
NAMES = st.sampled_from(("specc", "a", "type", "init", "eq", "*", "is", "class", "two words"))
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES, inner, max_size=3),
    max_leaves=6,
)
FILES = st.fixed_dictionaries({}, optional=dict.fromkeys(File.keys, VALUES))


@settings(max_examples=how_many(150), deadline=None)
@given(FILES)
def test_data_are_valid_or_there_are_findings(data: Any) -> None:
    found, faults = shape(File, desugar(data, "a.yaml", File)[0], "a.yaml")
    assert (found is None) == bool(faults)


@pytest.mark.parametrize("key", File.keys)
def test_every_kind_of_value_is_valid(key: str) -> None:
    values = {
        "specc": 1, "system": "a", "with": {"a": 1}, "elements": {"a": {"type": "a"}, "b": "b"},
        "rows": [["a", 1], {"type": "a"}], "names": ["a"], "keyed": {"a": 1}, "fields": {"a": "b"},
        "open": {"eq": 1, "a": {"type": "b"}}, "count": 2, "flag": True, "shape": "circle",
        "reason": "a", "python": "p.q:r", "rate": "5 Hz", "few": [1],
    }  # fmt: skip
    assert key in File.model_validate(desugar({key: values[key]}, "a.yaml", File)[0]).given_keys


def test_every_file_of_the_corpus_is_valid_or_there_are_findings() -> None:
    for path in (*SPECS[::3], *CASES[::12]):
        data, faults = desugar(read_file(str(path)).data, str(path))
        if not faults:
            found, findings = shape(SpecFile, data, str(path))
            assert (found is None) == bool(findings), path
