"""Reading in a process of its own, limited in memory and time.

A damaged Rhino file can make the library that reads it hang, take gigabytes, or end the process.
`call_guarded` runs a function of this package in a child process and hands its result, its progress and its
typed errors over; whatever becomes of the child, the caller goes on.

Limits on memory and processor time are set where the platform has them (Linux; macOS in part); the
limit on elapsed time holds everywhere.  A file of ordinary size ends within ten seconds, whatever is in
it; a large one gets more, and so does who asks for it (see `limits_for`).
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import pickle
import queue
import signal
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any

from weavecore import errors
from weavecore.errors import TooMuchWork, Unreadable, WeaveError
from weavecore.files import PathLike

Progress = Callable[[float, str], None]

_FRAME = struct.Struct("<cQ")
_STARTED, _PROGRESS, _RESULT, _ERROR = b"S", b"P", b"R", b"E"
_START = "from weavecore.reading.sandbox import serve; serve()"
_ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
_LESS_MEMORY = "Give a longer edge target, a simpler surface, or a time limit, which allows more memory as well."
_START_SECONDS = 40.0
_MEGABYTE = 2**20
_FREE_MEGABYTES = 0.5
_SECONDS_A_MEGABYTE = 20.0
_FINENESS_SECONDS = 120.0
_MOST_OBJECTS_AT_LENGTH = 10
_BUSY = 3.0
_MEMORY_A_MEGABYTE = 100


@dataclass(frozen=True)
class Limits:
    """What a child process may take.

    Parameters
    ----------
    reading_seconds : float
        Elapsed time until the first progress is told: as long as the file itself is read.
    seconds : float
        Processor time in all, and elapsed time from one progress to the next.  Where others use the machine as
        well, work that tells its progress may take up to three times as long by the clock.
    memory : int
        Address space, in bytes.
    n_objects : int
        How many objects, each told as a progress, may take so long each.
    """

    reading_seconds: float = 7.0
    seconds: float = 8.0
    memory: int = 2 * 1024 * _MEGABYTE
    n_objects: int = 1


def limits_for(path: PathLike, *, time_limit: float | None = None, is_fineness_asked: bool = False) -> Limits:
    """Limits that suit a file.

    Parameters
    ----------
    path : path
        Each megabyte that it has beyond the first half adds a second for reading, twenty seconds for making
        a mesh of what it holds, and 100 MB of memory.
    time_limit : float, optional
        Seconds in all instead, for reading as well; who gives it gets twice the memory.
    is_fineness_asked : bool
        Whether an edge target is given: a fine mesh that is asked for gets two minutes more, and twice the memory.
    """
    try:
        megabytes = max(Path(path).stat().st_size / _MEGABYTE - _FREE_MEGABYTES, 0.0)
    except OSError:
        megabytes = 0.0
    usual = Limits()
    memory = usual.memory + int(_MEMORY_A_MEGABYTE * megabytes) * _MEGABYTE
    if time_limit is not None:
        return Limits(time_limit, time_limit, 2 * memory)
    return Limits(
        reading_seconds=usual.reading_seconds + megabytes,
        seconds=usual.seconds + _SECONDS_A_MEGABYTE * megabytes + (_FINENESS_SECONDS if is_fineness_asked else 0.0),
        memory=2 * memory if is_fineness_asked else memory,
    )


def limits_for_all(path: PathLike, *, time_limit: float | None = None) -> Limits:
    """Limits for looking at every object of a file: each may take as long as `limits_for` gives to a single one."""
    each = limits_for(path, time_limit=time_limit)
    return replace(each, n_objects=_MOST_OBJECTS_AT_LENGTH)


def call_guarded(
    function: Callable[..., Any],
    /,
    *args: Any,
    limits: Limits | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Any:
    """Call a function in a child process.

    Parameters
    ----------
    function : callable
        A function of a module that can be imported; it takes ``progress``.
    *args, **options
        What it is called with: values that can be pickled.
    limits : Limits, optional
    progress : callable, optional
        Called with what the function tells; raising in it ends the child.

    Returns
    -------
    object
        What the function returns.

    Raises
    ------
    Unreadable
        Where the child ends by itself, or the file is not read in time.
    TooMuchWork
        Where the memory does not suffice, or the work that follows takes too long.
    WeaveError
        What the function raises.
    """
    limits = limits or Limits()
    request = pickle.dumps((function.__module__, function.__qualname__, args, options, limits))
    child = subprocess.Popen(
        [sys.executable, "-c", _START],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, **_ONE_THREAD, "PYTHONPATH": _search_path()},
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),  # Windows would open a console beside Rhino.
    )
    conversation = _Conversation(child, limits, progress)
    try:
        return conversation.result(request)
    finally:
        child.kill()
        child.wait()
        conversation.close()


def _search_path() -> str:
    home = str(Path(__file__).resolve().parents[2])
    return os.pathsep.join([home, *filter(None, [os.environ.get("PYTHONPATH")])])


class _Conversation:
    """What the parent hears from the child, with a limit on how long it waits."""

    def __init__(self, child: subprocess.Popen[bytes], limits: Limits, progress: Progress | None) -> None:
        self._child, self._limits, self._progress = child, limits, progress
        self._frames: queue.Queue[tuple[bytes, bytes] | None] = queue.Queue()
        self._threads: list[threading.Thread] = []
        self._deadline = time.monotonic() + _START_SECONDS
        self._started = time.monotonic()
        self._is_read = False

    def close(self) -> None:
        """Let go of the pipes, once the child has ended."""
        for thread in self._threads:
            thread.join()
        for pipe in (self._child.stdin, self._child.stdout):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()

    def result(self, request: bytes) -> Any:
        self._threads = [
            threading.Thread(target=self._listen, daemon=True),
            threading.Thread(target=self._ask, args=(request,), daemon=True),
        ]
        for thread in self._threads:
            thread.start()
        while True:
            kind, payload = self._next_frame()
            if kind == _RESULT:
                return pickle.loads(payload)
            if kind == _ERROR:
                raise _error_from(*pickle.loads(payload))
            if kind == _STARTED:
                self._started = time.monotonic()
                self._deadline = self._started + self._limits.reading_seconds
                continue
            self._is_read = True
            in_all = _slower() * self._limits.n_objects * self._limits.seconds
            self._deadline = min(self._started + in_all, time.monotonic() + self._limits.seconds)
            if self._progress is not None:
                self._progress(*pickle.loads(payload))

    def _next_frame(self) -> tuple[bytes, bytes]:
        left = self._deadline - time.monotonic()
        try:
            frame = self._frames.get(timeout=max(left, 0.0))
        except queue.Empty:
            raise self._too_slow() from None
        if frame is None:
            raise self._ended(self._child.wait())
        return frame

    def _ask(self, request: bytes) -> None:
        pipe = self._child.stdin
        with contextlib.suppress(OSError):  # Where the child has ended, the listener tells how.
            if pipe is not None:
                pipe.write(request)
                pipe.close()

    def _listen(self) -> None:
        pipe = self._child.stdout
        while pipe is not None:
            head = pipe.read(_FRAME.size)
            if len(head) < _FRAME.size:
                break
            kind, length = _FRAME.unpack(head)
            payload = pipe.read(length)
            if len(payload) < length:
                break
            self._frames.put((kind, payload))
        self._frames.put(None)

    def _too_slow(self) -> WeaveError:
        if self._is_read:
            return TooMuchWork(
                f"The surface takes longer than {self._limits.seconds:.0f} seconds",
                remedy="Give a time limit (--time-limit SECONDS), a longer edge target, or a simpler surface.",
            )
        return Unreadable(
            f"The file could not be read within {self._limits.reading_seconds:.0f} seconds",
            remedy="It is damaged: open it in Rhino, repair it there and save it again; or give a time limit "
            "(--time-limit SECONDS).",
        )

    def _ended(self, status: int) -> WeaveError:
        if hasattr(signal, "SIGXCPU") and status == -signal.SIGXCPU:
            return self._too_slow()
        return Unreadable(
            f"What reads the file has ended by itself (status {status})",
            remedy="It is damaged: open it in Rhino, repair it there and save it again.",
        )


def _error_from(code: str, what: str, remedy: str, ids: tuple[Any, ...], kind: str) -> WeaveError:
    kinds = [value for value in vars(errors).values() if isinstance(value, type) and issubclass(value, WeaveError)]
    found = next((one for one in kinds if one.code == code), Unreadable)
    return found(what, remedy=remedy, ids=ids, kind=kind)


def serve() -> None:
    """Answer one request: the child's side of `call_guarded`."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # Whatever libraries print must not mix with the answers.
    module, name, args, options, limits = pickle.load(sys.stdin.buffer)
    __import__(module)
    function: Any = sys.modules[module]
    for part in name.split("."):
        function = getattr(function, part)
    extend = limit_this_process(limits)
    _send(answers, _STARTED, None)

    def progress(share: float, label: str) -> None:
        extend()
        _send(answers, _PROGRESS, (float(share), label))

    try:
        _send(answers, _RESULT, function(*args, progress=progress, **options))
    except WeaveError as error:
        ids = tuple(i if isinstance(i, int) else str(i) for i in error.ids)
        _send(answers, _ERROR, (error.code, error.what, error.remedy, ids, error.kind))
    except MemoryError:
        _send(answers, _ERROR, (TooMuchWork.code, "The memory does not suffice", _LESS_MEMORY, (), ""))
    except Exception as error:  # noqa: BLE001 - a damaged file may fail anywhere
        what = f"The file cannot be read ({type(error).__name__}: {error})"
        _send(answers, _ERROR, (Unreadable.code, what, "Open it in Rhino and save it again.", (), ""))
    answers.close()


