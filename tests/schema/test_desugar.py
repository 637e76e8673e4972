"""Parts that are written once for many."""

import pytest

from specc.schema.desugar import desugar, route_below


def agents(text: dict[str, object]) -> object:
    data, faults = desugar({"agents": text}, "f.yaml")
    assert faults == []
    return data["agents"]


def faults(part: object, name: str = "a") -> list[str]:
    found = desugar({"agents": {name: part}}, "f.yaml")[1]
    return [f"{fault.code} {fault.message}" for fault in found]


def test_indices_end_a_name_without_braces() -> None:
    found = agents({"a": {"for": {"i": "1..2", "j": 3}, "title": "t"}})
    assert found == {
        "a_1_3": {"for": {"i": 1, "j": 3}, "title": "t"},
        "a_2_3": {"for": {"i": 2, "j": 3}, "title": "t"},
    }


def test_every_text_inside_knows_the_indices() -> None:
    made = agents(
        {"a{i}": {"for": {"i": "0..1"}, "use": "f_{i}.yaml", "with": {"p": "b_{(i + 1) % 2}"}}}
    )
    assert made["a0"]["use"] == "f_0.yaml"
    assert [a["with"]["p"] for a in made.values()] == ["b_1", "b_0"]


def test_parts_inside_parts_unfold_with_both_indices() -> None:
    wheel = {"for": {"j": "1..{i}"}, "x": {"v": {"type": "int", "title": "{i}{j}"}}}
    made = agents({"a": {"for": {"i": "1..2"}, "real_effectors": {"w{i}{j}": wheel}}})
    assert list(made["a_1"]["real_effectors"]) == ["w11"]
    assert list(made["a_2"]["real_effectors"]) == ["w21", "w22"]
    assert made["a_2"]["real_effectors"]["w22"]["x"]["v"]["title"] == "22"


def test_numbers_of_disturbances_unfold_below_names_only() -> None:
    """A number that stands for a list of numbers too; an item of a list has no name to count."""

    def unfold(disturbance: object) -> tuple[object, list[str]]:
        data = {"task": {"disturb": [disturbance]}}
        made, found = desugar(data, "f.yaml")
        return made["task"]["disturb"][0], [str(fault.primary.route[-1]) for fault in found]

    of_each = {"for": {"i": "1..2"}, "is": "0.1[m]"}
    for verb in ("shift", "bias", "scale"):
        made, found = unfold({verb: {"a_{i}.s": of_each}})
        one, two = ({"for": {"i": i}, "is": "0.1[m]"} for i in (1, 2))
        one, two = (one, two) if verb == "shift" else ([one], [two])
        assert (made, found) == ({verb: {"a_1.s": one, "a_2.s": two}}, [])
    for verb in ("push", "bias"):
        assert unfold({verb: {"b": [of_each, "0", "0"]}})[1] == ["for"]


def test_columns_of_expressions_stay_where_they_are() -> None:
    text = "x.a_{i % 2 + 1}.e + x.b{i}c.e in {u, k} and v in {i}"
    control = {"let": {"v": text}}
    made = agents({"a": {"for": {"i": 1}, "control": control}})
    found = made["a_1"]["control"]["let"]["v"]["is"]
    words = "x.a_2 .e + x.b1c .e in {u, k} and v in 1"
    assert found.split() == words.split()
    for part in (".e +", ".e in", "and v"):
        assert found.index(part) == text.index(part)


def test_parts_lead_to_the_text_that_they_come_from() -> None:
    made = agents({"a": {"for": {"i": "1..2"}, "real_effectors": {"w{i}": {"title": "t"}}}})
    here = route_below(made, "a_2", ("agents",))
    assert here == ("agents", "a")
    inside = made["a_2"]["real_effectors"]
    assert route_below(inside, "w2", (*here, "real_effectors")) == (*here, "real_effectors", "w{i}")


