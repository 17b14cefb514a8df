"""How long each stage works between two questions whether it is to go on.

    python benchmarks/stopping.py                      # the shell of the benchmarks, about 15,000 nodes
    python benchmarks/stopping.py --nodes 4000 --places

A stage stops within this time of being cancelled.  Times are processor seconds of the thread that works, so that other
programs do not count.  With ``--places`` the functions at both ends of each stage's longest gaps are printed.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import weavecore as wc
from shell import make_shell
from weavecore import pipeline, polling

N_GAPS = 4
"""Longest gaps whose places are printed."""


class Gaps:
    """Times between two calls of ``progress``, with the places from where it was called."""

    def __init__(self) -> None:
        self.found: list[tuple[float, str, str]] = []
        self._last, self._place = time.thread_time(), "the start"

    def __call__(self, _fraction: float, _label: str) -> None:
        """Take the time since the last call."""
        now, place = time.thread_time(), _caller()
        self.found.append((now - self._last, self._place, place))
        self._last, self._place = time.thread_time(), place

    def longest(self) -> list[tuple[float, str, str]]:
        """The longest gaps, up to now."""
        self(1.0, "")
        return sorted(self.found, reverse=True)[:N_GAPS]


def _caller() -> str:
    frame = sys._getframe(2)
    while frame.f_back and (frame.f_code.co_filename in (polling.__file__, __file__)):
        frame = frame.f_back
    return f"{Path(frame.f_code.co_filename).stem}:{frame.f_code.co_name}:{frame.f_lineno}"


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Longest times between two polls of each stage.")
    parser.add_argument("--nodes", type=int, default=15_000, help="nodes of the lattice, about")
    parser.add_argument("--faces", type=int, default=100_000)
    parser.add_argument("--places", action="store_true", help="print where the longest gaps are")
    options = parser.parse_args()
    polling.INTERVAL = 0.0
    surface = pipeline.surface_from(make_shell(options.faces))
    spacing = (surface.area / options.nodes * 0.87) ** 0.5
    print("| stage | longest gap, s | seconds |\n|---|---:|---:|")

    def run(name: str, stage: Callable[..., Any], *values: Any, **more: Any) -> Any:
        gaps, start = Gaps(), time.thread_time()
        made = stage(*values, progress=gaps, **more)
        longest = gaps.longest()
        print(f"| {name} | {longest[0][0]:.2f} | {time.thread_time() - start:.1f} |", flush=True)
        if options.places:
            for gap, one, other in longest:
                print(f"    {gap:.2f} s from {one} to {other}")
        return made

    latitudes = run("offset", pipeline.offset, surface, spacing=spacing)
    lattice = run("link", pipeline.link, latitudes)
    weave: wc.Weave = run("weave", pipeline.weave, lattice)
    print(f"{surface.n_faces:,} faces, {lattice.n_nodes:,} nodes, {len(weave):,} rods")
    with tempfile.TemporaryDirectory() as folder:
        run("json", pipeline.export_together, weave, [Path(folder) / "w.json"])
        run("view", pipeline.export_together, weave, [Path(folder) / "w.html"])


if __name__ == "__main__":
    main()
