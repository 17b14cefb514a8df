"""A polygon with a crowded side is filled with rows of triangles that are no longer than they must be."""

from __future__ import annotations

import numpy as np
import pytest

from weavecore.geometry.triangulate2d import MIN_CROWD, triangulate_crowded_side

TOPS = {
    "one corner": [[0.5, 0.1]],
    "two corners": [[0.8, 0.3], [0.2, 0.4]],
    "a flat one": [[0.9, 0.01], [0.3, 0.05], [0.1, 0.02]],
}


def crowded(top, n, turn=0, normal=(0.0, 0.0, 1.0)):
    """A polygon over n points of its lowest side, beginning with any corner, in a plane with some normal."""
    base = np.stack([np.linspace(0, 1, n + 2), np.zeros(n + 2)], axis=1)
    flat = np.concatenate([base, np.array(top)])
    across = np.linalg.svd(np.array([normal]))[2][1:]
    if np.dot(np.cross(across[0], across[1]), normal) < 0:
        across = across[::-1]
    return np.roll(flat @ across + (3.0, -2.0, 5.0), turn, axis=0)


def areas(points, triangles, normal):
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a) @ (np.array(normal) / np.linalg.norm(normal)) / 2


@pytest.mark.parametrize("top", TOPS)
@pytest.mark.parametrize("n", [MIN_CROWD, 40, 201])
def test_the_triangles_fill_the_polygon_once(top, n):
    normal = (1.0, 2.0, -1.0)
    polygon = crowded(TOPS[top], n, turn=n // 3, normal=normal)
    filled = triangulate_crowded_side(polygon)
    points = np.concatenate([polygon, filled.points])
    area = areas(points, filled.triangles, normal)
    fan = np.stack(
        [np.zeros(len(polygon) - 2, int), np.arange(1, len(polygon) - 1), np.arange(2, len(polygon))], axis=1
    )
    assert (area > 0).all()
    assert area.sum() == pytest.approx(areas(polygon, fan, normal).sum())
    sides = np.concatenate([filled.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    directed = {tuple(side) for side in sides.tolist()}
    assert len(directed) == len(sides)
    naked = {side for side in directed if side[::-1] not in directed}
    assert naked == {(k, (k + 1) % len(polygon)) for k in range(len(polygon))}


def test_few_edges_are_long():
    polygon = crowded(TOPS["a flat one"], 400)
    filled = triangulate_crowded_side(polygon)
    points = np.concatenate([polygon, filled.points])
    along = points[filled.triangles] - points[np.roll(filled.triangles, -1, axis=1)]
    # A fan of 400 has about 600 sides longer than a tenth of that side.
    assert (np.linalg.norm(along, axis=2) > 0.1).sum() < 60
    assert len(filled.triangles) < 4 * len(polygon)


@pytest.mark.parametrize(
    "polygon",
    [
        crowded(TOPS["one corner"], MIN_CROWD - 1),
        crowded([[1.3, 0.4], [0.5, 0.6]], 40),  # leans out over the end of the side
        np.stack([np.linspace(0, 1, 40), np.zeros(40), np.zeros(40)], axis=1),  # has no area
    ],
    ids=["not crowded", "leaning", "flat"],
)
def test_other_polygons_are_left_to_a_fan(polygon):
    assert triangulate_crowded_side(polygon) is None
