"""Where groups are woven: this process, processes of its own, any executor, or a Dask cluster.

All four take a group and return a ``concurrent.futures.Future`` of its results.  A surface is sent once to each
process: own processes get all surfaces when they start, a cluster by ``scatter``; only an executor that the caller
brings gets the surface with each group.

Own processes are spawned, not forked, on every system: they start the same everywhere, and no thread of the caller is
copied into them.  A script that asks for more than one therefore needs ``if __name__ == "__main__":``.
"""

from __future__ import annotations

import asyncio
import contextlib
import multiprocessing
import os
import sys
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from pathlib import Path
from typing import Any, Optional

from weavecore.errors import Unsupported
from weavecore.exploring.evaluate import Result, weave_group
from weavecore.exploring.variants import Group
from weavecore.model import SurfaceMesh
from weavecore.threads import THREAD_VARIABLES

Surfaces = Mapping[str, SurfaceMesh]
"""Surfaces by their digests."""

Results = Future[list[Result]]

_GROUPS_A_WORKER = 2
"""One that is woven, and one that the worker takes next without waiting for this process."""

_CONNECT_SECONDS = 30.0
"""Within which a scheduler must answer."""

_kept: dict[str, SurfaceMesh] = {}
"""Surfaces that this worker process was started with."""


class Crew:
    """The calling process: a group is woven while it is submitted."""

    capacity = 1
    """Groups that it has at a time."""

    def __init__(self, surfaces: Surfaces, **options: Any) -> None:
        self._surfaces = surfaces
        self._options = options  # Of `weave_group`.

    def submit(self, group: Group) -> Results:
        """Weave a group."""
        done: Results = Future()
        done.set_result(weave_group(self._surfaces[group.digest], group, **self._options))
        return done

    def restart(self) -> None:
        """Go on after a worker was lost."""

    def close(self) -> None:
        """End what was started; groups that wait are left out."""


class _OwnProcesses(Crew):
    """Worker processes on this machine."""

    def __init__(self, surfaces: Surfaces, *, n_workers: int, **options: Any) -> None:
        super().__init__(surfaces, **options)
        self.capacity = _GROUPS_A_WORKER * n_workers
        self._n_workers = n_workers
        self._pool = self._start()

    def _start(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(
            self._n_workers,
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_keep,
            initargs=(dict(self._surfaces),),
        )

    def submit(self, group: Group) -> Results:
        with _one_thread_each():  # The pool starts a process when it needs one more.
            return self._pool.submit(_weave_kept, group, self._options)

    def restart(self) -> None:
        self.close()
        self._pool = self._start()

    def close(self) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)


class _GivenExecutor(Crew):
    """An executor of the caller, which stays open."""

    def __init__(self, surfaces: Surfaces, *, executor: Executor, n_workers: int, **options: Any) -> None:
        super().__init__(surfaces, **options)
        self.capacity = _GROUPS_A_WORKER * n_workers
        self._executor = executor

    def submit(self, group: Group) -> Results:
        surface = self._surfaces[group.digest]
        return self._executor.submit(weave_group, surface, group, **self._options)


class _Cluster(Crew):
    """The workers of a Dask scheduler, which moves the groups of a lost worker to others."""

    def __init__(self, surfaces: Surfaces, *, client: Any, **options: Any) -> None:
        super().__init__(surfaces, **options)
        self.capacity = _GROUPS_A_WORKER * max(sum(client.nthreads().values()), 1)
        self._client = client
        self._executor = client.get_executor(pure=False)
        self._sent: dict[str, Any] = {}

    def submit(self, group: Group) -> Results:
        if group.digest not in self._sent:
            surface = self._surfaces[group.digest]
            # In the memory of every worker, so that it is not lost with one of them.
            self._sent[group.digest] = self._client.scatter(surface, broadcast=True, hash=False)
        future: Results = self._executor.submit(weave_group, self._sent[group.digest], group, **self._options)
        return future

    def restart(self) -> None:
        self._sent.clear()

    def close(self) -> None:
        self._client.close()


@contextlib.contextmanager
def open_crew(
    surfaces: Surfaces,
    *,
    with_pages: bool,
    time_limit: Optional[float] = None,
    workers: int = 1,
    executor: Optional[Executor] = None,
    scheduler: Optional[str] = None,
) -> Iterator[Crew]:
    """Start, or connect to, what weaves groups.

    Parameters
    ----------
    surfaces : mapping of str to SurfaceMesh
        By their digests.
    with_pages : bool
        Whether each variant gets a page of its own.
    time_limit : float, optional
        Seconds that a variant may take.
    workers : int
        Processes; with 1 the calling process does all.  Of an executor: how many it has.
    executor : concurrent.futures.Executor, optional
    scheduler : str, optional
        Address of a Dask scheduler, ``tcp://host:8786``.

    Yields
    ------
    Crew

    Raises
    ------
    Unsupported
        Where there is no worker, both an executor and a scheduler are named, or the scheduler is not reached.
    """
    if workers < 1:
        raise Unsupported(f"{workers} workers cannot weave", remedy="Use at least 1.")
    if executor is not None and scheduler is not None:
        raise Unsupported("Both an executor and a scheduler are named", remedy="Give one of the two.")
    options = {"with_pages": with_pages, "time_limit": time_limit}
    if scheduler is not None:
        crew: Crew = _Cluster(surfaces, client=_connect(scheduler), **options)
    elif executor is not None:
        crew = _GivenExecutor(surfaces, executor=executor, n_workers=workers, **options)
    elif workers > 1:
        _check_executable()
        crew = _OwnProcesses(surfaces, n_workers=workers, **options)
    else:
        crew = Crew(surfaces, **options)
    try:
        yield crew
    finally:
        crew.close()


def count_processors() -> int:
    """Processors that this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)  # Linux: also within a container.
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1


def _check_executable() -> None:
    """Refuse to start another Rhino, or whatever program Python runs in, instead of a worker."""
    program = Path(sys.executable or "").name
    if not program.lower().startswith("python"):
        raise Unsupported(f"No processes can be started from {program or 'here'}", remedy="Use 1 worker.")


def _connect(address: str) -> Any:
    try:
        from distributed import Client
    except ImportError as error:
        remedy = 'Install it: python -m pip install "weavecore[cluster]".'
        raise Unsupported("A cluster needs dask.distributed, which is not installed", remedy=remedy) from error
    try:
        # The class has types in part, where it is installed at all.
        client: Any = Client(address, timeout=_CONNECT_SECONDS, set_as_default=False)  # type: ignore[no-untyped-call]
        client.wait_for_workers(1, timeout=_CONNECT_SECONDS)
    except (OSError, ValueError, TimeoutError, asyncio.TimeoutError) as error:
        raise Unsupported(
            f"No scheduler with workers was reached at {address}: {error}",
            remedy="Start dask scheduler and dask worker, and give the address that the scheduler prints.",
        ) from error
    return client


@contextlib.contextmanager
def _one_thread_each() -> Iterator[None]:
    """Set the variables that processes which start now read, but for those that the user has set."""
    names = [name for name in THREAD_VARIABLES if name not in os.environ]
    os.environ.update(dict.fromkeys(names, "1"))
    try:
        yield
    finally:
        for name in names:
            os.environ.pop(name, None)


def _keep(surfaces: dict[str, SurfaceMesh]) -> None:
    _kept.update(surfaces)


def _weave_kept(group: Group, options: dict[str, Any]) -> list[Result]:
    return weave_group(_kept[group.digest], group, **options)
