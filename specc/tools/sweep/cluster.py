"""Runs on the workers of a Dask cluster. The door to distributed.

Workers get all files that runs read, those that join later too; what they need besides is specc
itself and the modules of the operators.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import distributed

from specc.tools.sweep.running import Bundle, Workspace, close_workspace, open_workspace
from specc.tools.sweep.table import SweepError

CONNECT_S = 10
_COMPARED_PACKAGES = ("specc", "numpy", "mujoco", "pin", "opencv-python-headless")
"""Packages of which another version may give other figures."""


def versions() -> dict[str, str]:
    """The versions of Python and of the installed packages that influence results."""
    found = {"Python": f"{sys.version_info.major}.{sys.version_info.minor}"}
    for package in _COMPARED_PACKAGES:
        with suppress(PackageNotFoundError):
            found[package] = version(package)
    return found


class Shipment(distributed.WorkerPlugin):  # type: ignore[misc]  # it has no types
    """Puts the files into a folder of a worker, and ends its processes afterwards."""

    def __init__(self, name: str, bundle: Bundle) -> None:
        self.name = name
        self._bundle = bundle
        self.versions = versions()

    def setup(self, worker: Any) -> None:
        """Raises RuntimeError for a worker with other versions.

        Of one that joins late Dask only logs that, so its runs tell it, too.
        """
        for package, worker_version in versions().items():
            if (own_version := self.versions.get(package, worker_version)) != worker_version:
                why = f"{worker.address} has {package} {worker_version}, not {own_version} as here"
                open_workspace(self.name, why := f"{why}; install the same there")
                raise RuntimeError(why)
        open_workspace(self.name, Workspace(Path(worker.local_directory, self.name), self._bundle))

    def teardown(self, worker: Any) -> None:
        """The sweep is over, or the worker."""
        close_workspace(self.name)


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
            try:
                client.register_plugin(Shipment(name, bundle))
            except Exception as error:
                why = f"{type(error).__name__}: {error}"
                raise SweepError(f"--scheduler {address}: a worker cannot begin: {why}") from error
            yield client.get_executor(pure=False), sum(client.nthreads().values())
        finally:
            with suppress(OSError):  # the scheduler is gone, and its workers go with it
                client.unregister_worker_plugin(name)
