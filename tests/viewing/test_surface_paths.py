"""Where distances start and where borders are free is kept apart in pictures, pages and words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from open_cloth import CLOTHS, COLUMNS, EDGE, ROWS, cloth_latitudes, path_through, plate, started
from weavecore.model import Origins
from weavecore.palette import FREE_BORDERS
from weavecore.viewing.page.page_content import page_content
from weavecore.viewing.picture import draw_pixels
from weavecore.viewing.scene import scene_of
from weavecore.viewing.summary import describe_latitudes, describe_surface
from weavecore.viewing.surface_paths import paths_of_surface
from woven_tube import tube_latitudes, tube_surface


@pytest.mark.parametrize("name", CLOTHS)
def test_every_border_edge_and_every_origin_is_drawn_once(name: str) -> None:
    surface = CLOTHS[name]()
    a, b, is_free_border = paths_of_surface(surface).segments()
    drawn = {frozenset(pair) for pair in zip(a.tolist(), b.tolist())}
    assert len(drawn) == len(a)
    of_borders = [zip(loop.tolist(), np.roll(loop, -1).tolist()) for loop in surface.borders]
    of_origins = zip(*(ends.tolist() for ends in surface.origins.edges()))
    assert drawn == {frozenset(pair) for rows in (*of_borders, of_origins) for pair in rows}
    assert is_free_border.sum() == surface.is_free_border.sum()


def test_free_borders_are_the_stretches_between_the_origins() -> None:
    whole, sides = paths_of_surface(CLOTHS["hole"]()), paths_of_surface(CLOTHS["two sides"]())
    assert (whole.names, whole.closed.tolist()) == (("origin 0", "free border 0"), [True, True])
    assert sides.names == ("origin 0", "origin 1", "free border 0", "free border 1")
    assert not sides.closed.any()
    assert [len(path) for path in sides.paths] == [ROWS + 1, ROWS + 1, COLUMNS + 1, COLUMNS + 1]
    assert paths_of_surface(tube_surface()).names == ("border 0", "border 1")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("side", "1,536 faces? 1 border (1 chosen in part)"),
        ("side with hole", "1,392 faces? 2 borders (1 chosen in part)"),
        ("hole", "1,392 faces? 2 borders (1 chosen)"),
        ("slit", "1,536 faces? 1 border (none chosen)? 1 curve inside"),
        ("two sides", "1,536 faces? 1 border (2 chosen in part)"),
    ],
)
def test_words_say_how_many_borders_were_chosen(name: str, words: str) -> None:
    surface = CLOTHS[name]()
    n = f"{surface.n_faces:,}"
    told = dict(describe_surface(surface))["surface"].partition(": ")[2]
    assert told == ", ".join(words.replace("1,536", n).replace("1,392", n).split("? "))


def test_words_of_a_border_and_a_curve_together() -> None:
    surface = plate()
    slit = path_through(surface, (8, 8), (16, 8))
    both = replace(surface, starts=Origins((surface.borders[0], slit), np.array([True, False])))
    assert describe_surface(both)[0][1].endswith(", 1 border (1 chosen), 1 curve inside")
    figures = {row["label"]: row["text"] for row in page_content(both)["figures"]}
    assert (figures["Borders"], figures["Curves inside"]) == ("1 (1 chosen)", "1")


def test_open_polylines_are_counted() -> None:
    latitudes = cloth_latitudes("hole")
    n, n_open = len(latitudes), int((~latitudes.polylines.closed).sum())
    assert 0 < n_open < n
    told = dict(describe_latitudes(latitudes))["latitudes"]
    assert told.startswith(f"{n} polylines in {latitudes.n_generations} generations, {n_open} open, ")
    figures = {row["label"]: row["text"] for row in page_content(latitudes)["figures"]}
    assert figures["Polylines"] == f"{n}, {n_open} open"
    assert "open" not in dict(describe_latitudes(tube_latitudes()))["latitudes"]


def test_an_open_polyline_is_drawn_without_a_closing_piece() -> None:
    latitudes = cloth_latitudes("three sides")
    scene, lines = scene_of(latitudes), latitudes.polylines
    drawn = np.linalg.norm(scene.ends - scene.starts, axis=1)
    of_free_borders = (scene.colours == FREE_BORDERS).all(1)
    assert drawn[~of_free_borders].sum() == pytest.approx(lines.lengths.sum())
    assert drawn[of_free_borders].sum() == pytest.approx(COLUMNS * EDGE)
    rods = page_content(latitudes)["rods"]
    assert len(rods["names"]) == len(latitudes)


def test_free_borders_are_grey_in_the_picture() -> None:
    surface = plate()
    view = (0.0, 0.0, 1.0)
    chosen = draw_pixels(started(surface, surface.borders[0], closed=True), size=(160, 120), view=view)
    by_default = draw_pixels(surface, size=(160, 120), view=view)
    from_slit = draw_pixels(CLOTHS["slit"](), size=(160, 120), view=view)
    assert np.array_equal(chosen, by_default)

    def is_blue(pixels: np.ndarray) -> np.ndarray:
        return pixels[..., 2].astype(int) > pixels[..., 0].astype(int) + 20

    assert is_blue(by_default)[5:20].any()
    assert not is_blue(from_slit)[5:20].any()
    assert is_blue(from_slit)[50:70].any()


def test_the_page_has_a_family_for_free_borders() -> None:
    assert [family["name"] for family in page_content(CLOTHS["side"]())["families"]] == ["Origins", "Free borders"]
    assert [family["name"] for family in page_content(tube_surface())["families"]] == ["Borders"]
