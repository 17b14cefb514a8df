"""A browser for the tests of the page: Chromium without a window, drawing by software."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Callable

import pytest

_BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_OPTIONS = (
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--hide-scrollbars",
    "--window-size=1100,760",
)


class Page:
    """A page in the browser, and what the browser told of it."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver

    def open(self, path: Path, fragment: str = "") -> Page:
        self.driver.get("about:blank")
        self.told("browser"), self.told("performance")
        self.rest_pointer()
        self.driver.get(path.as_uri() + fragment)
        self.wait("document.documentElement.dataset.ready === 'true'")
        return self

    def reset(self) -> Page:
        """As it was when it was opened."""
        self.rest_pointer()
        self.enter("find", "")
        self.driver.execute_script("document.activeElement.blur(); document.getElementById('home').click()")
        self.wait("true")
        return self

    def rest_pointer(self) -> None:
        """Lay the pointer aside: what it is over is drawn differently."""
        from selenium.webdriver.common.actions.action_builder import ActionBuilder

        actions = ActionBuilder(self.driver)
        actions.pointer_action.move_to_location(1, 1)
        actions.perform()

    def run(self, script: str, *values: object) -> Any:
        return self.driver.execute_script(f"return {script}", *values)

    def wait(self, condition: str) -> None:
        """Until a condition holds, and what follows from it has been drawn."""
        end = time.monotonic() + 60
        while not self.run(condition):
            assert time.monotonic() < end, f"never: {condition}"
            time.sleep(0.02)
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()))"
        )

    def text(self, selector: str) -> str:
        return str(self.run("document.querySelector(arguments[0]).innerText", selector))

    def click(self, selector: str) -> None:
        self.driver.find_element("css selector", selector).click()

    def click_canvas(self, x: float, y: float) -> None:
        from selenium.webdriver import ActionChains

        canvas = self.driver.find_element("id", "canvas")
        width, height = self.run("[canvas.clientWidth, canvas.clientHeight]")
        ActionChains(self.driver).move_to_element_with_offset(
            canvas, round(x - width / 2), round(y - height / 2)
        ).click().perform()

    def press(self, *keys: str) -> None:
        from selenium.webdriver import ActionChains

        ActionChains(self.driver).send_keys(*keys).perform()

    def enter(self, field: str, value: str) -> None:
        """Give a field a value, as typing or sliding does."""
        self.driver.execute_script(
            "const field = document.getElementById(arguments[0]); field.value = arguments[1];"
            "field.dispatchEvent(new Event('input', { bubbles: true }))",
            field,
            value,
        )

    def picture(self) -> str:
        """What is drawn on the canvas, as PNG; a screenshot would have the noise of what shines through it."""
        self.wait("true")
        return str(self.run("weavecorePage.picture()"))

    def told(self, log: str) -> list[str]:
        return [entry["message"] for entry in self.driver.get_log(log)]

    def requests(self) -> list[str]:
        """Addresses that the page has asked for since it was opened."""
        events = [json.loads(message)["message"] for message in self.told("performance")]
        return [event["params"]["request"]["url"] for event in events if event["method"] == "Network.requestWillBeSent"]


@pytest.fixture(scope="session")
def driver() -> Iterator[Any]:
    """A Chromium with its driver, or a skip that says what is missing."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="the page is tested with selenium")
    browser = next((found for name in _BROWSERS if (found := shutil.which(name))), None)
    server = shutil.which("chromedriver")
    if not browser or not server:
        pytest.skip("the page is tested in Chromium, which is not here: install chromium and chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for option in _OPTIONS:
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    from selenium.common.exceptions import WebDriverException

    try:
        running = webdriver.Chrome(options=options, service=webdriver.ChromeService(server))
    except WebDriverException as error:  # Such as a Chromium that only says where a real one is to be had.
        pytest.skip(f"the page is tested in Chromium, which does not start here: {error.msg}")
    yield running
    running.quit()


@pytest.fixture
def page(driver: Any) -> Page:
    return Page(driver)


@pytest.fixture
def opened(page: Page, tmp_path: Path) -> Callable[..., Page]:
    """Write the bytes of a page to a file and open it."""

    def open_bytes(content: bytes, fragment: str = "") -> Page:
        path = tmp_path / "page.html"
        path.write_bytes(content)
        return page.open(path, fragment)

    return open_bytes


@pytest.fixture(scope="module")
def shown(driver: Any, content: bytes, tmp_path_factory: pytest.TempPathFactory) -> Callable[[], Page]:
    """The page of the module's content, opened once and as new for every test."""
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_bytes(content)
    page = Page(driver)

    def show() -> Page:
        at = page.run("location.href.split('#')[0]")
        return page.reset() if at == path.as_uri() else page.open(path)

    return show
