"""Operators that are no pure functions, and how `--check-operators` finds them."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from specc_runtime.contracts import WrongValue, as_vector, operator
from specc_runtime.examination import WordBroken, examine, same
from specc_runtime.faults import StepFailed
from specc_runtime.loading import load_system

KEPT = np.zeros(2)
COUNT = itertools.count()


def pure(v: Any) -> Any:
    return 2.0 * v


def impure(v: Any) -> Any:
    return v + next(COUNT)


def changes(v: Any) -> Any:
    v[0] = 7.0
    return v.copy()


def keeps(v: Any) -> Any:
    KEPT[:] = v
    return KEPT


def wrong(v: Any) -> Any:
    return v[:1]


def examined(function: Callable[..., Any]) -> Callable[..., Any]:
    module = ModuleType("generated")
    module.OP = operator("OP", function, as_vector(2), "vector[2]", "eq. 3")  # type: ignore[attr-defined]  # as generated
    examine(module)
    return module.OP  # type: ignore[attr-defined,no-any-return]  # likewise


def test_an_operator_that_keeps_its_word_gives_what_it_gave() -> None:
    result = examined(pure)(np.array([1.0, 2.0]))
    assert result.tolist() == [2.0, 4.0] and not result.flags.writeable


@pytest.mark.parametrize(
    ("function", "said"),
    [
        (impure, "operator OP returns two results for equal arguments"),
        (changes, "operator OP changes its argument 1"),
        (keeps, "operator OP keeps an array that it returns"),
    ],
)
def test_an_operator_that_breaks_its_word_is_named(function: Callable[..., Any], said: str) -> None:
    with pytest.raises(WordBroken, match=said):
        examined(function)(np.array([1.0, 2.0]))


def test_a_system_is_loaded_with_all_its_operators_examined(tmp_path: Path) -> None:
    (tmp_path / "part.py").write_text(
        "from tests.runtime.test_examination import as_vector, impure, operator\n"
        'OP = operator("OP", impure, as_vector(2), "vector[2]")\n'
    )
    (tmp_path / "system.py").write_text(
        "import numpy as np\nfrom . import part\ndef build(base):\n    part.OP(np.zeros(2))\n"
    )
    folder = tmp_path.rename(tmp_path.with_name("parts"))
    with pytest.raises(StepFailed, match="operator OP returns two results"):
        load_system(folder, check_operators=True)


def test_results_are_still_checked_against_their_type() -> None:
    with pytest.raises(WrongValue, match="operator OP gave an array"):
        examined(wrong)(np.array([1.0, 2.0]))


def test_values_are_compared_to_the_last_bit_and_into_objects() -> None:
    assert not same(0.0, -0.0)
    assert not same(1, True)
    assert same(SimpleNamespace(a=[1, {"b": 2.0}]), SimpleNamespace(a=[1, {"b": 2.0}]))
    assert not same(SimpleNamespace(a=[1, {"b": 2.0}]), SimpleNamespace(a=[1, {"b": 3.0}]))
    loop = SimpleNamespace()
    loop.itself = loop
    assert same(loop, loop)
