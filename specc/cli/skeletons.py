"""`specc init`: starts a specification that validates and runs at once, from a skeleton."""

from __future__ import annotations

import sys
from pathlib import Path

from specc.diagnostics import nearest
from specc.resources import specs_dir


def start(directory: str, name: str) -> int:
    """Copy a skeleton into a directory, which is made if need be; nothing is ever overwritten."""
    known = names()
    if name not in known:
        close = nearest(name, known) or known
        print(f"specc: no skeleton {name!r}; there are {', '.join(close)}", file=sys.stderr)
        return 2
    source, target = specs_dir() / "skeletons" / name, Path(directory)
    files = sorted(path for path in source.rglob("*") if path.is_file())
    places = {path: target / path.relative_to(source) for path in files}
    taken = [str(place) for place in places.values() if place.exists() or place.is_symlink()]
    if taken:
        print(f"specc: {', '.join(taken)} exists already; nothing was written", file=sys.stderr)
        return 2
    try:
        for path, place in places.items():
            place.parent.mkdir(parents=True, exist_ok=True)
            with place.open("xb") as stream:
                stream.write(path.read_bytes())
    except OSError as error:
        print(f"specc: cannot write: {error}", file=sys.stderr)
        return 2
    for place in places.values():
        print(place)
    spec = next(place for place in places.values() if place.suffix == ".yaml")
    print(f"\nspecc status {spec}\nspecc run {spec} --cycles 1")
    return 0


def names() -> list[str]:
    """The skeletons that there are."""
    return sorted(path.name for path in (specs_dir() / "skeletons").iterdir() if path.is_dir())
