"""Reading in a process of its own, limited in memory and time.

A damaged Rhino file can make the library that reads it hang, take gigabytes, or end the process.
`call_guarded` runs a function of this package in a child process and hands over its result, its progress and its
typed errors; whatever becomes of the child, the caller goes on.

    parent                                   child
    search path, package  ── one line ─────▶ starts isolated, imports this module
    function, arguments   ── pickle ───────▶ `serve` sets the limits and calls the function
    progress, result      ◀─ messages ─────  (see `sandbox_messages`)

Where this process may be copied, the child is a copy, which need neither start nor import (see `sandbox_fork`).
The child looks for modules where the parent does, but never in the current folder: that is where the file may
come from, and a ``queue.py`` beside it must not run.  What the child sends is never unpickled: a file that exploits
a fault of the library could have taken the child over.

Limits on memory and processor time are set where the platform has them (Linux; macOS in part); the
limit on elapsed time holds everywhere.  A file of ordinary size ends within ten seconds, whatever is in
it; a large one gets more, and so does who asks for it (see `limits_for`).
"""

from __future__ import annotations

import contextlib
import importlib.util
import json
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from operator import attrgetter
from pathlib import Path
from typing import IO, Any, Union, cast

import numpy as np

from weavecore import errors
from weavecore.errors import TooMuchWork, Unreadable, Unsupported, WeaveError
from weavecore.files import PathLike
from weavecore.polling import INTERVAL, poll
from weavecore.reading.sandbox_fork import ForkedChild, can_fork, fork_child, mapped_memory
from weavecore.reading.sandbox_messages import BEGIN, Malformed, Message, decode, receive, send, skip_to_messages
from weavecore.threads import THREAD_VARIABLES

Progress = Callable[[float, str], None]
Child = Union[ForkedChild, "subprocess.Popen[bytes]"]

_STARTED, _PROGRESS, _RESULT, _ERROR = _KINDS = (b"S", b"P", b"R", b"E")

# Isolated (-I), the interpreter puts neither the current folder nor PYTHONPATH on its search path.  Until that is set
# nothing but the standard library is imported; weavecore is found by its file, wherever its folder is on the path.
_START = f"""
import os, sys
answers = os.dup(1)
os.dup2(2, 1)  # What libraries print must not mix with the messages.
import importlib.util, json
start = json.loads(sys.stdin.buffer.readline())
sys.path[:] = start["path"] + [place for place in sys.path if place not in start["path"]]
spec = importlib.util.spec_from_file_location("weavecore", start["package"])
sys.modules["weavecore"] = package = importlib.util.module_from_spec(spec)
spec.loader.exec_module(package)
from {__name__} import serve
serve(answers)
"""

_LESS_MEMORY = "Give a longer edge target, a simpler surface, or a time limit, which allows more memory as well."
_RUN_AGAIN = "Run it again; if that fails as well, open the file in Rhino, repair it there and save it again."

