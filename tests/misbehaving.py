"""Readers that do what damaged files make real ones do; run in a child process by the tests of the guard."""

from __future__ import annotations

import ctypes
import os
import time
from typing import Any

import numpy as np

from weavecore.errors import NonManifold


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


def fail(*, progress: Any) -> None:
    raise ZeroDivisionError("nothing to divide")


def crash(*, progress: Any) -> None:
    ctypes.string_at(0)


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
