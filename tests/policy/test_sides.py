"""Which side `--fix` mends when a use and a definition differ by a slip."""

import re
from pathlib import Path

import pytest

from specc.cli import main
from tests.seeds import every

SPEC = """\
specc: 1
system: demo
frames: {B: base}
constants: {limit: "2[m]"}
types: {Width: "real[m]"}
agents:
  a:
    control:
      rate: 10 Hz
      y: {m: {d: Width, e: Width}}
      memory: {count: {type: int, init: 0}}   # kept   so
      conditions:
        initial: {large: count > 3, small: count <= 3}
      functions:
        send: {y.m.d: limit, y.m.e: limit}
        step: {count: count + 1}
      behaviours:
        work: {functions: [send, step], terminal: always}
      states: {S0: work, S1: work}
      initial_state: S0
      transitions:
        - [S0, terminal, large, S1]
        - [S0, terminal, small, S0]
        - [S1, terminal, large, S1]
        - [S1, terminal, small, S0]
    virtual_effectors:
      m:
        rate: 10 Hz
        x: {c: {d: {type: Width, init: 0}, e: {type: Width, init: 0}}}
        conditions: {terminal: {commanded: x.c.d > limit or x.c.e > limit}}
        behaviours: {idle: {terminal: commanded}}
        states: {S0: idle}
        initial_state: S0
        transitions: [[S0, terminal, always, S0]]
"""


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "a.yaml"
    path.write_text(SPEC)
    return path


def mended(spec: Path, text: str) -> str:
    spec.write_text(text)
    main(["validate", "--fix", "a.yaml"])
    once = spec.read_text()
    main(["validate", "--fix", "a.yaml"])
    assert spec.read_text() == once
    return once


def test_the_host_is_clean(spec: Path) -> None:
    assert main(["validate", "--strict", "a.yaml"]) == 0


@pytest.mark.parametrize(
    ("definition", "right", "wrong"),
    every(
        3,
        [
            ("{@: count > 3", "large", "lagre"),
            ("@: {functions", "work", "wrok"),
            ("memory: {@:", "count", "conut"),
            ("constants: {@:", "limit", "limti"),
            ("types: {@:", "Width", "Widht"),
            ("types: {'@':", "Width", "Widht"),
            ('types: {"@" :', "Width", "Widht"),
        ],
    ),
)
def test_a_definition_is_mended_if_all_uses_agree(
    definition: str, right: str, wrong: str, spec: Path
) -> None:
    plain = definition.translate({ord(mark): None for mark in "'\" "}).replace(":{", ": {")
    written = definition.replace("@", right)
    good = SPEC if written in SPEC else SPEC.replace(plain.replace("@", right), written)
    assert written in good
    assert mended(spec, good.replace(written, definition.replace("@", wrong))) == good


@pytest.mark.parametrize(
    ("use", "misspelt"),
    [
        ("[S0, terminal, large, S1]", "[S0, terminal, lagre, S1]"),
        ("S1: work", "S1: wrok"),
        ("count <= 3", "conut <= 3"),
        ("x.c.e > limit", "x.c.e > limti"),
        ("d: Width, e", "d: Widht, e"),
        ("[send, step]", "[send, setp]"),
    ],
)
def test_a_use_is_mended_if_another_agrees_with_the_definition(
    use: str, misspelt: str, spec: Path
) -> None:
    assert mended(spec, SPEC.replace(use, misspelt)) == SPEC


def test_of_one_use_and_a_definition_the_one_whose_words_the_file_has_is_right(spec: Path) -> None:
    titled = SPEC.replace("send: {", "send: {title: send the limit, ")
    assert mended(spec, titled.replace("send: {", "sned: {")) == titled
    assert mended(spec, titled.replace("[send", "[sned")) == titled


