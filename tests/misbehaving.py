"""Readers that do what damaged files make real ones do; run in a child process by the tests of the guard."""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import stat
import struct
import time
from pathlib import Path
from typing import Any

import numpy as np

from weavecore import polling
from weavecore.errors import NonManifold
from weavecore.units import Length


def well(n: int, *, progress: Any) -> np.ndarray:
    progress(0.5, "half")
    progress(1.0, "done")
    return np.arange(n)


def noisily(*, progress: Any) -> str:
    os.write(1, b"noise that a library prints\n" * 1000)
    print("more of it", flush=True)  # noqa: T201
    return "heard"


def refuse(*, progress: Any) -> None:
    raise NonManifold("Two sheets touch", remedy="Pull them apart.", ids=[3, 5], kind="vertex")


def refuse_many(n: int, *, progress: Any) -> None:
    raise NonManifold("Sheets touch", remedy="Pull them apart.", ids=range(n), kind="vertex")


def refuse_layer(*, progress: Any) -> None:
    raise NonManifold("Sheets touch", remedy="Pull them apart.", ids=["Shell", 2], kind="layer")


def run_out_of_memory(*, progress: Any) -> None:
    raise MemoryError


def miss_a_library(*, progress: Any) -> None:
    import no_such_library  # noqa: F401


def length(*, progress: Any) -> Length:
    return Length(2.5, "Meters")


def fail(*, progress: Any) -> None:
    raise ZeroDivisionError("nothing to divide")


def crash(*, progress: Any) -> None:
    ctypes.string_at(0)


def be_killed(number: int, *, progress: Any) -> None:
    os.kill(os.getpid(), number)
    time.sleep(600)


def leave(*, progress: Any) -> None:
    os._exit(3)


def answer_wrongly(way: str, *, progress: Any) -> None:
    """Write what is not a message, to wherever the messages go."""
    answers = {
        "length": struct.pack("<cIQ", b"R", 4, 2**62) + b"null",
        "pickle": pickle.dumps((b"R", "result")),
        "restart": struct.pack("<cIQ", b"S", 4, 0) + b"null",
        "short": struct.pack("<cIQ", b"R", 100, 0) + b"null",
    }
    descriptor = next(i for i in range(3, 20) if _is_pipe(i))
    os.write(descriptor, answers[way])
    os._exit(0)


def _is_pipe(descriptor: int) -> bool:
    try:
        return stat.S_ISFIFO(os.fstat(descriptor).st_mode)
    except OSError:
        return False


def flood(*, progress: Any) -> None:
    while True:
        progress(0.5, "flood" * 1000)


def spin(*, progress: Any) -> None:
    while True:
        pass


def sleep(*, progress: Any) -> None:
    time.sleep(600)


def spin_after_reading(*, progress: Any) -> None:
    progress(0.0, "read")
    spin(progress=progress)


def sleep_after_reading(*, progress: Any) -> None:
    progress(0.0, "read")
    time.sleep(600)


def four_objects(*, progress: Any) -> str:
    for k in range(4):
        progress(k / 4, "the next")
        time.sleep(0.5)
    return "done"


def chatter(*, progress: Any) -> None:
    while True:
        progress(0.5, "still at it")
        time.sleep(0.05)


def eat(*, progress: Any) -> int:
    eaten = [bytearray(64 * 2**20) for _ in range(200)]
    return len(eaten)


def open_files(*, progress: Any) -> list[str]:
    """What the descriptors beyond the three standard ones lead to."""
    places = sorted(Path("/proc/self/fd").iterdir(), key=lambda place: int(place.name))
    return [place.readlink().name.split(":")[0] for place in places[3:] if place.exists() or place.is_fifo()]


def handlers(*, progress: Any) -> list[bool]:
    """Whether the signals that ask a process to end, end it."""
    return [signal.getsignal(number) is signal.SIG_DFL for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGALRM)]


def poll_long(*, progress: Any) -> str:
    time.sleep(2 * polling.INTERVAL)
    polling.poll()
    return "polled"
