"""How long each component of Grasshopper takes, and how long it does not look for Escape meanwhile.

    python benchmarks/canvas.py                              # a dome of about 14,000 nodes; prints the table
    python benchmarks/canvas.py --write docs/grasshopper.md  # and keeps it there, between two comments

The components run with the stubs of Grasshopper's modules that their tests have, and with rhino3dm in the place of
RhinoCommon, which takes whole arrays faster.  Times are processor seconds of the thread that works.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "ghpython_components")]

from ghpython.stubs import COMPONENTS, Canvas, Component, Ran, install, parameters_of, run_component  # noqa: E402

SAMPLE = ROOT / "sample_files" / "hemisphere.3dm"
BEGIN, END = "<!-- canvas figures -->", "<!-- end of canvas figures -->"
HEAD = "| component | what it does | seconds | longest without a look for Escape |\n|---|---|---:|---:|"


class Bench:
    """Runs components and keeps a row of the table for each."""

    def __init__(self) -> None:
        self.rows: list[str] = []
        self._canvas = Canvas()
        install(self._canvas, dict.__setitem__)
        sys.modules["Grasshopper.Kernel"].GH_Document.IsEscapeKeyDown = self._look
        self._last, self._longest = 0.0, 0.0

    def _look(self) -> bool:
        now = time.thread_time()
        self._last, self._longest = now, max(self._longest, now - self._last)
        return False

    def run(self, name: str, what: str, placed: str = "", **inputs: Any) -> Ran:
        """Run a component that was just placed, or one that was ``placed`` before."""
        names = [p["name"] for p in parameters_of(COMPONENTS / name, "input")]
        component = Component(names, wired=list(inputs), InstanceGuid=placed or str(len(self.rows)))
        begun = self._last = time.thread_time()
        self._longest = 0.0
        ran = run_component(name, component=component, **inputs)
        self._look()
        seconds = time.thread_time() - begun
        errors = [text for level, text in ran.messages if level == "Error"]
        if errors:
            raise SystemExit(f"{name}: {errors[0]}")
        self.rows.append(f"| *{name.replace('_', ' ')}* | {what} | {seconds:.2f} | {self._longest:.2f} s |")
        print(self.rows[-1], flush=True)
        return ran


def report(spacing: float, folder: Path) -> str:
    """The table, as Markdown, below the size of what was woven."""
    bench = Bench()
    run_component("Weave_Surface", geometry=str(SAMPLE), edge=1.0)  # Loads the package.
    surface = bench.run("Weave_Surface", "a file", geometry=str(SAMPLE))["surface"]
    latitudes = bench.run("Weave_Offset", "levels", surface=surface, spacing=[spacing])["latitudes"]
    lattice = bench.run("Weave_Link", "triangular", latitudes=latitudes)["lattice"]
    weave = bench.run("Weave_Strands", "a diameter", placed="strands", lattice=lattice, diameter=0.3)["weave"]
    bench.run("Weave_Strands", "another diameter", placed="strands", lattice=lattice, diameter=0.31)
    bench.run("Weave_Preview", "all rods", weave=weave)
    bench.run("Weave_Preview", "up to a step", weave=weave, step=len(weave) // 2)
    bench.run("Weave_Preview", "another amplitude", weave=weave, amplitude=3.0)
    bench.run("Weave_Measure", "all figures and checks", value=weave)
    bench.run("Deconstruct_Lattice", "", lattice=lattice)
    bench.run("Deconstruct_Weave", "", weave=weave)
    bench.run("Weave_Fabricate", "pieces and marks", weave=weave)
    bench.run("Weave_Fabricate", "and the folder", weave=weave, folder=str(folder / "workshop"), write=True)
    for ending in ("json", "3dm", "html"):
        bench.run("Weave_Export", f"`.{ending}`", value=weave, path=str(folder / f"woven.{ending}"), write=True)
    size = f"A dome with {len(weave)} rods and {lattice.n_nodes:,} nodes, in processor seconds:"
    return "\n".join([size, "", HEAD, *bench.rows])


def main() -> None:
    """Run the benchmark as the command line says."""
    parser = argparse.ArgumentParser(description="Seconds and silences of the components of Grasshopper.")
    parser.add_argument("--spacing", type=float, default=5.9, help="in millimetres, of a dome of radius 300")
    parser.add_argument("--write", type=Path, help="a Markdown file with two comments to keep the table between")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        text = report(options.spacing, Path(folder))
    if options.write:
        whole = options.write.read_text("utf-8")
        before, after = whole.split(BEGIN)[0], whole.split(END)[1]
        options.write.write_text(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
