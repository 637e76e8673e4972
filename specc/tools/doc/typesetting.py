"""Typst text as PDF and HTML: the door to typst, which is Rust.

Its time and memory grow with what files of strangers say, so it works in a process of its own, with
bounds, in which it reads no files and loads no packages: this file is its program, and imports
nothing of specc.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Sequence
from typing import Any

_SECONDS = 60
_BYTES = 4_000_000_000
"""Of address space; what is used of it is a fraction."""


class NotTypeset(Exception):
    """Typst made no document; the message says why."""


def typeset(text: str, font_folders: Sequence[str]) -> tuple[bytes, str]:
    """The PDF and the HTML of a text, with fonts of typst and of some folders.

    Raises:
        NotTypeset: typst finds errors, or needs more than its bounds.
    """
    with tempfile.TemporaryDirectory() as empty:
        command = [sys.executable, "-P", __file__, empty, *font_folders]
        try:
            done = subprocess.run(
                command, input=text.encode(), capture_output=True, check=False, timeout=4 * _SECONDS
            )
        except subprocess.TimeoutExpired as error:
            raise NotTypeset("it takes too long") from error
    if done.returncode:
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        raise NotTypeset(lines[-1] if lines else "it needs more than its bounds")
    size = int.from_bytes(done.stdout[:8], "big")
    return done.stdout[8 : 8 + size], done.stdout[8 + size :].decode()


def _typeset(root: str, font_folders: Sequence[str]) -> None:
    """What the process does: standard input to standard output."""
    resource.setrlimit(resource.RLIMIT_CPU, (_SECONDS, _SECONDS))
    resource.setrlimit(resource.RLIMIT_AS, (_BYTES, _BYTES))
    import typst

    warnings.simplefilter("ignore")
    text = sys.stdin.buffer.read()
    compiler = typst.Compiler(
        root=root,
        font_paths=list(font_folders),
        ignore_system_fonts=True,
        package_path=root,
        package_cache_path=root,
    )
    found: list[Any] = [
        compiler.compile(
            text, format=form, sys_inputs={"format": form}, timestamp=0, pdf_tags=False
        )
        for form in ("pdf", "html")
    ]
    sys.stdout.buffer.write(len(found[0]).to_bytes(8, "big") + b"".join(found))


if __name__ == "__main__":
    _typeset(sys.argv[1], sys.argv[2:])
