"""One of each tough surface is woven and keeps all promises; ``tests/sweep.py`` weaves them by the hundred."""

from __future__ import annotations

import numpy as np
import pytest

from stages import hold, weave
from tough_origins import started
from tough_surfaces import TOUGH
from weavecore import pipeline
from weavecore.model import SurfaceMesh
from weavecore.validating import validate

# Folded more sharply than a right angle: a face whose corners lie on both sides may look away from one of them.
KNIFE_FOLDED = {"two_triangles"}

# A long strip in many turns: at twice the spacing its lattice still has 5,293 edges.
COARSER = {"spiral": 2.0}

# Found by the sweep: each had been refused by the paper's method when distances start at a part of the borders.
ONCE_REFUSED_BY_FRONTS = [
    ("crumpled", 22002),
    ("graded_holes", 22001),
    ("rough_terrain", 22001),
    ("two_triangles", 22003),
]

# Found by the sweep: a flat pocket had faces turned over.
ONCE_BROKEN_WHOLE = [
    ("one_triangle", 71007),
    ("closed_bodies", 27003),
    ("box_with_a_hole", 61000),
    ("pieces", 61002),
]

# Found by the sweep as well, by levels: short edges, and faces turned over.
ONCE_BROKEN = [
    ("closed_bodies", 27002),
    ("cone", 27001),
    ("crumpled", 27002),
    ("graded_holes", 27000),
    ("hole_near_the_rim", 27002),
    ("missing_faces", 51003),
    ("pieces", 27001),
    ("slits", 51002),
    ("star", 51001),
    ("two_triangles", 27000),
    ("two_triangles", 27003),
]

every_surface = pytest.mark.parametrize("name", sorted(TOUGH))

# The paper's method takes longest; on the others it runs with ``-m slow``.
OFFSET_BY_FRONTS = {
    "box_with_a_hole",
    "cone",
    "far_away",
    "handles",
    "joint",
    "pinched_tube",
    "plate_with_holes",
    "star",
}


@every_surface
def test_a_surface_is_valid_and_the_same_each_time(name: str) -> None:
    vertices, faces = TOUGH[name](7)
    surface = SurfaceMesh(vertices, faces)
    assert np.array_equal(np.unique(surface.faces), np.arange(surface.n_vertices))
    again = TOUGH[name](7)
    assert np.array_equal(vertices, again[0])
    assert np.array_equal(faces, again[1])
    assert not np.array_equal(vertices, TOUGH[name](8)[0])


@pytest.mark.parametrize("name", sorted(set(TOUGH) - KNIFE_FOLDED))
def test_a_surface_is_woven(name: str) -> None:
    surface = pipeline.surface_from(TOUGH[name](0))
    hold(weave(surface, spacing=COARSER.get(name, 1.0) * pipeline.suggest_spacing(surface)))


@pytest.mark.parametrize("name", sorted(KNIFE_FOLDED))
def test_a_knife_fold_is_woven_but_for_faces_across_it(name: str) -> None:
    woven = weave(pipeline.surface_from(TOUGH[name](0)))
    findings = [*validate(woven.latitudes), *validate(woven.lattice), *validate(woven.strands, lattice=woven.lattice)]
    assert {finding.name for finding in findings if not finding.holds} <= {"flipped_faces_share"}


@every_surface
def test_a_surface_is_woven_from_a_part_of_its_borders(name: str) -> None:
    hold(weave(started(pipeline.surface_from(TOUGH[name](0)), np.random.default_rng(0))))


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in OFFSET_BY_FRONTS else pytest.mark.slow) for name in sorted(TOUGH)],
)
def test_the_papers_method_offsets_a_part_of_the_borders_too(name: str) -> None:
    surface = started(pipeline.surface_from(TOUGH[name](0)), np.random.default_rng(0))
    latitudes = pipeline.offset(surface, method="fronts")
    for report in (validate(latitudes), validate(pipeline.link(latitudes))):
        assert report.holds, f"\n{report}"


def sweep_case(name: str, seed: int, *, is_started: bool) -> tuple[SurfaceMesh, float]:
    """A surface of the sweep, that distances may start at a part of the borders of, and its spacing."""
    draw = np.random.default_rng([seed, *name.encode()])
    surface = pipeline.surface_from(TOUGH[name](seed))
    if is_started:
        surface = started(surface, draw)
    return surface, pipeline.suggest_spacing(surface) * (1.0 if seed % 2 == 0 else 2.0 ** draw.uniform(-1, 1))


@pytest.mark.parametrize(("name", "seed"), ONCE_BROKEN)
def test_a_surface_that_the_sweep_found_to_break_a_promise_keeps_them(name: str, seed: int) -> None:
    surface, spacing = sweep_case(name, seed, is_started=True)
    hold(weave(surface, spacing=spacing))


@pytest.mark.parametrize(("name", "seed"), ONCE_BROKEN_WHOLE)
def test_so_does_one_that_starts_at_all_of_its_borders(name: str, seed: int) -> None:
    surface, spacing = sweep_case(name, seed, is_started=False)
    hold(weave(surface, spacing=spacing))


def test_a_speck_of_the_first_generation_is_left_out_beside_longer_polylines() -> None:
    surface, spacing = sweep_case("star", 27006, is_started=True)
    latitudes = pipeline.offset(surface, spacing=spacing)
    lengths = latitudes.polylines.lengths[latitudes.generation == 1]
    assert len(lengths) == 3
    assert lengths.min() > 0.5 * spacing
    pipeline.link(latitudes)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed"), ONCE_REFUSED_BY_FRONTS)
def test_the_papers_method_gives_as_many_polylines_as_levels_where_it_once_gave_none(name: str, seed: int) -> None:
    surface, spacing = sweep_case(name, seed, is_started=True)
    fronts, levels = (pipeline.offset(surface, spacing=spacing, method=method) for method in ("fronts", "levels"))
    assert validate(fronts).holds
    assert np.bincount(fronts.generation).tolist() == np.bincount(levels.generation).tolist()
