"""Parts are made at once exactly of what the check of shapes has nothing against."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from specc.diagnostics import TooManyFaultsError
from specc.read import read_file
from specc.schema.files import SpecFile
from specc.schema.keys import Part
from specc.schema.making import Unlike, made
from specc.schema.shape import _Check, written_out
from specc.schema.unfold import Unfolded
from tests.corpus import CASES, SPECS
from tests.schema.test_shape import File

SCALARS = st.sampled_from((None, True, 1, 2, 0.5, "", "a", "two words", "circle", "p.q:r", "1"))
NAMES = st.sampled_from(("specc", "a", "type", "init", "eq", "*", "is", "class", "two words"))
VALUES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(NAMES, inner, max_size=3),
    max_leaves=6,
)
FILES = st.fixed_dictionaries({}, optional=dict.fromkeys(File.keys, VALUES))


def checked(part: type[Part], data: Any) -> Any:
    """What the check of shapes makes; None if it has something against the data."""
    check, found = _Check("a.yaml"), None
    with suppress(TooManyFaultsError):
        found = check.value(part, data, ())
    return None if check.findings else found


def at_once(part: type[Part], data: Any) -> Any:
    try:
        return made(part, data)
    except Unlike:
        return None


def plain(value: Any) -> Any:
    if isinstance(value, Part):
        return type(value), {name: plain(one) for name, one in sorted(vars(value).items())}
    if isinstance(value, dict):
        routes = value.routes if isinstance(value, Unfolded) else None
        return type(value), routes, {name: plain(one) for name, one in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value), [plain(one) for one in value]
    return type(value), value


@settings(max_examples=150, deadline=None)
@given(FILES)
def test_what_is_made_at_once_is_what_the_check_makes(data: Any) -> None:
    found = at_once(File, data)
    if found is not None:
        assert plain(found) == plain(checked(File, data))


@pytest.mark.parametrize("key", File.keys)
def test_every_kind_of_value_is_made_at_once(key: str) -> None:
    values = {
        "specc": 1, "system": "a", "with": {"a": 1}, "elements": {"a": {"type": "a"}, "b": "b"},
        "rows": [["a", 1], {"type": "a"}], "names": ["a"], "keyed": {"a": 1}, "fields": {"a": "b"},
        "open": {"eq": 1, "a": {"type": "b"}}, "count": 2, "flag": True, "shape": "circle",
        "reason": "a", "python": "p.q:r", "rate": "5 Hz", "few": [1],
    }  # fmt: skip
    data = {key: values[key]}
    assert plain(made(File, data)) == plain(checked(File, data))


def test_files_are_made_at_once_if_nothing_is_wrong() -> None:
    for path in (*SPECS[::3], *CASES[::12]):
        data = read_file(str(path)).data
        data, faults = written_out(data, str(path))
        if not faults:
            assert plain(at_once(SpecFile, data)) == plain(checked(SpecFile, data)), path
