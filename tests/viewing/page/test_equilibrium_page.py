"""The page of a weave at rest: the numbers in it, and the slider, the scale and the colours in a browser."""

from __future__ import annotations

import base64
from functools import cache
from typing import Any, Callable

import numpy as np
import pytest

from weavecore import pipeline
from weavecore.exporting.registry import encode
from weavecore.model import Equilibrium
from weavecore.viewing.page.page_content import page_content
from weavecore.viewing.page.page_curves import curves_of_weave
from weavecore.viewing.page.page_equilibrium import moves_of_samples, stations_at_points
from weavecore.viewing.picture import draw_pixels
from woven_rods import woven_sample

Shown = Callable[[], Any]


@cache
def at_rest() -> Equilibrium:
    return pipeline.simulate(woven_sample("narrow_neck", "plain"), pressure=200.0)


@pytest.fixture(scope="module")
def content() -> bytes:
    return encode(at_rest(), "relaxed.html")


def unpacked(packed: dict[str, str]) -> np.ndarray:
    assert packed["type"] == "Float32Array"
    return np.frombuffer(base64.b64decode(packed["data"]), "<f4")


def test_the_points_of_the_equilibrium_lie_at_their_stations_on_the_drawn_axes() -> None:
    equilibrium, weave = at_rest(), at_rest().weave
    curves, at = curves_of_weave(weave), stations_at_points(equilibrium)
    visits = equilibrium.point_of_visit
    assert at[visits] == pytest.approx(weave.axes.stations)
    for s in range(len(weave)):
        part = slice(curves.offsets[s], curves.offsets[s + 1])
        mine = slice(equilibrium.offsets[s], equilibrium.offsets[s + 1])
        for d in range(3):
            on_axis = np.interp(at[mine], curves.stations[part], curves.points[part, d])
            # The points lie at equal steps of the parameter, which is nearly the arc length.
            assert np.abs(on_axis - equilibrium.drawn[mine, d]).max() < 0.05 * weave.lattice.edge_length


def test_samples_at_joints_move_as_their_points_do_and_have_their_stress() -> None:
    equilibrium, weave = at_rest(), at_rest().weave
    curves = curves_of_weave(weave)
    moves, utilisation = moves_of_samples(equilibrium, curves)
    for s in range(len(weave)):
        visits = np.arange(weave.strands.offsets[s], weave.strands.offsets[s + 1])
        part = np.arange(curves.offsets[s], curves.offsets[s + 1])
        near = np.abs(curves.stations[part][:, None] - weave.axes.stations[visits]).argmin(0)
        points = equilibrium.point_of_visit[visits]
        move = (equilibrium.points - equilibrium.drawn)[points]
        assert moves[part[near]] == pytest.approx(move, abs=1e-6 * weave.lattice.edge_length)
        assert utilisation[part[near]] == pytest.approx(equilibrium.utilisation[points], abs=1e-6)


def test_the_page_has_the_numbers_of_the_equilibrium() -> None:
    equilibrium = at_rest()
    page = page_content(equilibrium)
    entry, figures = page["equilibrium"], {row["label"]: row for row in page["figures"]}
    assert page["stage"].endswith("at rest")
    assert page_content(equilibrium.weave)["equilibrium"] is None
    assert unpacked(entry["supports"]).reshape(-1, 3).shape == (equilibrium.is_supported.sum(), 3)
    assert unpacked(entry["rodUtilisation"]).max() == pytest.approx(equilibrium.utilisation_max, rel=1e-6)
    # The legend and the rods have the departure that the figures, the tables and the summary have.
    assert entry["largestMove"] == equilibrium.departure_max
    assert unpacked(entry["rodMove"]).max() == pytest.approx(equilibrium.departure_max, rel=1e-6)
    worst = figures["Stress at rest"]
    assert worst["text"] == f"{equilibrium.stress_max:.0f} MPa"
    assert equilibrium.rod[np.argmax(equilibrium.stress)] == worst["rod"]
    assert figures["Largest departure"]["text"] == f"{equilibrium.departure_max:.3g} mm"
    assert figures["At rest"]["text"] == "stable"
    force = unpacked(entry["rodForce"])
    of_rod = equilibrium.axial_force[equilibrium.offsets[0] : equilibrium.offsets[1]]
    assert abs(force[0]) == pytest.approx(np.abs(of_rod).max(), rel=1e-6)


def test_the_slider_moves_the_rods_from_as_drawn_to_at_rest_and_beyond(shown: Shown) -> None:
    page = shown().reset()
    at_first = page.picture()
    assert page.text("#rest-text") == "at rest"
    name = at_rest().weave.ids[
        int(at_rest().rod[np.argmax(np.linalg.norm(at_rest().points - at_rest().drawn, axis=1))])
    ]
    place = page.run("weavecorePage.placeOf(arguments[0])", name)
    page.enter("exaggeration", "20")
    assert page.text("#rest-text") == "at rest, × 20"
    further = page.run("weavecorePage.placeOf(arguments[0])", name)
    exaggerated = page.picture()
    page.enter("at-rest", "50")
    assert page.text("#rest-text") == "50% of the way to rest, × 20"
    halfway = page.run("weavecorePage.placeOf(arguments[0])", name)
    page.enter("at-rest", "0")
    assert page.text("#rest-text") == "as drawn"
    drawn = page.run("weavecorePage.placeOf(arguments[0])", name)
    assert len({at_first, exaggerated, page.picture()}) == 3
    moves = [np.linalg.norm(np.subtract(one, drawn)) for one in (place, halfway, further)]
    assert 0 < moves[0] < moves[1] < moves[2]
    assert page.reset().text("#rest-text") == "at rest"
    assert page.picture() == at_first
    assert page.told("browser") == []


@pytest.mark.parametrize(
    ("name", "low", "high"), [("stress", "0 MPa", "133 MPa: allowable"), ("departure", "0 mm", None)]
)
def test_rods_are_coloured_along_their_length_with_a_legend(shown: Shown, name: str, low: str, high: str) -> None:
    page = shown()
    by_family = page.picture()
    page.click(f"[value={name}]")
    assert page.picture() != by_family
    assert page.text("#ramp-low") == low
    assert page.text("#ramp-high") == (high or f"{at_rest().departure_max:.3g} mm")
    assert page.run("document.querySelectorAll('#colour-by [value=utilisation]').length") == 0


def test_the_card_of_a_rod_has_its_stress_force_and_departure(shown: Shown) -> None:
    page = shown()
    page.press("n")
    page.click("[value=stress]")
    card = page.text("#card")
    s = at_rest().weave.ids.index(page.run("weavecorePage.picked"))
    stress = at_rest().greatest_of_rods(at_rest().stress)[s]
    assert f"{stress:.0f} MPa" in card
    assert "Axial force" in card
    assert "Largest departure" in card
    assert page.told("browser") == []


def test_the_picture_shows_the_rods_at_rest_and_as_drawn_without_the_surface() -> None:
    weave = at_rest().weave
    at, drawn = (draw_pixels(value, size=(320, 240)) for value in (at_rest(), weave))
    free = (at == at[:, :1]).all(-1).mean()
    assert free > (drawn == drawn[:, :1]).all(-1).mean() + 0.1
    assert (at != drawn).any()
