"""How long the page of a weave takes to open and to draw a frame: ``python benchmarks/page_frames.py [--nodes N …]``.

The page is opened in Chromium without a window, which draws by software on the processor: a graphics card is faster.  A
frame is timed from the turn of the view until its pixels can be read.  It needs Chromium, its driver and selenium.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from pathlib import Path

from selenium import webdriver

from browser import HEADLESS
from shell import make_shell
from weavecore import pipeline

OPTIONS = (*HEADLESS, "--window-size=1440,1043")
FRAMES = """
const done = arguments[0], times = [];
const gl = document.getElementById("canvas").getContext("webgl2"), pixel = new Uint8Array(4);
function next() {
    if (times.length === 12) return done(times.sort((a, b) => a - b)[6]);
    let begin = 0;
    requestAnimationFrame(() => (begin = performance.now()));
    document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft", shiftKey: true, bubbles: true }));
    requestAnimationFrame(() => {
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        times.push(performance.now() - begin);
        next();
    });
}
next();
"""
"""What the page draws between two questions of ours in the same frame."""

NEARER = """
const press = () => document.body.dispatchEvent(new KeyboardEvent("keydown", { key: "+", bubbles: true }));
for (let k = 0; k < 9; k++) press();
"""
FACES_A_NODE = 6


def main() -> None:
    """Print the table as Markdown."""
    parser = argparse.ArgumentParser(description="Time of the page of a weave in the browser.")
    parser.add_argument("--nodes", type=int, nargs="+", default=[1_000, 4_000, 15_000], help="about how many")
    options = parser.parse_args()
    print(
        "| nodes | rods | page, MB | opens in, s | a frame of the whole, ms | near by, ms |\n|---|---|---|---|---|---|"
    )
    for nodes in options.nodes:
        print(row(nodes))


def row(nodes: int) -> str:
    """Figures of one size."""
    surface = pipeline.surface_from(make_shell(FACES_A_NODE * nodes))
    weave = pipeline.weave(pipeline.link(pipeline.offset(surface, spacing=(surface.area / nodes * 0.87) ** 0.5)))
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "woven.html"
        pipeline.export(weave, page)
        opened, whole, near = timed(page)
        size = page.stat().st_size / 1e6
    return f"| {weave.lattice.n_nodes:,} | {len(weave):,} | {size:.1f} | {opened:.1f} | {whole:.0f} | {near:.0f} |"


def timed(page: Path) -> tuple[float, float, float]:
    """Seconds until the page is ready, and milliseconds of a frame, of the whole and from four times as near."""
    settings = webdriver.ChromeOptions()
    settings.binary_location = shutil.which("chromium") or ""
    for option in OPTIONS:
        settings.add_argument(option)
    driver = webdriver.Chrome(options=settings, service=webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        begin = time.monotonic()
        driver.get(page.as_uri())
        while not driver.execute_script("return document.documentElement.dataset.ready === 'true'"):
            time.sleep(0.02)
        opened = time.monotonic() - begin
        whole = driver.execute_async_script(FRAMES)
        driver.execute_script(NEARER)
        return opened, whole, driver.execute_async_script(FRAMES)
    finally:
        driver.quit()


if __name__ == "__main__":
    main()
