"""The bands between the polylines, and the graph of parents and children."""

import numpy as np
import pytest

from flat_fields import flat_field, flat_surface
from planar_meshes import circle, rectangle
from weavecore.geometry.arrays import rows_of
from weavecore.model import SurfaceMesh
from weavecore.offsetting.distance.solver import DistanceField
from weavecore.offsetting.isolines.extract import trace_latitudes
from weavecore.offsetting.level_sets import offset_levels
from weavecore.validating import validate


def trace(loops, edge, spacing):
    surface = flat_surface(loops, edge)
    return trace_latitudes(surface, flat_field(surface), spacing=spacing)


def assert_holds(latitudes):
    report = validate(latitudes)
    assert report.holds, f"\n{report}"


def sides(latitudes):
    """Parents and children of each band."""
    bands = latitudes.bands
    band = rows_of(bands.offsets)
    return [
        (
            bands.polyline[(band == b) & bands.is_parent].tolist(),
            bands.polyline[(band == b) & ~bands.is_parent].tolist(),
        )
        for b in range(len(bands))
    ]


def n_cycles(latitudes):
    """Independent cycles of the graph of bands, joined by the polylines between them."""
    between = len(latitudes) - int((latitudes.generation == 0).sum())
    return between - len(latitudes.bands) + 1


def sphere(n_around, n_up):
    """A unit sphere in rings of vertices, and the ring in the middle."""
    up = np.pi * (np.arange(1, 2 * n_up) / (2 * n_up) - 0.5)
    around = 2 * np.pi * np.arange(n_around) / n_around
    ring = np.stack([np.cos(around), np.sin(around), 0 * around], axis=1)
    rings = [ring * np.cos(a) + [0, 0, np.sin(a)] for a in up]
    vertices = np.concatenate([*rings, [[0, 0, -1.0]], [[0, 0, 1.0]]])
    k, j = np.arange(n_around), (np.arange(n_around) + 1) % n_around
    faces = [np.stack([j, k, 0 * k + len(vertices) - 2], axis=1)]
    for r in range(2 * n_up - 2):
        low, high = r * n_around, (r + 1) * n_around
        faces += [np.stack([low + k, low + j, high + j], 1), np.stack([low + k, high + j, high + k], 1)]
    last = (2 * n_up - 2) * n_around
    faces.append(np.stack([last + k, last + j, 0 * k + len(vertices) - 1], axis=1))
    return vertices, np.concatenate(faces), (n_up - 1) * n_around + k


def torus(n, m, hole):
    """A torus of radii 3 and 1 with faces left out around its outermost point."""
    u, v = np.meshgrid(2 * np.pi * np.arange(n) / n, 2 * np.pi * np.arange(m) / m, indexing="ij")
    points = np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], -1).reshape(-1, 3)
    i, j = np.arange(n)[:, None], np.arange(m)
    a, b = i * m + j, (i + 1) % n * m + j
    c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    kept = faces[np.linalg.norm(points[faces].mean(1) - [4, 0, 0], axis=1) > hole]
    used, kept = np.unique(kept, return_inverse=True)
    return SurfaceMesh(points[used], kept.reshape(-1, 3))


def test_a_disc_is_rings_and_a_cap():
    latitudes = trace([circle(5.0, n=90)], 0.4, 1.1)
    assert latitudes.bands.euler.tolist() == [0, 0, 0, 0, 1]
    assert sides(latitudes) == [([0], [1]), ([1], [2]), ([2], [3]), ([3], [4]), ([4], [])]
    assert latitudes.parents.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4]]
    np.testing.assert_allclose(latitudes.bands.depth[:-1], 1.1 * np.arange(1, 5))
    assert 4.4 < latitudes.bands.depth[-1] <= 5.0
    assert_holds(latitudes)


def test_an_annulus_whose_borders_meet_has_a_pocket_between_two_parents():
    latitudes = trace([circle(5.0, n=90), circle(1.5, n=30)], 0.4, 1.1)
    assert latitudes.generation.tolist() == [0, 0, 1, 1]
    assert sides(latitudes) == [([0], [2]), ([1], [3]), ([2, 3], [])]
    assert latitudes.bands.euler.tolist() == [0, 0, 0]
    assert_holds(latitudes)


def test_fronts_that_merge_give_a_child_of_two_parents():
    hole_between = [rectangle(20, 9), circle(0.5, (-3, 0), 20), circle(0.5, (3, 0), 20)]
    latitudes = trace(hole_between, 0.35, 1.0)
    n_parents = np.bincount(latitudes.parents[:, 1], minlength=len(latitudes))
    assert n_parents.max() >= 2
    assert_holds(latitudes)


def test_a_pinch_gives_two_children():
    t = 2 * np.pi * np.arange(240) / 240
    radius = 3.5 + 2.2 * np.cos(2 * t)
    latitudes = trace([np.stack([1.3 * radius * np.cos(t), radius * np.sin(t)], axis=1)], 0.3, 1.5)
    assert latitudes.parents[:2].tolist() == [[0, 1], [0, 2]]
    assert latitudes.bands.euler[0] == -1
    assert n_cycles(latitudes) == 0
    assert_holds(latitudes)