_START_SECONDS = 40.0  # NumPy and SciPy may have to come from a slow disk, on a machine that is busy.
_END_SECONDS = 5.0  # A child that has closed its messages ends at once.
_LONGEST_SECONDS = 30 * 24 * 3600.0  # Clocks and locks take no more than some weeks on all platforms.
_MEGABYTE = 2**20
_FREE_MEGABYTES = 0.5
_SECONDS_A_MEGABYTE = 20.0
_FINENESS_SECONDS = 120.0
_MOST_OBJECTS_AT_LENGTH = 10
_BUSY = 3.0
_MEMORY_A_MEGABYTE = 100
_MOST_WAITING = 64  # Messages that the parent has not looked at yet: more, and the child waits.
_MOST_WORDS = 4096  # Bytes of what the child wrote last to its error stream: enough for the end of a traceback.
_FIRST_CRASH = 0xC0000000  # Windows: the exit statuses from here on are exceptions such as an access violation.
_FROM_OUTSIDE = ("SIGKILL", "SIGTERM", "SIGHUP", "SIGINT", "SIGQUIT")


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
        Address space, in bytes; of a copy of this process, beyond what that has.
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
        if not time_limit > 0:
            raise Unsupported(f"A time limit of {time_limit:g} seconds", remedy="Give a positive number of seconds.")
        seconds = min(time_limit, _LONGEST_SECONDS)
        return Limits(seconds, seconds, 2 * memory)
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
    classes: tuple[type, ...] = (),
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
        Called with the function's progress; raising in it ends the child.
    classes : tuple of type
        Dataclasses that the result may be made of, besides plain values, lists, tuples and arrays.

    Returns
    -------
    object
        What the function returns.

    Raises
    ------
    Unreadable
        Where the child does not start, crashes or is ended, or the file is not read in time.
    TooMuchWork
        Where the memory does not suffice, or the work that follows takes too long.
    WeaveError
        What the function raises.
    """
    limits = limits or Limits()
    child, request = _child_for(function, args, options, limits)
    conversation = _Conversation(child, limits, progress)
    try:
        return decode(conversation.result(request), classes)
    except Malformed as error:
        raise Unreadable("The process that reads the file sent a faulty answer", remedy=_RUN_AGAIN) from error
    finally:
        conversation.close()


def _child_for(
    function: Callable[..., Any], args: tuple[Any, ...], options: dict[str, Any], limits: Limits
) -> tuple[Child, bytes]:
    """The child, and what it is to be sent."""
    path = _search_path()
    if can_fork():
        try:
            return fork_child(lambda descriptor: _serve_copy(descriptor, path, function, args, options, limits)), b""
        except OSError as error:
            raise _not_started(error.strerror or str(error)) from error
    start = {"path": path, "package": str(Path(__file__).resolve().parents[1] / "__init__.py")}
    request = json.dumps(start).encode("ascii") + b"\n"
    return _start_child(), request + pickle.dumps((function.__module__, function.__qualname__, args, options, limits))


def _start_child() -> subprocess.Popen[bytes]:
    # Isolated, the child does not see the variables of the environment that set these two flags.
    flags = ["-I", "-X", f"utf8={sys.flags.utf8_mode}", *(["-B"] if sys.dont_write_bytecode else [])]
    try:
        return subprocess.Popen(
            [sys.executable, *flags, "-c", _START],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, **dict.fromkeys(THREAD_VARIABLES, "1")},
            creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),  # Windows would open a console beside Rhino.
        )
    except OSError as error:
        raise _not_started(error.strerror or str(error)) from error


def _search_path() -> list[str]:
    """Where the child looks for modules: where this process does, but for the current folder.

    The interpreter puts that first for ``python -m`` and ``python -c``.  It is kept only where PYTHONPATH names it
    in full, which is done on purpose.
    """
    places = [Path(place) for place in sys.path if isinstance(place, str) and place]
    try:
        here = Path.cwd().resolve()
    except FileNotFoundError:  # It was deleted, and nothing is found relative to it.
        return [str(place) for place in places if place.is_absolute()]
    named = map(Path, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    is_kept = any(place.is_absolute() and place.resolve() == here for place in named)
    return [str(place.absolute()) for place in places if is_kept or place.resolve() != here]


class _Conversation:
    """What the parent receives from the child, with a limit on how long it waits."""

    def __init__(self, child: Child, limits: Limits, progress: Progress | None) -> None:
        self._child, self._limits, self._progress = child, limits, progress
        self._messages: queue.Queue[Union[Message, Exception]] = queue.Queue(_MOST_WAITING)
        self._threads: list[threading.Thread] = []
        self._deadline = time.monotonic() + _START_SECONDS
        self._started = time.monotonic()
        self._is_started = self._is_read = False
        self._last_words = b""

    def close(self) -> None:
        """End the child and release the pipes."""
        self._child.kill()
        self._child.wait()
        while any(thread.is_alive() for thread in self._threads):
            with contextlib.suppress(queue.Empty):  # The thread that listens may wait for room.
                self._messages.get(timeout=0.01)
        for pipe in (self._child.stdin, self._child.stdout, self._child.stderr):
            with contextlib.suppress(OSError):
                if pipe is not None:
                    pipe.close()

    def result(self, request: bytes) -> Message:
        """The message with the result; progress is passed on, and an error is raised."""
        self._start_threads(self._listen, self._listen_to_errors, lambda: self._ask(request))
        while True:
            message = self._next_message()
            if message.kind == _RESULT:
                return message
            if message.kind == _ERROR:
                raise _error_from(*_fields(message, str, str, str, (tuple, np.ndarray), str))
            if message.kind == _PROGRESS:
                self._tell(*_fields(message, float, str))
            elif self._is_started:
                raise Malformed("a second start, which would put the end off")
            else:
                self._is_started, self._started = True, time.monotonic()
                self._deadline = self._started + self._limits.reading_seconds

    def _tell(self, share: float, label: str) -> None:
        in_all = _slower() * self._limits.n_objects * self._limits.seconds
        self._is_read = True
        self._deadline = min(self._started + in_all, time.monotonic() + self._limits.seconds)
        if self._progress is not None:
            self._progress(share, label)

    def _next_message(self) -> Message:
        message: Union[Message, Exception, None] = None
        while message is None:
            left = self._deadline - time.monotonic()
            try:
                message = self._messages.get(timeout=min(max(left, 0.0), INTERVAL))
            except queue.Empty:
                if left <= 0:
                    raise self._too_slow() from None
                poll()
        if isinstance(message, EOFError):
            raise self._ended()
        if isinstance(message, Exception):
            raise message
        return message

    def _start_threads(self, *targets: Callable[[], None]) -> None:
        for target in targets:
            thread = threading.Thread(target=target, daemon=True)
            try:
                thread.start()
            except RuntimeError as error:  # The system allows no more of them.
                raise _not_started(str(error)) from error
            self._threads.append(thread)

    def _ask(self, request: bytes) -> None:
        pipe = self._child.stdin
        if pipe is not None:
            with contextlib.suppress(OSError):  # Where the child has ended, its status says why.
                pipe.write(request)
                pipe.close()

    def _listen(self) -> None:
        pipe = cast(IO[bytes], self._child.stdout)
        try:
            skip_to_messages(pipe)
            while True:
                self._messages.put(receive(pipe, kinds=_KINDS, most_data=self._limits.memory))
        except Exception as error:  # noqa: BLE001 - the thread that waits for messages raises it
            self._messages.put(error)

    def _listen_to_errors(self) -> None:
        descriptor = cast(IO[bytes], self._child.stderr).fileno()
        while True:
            words = os.read(descriptor, _MOST_WORDS)
            if not words:
                return
            self._last_words = (self._last_words + words)[-_MOST_WORDS:]

    def _too_slow(self) -> WeaveError:
        if not self._is_started:
            return _not_started(f"it was not ready after {_START_SECONDS:.0f} seconds")
        if self._is_read:
            return TooMuchWork(
                f"The surface takes longer than {self._limits.seconds:.0f} seconds",
                remedy="Give a time limit (--time-limit SECONDS), a longer edge target, or a simpler surface.",
            )
        return Unreadable(
            f"The file could not be read within {self._limits.reading_seconds:.0f} seconds",
            remedy="It may be damaged: open it in Rhino, repair it there and save it again; or give a time limit "
            "(--time-limit SECONDS).",
        )

    def _ended(self) -> WeaveError:
        """The error of a child that has closed its messages without a result."""
        try:
            status = self._child.wait(_END_SECONDS)
        except (TimeoutError, subprocess.TimeoutExpired):
            return self._too_slow()
        name = _signal_name(status)
        if name == "SIGXCPU":
            return self._too_slow()
        if name in _FROM_OUTSIDE:
            return Unreadable(
                f"The process that reads the file was ended from outside ({name})",
                remedy="Run it again; if the system ended it because memory ran out, close other programs first.",
            )
        if not self._is_started:
            return _not_started(self._last_line() or name or f"exit status {status}")
        if name or status >= _FIRST_CRASH:
            return Unreadable(
                f"The library that reads the file crashed ({name or hex(status)})",
                remedy="The file is probably damaged: open it in Rhino, repair it there and save it again.",
            )
        return Unreadable(
            f"The process that reads the file ended without a result (exit status {status})", remedy=_RUN_AGAIN
        )

    def _last_line(self) -> str:
        """The last line that the child wrote to its error stream: of a traceback, the error."""
        self._threads[1].join(_END_SECONDS)
        lines = self._last_words.decode("utf-8", "replace").split("\n")
        return next(("".join(filter(str.isprintable, line)) for line in reversed(lines) if line.strip()), "")


def _signal_name(status: int) -> str:
    """The name of the signal that ended a process; "" where none did."""
    if status >= 0:
        return ""
    try:
        return signal.Signals(-status).name
    except ValueError:
        return f"signal {-status}"


def _not_started(reason: str) -> WeaveError:
    return Unreadable(
        f"The process that reads the file could not be started ({reason})",
        remedy=f"Check that {sys.executable} runs and can import NumPy, SciPy and weavecore.",
    )


def _fields(message: Message, *types: Any) -> tuple[Any, ...]:
    """The value of a message, which is a tuple of these types."""
    value = decode(message)
    if not (isinstance(value, tuple) and len(value) == len(types) and all(map(isinstance, value, types))):
        raise Malformed(f"a message of kind {message.kind!r} with other fields")
    return value


def _error_from(code: str, what: str, remedy: str, ids: Any, kind: str) -> WeaveError:
    kinds = [value for value in vars(errors).values() if isinstance(value, type) and issubclass(value, WeaveError)]
    found = next((one for one in kinds if one.code == code), Unreadable)
    return found(what, remedy=remedy, ids=ids if isinstance(ids, tuple) else ids.tolist(), kind=kind)


def serve(descriptor: int) -> None:
    """Answer one request: a new child's side of `call_guarded`.

    Parameters
    ----------
    descriptor : int
        Where the messages are written; what is printed goes elsewhere.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches both processes, and the parent ends this one.
    messages = os.fdopen(descriptor, "wb")
    messages.write(BEGIN)
    module, name, args, options, limits = pickle.load(sys.stdin.buffer)
    _answer(messages, attrgetter(name)(importlib.import_module(module)), args, options, limits)


