"""A sandboxed worker as a copy of this process: it has imported already what takes a new one half a second.

Only on Linux, and only while the process has a single thread: the copy of another one's lock is never released.  A
command has one (see `weavecore.threads`); where there are more, the worker is a new process.

What the copy must not keep of its parent is taken from it: open files, signal handlers, the callback of its progress
and the unwritten output.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
import traceback
from collections.abc import Callable
from contextvars import Context
from pathlib import Path
from typing import IO, NoReturn, Optional

_TASKS = Path("/proc/self/task")
_SIZE = Path("/proc/self/statm")
_FILES = Path("/proc/self/fd")
_PAUSE = 0.005
"""Seconds between two looks at a child that is waited for."""


class ForkedChild:
    """A child process, with as much of the interface of `subprocess.Popen` as the sandbox uses."""

    stdin: Optional[IO[bytes]] = None

    def __init__(self, pid: int, stdout: int, stderr: int) -> None:
        self._pid = pid
        self._status: Optional[int] = None
        self.stdout: IO[bytes] = os.fdopen(stdout, "rb")
        self.stderr: IO[bytes] = os.fdopen(stderr, "rb")

    def kill(self) -> None:
        """End the child, whatever it does."""
        if self._ended() is None:
            os.kill(self._pid, signal.SIGKILL)

    def wait(self, timeout: Optional[float] = None) -> int:
        """Exit status of the child once it has ended; the number of the signal, negative, that ended it.

        Raises
        ------
        TimeoutError
            Where it has not ended after so many seconds.
        """
        end = None if timeout is None else time.monotonic() + timeout
        status = self._ended()
        while status is None:
            if end is not None and time.monotonic() > end:
                raise TimeoutError
            time.sleep(_PAUSE)
            status = self._ended()
        return status

    def _ended(self) -> Optional[int]:
        if self._status is None:
            pid, status = os.waitpid(self._pid, os.WNOHANG)
            if pid:
                self._status = os.waitstatus_to_exitcode(status)
        return self._status


def can_fork() -> bool:
    """Whether this process may be copied, and can wait for the copy."""
    if sys.platform != "linux" or signal.getsignal(signal.SIGCHLD) != signal.SIG_DFL:
        return False
    return _TASKS.is_dir() and len(list(_TASKS.iterdir())) == 1


def mapped_memory() -> int:
    """Bytes of address space that this process has, and that a copy of it starts with."""
    return int(_SIZE.read_text("ascii").split()[0]) * os.sysconf("SC_PAGE_SIZE")


def fork_child(serve: Callable[[int], None]) -> ForkedChild:
    """Copy this process.

    Parameters
    ----------
    serve : callable
        What the copy does, with the descriptor to which it writes its messages; what is printed goes to ``stderr``.

    Returns
    -------
    ForkedChild

    Raises
    ------
    OSError
        Where the system allows no more processes or files.
    """
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    answers, words = os.pipe(), os.pipe()
    try:
        pid = os.fork()
    except OSError:
        for descriptor in (*answers, *words):
            os.close(descriptor)
        raise
    if pid == 0:
        _be_child(serve, answers[1], words[1])
    os.close(answers[1])
    os.close(words[1])
    return ForkedChild(pid, answers[0], words[0])


def _be_child(serve: Callable[[int], None], answers: int, words: int) -> NoReturn:
    """Do the work and end, without what the parent does at its end."""
    status = 1
    try:
        for name in ("SIGALRM", "SIGTERM", "SIGHUP"):
            signal.signal(getattr(signal, name), signal.SIG_DFL)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(words, 1)
        os.dup2(words, 2)
        for descriptor in [int(place.name) for place in _FILES.iterdir()]:
            if descriptor > 2 and descriptor != answers:
                with contextlib.suppress(OSError):  # That of the folder itself has been closed.
                    os.close(descriptor)
        sys.stdout = sys.stderr = os.fdopen(2, "w", errors="replace", closefd=False)
        Context().run(serve, answers)
        status = 0
    except BaseException:  # noqa: BLE001 - the parent reads the last line where the child has not started.
        traceback.print_exc()
    finally:
        with contextlib.suppress(OSError, ValueError):
            sys.stderr.flush()
        os._exit(status)
