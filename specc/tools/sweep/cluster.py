"""Runs on the workers of a Dask cluster. The door to distributed.

Workers get all files that runs read, those that join later too; what they need besides is specc
itself and the modules of the operators.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import distributed

from specc.tools.sweep.running import Bundle, Place, enter, leave
from specc.tools.sweep.settings import SweepError

CONNECT_S = 10


class _Shipment(distributed.WorkerPlugin):  # type: ignore[misc]  # it has no types
    """Puts the files into a folder of a worker, and ends its processes afterwards."""

    def __init__(self, name: str, bundle: Bundle) -> None:
        self.name = name
        self._bundle = bundle

    def setup(self, worker: Any) -> None:
        enter(self.name, Place(Path(worker.local_directory, self.name), self._bundle))

    def teardown(self, worker: Any) -> None:
        leave(self.name)


@contextmanager
def cluster(address: str, name: str, bundle: Bundle) -> Iterator[tuple[Executor, int]]:
    """The workers of the scheduler at `HOST:PORT`, and how many runs they take at once.

    Raises SweepError when it is not there, or its workers cannot take what they need.
    """
    try:
        client: Any = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise SweepError(f"--scheduler {address}: no Dask scheduler there: {error}") from None
    with client:
        try:
            client.register_plugin(_Shipment(name, bundle))
        except Exception as error:
            why = f"{type(error).__name__}: {error}"
            raise SweepError(f"--scheduler {address}: a worker cannot begin: {why}") from error
        try:
            yield client.get_executor(pure=False), sum(client.nthreads().values())
        finally:
            client.unregister_worker_plugin(name)
