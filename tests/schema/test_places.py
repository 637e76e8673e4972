"""What the schema says of places is said of every key, once."""

from collections.abc import Iterator

from specc.reachable import reachable
from specc.schema.files import SpecFile
from specc.schema.keys import OTHERS, ListKind, MappingKind, SpecModel, ValueKind, is_model, layout
from specc.schema.places import defined_by, keys_at, node_at, role_of, split_at_part, values_at


def parts_in(kind: ValueKind) -> Iterator[type[SpecModel]]:
    if is_model(kind):
        yield kind
    elif isinstance(kind, MappingKind):
        yield from parts_in(kind.value)
    elif isinstance(kind, ListKind):
        yield from parts_in(kind.item)


def below(part: type[SpecModel]) -> list[type[SpecModel]]:
    return [inner for one in part.keys.values() for inner in parts_in(one.kind)]


PARTS = list(reachable([SpecFile], below))


def test_the_formatter_orders_all_keys_and_no_others() -> None:
    for part in PARTS:
        assert sorted(layout(part)) == sorted(set(part.keys) - {OTHERS}), part
        assert set(part.first) <= set(part.keys), part
        assert {part.short, *part.row} <= {"", *part.keys}, part


def test_every_key_is_described() -> None:
    keys = [(part, name, one) for part in PARTS for name, one in part.keys.items()]
    assert [(part, name) for part, name, one in keys if name != OTHERS and not one.about] == []


def test_a_place_is_known_in_each_of_its_forms() -> None:
    top = ("agents", "a", "control")
    for route in [("let", "v"), ("let", "v", "is"), ("functions", "f", "m"), ("assume", 0, "that")]:
        found = role_of((*top, *route))
        assert found is not None
        assert found.form == "full"
    for step in (0, "from", 3, "to"):
        found = role_of((*top, "transitions", 1, step))
        assert found is not None
        assert found.kind == "state"
    assert role_of((*top, "functions", "f", "title")) is None


def test_names_define_what_they_stand_for() -> None:
    assert defined_by(("agents", "a", "control", "x", "p")) is None
    assert defined_by(("agents", "a", "control", "x", "p", "e")) == "element"
    assert defined_by(("agent", "real_effectors", "m", "x", "e")) == "element"
    assert defined_by(("subsystem",)) == "subsystem"
    assert defined_by(("agent",)) is None


def test_a_route_is_split_at_its_subsystem_or_device() -> None:
    route = ("agents", "a", "real_receptors", "k", "y", "image")
    assert split_at_part(route) == (route[:4], ("y", "image"))
    assert split_at_part(("types", "T")) == ((), ("types", "T"))


def test_beyond_the_schema_nothing_is_known() -> None:
    for route in [("bogus",), ("title", "x"), ("agents", "a", "bogus", 1), ("use", "x", "y")]:
        assert node_at(route).kind is None
        assert (defined_by(route), role_of(route)) == (None, None)
        assert (keys_at(route), values_at(route)) == ({}, [])


def test_values_that_one_is_chosen_from() -> None:
    assert values_at(("plant", "bind", "a.E.m.q", "image")) == ["rgb", "depth"]
    assert values_at(("subsystem", "transitions", 0, 1)) == ["terminal", "error"]
    assert values_at(("types", "T", "opaque")) == ["true"]
    assert values_at(("subsystem", "through")) == ["identity"]
