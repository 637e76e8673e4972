"""The canonical layout, rule by rule."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from specc.tools.fmt import format_text

RULES = {
    "keys in order": (
        "system: demo\nspecc: 1\ntypes: {A: {title: t, type: real}}\n",
        "specc: 1\nsystem: demo\ntypes: {A: {type: real, title: t}}\n",
    ),
    "unknown keys last, names as they stand": (
        "odd: 1\nframes: {E: end, B: base}\nspecc: 1\n",
        "specc: 1\nframes: {E: end, B: base}\nodd: 1\n",
    ),
    "two blanks deep": (
        "agents:\n    irp:\n        kind: C\n    list:\n    - 1\n",
        "agents:\n  irp:\n    kind: C\n  list:\n    - 1\n",
    ),
    "quotes only where needed": (
        "frames:\n  A: 'plain [x], y'\n  B: {a: 'x, y', \"b\": 'z'}\n  C: 'a: b'\n  D: \"1\"\n"
        '  E: "it\'s"\n  F: \'say "x"\'\n  G: "true"\n  H: \'\'\n  I: "a\\tb"\n  J: \'#\'\n',
        'frames:\n  A: plain [x], y\n  B: {a: "x, y", b: z}\n  C: "a: b"\n  D: "1"\n'
        '  E: it\'s\n  F: say "x"\n  G: "true"\n  H: ""\n  I: "a\\tb"\n  J: "#"\n',
    ),
    "numbers as they are written": ("a: 0x1F\nb: 1.50\n", "a: 0x1F\nb: 1.50\n"),
    "blanks inside braces": ("a: { b:  1 ,c: [ 1,2 ] }\n", "a: {b: 1, c: [1, 2]}\n"),
    "braces over several lines are joined": ("a: {b: 1,\n  c: 2}\n", "a: {b: 1, c: 2}\n"),
    "braces with a comment become a block": (
        "a: {b: 1, # one\n  c: [2, 3]}\n",
        "a:\n  b: 1 # one\n  c: [2, 3]\n",
    ),
    "braces that do not fit become a block": (
        "a: {b: {c: {d: %s}}}\n" % ("x" * 85),
        "a:\n  b: {c: {d: %s}}\n" % ("x" * 85),
    ),
    "indentation counts": (
        "a:\n  b: {c: %s, d: 1}\n" % ("x" * 85),
        "a:\n  b:\n    c: %s\n    d: 1\n" % ("x" * 85),
    ),
    "braces that fit stay": (
        "a:\n  b: {c: %s, d: 1}\n" % ("x" * 84),
        "a:\n  b: {c: %s, d: 1}\n" % ("x" * 84),
    ),
    "long rows of names stay": (
        "a: [%s, b]\n" % ("x" * 110),
        "a: [%s, b]\n" % ("x" * 110),
    ),
    "comments stay with their keys": (
        "# about system\nsystem: demo # beside\n# about specc\nspecc: 1\n# at the end\n",
        "# about specc\nspecc: 1\n# about system\nsystem: demo # beside\n# at the end\n",
    ),
    "comments at the end of a block": (
        "agents:\n  a:\n    kind: C\n    # inner\n  # outer\n\n  # next\n  b: {}\n",
        "agents:\n  a:\n    kind: C\n    # inner\n  # outer\n\n  # next\n  b: {}\n",
    ),
    "one empty line at most": ("\n\nspecc: 1\n\n\n\nsystem: a\n\n", "specc: 1\n\nsystem: a\n"),
    "folded text moves as it is": (
        "agents:\n    a:\n     title: >-  # why\n         one\n           two\n\n         three\n",
        "agents:\n  a:\n    title: >- # why\n      one\n        two\n\n      three\n",
    ),
    "text over several lines is joined": ("title: one\n  two\n", "title: one two\n"),
    "anchors and aliases": (
        "system:   &n demo\ntitle: *n\nspecc: 1\n",
        "system: &n demo\ntitle: *n\nspecc: 1\n",
    ),
    "lists in lists": (
        "a:\n- - 1\n  - 2\n-\n  b: 1\n  c: 2\n",
        "a:\n  - - 1\n    - 2\n  - b: 1\n    c: 2\n",
    ),
    "windows line ends": ("specc: 1\r\nsystem: a\r\n", "specc: 1\nsystem: a\n"),
    "json": ('{"specc": 1, "system": "demo"}\n', "specc: 1\nsystem: demo\n"),
    "comments in empty braces": ("a: [ # one\n  # two\n  ]\nb: 1\n", "a: [] # one\n# two\nb: 1\n"),
    "document marks go": ("--- # top\nspecc: 1\n...\n", "# top\nspecc: 1\n"),
}
TABLE = """\
subsystem:
  transitions:
    # state  cause      when  next
    - [S0, terminal, always, S10]
    # a comment
    - [S10, error, lost, S0] # beside
    - {from: S1, cause: error, when: lost, to: S0}
