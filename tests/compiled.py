"""The specifications in `specs/` are not compiled again for each test: no test changes them.

What is compiled is frozen, and so is the code that was generated from it. Tests of what compiling
takes ask `anew`. A changed text is compiled for whoever asks: nobody else will.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from itertools import starmap
from pathlib import Path
from typing import Any

from specc import pipeline
from specc.source import real_path

SPECS = Path(__file__).resolve().parents[1] / "specs"
MADE = "compile_spec", "build"
MOST = 6
"""Proofs are large: those that were asked for last are kept."""
NOTHING: Mapping[str, str] = {}

_kept: dict[Hashable, Any] = {}


def once() -> None:
    """From now on, in this process."""
    for name in MADE:
        setattr(pipeline, name, _once(getattr(pipeline, name)))


@contextmanager
def anew() -> Iterator[None]:
    """Compile as often as it is asked for."""
    before = {name: getattr(pipeline, name) for name in MADE}
    for name, made in before.items():
        setattr(pipeline, name, made.__wrapped__)
    try:
        yield
    finally:
        for name, made in before.items():
            setattr(pipeline, name, made)


def _once(made: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(made)
    def kept(
        path: str,
        values: Mapping[str, str] = NOTHING,
        texts: Mapping[str, str] = NOTHING,
        **options: bool | str | None,
    ) -> Any:
        file = real_path(path)
        if not (Path(file).is_relative_to(SPECS) and os.path.isfile(file)):
            return made(path, values, texts, **options)
        if not all(starmap(_is_what_stands, texts.items())):
            return made(path, values, texts, **options)
        asked = str(path), os.getcwd(), _changed()
        key = made, *asked, *map(_items, (values, options))
        found = _kept[key] = _kept.pop(key, None) or made(path, values, texts, **options)
        while len(_kept) > MOST:
            del _kept[next(iter(_kept))]
        return found

    return kept


def _changed() -> Hashable:
    """When the files that specifications may name were changed last."""
    files = (Path(folder, name) for folder, _, names in os.walk(SPECS) for name in names)
    times = [file.stat().st_mtime_ns for file in files]
    return max(times), len(times)


def _is_what_stands(file: str, text: str) -> bool:
    """Whether this is the text of the file on the disk, which is read anyway."""
    try:
        return Path(file).read_text(encoding="utf-8") == text
    except (OSError, ValueError):
        return False


def _items(given: Mapping[str, Any]) -> Hashable:
    return tuple(sorted(given.items()))