@pytest.mark.parametrize(
    ("part", "expected"),
    [
        ({"for": {"i": "1..1000000000"}}, "E0017 these are 1,000,000,000 copies,"),
        ({"for": {"i": "1..100", "j": "1..100"}}, "E0017 these are 10,000 copies,"),
        ({"for": {"i": "2..1"}}, "E0108 there is nothing between the ends of the range"),
        ({"for": {"i": "1.5"}}, "E0108 `1.5` is not a range"),
        ({"for": {"i": True}}, "E0108 `True` is not a range"),
        ({"for": {"i": "9" * 30}}, f"E0108 `{'9' * 30}` is not a range"),
        ({"for": {"1": "1..2"}}, "E0108 `1` is not a name"),
        ({"for": {}}, "E0108 `for` has no index"),
        ({"for": 3}, "E0108 `for` has no index"),
        ({"for": {"i": 1}, "title": "{i // 0}"}, "E0108 `{i // 0}` divides by zero"),
        ({"for": {"i": 1}, "title": "{i ** 9}"}, "E0108 `{i ** 9}` is not arithmetic on indices"),
        ({"control": {"for": {"i": 1}}}, "E0108 there is only one `control`,"),
    ],
)  # fmt: skip
def test_what_cannot_be_unfolded_is_reported(part: object, expected: str) -> None:
    (found,) = faults(part)
    assert found.startswith(expected)


def test_names_must_differ_and_be_known() -> None:
    assert faults({"for": {"i": "1..2"}}, "a{k}_{i}") == [
        "E0108 `{k}` has no value: the indices are `i`"
    ]
    assert faults({"for": {"i": "1..2", "j": "1..2"}}, "a{i}") == [
        "E0205 `a1` is defined twice",
        "E0205 `a2` is defined twice",
    ]


def test_copies_of_copies_are_bounded() -> None:
    inner = {"for": {"j": "1..1000"}, "x": {"v": "int"}}
    found = faults({"for": {"i": "1..1000"}, "real_effectors": {"w{j}": inner}})
    assert len(found) == 1
    assert found[0].startswith("E0017 with its parts unfolded")


def test_a_fault_in_a_name_is_reported_once() -> None:
    assert faults({"for": {"i": "1..1"}}, "a{i % 0}") == ["E0108 `{i % 0}` divides by zero"]


def test_an_index_is_no_keyword() -> None:
    assert faults({"for": {"if": "1..1"}}) == ["E0108 `if` is not a name"]


@pytest.mark.parametrize(
    "text",
    [
        f"{{i * {'9' * 4000} * {'9' * 4000}}}",
        f"{{i * {'9' * 200} * {'9' * 200}}}",
        "{i" + " + i" * 800 + "}",
        "{" + "-" * 800 + "i}",
    ],
)
def test_arithmetic_on_indices_is_bounded(text: str) -> None:
    _, found = desugar({"agents": {"a": {"for": {"i": 1}, "title": text}}}, "f.yaml")
    assert {fault.code for fault in found} <= {"E0108"}


@pytest.mark.filterwarnings("error")
def test_python_says_nothing_of_texts_in_braces() -> None:
    assert faults({"for": {"i": "1..1"}, "title": "{0x1for i in i}"})


def test_a_behaviour_in_its_state_gets_the_name_of_the_state() -> None:
    stays = {"title": "stays", "functions": ["hold"], "terminal": "late", "holds": ["y.m.v"]}
    control = {"behaviours": {"go": {"terminal": "near"}}, "states": {"S": stays, "T": "go"}}
    made = agents({"a": {"control": control}})["a"]["control"]
    own = {"title": "stays", "functions": ["hold"], "terminal": "late"}
    own["terminal"] = {"condition": "late"}
    own["functions"] = [{"function": "hold"}]
    assert made["behaviours"] == {"go": {"terminal": {"condition": "near"}}, "S": own}
    state = {"title": "stays", "holds": ["y.m.v"], "behaviour": "S"}
    assert made["states"] == {"S": state, "T": {"behaviour": "go"}}
    states = ("agents", "a", "control", "states", "S")
    assert route_below(made["behaviours"], "S", ()) == states
    assert route_below(made["behaviours"]["S"], "terminal", states) == (*states, "terminal")
    assert route_below(made["states"]["S"], "behaviour", states) == states


def test_a_state_has_one_behaviour() -> None:
    two = {"states": {"S": {"behaviour": "go", "terminal": "late"}}}
    assert faults({"control": two}) == ["E0104 the state has a behaviour of its own already"]
    again = {"behaviours": {"S": {}}, "states": {"S": {"terminal": "late"}}}
    message = "behaviour `S` is defined twice: a state of this name has its own"
    assert faults({"control": again}) == [f"E0205 {message}"]
