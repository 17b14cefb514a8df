"""Run one method in a process of its own, so that its memory can be told: ``comparison_worker.py METHOD MESH RESULT``.

After a run on a tiny mesh, for what is imported and set up, the memory in use is noted, the method runs, and the
peak is noted: the difference is the method's.  It is read where Linux tells it; a process's resource usage would
begin with its parent's.  Seconds are of the processor.
"""

from __future__ import annotations

import math
import sys
import time
from pathlib import Path

import numpy as np

from comparison_methods import METHODS, Line, Mesh
from shell import make_shell
from weavecore.model import SurfaceMesh

LONG = 4.0
"""Seconds from which on a run is not repeated."""

ROUNDS = 3
_TINY = 600
_STATUS, _CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def main(name: str, given: str, result: str) -> None:
    """Read the mesh, run, write polylines, seconds and memory."""
    run = METHODS[name][1]
    vertices, faces = make_shell(_TINY)
    run(as_mesh(vertices, faces, 0.2))
    with np.load(given) as data:
        mesh = as_mesh(data["vertices"], data["faces"], float(data["spacing"]))
    before = forget_peak()
    begin = time.process_time()
    lines = run(mesh)
    seconds = [time.process_time() - begin]
    memory = memory_of("VmHWM") - before
    while seconds[-1] < LONG and len(seconds) < ROUNDS:
        begin = time.process_time()
        run(mesh)
        seconds.append(time.process_time() - begin)
    np.savez(result, seconds=np.median(seconds), memory=memory, **pack(lines))


def as_mesh(vertices: np.ndarray, faces: np.ndarray, spacing: float) -> Mesh:
    """The mesh with its borders."""
    return Mesh(vertices, faces, list(SurfaceMesh(vertices, faces).borders), spacing)


def forget_peak() -> float:
    """Let the peak of this process's memory begin anew; what is in use now, in MB."""
    if _CLEAR.exists():
        _CLEAR.write_text("5", encoding="ascii")
    return memory_of("VmRSS")


def memory_of(entry: str) -> float:
    """An entry of what Linux tells of this process's memory, in MB; not a number elsewhere."""
    if not _STATUS.exists():
        return math.nan
    line = next(line for line in _STATUS.read_text("ascii", "replace").splitlines() if line.startswith(entry))
    return int(line.split()[1]) * 1024 / 1e6


def pack(lines: list[Line]) -> dict[str, np.ndarray]:
    """Polylines as arrays."""
    points = [line.points for line in lines]
    return {
        "points": np.concatenate(points) if points else np.zeros((0, 3)),
        "counts": np.array([len(p) for p in points], np.int64),
        "distance": np.array([line.distance for line in lines]),
        "closed": np.array([line.closed for line in lines], bool),
    }


if __name__ == "__main__":
    main(*sys.argv[1:])
