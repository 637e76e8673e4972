"""Texts from nothing: random bytes, random words of YAML, random trees of known keys."""

from __future__ import annotations

import json
import re
from random import Random
from typing import Any

_KEYS = re.findall(
    r"\S+",
    """
    specc system title use frames types constants files operators agents plant task parameters
    subsystem agent kind control virtual_effectors virtual_receptors real_effectors real_receptors
    rate x y memory let conditions initial terminal error functions behaviours states
    initial_state transitions assume with uses type init is when eq fig table signature python
    fields opaque model bind actuators joints sensors camera image noise through cycle of from to
    watch scene judge behaviour cause that because c E R m S0 y.c.e
    """,
)
_INDICATORS = re.findall(
    r"\S+",
    """
    - : , [ ] { } & * ! | > ' " # % @ ` ? ~ --- ... << 0 -1 .inf .nan 1e999 0x1F !!str
    !!python/object &a *a &b *b null true a: b: c: a b c é ∞ 😀
    """,
)
_INVISIBLE = ("\n", "\n\n", "\t", "\r", "\r\n", "  ", "\ufeff", "\u2028", "\u202e", "\x85", "\x00")

ODD_VALUES: tuple[str, ...] = (
    *("null", "~", "true", "false", '""', "''", "[]", "{}", "0", "-1", "1e999", "-1e-999", ".nan"),
    *("0x7fffffffffffffff", "9" * 30, "1" + "0" * 400, "0.1", "[[]]", "[null]", "{a: }", "*a"),
    *("'é'", '"\\u202e"', '"\\0"', '"a\\nb"', "😀", "1[m]", "1[m", "x.", "x.c", "_", "a if b"),
    *('"' + "not " * 300 + 'True"', '"' + "-" * 900 + '1"', "(" * 70, "always", "S0", "5 Hz"),
    *(
        '"' + "(" * 300 + "1" + ")" * 300 + '"',
        '"1e400 Hz"',
        '"0.000001 Hz"',
        '"1/3 Hz"',
        "1e999999999 Hz",
    ),
    *('"2 ** 9 ** 9 ** 9"', '"9 ** 9 * 10[m] ** 9"', '"[[[1]]]"', '"x.c.T_d.x.y"', '"lambda: 1"'),
    *('"vector[999999999, rad]"', '"vector[-1]"', '"image[0, 0, 3]"', '"list[list[list[int]]]"'),
    *('"enum[]"', '"enum[a, a]"', '"pose[B]"', '"pose[B, B]"', '"real[m**(1/0)]"'),
    *('"real[m**999]"', '"real[((m))]"', '"() -> int"', '"(a: int, a: int) -> int"', '"a.b:c"'),
    *(
        '"(a: pose[X, Y]) -> pose[Y, X]"',
        "../" * 4 + "etc",
        "plants",
        "parts/two_finger_gripper.yaml",
    ),
    *("/dev/null", "a" * 3000),
)


def random_bytes(random: Random) -> bytes:
    """Up to some thousand bytes of any value."""
    return random.randbytes(random.choice((0, 1, 10, 100, 3000)))


def random_words(random: Random) -> bytes:
    """Indicators of YAML, keys of the language and odd values, one after the other."""
    words = random.choices(
        (*_INDICATORS, *_INVISIBLE, *_KEYS, *ODD_VALUES), k=random.randrange(200)
    )
    return " ".join(words).encode("utf-8", "surrogatepass")


def random_tree(random: Random) -> bytes:
    """A mapping of keys of the language to anything."""
    tree = {"specc": 1, "system": "fuzz", **_mapping(random, 5)}
    return json.dumps(tree, ensure_ascii=random.random() < 0.5).encode()


def _mapping(random: Random, depth: int) -> dict[str, Any]:
    keys = random.choices(_KEYS, k=random.randrange(6))
    return {key: _anything(random, depth - 1) for key in keys}


def _anything(random: Random, depth: int) -> Any:
    kind = random.random()
    if depth > 0 and kind < 0.6:
        return _mapping(random, depth)
    if depth > 0 and kind < 0.75:
        return [_anything(random, depth - 1) for _ in range(random.randrange(4))]
    return random.choice((None, True, 0, -1, 0.5, 1e308, 10**30, "", *_KEYS, *ODD_VALUES))