def _send(answers: IO[bytes], kind: bytes, value: Any) -> None:
    payload = pickle.dumps(value)
    answers.write(_FRAME.pack(kind, len(payload)) + payload)
    answers.flush()


def _slower() -> float:
    """How much longer than their processor time others may make the work last; not where that is not limited."""
    return _BUSY if importlib.util.find_spec("resource") else 1.0


def limit_this_process(limits: Limits) -> Callable[[], None]:
    """Limit this process from now on; what is returned extends its time once the file is read."""
    try:
        import resource
    except ImportError:  # Windows
        return lambda: None
    used = resource.getrusage(resource.RUSAGE_SELF)
    started = used.ru_utime + used.ru_stime
    soft = int(started + limits.n_objects * limits.seconds) + 1
    hard = soft + 5  # At the hard limit the process is killed outright, and nothing tells why.
    _limit(resource.RLIMIT_CPU, int(started + limits.reading_seconds) + 1, hard)
    _limit(resource.RLIMIT_AS, limits.memory, limits.memory)
    _limit(resource.RLIMIT_CORE, 0, 0)
    return lambda: _limit(resource.RLIMIT_CPU, soft, hard)


def _limit(what: int, soft: int, hard: int) -> None:
    import resource

    try:
        resource.setrlimit(what, (soft, hard))
    except (OSError, ValueError):
        return  # The platform does not have it, or a stricter one is set.
