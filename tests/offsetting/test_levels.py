"""The method as a whole: refinement, refusals, progress."""

import numpy as np
import pytest

from flat_fields import distance_at, flat_surface
from planar_meshes import circle, rectangle
from weavecore.errors import SpacingTooLarge, Unsupported
from weavecore.model import SurfaceMesh
from weavecore.offsetting.level_sets import offset_levels
from weavecore.offsetting.preparation import MIN_EDGES_PER_SPACING
from weavecore.validating import validate


def octahedron():
    vertices = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    faces = np.array([[k, (k + 1) % 4, 4] for k in range(4)] + [[(k + 1) % 4, k, 5] for k in range(4)])
    return vertices, faces


def test_two_triangles_are_refined_until_the_levels_fit():
    square = SurfaceMesh([[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0]], [[0, 1, 2], [0, 2, 3]], unit="Meters", name="a")
    latitudes = offset_levels(square, spacing=0.6)
    surface = latitudes.surface
    assert np.bincount(latitudes.generation).tolist() == [1, 1, 1, 1]
    assert (surface.unit, surface.name) == ("Meters", "a")
    assert np.array_equal(surface.vertices[:4], square.vertices)
    assert np.array_equal(surface.borders[0], square.borders[0])
    traced = latitudes.polylines.owner > 0
    exact, _ = distance_at(surface, latitudes.polylines.points[traced])
    wanted = latitudes.distance[latitudes.polylines.owner[traced]]
    assert np.quantile(np.abs(exact - wanted), 0.9) < 0.006
    report = validate(latitudes)
    assert report.holds, f"\n{report}"


def test_a_mesh_fine_enough_is_not_touched():
    surface = flat_surface([circle(5.0, n=120)], 0.3)
    longest = surface.edge_lengths.max()
    assert offset_levels(surface, spacing=MIN_EDGES_PER_SPACING * longest).surface is surface
    assert offset_levels(surface, spacing=0.9 * MIN_EDGES_PER_SPACING * longest).surface is not surface


def test_cuts_survive_refinement():
    vertices, faces = octahedron()
    latitudes = offset_levels(SurfaceMesh(vertices, faces, cuts=(np.arange(4),)), spacing=0.2)
    assert np.array_equal(latitudes.polylines.polyline(0), vertices[:4])
    assert np.bincount(latitudes.generation).tolist() == [1] + [2] * 6
    report = validate(latitudes)
    assert report.holds, f"\n{report}"


@pytest.mark.parametrize("spacing", [0, -1.0, float("nan"), float("inf")])
def test_a_spacing_that_is_no_length_is_refused(spacing):
    with pytest.raises(Unsupported, match="positive"):
        offset_levels(flat_surface([circle(1.0)], 0.4), spacing=spacing)


def test_a_closed_component_without_cut_is_refused_with_its_faces():
    vertices, faces = octahedron()
    disc = flat_surface([circle(1.0)], 0.4)
    both = SurfaceMesh(
        np.concatenate([disc.vertices, vertices + 5]), np.concatenate([disc.faces, faces + disc.n_vertices])
    )
    with pytest.raises(Unsupported, match="Cut it in two") as caught:
        offset_levels(both, spacing=0.2)
    assert caught.value.ids == tuple(range(disc.n_faces, disc.n_faces + 8))


@pytest.mark.parametrize("loops", [[rectangle(2, 2)], [np.array([[0, 0], [3, 0], [0, 1.0]])]])
def test_the_spacing_that_a_refusal_recommends_works(loops):
    surface = flat_surface(loops, 5.0)  # hardly a vertex but on the border
    with pytest.raises(SpacingTooLarge) as caught:
        offset_levels(surface, spacing=50.0)
    recommended = float(caught.value.remedy.split()[4])
    assert offset_levels(surface, spacing=recommended).generation.max() >= 1


def test_progress_is_told_and_can_cancel():
    class Cancelled(Exception):
        pass

    told = []

    def stop(fraction, label):
        told.append((fraction, label))
        if len(told) > 1:
            raise Cancelled

    surface = flat_surface([circle(5.0, n=120)], 0.2)
    with pytest.raises(Cancelled):
        offset_levels(surface, spacing=0.7, progress=stop)
    assert all(0 <= fraction <= 1 and label for fraction, label in told)
