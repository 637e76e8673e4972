"""Commands in the process of the tests: what a shell would see of them, at a tenth of the cost."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, chdir, contextmanager, redirect_stderr, redirect_stdout
from importlib import invalidate_caches
from io import BytesIO, TextIOWrapper
from pathlib import Path
from unittest import mock

from specc.cli import main

ROOT = Path(__file__).parents[1]


def specc(
    *arguments: object,
    cwd: Path = ROOT,
    env: Mapping[str, str] | None = None,
    together: bool = False,
) -> subprocess.CompletedProcess[str]:
    """Run a command to its end in an environment, whose PYTHONPATH counts.

    `together` is both streams as one, in the order of what is printed.

    What is about signals, standard streams or the end of a process needs a process of its own.
    """
    words = [str(argument) for argument in arguments]
    out, err = (TextIOWrapper(BytesIO(), encoding="utf-8", newline="") for _ in range(2))
    with ExitStack() as stack:
        stack.enter_context(chdir(cwd))
        if env is not None:
            stack.enter_context(mock.patch.dict(os.environ, env, clear=True))
        stack.enter_context(modules_of(*(env or {}).get("PYTHONPATH", "").split(os.pathsep)))
        # Those beside a specification, unless they are our own.
        stack.enter_context(forgotten(*(() if cwd == ROOT else (cwd,))))
        stack.enter_context(redirect_stdout(out))
        stack.enter_context(redirect_stderr(out if together else err))
        try:
            code = main(words)
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
    return subprocess.CompletedProcess(words, code, _text(out), _text(err))


def alone(folder: Path) -> list[str]:
    """Arguments of pytest for the tests in a folder, without a look at what lies beside it."""
    return [f"--rootdir={folder}", f"--confcutdir={folder}", "-c", os.devnull, str(folder)]


def _text(stream: TextIOWrapper) -> str:
    stream.flush()
    stream.seek(0)
    return stream.read()


@contextmanager
def modules_of(*folders: str | Path) -> Iterator[None]:
    """With the modules in these folders; they, and generated ones, are forgotten afterwards."""
    own = [str(folder) for folder in folders if folder]
    with forgotten(*own):
        sys.path[:0] = own
        invalidate_caches()
        yield


@contextmanager
def forgotten(*folders: str | Path) -> Iterator[None]:
    """Modules in these folders, generated ones and changes of the path are forgotten afterwards."""
    before, path = dict(sys.modules), list(sys.path)
    try:
        yield
    finally:
        sys.path[:] = path
        for name in sys.modules.keys() - before.keys():
            file = getattr(sys.modules[name], "__file__", None) or ""
            if name.startswith("generated_") or any(map(Path(file).is_relative_to, folders)):
                del sys.modules[name]
        sys.modules.update(before)
