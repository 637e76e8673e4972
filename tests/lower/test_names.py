"""Names: safe, distinct, and of a pair independent of the other pairs' order."""

from __future__ import annotations

import keyword
import re
from dataclasses import fields, is_dataclass, replace
from io import StringIO
from pathlib import Path
from token import NAME, OP
from tokenize import generate_tokens
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from specc.emit import fill_templates
from specc.lower import lower
from specc.lower.names import OWN_NAMES, Imports, Namespace, class_name, identifier, pair_names
from specc.pipeline import compile_spec

SPECS = Path(__file__).resolve().parents[2] / "specs"
TEMPLATES = SPECS.parent / "templates"

texts = st.sampled_from(["a", "b", "a_b", "b_c", "c", "_", "__", "class", "l", "", "é"]) | st.text()


@given(st.text())
def test_identifiers_are_ascii_and_no_keywords(text: str) -> None:
    name = identifier(text)
    assert name.isidentifier()
    assert name.isascii()
    assert not keyword.iskeyword(name)
    assert not name.startswith("_")
    assert identifier(name) == name


def test_templates_import_reserved_names_only() -> None:
    """What emitters import has to be reserved for it, too: see `Imports.own`."""
    lines = [line for path in TEMPLATES.glob("*.j2") for line in path.read_text().splitlines()]
    generated = [line for line in lines if re.match(r"from (?!pathlib|specc\.)\S+ import", line)]
    names = set(re.findall(r"\w+", " ".join(line.partition(" import ")[2] for line in generated)))
    assert names
    assert names - {"if"} <= OWN_NAMES | {"equations", "constants", "transitions"}
    with pytest.raises(KeyError):
        Imports().runtime_name("a_name_of_the_designer")


@given(st.lists(st.text(max_size=4)))
def test_new_names_differ(wanted: list[str]) -> None:
    names = Namespace(["taken"])
    found = [names.new(text) for text in [*wanted, "taken"]]
    assert len({*found, "taken"}) == len(found) + 1


def test_names_of_inner_scopes_hide_none_of_outer_ones() -> None:
    """Also those of outer scopes that come later; scopes side by side may share names."""
    outer = Namespace(["first"])
    one, other = outer.inner(), outer.inner()
    assert one.new("X") == other.new("X") == "X"
    assert outer.new("X") == "X_2"
    assert outer.new("Y") == "Y"
    assert one.inner().new("Y") == other.new("Y") == "Y_2"
    assert one.new("first") == "first_2"


def test_good_names_stay_as_they_are() -> None:
    for name in ("T_d", "X_BE", "m", "q1", "rdot_p"):
        assert identifier(name) == Namespace().new(name) == name


@given(st.lists(st.tuples(texts, texts), unique=True), st.randoms(use_true_random=False))
def test_names_of_pairs_are_distinct(pairs: list[tuple[str, str]], random) -> None:
    names = pair_names(pairs)
    assert names.keys() == set(pairs)
    assert len(set(names.values())) == len(pairs)


def test_names_of_pairs_do_not_depend_on_order() -> None:
    pairs = [("a", "b_c"), ("a_b", "c"), ("c", "T_d")]
    expected = {("a", "b_c"): "a__b_c", ("a_b", "c"): "a_b__c", ("c", "T_d"): "c_T_d"}
    assert pair_names(pairs) == pair_names(pairs[::-1]) == expected


def test_flags_keep_their_names_apart_from_elements() -> None:
    pairs = [("fresh", "c_a"), ("c", "a")]
    names = pair_names(pairs, {"fresh_c_a"})
    assert names["c", "a"] == "c_a"
    assert names["fresh", "c_a"] != "fresh_c_a"


def test_classes_are_named_after_agent_and_subsystem() -> None:
    assert class_name("irp m") == "IrpM"
    assert class_name("left_arm grip") == "LeftArmGrip"
    assert class_name("robot_2 c") == "Robot2C"
    assert class_name("") == "unnamed"


def test_rewording_a_title_changes_no_identifier() -> None:
    result = compile_spec(str(SPECS / "conveyor_gate.yaml"))
    assert result.system is not None
    plain = fill_templates(lower(result.system, result.proofs))
    reworded = fill_templates(lower(_reworded(result.system), result.proofs))
    assert {path: _code(text) for path, text in plain.items()} == {
        path: _code(text) for path, text in reworded.items()
    }


def _reworded(value: Any) -> Any:
    """A model with every title in it replaced by another one."""
    if isinstance(value, tuple):
        return tuple(map(_reworded, value))
    if not is_dataclass(value) or isinstance(value, type):
        return value
    inside = {
        part.name: _reworded(getattr(value, part.name)) for part in fields(value) if part.init
    }
    return replace(value, **(inside | ({"title": "Reworded"} if "title" in inside else {})))


def _code(text: str) -> list[str]:
    """The names, keywords and operators of a module, in order."""
    tokens = generate_tokens(StringIO(text).readline)
    return [token.string for token in tokens if token.type in (NAME, OP)]
