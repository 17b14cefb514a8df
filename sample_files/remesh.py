"""Isotropic remeshing of an implicit surface with a border, in NumPy alone.

Split long edges, collapse short ones, flip to Delaunay, relax along the surface and
project back, after Botsch and Kobbelt 2004.  Every step takes an independent set of edges
at once, so that the result does not depend on an order of visiting.

A surface is given by a function of points that is zero on it, with its gradient pointing
outwards; a region by a function that is negative inside, zero on the border.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Field = Callable[[Array], Array]

LONG, SHORT = 4 / 3, 4 / 5  # of the wanted edge: splitting or collapsing brings it nearer


class Edges:
    """The undirected edges of ``faces``: ends (E, 2), faces (E, 2) and opposite corners (E, 2), -1 for none."""

    def __init__(self, faces: Index) -> None:
        tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
        apex = faces[:, [2, 0, 1]].ravel()
        n = np.int64(faces.max() + 1)
        key = np.minimum(tail, head) * n + np.maximum(tail, head)
        order = np.argsort(key, kind="stable")
        starts = np.r_[True, np.diff(key[order]) > 0]
        of_halfedge = np.empty(len(key), np.int64)
        of_halfedge[order] = np.cumsum(starts) - 1
        self.keys = key[order][starts]
        self.ends = np.stack([self.keys // n, self.keys % n], axis=1)
        count = np.diff(np.r_[np.flatnonzero(starts), len(key)])
        first = np.concatenate([[0], np.cumsum(count)[:-1]])
        second = np.where(count == 2, order[np.minimum(first + 1, len(order) - 1)], -1)
        halfedges = np.c_[order[first], second]
        self.faces = np.where(halfedges >= 0, halfedges // 3, -1)
        self.apexes = np.where(halfedges >= 0, apex[halfedges], -1)
        self.of_face = of_halfedge.reshape(-1, 3)
        self.on_border = count == 1

    def __len__(self) -> int:
        return len(self.ends)

    def border_vertices(self, n: int) -> NDArray[np.bool_]:
        flag = np.zeros(n, bool)
        flag[self.ends[self.on_border]] = True
        return flag

    def lengths(self, vertices: Array) -> Array:
        lengths: Array = np.linalg.norm(vertices[self.ends[:, 1]] - vertices[self.ends[:, 0]], axis=1)
        return lengths

    def best_of_faces(self, wanted: NDArray[np.bool_], score: Array) -> NDArray[np.bool_]:
        """Wanted edges that have the best score in both of their faces: no face has two of them."""
        rank = np.empty(len(self), np.int64)
        rank[np.lexsort((np.arange(len(self)), score, wanted))] = np.arange(len(self))
        best = rank[self.of_face].max(1)
        chosen = wanted.copy()
        for side in (0, 1):
            there = self.faces[:, side] >= 0
            chosen[there] &= best[self.faces[there, side]] == rank[there]
        return chosen


def gradient(field: Field, points: Array) -> Array:
    """Central differences."""
    step = 1e-6 * max(float(np.abs(points).max()), 1.0)
    shifts = step * np.eye(3)
    return np.stack([(field(points + s) - field(points - s)) / (2 * step) for s in shifts], axis=1)


def project(points: Array, fields: tuple[Field, ...], rounds: int = 6) -> Array:
    """Move points to where all the given fields (one or two) are zero, by the least way."""
    for _ in range(rounds):
        values = np.stack([f(points) for f in fields], axis=1)
        jacobian = np.stack([gradient(f, points) for f in fields], axis=1)
        gram = jacobian @ jacobian.transpose(0, 2, 1)
        points = points - (jacobian.transpose(0, 2, 1) @ np.linalg.solve(gram, values[..., None]))[..., 0]
    return points


def face_normals(vertices: Array, faces: Index) -> Array:
    """Normals (F, 3), twice the area long."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def compact(vertices: Array, faces: Index) -> tuple[Array, Index]:
    """Without the vertices that no face uses."""
    used, inverse = np.unique(faces, return_inverse=True)
    return vertices[used], inverse.reshape(-1, 3).astype(np.int64)