"""
ALIGNED = """\
subsystem:
  transitions:
    #  state  cause     when    next
    - [S0,    terminal, always, S10]
    # a comment
    - [S10,   error,    lost,   S0] # beside
    - {from: S1, cause: error, when: lost, to: S0}
"""


@pytest.mark.parametrize(("old", "new"), RULES.values(), ids=RULES)
def test_rule(old: str, new: str) -> None:
    assert format_text(old) == new
    assert format_text(new) == new


def test_tables_are_aligned_with_their_headers() -> None:
    assert format_text(TABLE) == ALIGNED
    assert format_text(ALIGNED) == ALIGNED
    assert "[S10, error,    lost,   S0]" in format_text(
        TABLE.replace("# state  cause", "# state cause")
    )


def test_rows_of_several_states_are_cells_of_the_table() -> None:
    rows = "  - [[S0, S1], error, lost, S2]\n  - [S2, terminal, otherwise, S0]\n"
    text = format_text(f"specc: 1.1\nsubsystem:\n  transitions:\n{rows}")
    assert "- [[S0, S1], error,    lost,      S2]\n" in text
    assert "- [S2,       terminal, otherwise, S0]\n" in text
    assert format_text(text) == text


def test_aliases_stay_behind_their_anchors() -> None:
    text = "title: &t demo\nsystem: *t\nspecc: 1\n"
    assert format_text(text).index("&t") < format_text(text).index("*t")


STATES = "looking, approaching, lifting, carrying, lowering, leaving"


def formatted_rows(*rows: str) -> list[str]:
    text = format_text("subsystem:\n  transitions:\n" + "".join(f"  - {row}\n" for row in rows))
    assert format_text(text) == text
    lines = text.splitlines()[2:]
    assert all(len(line) <= 100 for line in lines)
    return [line.removeprefix("    ") for line in lines]


def test_rows_with_the_longest_cells_are_not_aligned_where_a_table_is_too_wide() -> None:
    assert formatted_rows(
        f"[[{STATES}], error, always, failed]",
        "[looking, terminal, the_object_is_in_sight, approaching]",
        "[[approaching, lifting], terminal, otherwise, failed] # beside",
    ) == [
        f"- [[{STATES}], error, always, failed]",
        "- [looking,                terminal, the_object_is_in_sight, approaching]",
        "- [[approaching, lifting], terminal, otherwise,              failed] # beside",
    ]


def test_a_row_that_is_too_long_goes_on_on_the_next_line() -> None:
    rows = formatted_rows(
        f"[[{STATES}, {STATES.upper()}], error, the_operator_stops_all_of_them, failed] # why",
        "[looking, terminal, always, approaching]",
    )
    assert rows == [
        f"- [[{STATES}, LOOKING, APPROACHING, LIFTING,",
        "    CARRYING, LOWERING, LEAVING], error, the_operator_stops_all_of_them, failed] # why",
        "- [looking, terminal, always, approaching]",
    ]


def test_a_table_that_fits_is_aligned_even_with_long_cells() -> None:
    rows = formatted_rows(
        "[[looking, approaching, lifting, carrying, lowering], error, always, failed]",
        "[failed, terminal, always, looking]",
    )
    assert len({row.index("always") for row in rows}) == 1


@given(
    st.lists(
        st.tuples(
            st.lists(st.integers(1, 30), min_size=1, max_size=8),
            *[st.integers(1, 60)] * 2,
            st.integers(1, 30),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_no_table_is_wider_than_a_page(rows: list[tuple[list[int], int, int, int]]) -> None:
    formatted_rows(
        *(
            f"[[{', '.join('s' * n for n in states)}], {'c' * cause}, {'w' * when}, {'t' * to}]"
            for states, cause, when, to in rows
        )
    )


def test_modes_stand_behind_states_and_say_first_what_is_in_them() -> None:
    text = """\
agents:
  a:
    control:
      transitions: [[m, tired, always, s], [s, terminal, always, resume(m)]]
      modes:
        m: {error: {tired: "elapsed(m) > 3[s]"}, initial: t, states: [t], title: the task}
      states: {s: hold, t: hold}
"""
    assert (
        format_text(text)
        == """\
agents:
  a:
    control:
      states: {s: hold, t: hold}
      modes:
        m: {title: the task, states: [t], initial: t, error: {tired: "elapsed(m) > 3[s]"}}
      transitions: [[m, tired, always, s], [s, terminal, always, resume(m)]]
"""
    )
