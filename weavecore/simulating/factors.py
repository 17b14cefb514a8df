"""Factors of sparse symmetric matrices by SuperLU, made and freed in one thread.

SciPy lists the memory of SuperLU thread by thread and frees only what the same thread took.  Factors that are made in
one thread, so that the caller can poll meanwhile, and dropped in another would keep their memory until the process
ends.  So one thread makes all factors, and those that are dropped are handed back to it.
"""

from __future__ import annotations

import atexit
import os
import threading
from functools import cache, partial
from queue import SimpleQueue
from typing import Any, Callable

from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from weavecore.geometry.arrays import Floats
from weavecore.polling import poll_during
from weavecore.simulating.structure import NO_RELAXATION


class Factors:
    """Factors of a symmetric matrix, and the number of its negative eigenvalues."""

    def __init__(self, made: list[Any], n_negative: int, tasks: Any) -> None:
        self._made, self.n_negative, self._tasks = made, n_negative, tasks

    def __del__(self) -> None:
        self._tasks.put(self._made.clear)

    def solve(self, right: Floats) -> Floats:
        """Solve for one right side (f,) or several (f, k)."""
        solution: Floats = self._made[0].solve(right)
        return solution


def factorise(matrix: csc_matrix) -> Factors:
    """Factors of a symmetric matrix (f, f) in its own order, without pivoting; polls meanwhile."""
    return poll_during(_ask, matrix, _tasks_of(os.getpid()))


def _ask(matrix: csc_matrix, tasks: Any) -> Factors:
    answer: Any = SimpleQueue()
    tasks.put(partial(_make, matrix, tasks, answer.put))
    made = answer.get()
    if isinstance(made, Exception):
        raise made
    factors: Factors = made
    return factors


def _make(matrix: csc_matrix, tasks: Any, answer: Callable[[Any], None]) -> None:
    options = {"SymmetricMode": True}
    try:
        made = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0.0, relax=NO_RELAXATION, options=options)
        answer(Factors([made], int((made.U.diagonal() < 0).sum()), tasks))
    except Exception as error:  # noqa: BLE001 - it is raised where the factors are asked for.
        answer(error)


@cache
def _tasks_of(_process: int) -> Any:
    """The queue of the thread that makes and frees factors; a forked process has none of its parent's threads."""
    tasks: Any = SimpleQueue()
    thread = threading.Thread(target=_serve, args=(tasks,), daemon=True, name="factors")
    thread.start()
    # Mono, which hosts Python in some programs, waits at its end for threads that still wait for something.
    atexit.register(_end, tasks, thread)
    return tasks


def _serve(tasks: Any) -> None:
    for task in iter(tasks.get, None):
        task()


def _end(tasks: Any, thread: threading.Thread) -> None:
    tasks.put(None)
    thread.join()