def split_long(vertices: Array, faces: Index, longest: float) -> tuple[Array, Index]:
    """Cut edges longer than ``longest`` in the middle until there are none."""
    while True:
        edges = Edges(faces)
        lengths = edges.lengths(vertices)
        chosen = edges.best_of_faces(lengths > longest, lengths)
        if not chosen.any():
            return vertices, faces
        middle = np.full(len(edges), -1, np.int64)
        middle[chosen] = len(vertices) + np.arange(chosen.sum())
        vertices = np.concatenate([vertices, vertices[edges.ends[chosen]].mean(1)])
        new = middle[edges.of_face]
        face, k = np.nonzero(new >= 0)
        a, b, c = (faces[face, (k + i) % 3] for i in range(3))
        m = new[face, k]
        keep = np.ones(len(faces), bool)
        keep[face] = False
        faces = np.concatenate([faces[keep], np.c_[a, m, c], np.c_[m, b, c]])


def collapse_short(vertices: Array, faces: Index, shortest: float, longest: float) -> tuple[Array, Index]:
    """Collapse edges shorter than ``shortest`` where no face turns over and none grows longer than ``longest``."""
    for _ in range(30):
        edges = Edges(faces)
        n = len(vertices)
        kept, gone, place = _collapses(vertices, edges, shortest)
        if len(gone) <= len(faces) // 2000:
            break
        target = np.arange(n)
        target[gone] = kept
        moved = vertices.copy()
        moved[kept] = place
        bad = _spoilt(vertices, moved, faces, target, longest)
        refused = np.zeros(n, bool)
        refused[faces[bad]] = True
        fine = ~(refused[kept] | refused[gone])
        if not fine.any():
            break
        vertices = vertices.copy()
        vertices[kept[fine]] = place[fine]
        target = np.arange(n)
        target[gone[fine]] = kept[fine]
        faces = target[faces]
        alive = (faces != np.roll(faces, 1, axis=1)).all(1)
        vertices, faces = compact(vertices, faces[alive])
    return vertices, faces


def _collapses(vertices: Array, edges: Edges, shortest: float) -> tuple[Index, Index, Array]:
    """An independent set of short edges: the vertex kept, the vertex gone, where they meet."""
    n = len(vertices)
    u, v = edges.ends.T
    on_border = edges.border_vertices(n)
    lengths = edges.lengths(vertices)
    wanted = (lengths < shortest) & (edges.on_border | ~(on_border[u] & on_border[v]))
    links = coo_matrix((np.ones(2 * len(u)), (np.r_[u, v], np.r_[v, u])), shape=(n, n)).tocsr()
    common = np.asarray((links @ links)[u, v]).ravel()
    wanted &= common == np.where(edges.on_border, 1, 2)
    rank = np.full(len(edges), len(edges), np.int64)
    candidates = np.flatnonzero(wanted)
    rank[candidates[np.argsort(lengths[candidates], kind="stable")]] = np.arange(len(candidates))
    least = np.full(n, len(edges), np.int64)
    for end in (u, v):
        np.minimum.at(least, end, rank)
    for _ in range(2):
        spread = least.copy()
        np.minimum.at(spread, u, least[v])
        np.minimum.at(spread, v, least[u])
        least = spread
    wanted &= (rank == least[u]) & (rank == least[v])
    u, v = u[wanted], v[wanted]
    keeps_v = on_border[v] & ~on_border[u]
    kept, gone = np.where(keeps_v, v, u), np.where(keeps_v, u, v)
    place = np.where((on_border[u] == on_border[v])[:, None], (vertices[u] + vertices[v]) / 2, vertices[kept])
    return kept, gone, place


def _spoilt(vertices: Array, moved: Array, faces: Index, target: Index, longest: float) -> NDArray[np.bool_]:
    """Faces that a set of collapses would turn over or stretch."""
    after = target[faces]
    alive = (after != np.roll(after, 1, axis=1)).all(1)
    before, then = face_normals(vertices, faces), face_normals(moved, after)
    size = np.linalg.norm(before, axis=1) * np.linalg.norm(then, axis=1)
    turned = (before * then).sum(1) < 0.5 * size
    corners = moved[after]
    stretched = (np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2) > longest).any(1)
    changed = (after != faces).any(1) | (moved[faces] != vertices[faces]).any((1, 2))
    return alive & changed & (turned | stretched)


def _angle_at(apex: Array, a: Array, b: Array) -> Array:
    p, q = a - apex, b - apex
    return np.arctan2(np.linalg.norm(np.cross(p, q), axis=1), (p * q).sum(1))


