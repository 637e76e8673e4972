"""Runs on the workers of a Dask cluster. The door to distributed.

Workers get an archive with the generated packages and the files of the specification, those that
join later too; what they need besides is specc itself and the modules of the operators.
"""

from __future__ import annotations

import io
import shutil
import zipfile
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import distributed

from specc.tools.sweep.running import Place, enter, leave
from specc.tools.sweep.settings import SweepError

CONNECT_S = 10
_MADE = (1980, 1, 1, 0, 0, 0)


class _Shipment(distributed.WorkerPlugin):  # type: ignore[misc]  # it has no types
    """Puts the archive into the folder of a worker, and ends its processes afterwards."""

    def __init__(self, name: str, content: bytes, base: str) -> None:
        self.name = name
        self._content = content
        self._base = base

    def setup(self, worker: Any) -> None:
        folder = self._folder(worker)
        shutil.rmtree(folder, ignore_errors=True)
        with zipfile.ZipFile(io.BytesIO(self._content)) as archive:
            archive.extractall(folder)
        enter(self.name, Place(folder, folder / self._base))

    def teardown(self, worker: Any) -> None:
        leave(self.name)
        shutil.rmtree(self._folder(worker), ignore_errors=True)

    def _folder(self, worker: Any) -> Path:
        return Path(worker.local_directory, self.name)


def archive(files: Mapping[str, bytes]) -> bytes:
    """Files by their paths below `packages/` and `base/`, packed."""
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in sorted(files.items()):
            packed.writestr(zipfile.ZipInfo(name, _MADE), data, zipfile.ZIP_DEFLATED)
    return content.getvalue()


@contextmanager
def cluster(address: str, name: str, content: bytes, base: str) -> Iterator[tuple[Executor, int]]:
    """The workers of the scheduler at `HOST:PORT`, and how many runs they take at once.

    They get the archive `content`, where `base` is the folder of the specification.

    Raises SweepError when it is not there, or its workers cannot take what they need.
    """
    try:
        client: Any = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SweepError(f"--scheduler {address}: no Dask scheduler there: {error}") from None
    with client:
        try:
            client.register_plugin(_Shipment(name, content, base))
        except Exception as error:
            why = f"{type(error).__name__}: {error}"
            raise SweepError(f"--scheduler {address}: a worker cannot begin: {why}") from error
        try:
            yield client.get_executor(pure=False), sum(client.nthreads().values())
        finally:
            client.unregister_worker_plugin(name)
