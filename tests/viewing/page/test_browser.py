"""The page in a browser: it loads by itself, rods are picked, and switches and steps change the picture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Callable

import numpy as np
import pytest

from weavecore.model import SurfaceMesh, Weave
from weavecore.viewing.page.html_page import encode_page
from weavecore.viewing.page.page_content import page_content
from weavecore.weaving.sequence import find_sequence
from woven_rods import woven_sample, woven_tube
from woven_tube import tube_latitudes, tube_lattice, tube_strands, tube_surface

Opened = Callable[..., Any]
Shown = Callable[[], Any]


def woven() -> Weave:
    return woven_sample("hemisphere", "plain")


@pytest.fixture(scope="module")
def content() -> bytes:
    return encode_page(woven(), sequence=find_sequence(woven()))


def nearest_to_the_eye(weave: Weave, name: str) -> float:
    """The part of a rod's length at which it lies nearest to the eye in the first view."""
    samples = weave.axes.samples(weave.lattice.edge_length / 8)
    s = weave.ids.index(name)
    mine = slice(samples.offsets[s], samples.offsets[s + 1])
    nearest = int(np.argmax(samples.points[mine] @ page_content(weave)["view"]))
    return float(samples.stations[mine][nearest] / weave.axes.lengths[s])


def place_of(page: Any, name: str) -> tuple[float, float]:
    x, y = page.run("weavecorePage.placeOf(arguments[0], arguments[1])", name, nearest_to_the_eye(woven(), name))
    return x, y


@pytest.mark.parametrize("stage", ["weave", "lattice", "latitudes", "surface"])
def test_it_loads_without_errors_and_asks_the_network_for_nothing(opened: Opened, content: bytes, stage: str) -> None:
    pages = {
        "weave": lambda: content,
        "lattice": lambda: encode_page(tube_lattice(), strands=tube_strands()),
        "latitudes": lambda: encode_page(tube_latitudes()),
        "surface": lambda: encode_page(tube_surface()),
    }
    page = opened(pages[stage]())
    page.run("document.getElementById('fit').click()")
    page.wait("true")
    assert page.told("browser") == []
    assert [url for url in page.requests() if not url.startswith("file:")] == []
    assert page.run("document.querySelectorAll('#list button').length") > 0
    assert page.run("document.getElementById('player').hidden") is (stage != "weave")


def test_a_click_on_a_rod_picks_it_and_one_beside_lets_go(shown: Shown) -> None:
    page = shown()
    for name in ("L01", "L03", "L05"):
        page.click_canvas(*place_of(page, name))
        assert page.run("weavecorePage.picked") == name
        assert page.text("#card h2") == name
        assert page.run("location.hash") == f"#rod={name}"
    page.click_canvas(4, 4)
    assert page.run("weavecorePage.picked") is None
    assert page.run("document.getElementById('card').hidden")


def test_a_drag_turns_the_view_and_picks_nothing(shown: Shown) -> None:
    from selenium.webdriver import ActionChains

    page = shown()
    before = page.picture()
    canvas = page.driver.find_element("id", "canvas")
    ActionChains(page.driver).drag_and_drop_by_offset(canvas, 120, 20).perform()
    assert page.run("weavecorePage.picked") is None
    assert page.picture() != before


def test_a_tap_picks_as_a_click_does(shown: Shown) -> None:
    from selenium.webdriver.common.actions.action_builder import ActionBuilder
    from selenium.webdriver.common.actions.interaction import POINTER_TOUCH
    from selenium.webdriver.common.actions.pointer_input import PointerInput

    page = shown()
    x, y = place_of(page, "L03")
    left, top = page.run("(({ x, y }) => [x, y])(canvas.getBoundingClientRect())")
    touch = ActionBuilder(page.driver, mouse=PointerInput(POINTER_TOUCH, "finger"))
    touch.pointer_action.move_to_location(round(left + x), round(top + y)).pointer_down().pointer_up()
    touch.perform()
    assert page.run("weavecorePage.picked") == "L03"