def test_a_handle_makes_a_cycle():
    latitudes = offset_levels(torus(72, 24, 0.6), spacing=0.55)
    assert latitudes.surface.euler_characteristic == -1
    assert n_cycles(latitudes) == 1
    assert latitudes.bands.euler.sum() == -1
    assert_holds(latitudes)


def test_a_hole_for_each_unit_of_euler_characteristic():
    holes = [circle(0.6, (x, y), 20) for x in (-3.0, 0.0, 3.0) for y in (-1.5, 1.6)]
    latitudes = trace([rectangle(11, 8), *holes], 0.35, 0.8)
    assert latitudes.bands.euler.sum() == 1 - len(holes) == latitudes.surface.euler_characteristic
    assert_holds(latitudes)


@pytest.mark.parametrize("spacing", [0.21, 0.4, 0.7, 1.2])
def test_a_cut_has_a_band_on_either_side(spacing):
    vertices, faces, equator = sphere(48, 12)
    surface = SurfaceMesh(vertices, faces, cuts=(equator,))
    height = vertices[:, 2]
    along = np.cross(np.cross(vertices, np.sign(height)[:, None] * [0, 0, 1.0]), vertices)
    size = np.linalg.norm(along, axis=1, keepdims=True)
    direction = np.divide(along, size, out=np.zeros_like(along), where=(size > 1e-9) & (np.abs(height) > 1e-9)[:, None])
    field = DistanceField(np.abs(np.arcsin(np.clip(height, -1, 1))), direction)
    latitudes = trace_latitudes(surface, field, spacing=spacing)
    n = int(np.pi / 2 / spacing)
    assert np.bincount(latitudes.generation).tolist() == [1] + [2] * n
    assert np.array_equal(latitudes.polylines.polyline(0), vertices[equator])
    bands = latitudes.bands
    at_cut = np.flatnonzero(bands.polyline == 0)
    assert bands.is_left[at_cut].tolist() == [True, False]
    north, south = rows_of(bands.offsets)[at_cut]
    child = {b: bands.polyline[bands.offsets[b] : bands.offsets[b + 1]][-1] for b in (north, south)}
    assert latitudes.polylines.polyline(child[north])[:, 2].min() > 0
    assert latitudes.polylines.polyline(child[south])[:, 2].max() < 0
    assert bands.euler.sum() == 2
    assert_holds(latitudes)


def cut_torus():
    whole = torus(48, 16, 0.0)
    x, y, z = whole.vertices.T
    cut = np.flatnonzero(np.isclose(y, 0) & (x > 0))
    return whole.vertices, whole.faces, cut[np.argsort(np.arctan2(z[cut], x[cut] - 3) % (2 * np.pi))]


def test_a_cut_that_does_not_part_the_surface_closes_a_cycle():
    vertices, faces, cut = cut_torus()
    latitudes = offset_levels(SurfaceMesh(vertices, faces, cuts=(cut,)), spacing=1.9)
    assert np.bincount(latitudes.generation)[:4].tolist() == [1, 2, 2, 2]
    # The cut, too, lies between two bands here.
    assert len(latitudes) - len(latitudes.bands) + 1 >= 1
    assert latitudes.bands.euler.sum() == 0
    assert_holds(latitudes)


def test_a_cut_in_a_component_too_shallow_for_a_level_bounds_one_band_twice():
    vertices, faces, cut = cut_torus()
    disc = flat_surface([circle(5.0, n=90)], 0.4)
    n = disc.n_vertices
    surface = SurfaceMesh(
        np.concatenate([disc.vertices, vertices * 0.1 + [0, 0, 9]]),
        np.concatenate([disc.faces, faces + n]),
        cuts=(cut + n,),
    )
    latitudes = offset_levels(surface, spacing=1.1)
    assert np.bincount(latitudes.generation).tolist() == [2, 1, 1, 1, 1]
    bands = latitudes.bands
    at_cut = np.flatnonzero(bands.polyline == 1)
    assert len(set(rows_of(bands.offsets)[at_cut])) == 1
    assert bands.is_left[at_cut].tolist() == [True, False]
    assert bands.is_parent[at_cut].all()
    assert_holds(latitudes)


def test_components_are_offset_each():
    big, small, tiny = (flat_surface([circle(r, (8 * k, 0), n=60)], 0.3) for k, r in enumerate((3.4, 1.4, 0.7)))
    offsets = np.cumsum([0, big.n_vertices, small.n_vertices])
    surface = SurfaceMesh(
        np.concatenate([s.vertices for s in (big, small, tiny)]),
        np.concatenate([s.faces + o for s, o in zip((big, small, tiny), offsets)]),
    )
    latitudes = trace_latitudes(surface, flat_field(surface), spacing=1.0)
    assert np.bincount(latitudes.generation).tolist() == [3, 2, 1, 1]
    assert sorted(latitudes.bands.euler.tolist()) == [0, 0, 0, 0, 1, 1, 1]
    assert sides(latitudes)[2] == ([2], [])
    assert_holds(latitudes)
