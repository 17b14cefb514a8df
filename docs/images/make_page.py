"""Take the picture of the page: ``python docs/images/make_page.py``; it needs Chromium, its driver and selenium."""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path

from selenium import webdriver

import weavecore as wc

HERE = Path(__file__).resolve().parent
SAMPLE = HERE.parents[1] / "sample_files" / "shell_2400x1600.3dm"
OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--window-size=1440,1043",
)


def main() -> None:
    """Weave a sample, open its page with a rod picked, and keep what is seen."""
    surface = wc.read_surface(SAMPLE)
    lattice = wc.link(wc.offset(surface, spacing=90.0), pattern="plain")
    with tempfile.TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        wc.export(wc.weave(lattice, rod_diameter=6.0), page)
        options = webdriver.ChromeOptions()
        options.binary_location = shutil.which("chromium") or ""
        for option in OPTIONS:
            options.add_argument(option)
        driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
        driver.get(f"{page.as_uri()}#rod=A20")
        time.sleep(3.0)  # The first drawing by software takes its time.
        driver.save_screenshot(str(HERE / "page.png"))
        driver.quit()


if __name__ == "__main__":
    main()
