"""Explore a sample over 60 variants, and measure: ``python benchmarks/exploring.py [--workers N] [--picture OUT.png]``.

Prints a Markdown table: variants, time, processor time and memory of the workers, and what writing takes; then how long
a million variants would take on a thousand cores at these figures.  With ``--picture`` Chromium draws the page (needs
the ``test`` extra); with ``--scheduler`` the workers of a Dask cluster weave, whose processor time is not measured.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from weavecore.exploring import explore
from weavecore.exploring.evaluate import Result
from weavecore.exploring.table import find_result, keep_result, prepare_folder
from weavecore.exploring.variants import Variant

SAMPLES = Path(__file__).resolve().parents[1] / "sample_files"
GRID = {
    "spacings": [40.0, 50.0, 60.0, 70.0, 80.0],
    "patterns": ["triangular", "plain", "kagome"],
    "rods": ["stock", 1.0],
    "borders": ["all", (0,)],
}
MILLION, CORES = 1_000_000, 1_000
WRITTEN = 50
"""Results that are written to find what one takes."""

WINDOW = (1500, 1290)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sample", default="hourglass")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--scheduler")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--folder", type=Path, help="keep the exploration here")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.folder or Path(scratch) / "explored"
        begun = time.perf_counter()
        explored = explore(
            SAMPLES / f"{options.sample}.3dm", folder, workers=options.workers, scheduler=options.scheduler, **GRID
        )
        elapsed = time.perf_counter() - begun
        n = len(explored.rows)
        children = resource.getrusage(resource.RUSAGE_CHILDREN)
        processor = (children.ru_utime + children.ru_stime) / n
        writing = seconds_to_write(explored.folder, explored.rows[0].key)
        rows = {
            "variants": f"{n}, {len(explored.failed)} with errors",
            "elapsed": f"{elapsed:,.0f} s with {options.workers} workers",
            "processor time of a variant": f"{processor:.2f} s",
            "largest worker": f"{children.ru_maxrss / 1024:,.0f} MB",
            "exploring process": f"{resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:,.0f} MB",
            "files of a variant": f"{bytes_in(explored.folder) / n / 1e6:.2f} MB, "
            f"{bytes_in(explored.folder / 'pages') / n / 1e6:.2f} MB of them its page",
            "writing a variant": f"{1000 * writing[0]:.1f} ms; without page {1000 * writing[1]:.1f} ms",
            "finding a variant again": f"{1000 * writing[2]:.2f} ms",
        }
        if options.scheduler:  # Its workers are not children of this process.
            del rows["processor time of a variant"], rows["largest worker"]
        print("| | |\n|---|---|")
        for label, text in rows.items():
            print(f"| {label} | {text} |")
        if not options.scheduler:
            print_estimate(processor, writing, bytes_in(folder) / n)
        print(f"\nNumPy {np.__version__}, Python {sys.version.split()[0]}.")
        if options.picture:
            draw_page(folder / "index.html", options.picture)


def print_estimate(processor: float, writing: tuple[float, float, float], size: float) -> None:
    """Print what a million variants take, from the figures of one in seconds and bytes."""
    with_page, without, again = (MILLION * one / 3600 for one in writing)
    print(f"\n{MILLION:,} variants on {CORES:,} cores: {MILLION * processor / CORES / 3600:.1f} h of weaving;")
    print(f"{with_page:.1f} h of writing by one process, {without:.1f} h without pages;")
    print(f"{60 * again:.0f} min to go on; {MILLION * size / 1e12:.2f} TB.")


def seconds_to_write(folder: Path, key: str) -> tuple[float, float, float]:
    """Time to write a result with a page and without one, and to find it."""
    picture, page = ((folder / name).read_bytes() for name in (f"pictures/{key}.png", f"pages/{key}.html"))
    variants = [Variant("s", "", "None", None, 1.0 + k, "plain", None, "gfrp") for k in range(WRITTEN)]
    times = []
    with tempfile.TemporaryDirectory(dir=folder.parent) as scratch:
        for content in (page, None):
            target = Path(scratch) / str(len(times))
            prepare_folder(target)
            begun = time.perf_counter()
            for variant in variants:
                keep_result(target, Result(variant.key, {"rods": 1}, picture=picture, page=content))
            times.append((time.perf_counter() - begun) / WRITTEN)
        begun = time.perf_counter()
        for variant in variants:
            assert find_result(target, variant, with_page=False) is not None
        times.append((time.perf_counter() - begun) / WRITTEN)
    return times[0], times[1], times[2]


def bytes_in(folder: Path) -> int:
    """Size of all files in a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


def draw_page(page: Path, picture: Path) -> None:
    """Draw the page with Chromium."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or shutil.which("google-chrome") or ""
    for option in ("--headless=new", "--no-sandbox", "--hide-scrollbars", f"--window-size={WINDOW[0]},{WINDOW[1]}"):
        options.add_argument(option)
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    driver.get(page.resolve().as_uri())
    time.sleep(2.0)  # Pictures are loaded as they come into view.
    driver.save_screenshot(str(picture))
    driver.quit()


if __name__ == "__main__":
    main()