def test_looking_at_a_rod_brings_it_near(shown: Shown) -> None:
    page = shown()
    page.driver.execute_script("location.hash = 'rod=A12'")
    page.wait("!document.getElementById('card').hidden")
    ends = "Math.hypot(...[0, 1].map((k) => weavecorePage.placeOf('A12', 0)[k] - weavecorePage.placeOf('A12', 1)[k]))"
    before, width = page.run(ends), page.run("canvas.clientWidth")
    page.click("#card .look")
    page.wait("true")
    assert page.run(ends) > 1.2 * before
    for part in (0.0, 0.5, 1.0):
        x, y = page.run("weavecorePage.placeOf('A12', arguments[0])", part)
        assert 0 < x < width
        assert 0 < y < page.run("canvas.clientHeight")


@pytest.mark.parametrize("name", ["L02", "A04"])
def test_the_card_tells_length_radius_utilisation_and_marks(shown: Shown, name: str) -> None:
    weave = woven()
    s = weave.ids.index(name)
    page = shown()
    page.driver.execute_script("location.hash = arguments[0]", f"rod={name}")
    page.wait("!document.getElementById('card').hidden")
    rows = dict(
        page.run(
            "[...document.querySelectorAll('#card dl > div')].map((row) => [...row.children].map((c) => c.textContent))"
        )
    )
    assert float(rows["Length"].split()[0].replace(",", "")) == pytest.approx(weave.axes.lengths[s], rel=1e-5)
    assert float(rows["Least radius"].split()[0].replace(",", "")) == pytest.approx(
        weave.bending.min_radius[s], rel=1e-4
    )
    assert float(rows["at station"].split()[0].replace(",", "")) == pytest.approx(
        weave.bending.station_at_min[s], rel=1e-4
    )
    assert page.text("#card .meter strong") == f"{weave.bending.utilisation[s]:,.0%}"
    marks = page.run(
        "[...document.querySelectorAll('#card tbody tr')].map((row) => [...row.children].map((c) => c.textContent))"
    )
    joints, expected = weave.joints, []
    for at in np.flatnonzero(joints.strand == s).tolist():
        first, last = joints.offsets[joints.joint[at]], joints.offsets[joints.joint[at] + 1]
        station = float(weave.axes.stations[joints.visit[at]])
        expected += [
            (station, weave.ids[joints.strand[other]], "over" if at > other else "under")
            for other in range(first, last)
            if other != at
        ]
    assert sorted((other, lies) for _, other, lies in marks) == sorted((other, lies) for _, other, lies in expected)
    stations = [float(station.replace(",", "")) for station, _, _ in marks]
    assert stations == pytest.approx(sorted(station for station, _, _ in expected), abs=0.051)


def test_a_step_changes_the_picture_and_the_end_brings_it_back(shown: Shown) -> None:
    weave = woven()
    names = [weave.ids[s] for s in find_sequence(weave).strand.tolist()]
    page = shown()
    whole = page.picture()
    page.click("#first")
    pictures = [page.picture()]
    assert page.text("#step-text") == f"Nothing stands yet; {len(weave)} rods to set"
    for k in (1, 2, 3):
        page.press("\ue014")  # the arrow to the right
        assert page.text("#step-text").startswith(f"Step {k} of {len(weave)}: ")
        assert names[k - 1] in page.text("#step-text")
        pictures.append(page.picture())
    assert len({whole, *pictures}) == 5
    page.press("\ue010")  # the end key
    assert page.text("#step-text") == f"Complete: {len(weave)} rods, {len(weave.joints)} joints tied"
    assert page.picture() == whole


def test_a_rod_that_is_not_set_yet_cannot_be_hit(shown: Shown) -> None:
    page = shown()
    place = place_of(page, "L03")
    assert page.run("weavecorePage.rodAt(...arguments)", *place) == "L03"
    page.click("#first")
    assert page.run("weavecorePage.rodAt(...arguments)", *place) is None


def test_playing_goes_on_by_itself_until_it_is_paused(shown: Shown) -> None:
    page = shown()
    page.click("#play")
    page.wait("+document.getElementById('step').value >= 2")
    page.click("#play")
    at = page.run("document.getElementById('step').value")
    page.driver.execute_async_script("setTimeout(arguments[0], 900)")
    assert page.run("document.getElementById('step').value") == at
    assert page.run("document.getElementById('play').getAttribute('aria-label')") == "Play"


