"""Settings and models that a stranger may have written, by seed: long, deep, many, or no text."""

from __future__ import annotations

from collections.abc import Callable
from random import Random

from bench.harness.lists import GROWING, MAIN, MODEL, Files, small, written

_SIZES = (1, 30, 33, 300, 5_000, 60_000)
_STRANGE = ("\0", "\\u0000", "\U0001f600", "\ud7ff", "../" * 40, "*a" * 200, "x" * 5000, "\u00b2")


def _values(random: Random, size: int) -> str:
    """A value of TOML."""
    return random.choice(
        (
            lambda: "9" * size,
            lambda: "1" + "_0" * size,
            lambda: "0x" + "f" * size,
            lambda: "1." + "3" * size,
            lambda: "[" * size + "]" * size,
            lambda: "[" + "[]," * size + "]",
            lambda: "{a=" * size + "1" + "}" * size,
            lambda: "{" + ".".join("a" * size) + "=1}",
            lambda: '"""' + '"' * size,
            lambda: (
                "[" + ", ".join(f'"{random.choice(_STRANGE)}"' for _ in range(size % 997)) + "]"
            ),
            lambda: f'"{random.choice(_STRANGE)}"',
            lambda: "\n" * size + "1979-13-45",
        )
    )()


def settings(seed: int) -> dict[str, bytes]:
    """A pyproject.toml beside a specification."""
    random = Random(seed)
    size = random.choice(_SIZES)
    keys = ("select", "ignore", "strict", "exclude", "allow", "x", "\u00e4", "a" * 300)
    key = random.choice((*keys, ".".join("a" * size), ".".join(["'b.'"] * size)))
    line = f"{key} = {_values(random, size)}\n"
    head = random.choice(
        ("[tool.specc]\n", "[tool]\nspecc.", "# specc\n", f"[{key}]\n[tool.specc]\n")
    )
    many = random.choice((1, 1, 1, 200))
    text = head + "".join(line if n == 0 else f"k{n}{line}" for n in range(many))
    data = text.encode("utf-8", "surrogatepass")[:3_000_000]
    if random.random() < 0.15:
        data = random.choice((b"\xff\xfe", b"\xef\xbb\xbf", b"\0")) + data
    return {MAIN: written(small()).encode(), "pyproject.toml": data}


_GRIN = "\U0001f600"
_ENCODINGS = ("utf-7", "shift_jis", "utf-16", "idna", "none", "rot13", "big5", "cp037", "undefined")
SECRET = b"a private file of somebody"


def _elements(random: Random, size: int) -> str:
    """Elements of MJCF that ask for much, or for a file of somebody else."""
    file = random.choice(
        ("../secret", "/etc/hostname", "secret", "link", "../" * 30 + "etc/hostname")
    )
    few = min(size, 3000)
    return random.choice(
        (
            lambda: (
                '<asset><texture name="t" builtin="flat" width="2" height="2" '
                f'file="{file}"/></asset>'
            ),
            lambda: f'<asset><texture name="t" type="2d" file="{file}"/></asset>',
            lambda: f'<asset><mesh name="m" file="{file}"/></asset>',
            lambda: f'<asset><hfield name="h" file="{file}"/></asset>',
            lambda: f'<asset><model name="n" file="{file}"/></asset>',
            lambda: f'<include file="{file}"/>',
            lambda: f'<compiler meshdir="{file}"/><asset><mesh file="x.obj"/></asset>',
            lambda: f'<size memory="{"9" * few}P"/>',
            lambda: f'<worldbody><replicate count="{size}"><body/></replicate></worldbody>',
            lambda: (
                "<worldbody>"
                + "<replicate count='9'>" * (few % 190)
                + "</replicate>" * (few % 190)
                + "</worldbody>"
            ),
            lambda: (
                f'<asset><texture name="t" builtin="flat" width="{size}" height="{size}"/></asset>'
            ),
            lambda: f'<sensor><user name="u" dim="{random.choice(_STRANGE[4:])}"/></sensor>',
            lambda: f'<worldbody><camera name="c" resolution="{"9" * few} 1"/></worldbody>',
            lambda: f'<worldbody><body name="{_GRIN * few}"/></worldbody>',
            lambda: "<default>" * (few % 190) + "</default>" * (few % 190),
            lambda: f'<deformable><skin name="s" file="{file}"/></deformable>',
            lambda: (
                f'<worldbody><flexcomp name="f" type="grid" count="{size} 9 9" '
                f'file="{file}"/></worldbody>'
            ),
            lambda: f'<option timestep="{random.choice(("nan", "inf", "1e-300", "0", "-1"))}"/>',
            lambda: (
                "<asset>"
                + "".join(f'<mesh name="m{n}" file="{n}.obj"/>' for n in range(few))
                + "</asset>"
            ),
        )
    )()


def model(seed: int) -> dict[str, bytes]:
    """A plant of a small system, and what a stranger has put into it."""
    random = Random(seed)
    files: Files = GROWING["plant bindings"](2)
    inside = "".join(
        _elements(random, random.choice(_SIZES)) for _ in range(random.choice((1, 1, 3)))
    )
    text = files[MODEL].replace("<worldbody>", f"{inside}<worldbody>", 1)
    if random.random() < 0.25:
        text = f'<?xml version="1.0" encoding="{random.choice(_ENCODINGS)}"?>{text}'
    data = text.encode("utf-8", "surrogatepass")
    if random.random() < 0.1:
        data = data[: random.randrange(len(data))]
    return {MAIN: files[MAIN].encode(), MODEL: data}


STRANGERS: dict[str, Callable[[int], dict[str, bytes]]] = {"settings": settings, "model": model}
