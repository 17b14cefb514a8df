"""How long each stage works between two questions whether it is to go on.

    python benchmarks/stopping.py                      # the shell of the benchmarks, about 15,000 nodes
    python benchmarks/stopping.py --nodes 4000 --places

A stage stops within this time of being cancelled.  Times are processor seconds of the thread that works, so that other
programs do not count; where another process works (reading, info) they are elapsed seconds.  The weave that is
simulated and fabricated has ``--few`` nodes.  With ``--places`` the functions at both ends of each stage's longest gaps
are printed.
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

    def __init__(self, clock: Callable[[], float]) -> None:
        self.found: list[tuple[float, str, str]] = []
        self._clock, self._last, self._place = clock, clock(), "the start"

    def __call__(self, _fraction: float, _label: str) -> None:
        """Take the time since the last call."""
        now, place = self._clock(), _caller()
        self.found.append((now - self._last, self._place, place))
        self._last, self._place = self._clock(), place

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
    parser.add_argument("--few", type=int, default=4_000, help="nodes of the weave that is simulated and fabricated")
    parser.add_argument("--faces", type=int, default=100_000)
    parser.add_argument("--places", action="store_true", help="print where the longest gaps are")
    options = parser.parse_args()
    polling.INTERVAL = 0.0
    print("| stage | longest gap, s | seconds |\n|---|---:|---:|")

    def run(name: str, stage: Callable[..., Any], *values: Any, clock: Any = time.thread_time, **more: Any) -> Any:
        gaps, start = Gaps(clock), clock()
        made = stage(*values, progress=gaps, **more)
        longest = gaps.longest()
        print(f"| {name} | {longest[0][0]:.2f} | {clock() - start:.1f} |", flush=True)
        if options.places:
            for gap, one, other in longest:
                print(f"    {gap:.2f} s from {one} to {other}")
        return made

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        surface = run("repairing", pipeline.surface_from, make_shell(options.faces), unit="Meters")
        pipeline.export(surface, folder / "shell.3dm")
        run("reading", pipeline.read_surface, folder / "shell.3dm", guarded=True, clock=time.monotonic)
        run("info", pipeline.inspect_file, folder / "shell.3dm", guarded=True, clock=time.monotonic)
        weave = weave_shell(run, surface, options.nodes)
        print(f"{surface.n_faces:,} faces, {weave.lattice.n_nodes:,} nodes, {len(weave):,} rods")
        for ending in ("json", "html", "png", "3dm"):
            run(f".{ending}", pipeline.export_together, weave, [folder / f"w.{ending}"])
        few = weave_shell(lambda _name, stage, *values, **more: stage(*values, **more), surface, options.few)
        print(f"{few.lattice.n_nodes:,} nodes, {len(few):,} rods")
        run("simulate", pipeline.simulate, few)
        run("fabricate", pipeline.fabricate, few, folder / "out")


def weave_shell(run: Callable[..., Any], surface: wc.SurfaceMesh, n_nodes: int) -> wc.Weave:
    """A weave of about so many nodes, its stages called by ``run``."""
    latitudes = run("offset", pipeline.offset, surface, spacing=(surface.area / n_nodes * 0.87) ** 0.5)
    woven: wc.Weave = run("weave", pipeline.weave, run("link", pipeline.link, latitudes))
    return woven


if __name__ == "__main__":
    main()