def test_families_and_generations_are_switched(shown: Shown) -> None:
    page = shown()
    border, ring = place_of(page, "L01"), place_of(page, "L03")
    whole = page.picture()
    page.click("#families input")
    assert page.text("#families li").startswith("Latitudes")
    without = page.picture()
    assert without != whole
    assert page.run("weavecorePage.rodAt(...arguments)", *border) != "L01"
    page.click("#families input")
    page.enter("from", "1")
    assert page.text("#generations-text") == f"1 to {woven().lattice.latitudes.n_generations - 1}"
    assert page.picture() not in (whole, without)
    assert page.run("weavecorePage.rodAt(...arguments)", *border) != "L01"
    assert page.run("weavecorePage.rodAt(...arguments)", *ring) == "L03"


def test_without_its_surface_what_lies_behind_is_seen(shown: Shown) -> None:
    page = shown()
    whole = page.picture()
    page.click("#surface")
    assert page.run("document.getElementById('surface').getAttribute('aria-pressed')") == "false"
    assert page.picture() != whole


@pytest.mark.parametrize("name", ["generation", "utilisation"])
def test_the_rods_are_coloured_by_what_is_asked_for(shown: Shown, name: str) -> None:
    page = shown()
    whole = page.picture()
    page.click(f"[value={name}]")
    assert page.picture() != whole
    assert page.run("document.getElementById('ramp').hidden") is False


def test_a_rod_is_found_and_picked_without_a_mouse(shown: Shown) -> None:
    page = shown()
    page.press("/", "a04")
    assert page.run("[...document.querySelectorAll('#list li')].filter((row) => !row.hidden).length") == 1
    page.press("\ue007")  # enter
    assert page.run("weavecorePage.picked") == "A04"
    page.press("\ue00c")  # escape leaves the field
    page.press("\ue00c")  # and lets go
    assert page.run("weavecorePage.picked") is None
    page.enter("find", "")
    page.press("n", "n")
    assert page.run("weavecorePage.picked") == "L02"


def test_the_tab_key_comes_to_every_control_and_each_has_a_name(shown: Shown) -> None:
    page = shown()
    page.press("n")
    nameless = page.run(
        "[...document.querySelectorAll('button, input, select, canvas')].filter((one) => !(one.ariaLabel"
        " || one.textContent.trim() || one.labels?.length)).map((one) => one.outerHTML)"
    )
    assert nameless == []
    seen = set()
    for _ in range(60):
        page.press("\ue004")
        seen.add(page.run("document.activeElement.id || document.activeElement.closest('[id]')?.id"))
    assert {"canvas", "fit", "surface", "play", "step", "from", "to", "find", "list", "card", "families"} <= seen


def test_a_surface_without_borders_is_shown(opened: Opened) -> None:
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    closed = SurfaceMesh(corners, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
    page = opened(encode_page(closed))
    page.press("n", "f", "\ue00c")
    assert page.text("h1") == "Unnamed surface"
    assert page.told("browser") == []


def test_a_link_opens_it_with_the_rod_and_the_step_that_it_names(opened: Opened, content: bytes) -> None:
    page = opened(content, "#rod=L02&step=5")
    assert page.run("weavecorePage.picked") == "L02"
    assert page.text("#step-text").startswith("Step 5 of ")


def test_names_from_the_file_are_shown_as_text(opened: Opened) -> None:
    name = '</script ><img src=x onerror="window.hacked=1">{{data}}<!--<script '
    weave = woven_tube("plain")
    surface = replace(weave.lattice.latitudes.surface, name=name)
    lattice = replace(weave.lattice, latitudes=replace(weave.lattice.latitudes, surface=surface))
    ids = ("<b>L</b>", *weave.ids[1:])
    page = opened(encode_page(replace(weave, lattice=lattice, ids=("L<i>1", *ids[1:]))))
    assert page.text("h1") == name.strip()
    assert page.run("document.title") == f"{name}– weavecore"
    assert page.run("[...document.querySelectorAll('.row-name')].map((row) => row.textContent)")[0] == "L<i>1"
    assert page.run("window.hacked") is None
    assert page.told("browser") == []


def test_it_is_drawn_light_and_dark_and_on_a_narrow_screen(shown: Shown) -> None:
    page = shown()
    light = page.picture()
    features = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", features)
    assert page.picture() != light
    page.driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})
    narrow = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    page.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", narrow)
    page.wait("canvas.clientWidth === 390")
    assert page.run("document.documentElement.scrollWidth") == 390
    page.driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
    assert page.told("browser") == []