@pytest.mark.parametrize("text", ["{S0: work, S1: wrok}", "{S0: work, S1: work, S2: wrok}"])
def test_of_one_use_of_a_name_that_others_see_and_its_definition_nobody_knows(
    text: str, spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Written either way the function does the same, but not the memory."""
    once = SPEC.replace("count > 3", "True").replace("count <= 3", "False")
    once = once.replace("step: {count: count + 1}", "step: {conut: 2}").replace(
        "{S0: work, S1: work}", text
    )
    spec.write_text(once)
    main(["validate", "a.yaml"])
    assert "help: did you mean `count`?" in capsys.readouterr().err
    assert mended(spec, once) == once.replace("wrok", "work")


def test_a_repair_that_would_change_what_else_is_known_is_not_made(
    spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The targets ask for memory `count`, but a condition knows a constant of that name."""
    both = SPEC.replace("constants: {", "constants: {count: 2, ").replace(
        "memory: {count", "memory: {conut"
    )
    both = both.replace("{send: {y", "{send: {count: 1, y").replace("count: count + 1", "count: 2")
    assert mended(spec, both) == both
    assert "did you mean `conut`" in capsys.readouterr().err


def test_a_library_that_others_may_use_keeps_its_names(spec: Path, tmp_path: Path) -> None:
    """Who is right, the library or all who use it, nobody here can tell."""
    library = tmp_path / "lib.yaml"
    library.write_text("specc: 1\nconstants: {limti: '2[m]'}\n")
    used = SPEC.replace('constants: {limit: "2[m]"}', "use: [lib.yaml]")
    assert mended(spec, used) == used
    main(["validate", "--fix", "."])
    assert (spec.read_text(), library.read_text()) == (
        used,
        "specc: 1\nconstants: {limti: '2[m]'}\n",
    )
    right = used.replace("limit", "limti")
    assert mended(spec, right.replace("y.m.e: limti", "y.m.e: limit")) == right


def test_an_element_is_called_as_at_its_other_end(spec: Path) -> None:
    long = re.sub(r"\be(?=[:,} ])(?!:? *\d)", "speed", SPEC)
    assert mended(spec, long) == long
    assert main(["validate", "--strict", "a.yaml"]) == 0
    # Two ends that differ are reported as that; which of them is right is for people to say.
    end = long.replace("speed: {type", "sped: {type")
    assert mended(spec, end) == end
    assert mended(spec, long.replace("x.c.speed", "x.c.sped")) == long


@pytest.mark.parametrize(
    ("one", "other"),
    [("S1]", "s1]"), ("Width, e", "width, e"), ("count + 1", "Count + 1")],
)
def test_a_slip_of_case_is_mended_however_short_the_name(one: str, other: str, spec: Path) -> None:
    assert mended(spec, SPEC.replace(one, other, 1)) == SPEC


def test_names_that_differ_by_case_only_are_not_guessed(spec: Path) -> None:
    two = SPEC.replace("memory: {count", "memory: {t_c: {type: int, init: 0}, count")
    two = two.replace("step: {count: count", "step: {t_c: t_c, count: T_C")
    both = two.replace("memory: {", "memory: {T_c: {type: int, init: 0}, ")
    assert mended(spec, both) == both
    assert mended(spec, two) == two.replace("T_C", "t_c")


@pytest.mark.parametrize(
    ("written", "meant"),
    every(
        3,
        [
            ('"2[M]"', '"2[m]"'),
            ('"2[degg]"', '"2[deg]"'),
            ('"2[KHZ]"', '"2[kHz]"'),
            ('"2[mrd]"', '"2[mrad]"'),
            # A thousandth and a million of it, another prefix, another unit.
            ('"2[MN]"', ""),
            ('"2[mW]"', ""),
            ('"2[um]"', ""),
            ('"2[dam]"', ""),
            ('"true and 1 > 0"', '"True and 1 > 0"'),
        ],
    ),
)
def test_units_whose_prefix_stays_and_words_of_yaml_are_mended(
    written: str, meant: str, spec: Path
) -> None:
    text = SPEC.replace('{limit: "2[m]"}', "{limit: %s}")
    assert mended(spec, text % written) == text % (meant or written)
