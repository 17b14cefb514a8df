"""In which order groups are given to workers, and what follows when a worker is lost.

::

    waiting ──▶ running (at most two groups a worker) ──▶ results
                   │ worker lost
                   ▼
                suspects, one at a time ──▶ results
                   │ lost again: its variants, one at a time; then the error WORKER_LOST

Two groups a worker keep every worker busy and bound the memory: of those alone results are held.  When a process ends,
no executor can say which of its groups ended it; run alone, the group, and then the variant, that is to blame is found,
and all others are woven.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, CancelledError, wait
from typing import Optional

from weavecore.exploring.evaluate import Result
from weavecore.exploring.executors import Crew, Results
from weavecore.exploring.variants import Group


def run_groups(groups: Iterable[Group], crew: Crew) -> Iterator[Result]:
    """Weave groups, and give each result as soon as it is known, in no fixed order.

    Parameters
    ----------
    groups : iterable of Group
    crew : Crew

    Yields
    ------
    Result
    """
    waiting, suspects = deque(groups), deque[Group]()
    running: dict[Results, Group] = {}
    while waiting or suspects or running:
        most = 1 if suspects else crew.capacity
        queue = suspects or waiting
        alone = bool(suspects) and not running
        while queue and len(running) < most:
            group = queue.popleft()
            submitted = _submit(crew, group)
            running[submitted] = group
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            group = running.pop(future)
            trouble = _trouble(future)
            if trouble is None:
                yield from future.result()
                continue
            if not running:
                crew.restart()
            if not alone:
                suspects.append(group)
            elif len(group.variants) > 1:
                suspects.extendleft(Group((variant,)) for variant in reversed(group.variants))
            else:
                yield _lost(group, trouble)


def _submit(crew: Crew, group: Group) -> Results:
    """Submit a group; where the executor is broken already, a future that says so."""
    try:
        return crew.submit(group)
    except RuntimeError as error:  # `BrokenExecutor` is one, and so is what an executor that was shut down raises.
        failed: Results = Results()
        failed.set_exception(error)
        return failed


def _trouble(future: Results) -> Optional[BaseException]:
    try:
        return future.exception()
    except CancelledError as error:
        return error


def _lost(group: Group, trouble: BaseException) -> Result:
    what = f"{type(trouble).__name__}: {' '.join(str(trouble).split())}".rstrip(": .")
    error = f"WORKER_LOST: The worker ended, or its result was lost ({what}). Explore again with more memory a worker."
    return Result(group.variants[0].key, error=error, is_final=False)