def flip_to_delaunay(vertices: Array, faces: Index) -> Index:
    """Flip inner edges whose opposite angles sum to more than a half turn."""
    n = np.int64(len(vertices))
    for _ in range(60):
        edges = Edges(faces)
        inner = np.flatnonzero(~edges.on_border)
        (u, v), (p, q) = edges.ends[inner].T, edges.apexes[inner].T
        x, y, s, t = vertices[u], vertices[v], vertices[p], vertices[q]
        excess = np.zeros(len(edges))
        excess[inner] = _angle_at(s, x, y) + _angle_at(t, x, y) - np.pi
        wanted = excess > 1e-6
        fold = (np.cross(t - s, x - s) * np.cross(y - s, t - s)).sum(1) > 0
        taken = np.isin(np.minimum(p, q) * n + np.maximum(p, q), edges.ends[:, 0] * n + edges.ends[:, 1])
        wanted[inner] &= fold & ~taken
        chosen = edges.best_of_faces(wanted, excess)
        if not chosen.any():
            break
        faces = _flipped(faces, edges, np.flatnonzero(chosen), n)
    return faces


def _flipped(faces: Index, edges: Edges, chosen: Index, n: np.int64) -> Index:
    first, second = edges.faces[chosen].T
    corners = faces[first]
    k = np.argmax(edges.of_face[first] == chosen[:, None], axis=1)
    row = np.arange(len(chosen))
    u, v, p = corners[row, k], corners[row, (k + 1) % 3], corners[row, (k + 2) % 3]
    q = edges.apexes[chosen].sum(1) - p
    after = faces.copy()
    after[first], after[second] = np.c_[p, u, q], np.c_[q, v, p]
    # two flips side by side may ask for the same new edge: undo the later one
    key = np.minimum(p, q) * n + np.maximum(p, q)
    _, leader = np.unique(key, return_index=True)
    late = np.setdiff1d(row, leader)
    after[first[late]], after[second[late]] = faces[first[late]], faces[second[late]]
    return after


def relax(vertices: Array, faces: Index, surface: Field, region: Field | None, step: float = 0.7) -> Array:
    """Move each vertex along the surface towards the middle of its neighbours; border vertices along the border."""
    edges = Edges(faces)
    on_border = edges.border_vertices(len(vertices))
    moved = vertices + step * _tangential(vertices, edges.ends, surface)
    moved[~on_border] = project(moved[~on_border], (surface,), 3)
    moved[on_border] = vertices[on_border]
    if region is not None and on_border.any():
        moved = _even_border(moved, edges, on_border, surface, region)
    return moved


def _even_border(vertices: Array, edges: Edges, on_border: NDArray[np.bool_], surface: Field, region: Field) -> Array:
    rows = np.cumsum(on_border) - 1
    ends = rows[edges.ends[edges.on_border]]
    points = vertices[on_border]
    for _ in range(8):
        points = points + 0.5 * _tangential(points, ends, surface)
        points = project(points, (surface, region), 1)
    moved = vertices.copy()
    moved[on_border] = project(points, (surface, region), 4)
    return moved


def _tangential(points: Array, ends: Index, surface: Field) -> Array:
    """From each point to the mean of the points joined to it, along the surface."""
    n = len(points)
    here, there = np.r_[ends[:, 0], ends[:, 1]], np.r_[ends[:, 1], ends[:, 0]]
    total = np.stack([np.bincount(here, x, n) for x in points[there].T], axis=1)
    normal = gradient(surface, points)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    way = total / np.bincount(here, minlength=n)[:, None] - points
    along: Array = way - normal * (way * normal).sum(1, keepdims=True)
    return along


def remesh(
    vertices: Array, faces: Index, surface: Field, region: Field | None, edge: float, rounds: int = 6
) -> tuple[Array, Index]:
    """Well-shaped triangles with edges about ``edge`` long, on the surface, borders on the region's border."""
    for _ in range(rounds):
        vertices, faces = split_long(vertices, faces, LONG * edge)
        vertices, faces = collapse_short(vertices, faces, SHORT * edge, LONG * edge)
        faces = flip_to_delaunay(vertices, faces)
        for _ in range(3):
            vertices = relax(vertices, faces, surface, region)
        faces = flip_to_delaunay(vertices, faces)
    for _ in range(10):
        vertices = relax(vertices, faces, surface, region)
        faces = flip_to_delaunay(vertices, faces)
    return vertices, faces
