"""A sweep from the specification to the table: what is missing is run, wherever there is room."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

from specc.analysis.plant import plant_model
from specc.mjcf import Model
from specc.model.system import System
from specc.source import COMMAND_LINE, Sources, relative_path
from specc.tools.sweep.running import (
    PACKAGES,
    Bundle,
    Closed,
    Figures,
    NoRun,
    SweepJob,
    Workspace,
    close_workspace,
    failure_row,
    open_workspace,
    run_job,
)
from specc.tools.sweep.table import Folder, SweepError

RENEWED_S = 10.0
"""Wall time between two versions of the table, and between two lines of progress."""


@dataclass(frozen=True, slots=True)
class InputFiles:
    """The files that runs read, by their paths below one folder; `base` is the specification's."""

    base: str
    files: Mapping[str, bytes]
    fingerprint: str
    """Another one when the specification, or a file that it uses or names, is another."""


def inputs_of(spec: str, sources: Sources, system: System, more: Iterable[str] = ()) -> InputFiles:
    """What runs of a system read beside the generated code, and `more` files. Raises OSError.

    Paths are as they are named, whatever links they lead over: so they are found in a copy, too.
    """
    base = os.path.abspath(os.path.dirname(spec))
    named = [os.path.join(base, path) for _, path in system.files]
    model = plant_model(system)
    of_model = model.files.possible if isinstance(model, Model) else ()
    paths = [*_files_below(named), *of_model, *more]
    content = {os.path.abspath(path): Path(path).read_bytes() for path in paths}
    root = os.path.commonpath([base, *map(os.path.dirname, content)])
    files = {os.path.relpath(path, root): content[path] for path in sorted(content)}
    return InputFiles(os.path.relpath(base, root), files, _fingerprint(spec, sources, files))


def bundle_of(packages: Mapping[str, str], inputs: InputFiles) -> Bundle:
    """Generated files, by their paths, and inputs as what runs read."""
    # Nearly all generated files are the same for all settings.
    encoded = {text: text.encode() for text in packages.values()}
    files = {f"{PACKAGES}/{path}": encoded[text] for path, text in packages.items()}
    files |= {f"base/{path}": content for path, content in inputs.files.items()}
    return Bundle(files, f"base/{inputs.base}")


def _files_below(paths: Iterable[str]) -> Iterator[str]:
    """The files at paths, and those in folders, without what Python compiled there."""
    for path in paths:
        if os.path.isdir(path):
            for folder, folders, names in os.walk(path):
                folders[:] = [name for name in folders if name != "__pycache__"]
                yield from (os.path.join(folder, name) for name in names)
        else:
            yield path


def _fingerprint(spec: str, sources: Sources, files: Mapping[str, bytes]) -> str:
    base = os.path.dirname(spec)
    texts = {
        relative_path(source.path, base or "."): source.text.encode()
        for source in sources
        if source.path not in COMMAND_LINE
    }
    digest = hashlib.sha256()
    for name, content in (*sorted(texts.items()), *files.items()):
        digest.update(hashlib.sha256(name.encode() + b"\0" + content).digest())
    return digest.hexdigest()


@contextmanager
def local_workers(
    name: str, folder: Path, bundle: Bundle, workers: int
) -> Iterator[tuple[Executor, int]]:
    """An executor of processes of this machine, which read copies in the folder, and how many."""
    open_workspace(name, Workspace(folder.absolute(), bundle))
    pool = ThreadPoolExecutor(workers)
    try:
        yield pool, workers
    finally:
        close_workspace(name)
        pool.shutdown(cancel_futures=True)


def carry_out(
    folder: Folder,
    jobs: Sequence[SweepJob],
    executor: Executor,
    on_progress: Callable[[int], None],
    on_renewal: Callable[[], None],
) -> None:
    """Run the jobs, in their order as far as there is room; each is a row when it ends.

    Those whose workers died are made again, one at a time: only so it is known which of them ended
    its worker. `on_progress` gets the number of jobs that are done; `on_renewal` is called from
    time to time.

    Raises:
        SweepError: the workers are gone. What is done is kept.
        OSError: a row cannot be written.
    """
    done, renewed_s = 0, time.monotonic()

    def watch() -> None:
        nonlocal renewed_s
        on_progress(done)
        if time.monotonic() - renewed_s >= RENEWED_S:
            if done:
                on_renewal()
            renewed_s = time.monotonic()

    suspects = []
    for job, figures in _outcomes(jobs, executor, watch):
        if figures is None:
            suspects.append(job)
        else:
            folder.add(job.setting, job.seed, figures)
            done += 1
    for suspect in suspects:
        for _, figures in _outcomes([suspect], executor, watch):
            figures = figures or failure_row("its worker died, again and again")
            folder.add(suspect.setting, suspect.seed, figures)
            done += 1
    watch()


def _outcomes(
    jobs: Sequence[SweepJob], executor: Executor, watch: Callable[[], None]
) -> Iterator[tuple[SweepJob, Figures | None]]:
    """What came of each job, in the order in which they end; None of one whose workers died.

    `watch` is called from time to time.
    """
    ended: SimpleQueue[Future[Figures]] = SimpleQueue()
    job_of = {executor.submit(run_job, job): job for job in jobs}
    for future in job_of:
        future.add_done_callback(ended.put)
    while job_of:
        watch()
        with suppress(Empty):
            future = ended.get(timeout=1.0)
            yield job_of.pop(future), _outcome(future)


def _outcome(future: Future[Figures]) -> Figures | None:
    """The figures of a run; None if the worker was killed."""
    try:
        return future.result()
    except (CancelledError, Closed):
        raise SweepError(
            "the workers are gone; the same command goes on where this ended"
        ) from None
    except NoRun as unfit:
        raise SweepError(f"a run could not be made: {unfit}") from None
    except Exception as error:
        # A run may kill the worker itself, not only the process that it runs in; Dask blames
        # whatever was there.
        if type(error).__name__ == "KilledWorker":
            return None
        raise SweepError(f"a run could not be made: {type(error).__name__}: {error}") from error
