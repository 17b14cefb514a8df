"""Asking in long loops whether the work is to go on.

A stage calls ``progress(fraction, label)`` at its own steps, and raising in it cancels.  Between two steps seconds may
pass.  `pollable` keeps the callback for the time of a stage, and `poll`, called wherever a loop takes long, calls it
again with what was told last, every `INTERVAL` at most.  So the work can be stopped between any two operations on
arrays, and no function takes a callback that it does not report to itself.
"""

from __future__ import annotations

import functools
import threading
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import islice
from typing import Any, Callable, Optional, TypeVar, cast

Progress = Callable[[float, str], None]
Item = TypeVar("Item")
Result = TypeVar("Result")
Stage = TypeVar("Stage", bound=Callable[..., Any])

INTERVAL = 0.1
"""Seconds from one call to the next: a third of what a person takes for at once."""

_MANY = 256
"""Small items between two polls."""

_WAIT = 0.1
"""Seconds for which a thread is waited for between two polls."""


class _Listener:
    """A callback, and what it was told last."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._fraction, self._label, self._called = 0.0, "", time.monotonic()

    def tell(self, fraction: float, label: str) -> None:
        self._fraction, self._label = fraction, label
        self._progress(fraction, label)
        self._called = time.monotonic()

    def ask(self) -> None:
        if time.monotonic() - self._called >= INTERVAL:
            self.tell(self._fraction, self._label)


_LISTENER: ContextVar[Optional[_Listener]] = ContextVar("weavecore_listener", default=None)


def pollable(stage: Stage) -> Stage:
    """Let `poll` call the ``progress`` of a stage while that runs.

    Parameters
    ----------
    stage : callable
        Takes ``progress``, by keyword: a callback or None.

    Returns
    -------
    callable
        The same, with the same parameters.
    """

    @functools.wraps(stage)
    def run(*arguments: Any, progress: Optional[Progress] = None, **options: Any) -> Any:
        if progress is None:
            return stage(*arguments, **options)
        with listening(progress) as tell:
            return stage(*arguments, progress=tell, **options)

    return cast("Stage", run)


@contextmanager
def listening(progress: Progress) -> Iterator[Progress]:
    """Let `poll` call a callback meanwhile; a stage that has one of its own is heard by that.

    Parameters
    ----------
    progress : callable

    Yields
    ------
    callable
        What is to be called in its place, so that `poll` repeats what was told last.
    """
    listener = _Listener(progress)
    token = _LISTENER.set(listener)
    try:
        yield listener.tell
    finally:
        _LISTENER.reset(token)


def poll() -> None:
    """Call the callback of the stage that runs, where the last call is longer ago than `INTERVAL`."""
    listener = _LISTENER.get()
    if listener is not None:
        listener.ask()


def poll_during(work: Callable[..., Result], *arguments: Any, **options: Any) -> Result:
    """Do in a thread what is one long call of a library, such as a factorisation, and poll meanwhile.

    It only helps where the library releases the interpreter's lock.  A cancelled call goes on in its thread to its end.

    Parameters
    ----------
    work : callable
        Must not poll itself.
    *arguments, **options
        What it is called with.

    Returns
    -------
    object
        What ``work`` returns; what it raises is raised.
    """
    if _LISTENER.get() is None:
        return work(*arguments, **options)
    done: list[Result] = []
    failed: list[BaseException] = []

    def run() -> None:
        try:
            done.append(work(*arguments, **options))
        except BaseException as error:  # noqa: BLE001 - it is raised below.
            failed.append(error)

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(_WAIT)
        poll()
    if failed:
        raise failed[0]
    return done[0]


def each(items: Iterable[Item]) -> Iterator[Item]:
    """The items, with a `poll` before each.

    Parameters
    ----------
    items : iterable
    """
    listener = _LISTENER.get()
    if listener is None:
        yield from items
        return
    for item in items:
        listener.ask()
        yield item


def each_of_many(items: Iterable[Item]) -> Iterator[Item]:
    """The items, with a `poll` now and then: of those that take microseconds and come by the hundred thousand.

    Parameters
    ----------
    items : iterable
    """
    source = iter(items)
    while some := tuple(islice(source, _MANY)):
        poll()
        yield from some
