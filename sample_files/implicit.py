"""Triangle meshes of implicit surfaces: marching tetrahedra, trimming, remeshing."""

from __future__ import annotations

import numpy as np

from remesh import Array, Field, Index, compact, project, remesh

# The six tetrahedra of a cube about its main diagonal; corner bits are x, y, z.
_TETRAHEDRA = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


def implicit_surface(
    surface: Field, region: Field | None, low: tuple[float, ...], high: tuple[float, ...], edge: float, rounds: int = 6
) -> tuple[Array, Index]:
    """The zero set of ``surface`` where ``region`` is negative, as well-shaped triangles.

    Parameters
    ----------
    surface : function of points (N, 3)
        Zero on the surface, rising outwards.
    region : function of points (N, 3) or None
        Negative inside; the borders lie where it is zero.  None for a closed surface.
    low, high : corners of a box that holds the trimmed surface
    edge : float
        The wanted length of an edge.
    """
    vertices, faces = march(surface, low, high, edge * 1.6)
    vertices = project(vertices, (surface,))
    if region is not None:
        vertices, faces = trim(vertices, faces, region(vertices))
    return remesh(vertices, faces, surface, region, edge, rounds)


def march(field: Field, low: tuple[float, ...], high: tuple[float, ...], cell: float) -> tuple[Array, Index]:
    """Marching tetrahedra on a grid of cubes; faces counter-clockwise seen from where the field is positive."""
    counts = [int(np.ceil((b - a) / cell)) + 2 for a, b in zip(low, high)]
    axes = [a + cell * (np.arange(n) - 0.37) for a, n in zip(low, counts)]  # off the symmetric planes
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    value = field(grid)
    value[value == 0] = 1e-300
    strides = np.array([counts[1] * counts[2], counts[2], 1])
    cubes = np.stack(np.meshgrid(*[np.arange(n - 1) for n in counts], indexing="ij"), axis=-1).reshape(-1, 3) @ strides
    corner = np.array([(c & 1) * strides[0] + (c >> 1 & 1) * strides[1] + (c >> 2 & 1) * strides[2] for c in range(8)])
    tets = (cubes[:, None] + corner).reshape(-1, 8)[:, _TETRAHEDRA].reshape(-1, 4)
    inside = value[tets] < 0
    n_inside = inside.sum(1)
    crossed = (n_inside > 0) & (n_inside < 4)
    tets, inside, n_inside = tets[crossed], inside[crossed], n_inside[crossed]
    order = np.argsort(~inside, axis=1, kind="stable")
    tets = np.take_along_axis(tets, order, axis=1)  # the inside corners first
    a, b, c, d = tets.T
    one, two, three = (n_inside == k for k in (1, 2, 3))

    def triangles(rows: Array, *edges: tuple[Index, Index]) -> Array:
        return np.stack([np.stack([p[rows], q[rows]], axis=1) for p, q in edges], axis=1)

    cut = np.concatenate(
        [
            triangles(one, (a, b), (a, c), (a, d)),
            triangles(three, (a, d), (b, d), (c, d)),
            triangles(two, (a, c), (a, d), (b, d)),
            triangles(two, (a, c), (b, d), (b, c)),
        ]
    )
    low_end, high_end = np.sort(cut.reshape(-1, 2), axis=1).T
    keys, index = np.unique(low_end * np.int64(len(grid)) + high_end, return_inverse=True)
    i, j = keys // len(grid), keys % len(grid)
    vertices = grid[i] + (grid[j] - grid[i]) * (value[i] / (value[i] - value[j]))[:, None]
    faces = index.reshape(-1, 3).astype(np.int64)
    # outwards is from the inside end of the first edge cut to its other end
    ends = cut[:, 0]
    swap = value[ends[:, 0]] > 0
    out = grid[np.where(swap, ends[:, 0], ends[:, 1])] - grid[np.where(swap, ends[:, 1], ends[:, 0])]
    normal = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    wrong = (normal * out).sum(1) < 0
    faces[wrong] = faces[wrong][:, ::-1]
    return vertices, faces


def trim(vertices: Array, faces: Index, level: Array) -> tuple[Array, Index]:
    """The part of a mesh where the linear function with these values at the vertices is negative."""
    level = np.where(level == 0, 1e-300, level)
    inside = level[faces] < 0
    n_inside = inside.sum(1)
    lead = np.where(n_inside == 1, np.argmax(inside, axis=1), np.argmin(inside, axis=1))
    turned = np.take_along_axis(faces, (lead[:, None] + np.arange(3)) % 3, axis=1)
    mixed = (n_inside == 1) | (n_inside == 2)
    a, b, c = turned.T
    n = np.int64(len(vertices))
    key_ab, key_ac = (np.minimum(a, o) * n + np.maximum(a, o) for o in (b, c))
    keys = np.unique(np.r_[key_ab[mixed], key_ac[mixed]])
    i, j = keys // n, keys % n
    cut = vertices[i] + (vertices[j] - vertices[i]) * (level[i] / (level[i] - level[j]))[:, None]
    ab, ac = (n + np.searchsorted(keys, key) for key in (key_ab, key_ac))
    one, two = n_inside == 1, n_inside == 2
    pieces = [
        faces[n_inside == 3],
        np.c_[a, ab, ac][one],
        np.c_[ab, b, c][two],
        np.c_[ab, c, ac][two],
    ]
    return compact(np.concatenate([vertices, cut]), np.concatenate(pieces))
