"""The page of a weave at rest, as a browser shows it; needs Chromium, its driver and selenium."""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

import weavecore as wc
from browser import HEADLESS
from paper_figures.pages import count, image, join
from weavecore.units import with_unit

SAMPLES = Path(__file__).resolve().parents[2] / "sample_files"
OPTIONS = (*HEADLESS, "--window-size=1280,943")
_FIRST_DRAWING, _NEXT_DRAWING = 4.0, 1.5
"""Seconds that drawing by software takes."""


def draw_page(folder: Path) -> str:
    """Simulate the narrow neck in plain weave, released, and keep the page coloured by departure."""
    surface = wc.read_surface(SAMPLES / "narrow_neck.3dm")
    weave = wc.weave(wc.link(wc.offset(surface), pattern="plain"))
    equilibrium = wc.simulate(weave, supports="none")
    with tempfile.TemporaryDirectory() as temporary:
        page = Path(temporary) / "page.html"
        wc.export(equilibrium, page)
        _take(page, folder / "page_at_rest.png")
    mean, largest = (
        with_unit(length, surface.unit, digits=3) for length in (equilibrium.departure_mean, equilibrium.departure_max)
    )
    words = "The page of a weave at rest: as drawn in grey, at rest coloured by departure"
    caption = (
        f"`narrow_neck` in plain weave ({count(len(weave), 'rod')}), let go: the rods as drawn in grey, at rest "
        f"coloured by departure, {mean} in the mean and {largest} at most."
    )
    return join(image("page_at_rest", words), caption)


def _take(page: Path, picture: Path) -> None:
    """Open a page, colour it by departure, and keep what is seen."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for option in OPTIONS:
        options.add_argument(option)
    driver: Any = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        driver.get(page.as_uri())
        time.sleep(_FIRST_DRAWING)
        driver.find_element("css selector", "[value=departure]").click()
        time.sleep(_NEXT_DRAWING)
        driver.save_screenshot(str(picture))
    finally:
        driver.quit()
