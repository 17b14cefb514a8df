"""The time limit of a whole command.

Where the system has timers (``signal.setitimer``: not on Windows), one ends the command wherever it is, between two
steps of Python.  Elsewhere it ends at the next progress (`checked`).
"""

from __future__ import annotations

import contextlib
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Callable, NoReturn, Optional

from weavecore.errors import TooMuchWork
from weavecore.viewing.terminal import progress_bar

DEFAULT_SECONDS = 115.0
"""Time of a command without a limit of its own: no wait is longer than two minutes."""
_FREE_MEGABYTES = 5.0
"""Files up to this size get the default; each megabyte more adds `_SECONDS_A_MEGABYTE`, as reading does."""
_SECONDS_A_MEGABYTE = 20.0
_MEGABYTE = 1_000_000
_FINENESS_SECONDS = 120.0
"""More for a fine mesh that is asked for, as reading gets."""

_ends_at: Optional[float] = None
_seconds = DEFAULT_SECONDS


def start_clock(path: Path, seconds: Optional[float] = None, *, extra: float = 0.0) -> None:
    """Bound the time that the command may take from now on.

    Parameters
    ----------
    path : Path
        The input file, on whose size the default depends.
    seconds : float, optional
        A limit that was asked for.
    extra : float
        Seconds that are added to the default.
    """
    global _ends_at, _seconds  # noqa: PLW0603 - a process runs one command.
    if seconds is None:
        size = path.stat().st_size / _MEGABYTE if path.is_file() else 0.0
        seconds = DEFAULT_SECONDS + extra + _SECONDS_A_MEGABYTE * max(size - _FREE_MEGABYTES, 0.0)
    _seconds = min(seconds, threading.TIMEOUT_MAX)
    _ends_at = time.monotonic() + _seconds
    if _has_timer():
        signal.signal(signal.SIGALRM, lambda _signal, _frame: _end())
        signal.setitimer(signal.ITIMER_REAL, _seconds)


@contextlib.contextmanager
def timed_progress(
    path: Path, seconds: Optional[float] = None, *, quiet: bool, is_fine: bool = False
) -> Iterator[Callable[[float, str], None]]:
    """A progress bar, with the clock started; see `start_clock` and `progress_bar`."""
    start_clock(path, seconds, extra=_FINENESS_SECONDS if is_fine else 0.0)
    with progress_bar(quiet=quiet) as show_progress:
        yield checked(show_progress)


def stop_clock() -> None:
    """Let the process take as long as it likes again."""
    global _ends_at  # noqa: PLW0603
    if _ends_at is not None and _has_timer():
        signal.setitimer(signal.ITIMER_REAL, 0.0)
    _ends_at = None


def checked(progress: Callable[[float, str], None]) -> Callable[[float, str], None]:
    """A progress callback that ends the command when its time is over.

    Parameters
    ----------
    progress : callable
    """

    def check(fraction: float, label: str) -> None:
        if _ends_at is not None and time.monotonic() > _ends_at:
            _end()
        progress(fraction, label)

    return check


def _has_timer() -> bool:
    return hasattr(signal, "setitimer") and threading.current_thread() is threading.main_thread()


def _end() -> NoReturn:
    raise TooMuchWork(
        f"The command takes longer than {_seconds:.4g} seconds",
        remedy="Use a larger spacing, longer edges or a coarser mesh, or raise --time-limit.",
    )
