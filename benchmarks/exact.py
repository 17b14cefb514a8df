"""The error of level sets against an exact polyhedral solver (MMP, pygeodesic)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

PARTS = 6
"""A border edge becomes this many, since the solver takes points as sources and not edges."""

SMOOTH_SLOPE = 0.97
"""Where the exact distance rises less than this, a face lies across a ridge."""


@dataclass(frozen=True)
class Places:
    """Points on a mesh that should lie at given distances: face (N,), barycentric (N, 3), distance (N,)."""

    vertices: np.ndarray
    faces: np.ndarray
    face: np.ndarray
    barycentric: np.ndarray
    distance: np.ndarray


class ExactDistance:
    """The exact distance from border edges at the vertices and the edges' midpoints of a mesh.

    Which halfedges (3F,) it starts at may be told by ``is_origin``; others of the border only bound the surface then.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, is_origin: np.ndarray | None = None) -> None:
        from pygeodesic.geodesic import PyGeodesicAlgorithmExact

        if is_origin is None:
            is_origin = np.ones(faces.size, bool)
        self._vertices, self._faces = _halve_edges(vertices, faces)
        split_vertices, split_faces, sources = _split_borders(self._vertices, self._faces, _halves(is_origin))
        solver = PyGeodesicAlgorithmExact(split_vertices, split_faces)
        self._distance = solver.geodesicDistances(sources, None)[0][: len(self._vertices)]

    def errors_at(self, places: Places) -> np.ndarray:
        """Difference (M,) from the exact distance at the places that are off the ridges."""
        n_faces = len(self._faces) // 4
        weights = places.barycentric
        corner = weights.argmax(1)
        rows = np.arange(len(weights))
        in_corner = weights[rows, corner] >= 0.5
        face = places.face + n_faces * np.where(in_corner, corner, 3)
        # In the quarter at corner k the weights are 2 w - 1 at k and 2 w at the others; the
        # middle quarter has its corner k across from corner k of the whole.
        finer = np.where(in_corner[:, None], 2 * weights, 1 - 2 * weights)
        finer[rows[in_corner], corner[in_corner]] -= 1
        found = (self._distance[self._faces[face]] * finer).sum(1)
        return np.abs(found - places.distance)[self._slopes()[face] > SMOOTH_SLOPE]

    def _slopes(self) -> np.ndarray:
        """How fast the distance rises in each face."""
        a, b, c = (self._vertices[self._faces[:, k]] for k in range(3))
        p, q, r = (self._distance[self._faces[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        twice_area = np.linalg.norm(normal, axis=1)
        rise = np.cross(normal, a - c) * (q - p)[:, None] + np.cross(normal, b - a) * (r - p)[:, None]
        return np.linalg.norm(rise, axis=1) / twice_area**2


def _halve_edges(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Four faces for each: those at corners 0, 1 and 2 of all faces, then the middle ones."""
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    ends, edge = np.unique(np.sort(np.c_[tail, head], axis=1), axis=0, return_inverse=True)
    ab, bc, ca = (edge.reshape(-1, 3) + len(vertices)).T
    a, b, c = faces.T
    parts = [np.c_[a, ab, ca], np.c_[ab, b, bc], np.c_[ca, bc, c], np.c_[bc, ca, ab]]
    return np.concatenate([vertices, vertices[ends].mean(1)]), np.concatenate(parts)


def _halves(flags: np.ndarray) -> np.ndarray:
    """Flags of halfedges handed on to their halves, in the order of `_halve_edges`."""
    ab, bc, ca = flags.reshape(-1, 3).T
    no = np.zeros(len(ab), bool)
    return np.concatenate([np.c_[ab, no, ca], np.c_[ab, bc, no], np.c_[no, bc, ca], np.c_[no, no, no]]).ravel()


def _split_borders(
    vertices: np.ndarray, faces: np.ndarray, is_origin: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cut faces at origins on the border into fans; the origins' vertices and the new points are the sources."""
    n = len(vertices)
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    border = np.flatnonzero(is_origin & ~np.isin(head * n + tail, tail * n + head))
    # A face with two sides on the border has one of them split.
    face, first = np.unique(border // 3, return_index=True)
    side = border[first]
    a, b, apex = tail[side], head[side], faces.ravel()[3 * face + (side % 3 + 2) % 3]
    part = np.arange(1, PARTS) / PARTS
    extra = vertices[a][:, None] * (1 - part)[:, None] + vertices[b][:, None] * part[:, None]
    row = np.c_[a, n + np.arange(extra.shape[0] * extra.shape[1]).reshape(len(side), -1), b]
    fans = np.stack([row[:, :-1], row[:, 1:], np.broadcast_to(apex[:, None], (len(side), PARTS))], axis=2)
    kept = np.delete(faces, face, axis=0)
    sources = np.unique(np.concatenate([tail[border], head[border], row.ravel()]))
    return np.concatenate([vertices, extra.reshape(-1, 3)]), np.concatenate([kept, fans.reshape(-1, 3)]), sources