def _serve_copy(
    descriptor: int,
    path: list[str],
    function: Callable[..., Any],
    args: tuple[Any, ...],
    options: dict[str, Any],
    limits: Limits,
) -> None:
    """Answer one request: the same of a copy of the parent, which has the request already."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.path[:] = path
    messages = os.fdopen(descriptor, "wb")
    messages.write(BEGIN)
    _answer(messages, function, args, options, replace(limits, memory=limits.memory + mapped_memory()))


def _answer(
    messages: IO[bytes], function: Callable[..., Any], args: tuple[Any, ...], options: dict[str, Any], limits: Limits
) -> None:
    """Call a function within limits, and send what comes of it."""
    extend = limit_this_process(limits)
    send(messages, _STARTED, None)

    def progress(share: float, label: str) -> None:
        extend()
        send(messages, _PROGRESS, (float(share), label))

    try:
        send(messages, _RESULT, function(*args, progress=progress, **options))
    except Exception as error:  # noqa: BLE001 - a damaged file may fail anywhere
        told = _told(error)
        send(messages, _ERROR, (told.code, told.what, told.remedy, _plain_ids(told), told.kind))
    messages.close()


def _told(error: Exception) -> WeaveError:
    """An error in reading as one of this package."""
    if isinstance(error, WeaveError):
        return error
    if isinstance(error, MemoryError):
        return TooMuchWork("The memory does not suffice", remedy=_LESS_MEMORY)
    if isinstance(error, ImportError):
        return Unreadable(
            f"A library that reads the file cannot be loaded ({error})", remedy=f"Install it for {sys.executable}."
        )
    return Unreadable(
        f"The file cannot be read ({type(error).__name__}: {error})", remedy="Open it in Rhino and save it again."
    )


def _plain_ids(error: WeaveError) -> Any:
    """The ids of an error as they are sent: whole numbers, of which there may be millions, as an array."""
    if error.ids and all(isinstance(i, int) for i in error.ids):
        return np.array(error.ids, np.int64)
    return tuple(map(str, error.ids))


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
