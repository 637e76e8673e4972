"""For every text the layout keeps data and comments, and is its own layout."""

from functools import cache
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from specc.read import read_file, read_text
from specc.tools.fmt.tree import parse
from tests.corpus import CASES, SPECS
from tests.seeds import drawn
from tests.tools.fmt.layout import keeps_what_is_written


@pytest.mark.parametrize(
    "text",
    [
        "a: &a [x]\nb: *a\n",
        "a: &a {x: 1}\nb: [*a, &c [*a], *c]\n",
        "a: &a\n  x: 1\nb:\n  - *a\n  - &b [*a]\n",
        "transitions:\n  - &r [S0, terminal, &c go, S1]\n  - *r\n  - [S1, terminal, *c, S1]\n",
        "a: &e []\nb: *e\nc: &t 'x: y'\nd: *t\n",
        "a: &a\n  x: 1\n  b: &b\n    - 1\n    # below\nc: 2\n",
        "a: &a # beside\n  x\nb:\n  - &b # beside\n    y: 1\n  - &c\n    # above\n    z: 1\n",
        "a: &a # beside\nb: *a\n",
    ],
)
def test_anchors_are_written_once(text: str) -> None:
    keeps_what_is_written(text)


scalars = st.one_of(
    st.integers(-9, 9),
    st.booleans(),
    st.none(),
    st.text(st.sampled_from("ab:# ,[]{}'\"\\-?&*!|>%@`~=<.\n\t1é\x07"), max_size=6),
    st.sampled_from(["null", "true", "0x1", "1e3", "---", "...", "<<", "a: b", "- a", "off"]),
)
names = st.one_of(
    st.sampled_from(["specc", "types", "title", "transitions", "subsystem", "x", "eq", "type"]),
    st.text(st.sampled_from("ab.:# ,[{'\"-"), min_size=1, max_size=4),
)
data = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(names, inner, max_size=4)),
    max_leaves=12,
)


def written(value: Any, draw: Any, depth: int, flow: bool, anchors: list[str]) -> str:
    """A YAML text of a value, in styles that `draw` chooses, with comments in between.

    What has an anchor can be written as an alias where it comes again; `anchors` are the `repr` of
    values that have one.
    """
    if repr(value) in anchors and draw(st.booleans()):
        return f"*a{anchors.index(repr(value))} "
    text = plain(value, draw, depth, flow, anchors)
    if repr(value) in anchors or draw(st.integers(0, 3)):
        return text
    anchors.append(repr(value))
    return f"&a{len(anchors) - 1}{'' if text.startswith(chr(10)) else ' '}{text}"


def plain(value: Any, draw: Any, depth: int, flow: bool, anchors: list[str]) -> str:
    """A YAML text of a value without an anchor of its own."""
    from specc.tools.fmt.tree import quoted

    if not isinstance(value, (dict, list)) or not value:
        if isinstance(value, str):
            return quoted(value)
        return (
            {None: "null", True: "true", False: "false"}.get(value, str(value))
            if not isinstance(value, (dict, list))
            else ("{}" if isinstance(value, dict) else "[]")
        )
    items = value.items() if isinstance(value, dict) else ((None, item) for item in value)
    if flow or draw(st.integers(0, 2)) == 0:
        separator = draw(st.sampled_from([", ", ",", ",\n" + " " * 40, ", # inner\n" + " " * 40]))
        parts = [
            ("" if key is None else f"{quoted(key)}: ") + written(item, draw, depth, True, anchors)
            for key, item in items
        ]
        joined = separator.join(parts)
        return f"{{{joined}}}" if isinstance(value, dict) else f"[{joined}]"
    indent = " " * depth
    lines = ""
    for key, item in items:
        lines += draw(st.sampled_from(["", "", "\n", f"{indent}# above\n", f"\n{indent}# above\n"]))
        text = written(item, draw, depth + draw(st.integers(1, 3)), False, anchors)
        head = "-" if key is None else f"{quoted(key)}:"
        beside = draw(st.sampled_from(["", "", " # beside"]))
        if "\n" in text and text.split("\n")[0] in ("", *(f"&a{n}" for n in range(99))):
            anchor, below = text.split("\n", 1)
            lines += f"{indent}{head} {anchor}{beside}\n{below}"
        else:
            lines += f"{indent}{head} {text}{beside}\n"
    lines += draw(st.sampled_from(["", "", f"{indent}# below\n", "# far below\n"]))
    return "\n" + lines


@drawn(st.dictionaries(names, data, min_size=1, max_size=4), st.data(), few=15, many=80)
def test_laws_hold_for_any_style(value: dict[str, Any], chosen: st.DataObject) -> None:
    text = plain(value, chosen.draw, 0, False, [])
    assert read_text("a.yaml", text).data == value
    keeps_what_is_written(text)


@cache
def texts() -> list[str]:
    documents = (read_file(str(path)) for path in (*CASES, *SPECS))
    return [document.source.text for document in documents if document.ok]


@pytest.mark.long
@drawn(st.data(), few=10, many=50)
def test_laws_hold_with_comments_anywhere(chosen: st.DataObject) -> None:
    lines = chosen.draw(st.sampled_from(texts())).split("\n")
    for _ in range(chosen.draw(st.integers(1, 4))):
        at = chosen.draw(st.integers(0, len(lines) - 1))
        if chosen.draw(st.booleans()):
            lines[at] += " # beside"
        else:
            lines.insert(at, " " * chosen.draw(st.integers(0, 14)) + "# alone")
    new = "\n".join(lines)
    document = read_text("a.yaml", new)
    # Inside a scalar the words are no comment; they may break it.
    if document.ok and document.data is not None:
        keeps_what_is_written(new)


@given(st.text(max_size=30))
@example("a: 'x'\n")
def test_quoted_texts_mean_what_they_say(value: str) -> None:
    document = read_text("a.yaml", "a: 1\n")
    assert document.ok
    from specc.tools.fmt.tree import quoted

    if not any(0xD800 <= ord(char) < 0xE000 for char in value):
        root, scalars = parse(f"a: {quoted(value)}\n")
        assert scalars[1].text == value
        assert root.start == 0
