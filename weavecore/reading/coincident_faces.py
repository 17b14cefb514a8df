"""Faces that lie on other faces: a sheet that is in the file twice, whatever its diagonals.

A face lies on another sheet if its centroid and three points halfway to its corners do: each is in a face of another
part, with a parallel normal, nearer than the tolerance plus the chord error of a curved surface (height over an edge
times the bend there).  Parts are joined across edges with two faces, but where these name different vertices only if
they are not folded onto each other, so that two sheets with one rim stay two parts.  A part
that lies wholly on others is left out::

      ╱──╲──╱──╲──╱──╲        a                            a
      ╲──╱──╲──╱──╲──╱        b lies on a        ──▶       (b is left out, with the note COINCIDENT)

Candidates are the faces with the nearest centroids: O(n log n) in the faces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, connected
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.reading.orientation import NO_PARTNER, pair_edges, runs_alike

_NEAREST = 24
"""Faces whose centroids are nearest: more than surround a point on two sheets of like fineness."""

_PARALLEL = np.cos(np.radians(15.0))
"""Faces whose normals differ by more do not lie on each other."""

_FOLDED = -np.cos(np.radians(30.0))
"""Faces at an edge that are folded by more may lie on each other: the normals of curved sheets with other diagonals
differ, and a sharp fold that is no double only makes two parts."""

_CHORD = 0.2
"""Part of the height of a face over an edge times the bend there: more than the 1/8 of a sagitta."""

_MOST_BEND = 0.5
"""Radians.  A larger angle between neighbours is a crease, not a curved surface."""

_NARROW = 10
"""Of the tolerance: a narrower face lies within it of its neighbours, and says nothing of a second sheet."""

_SAMPLED = 4000
"""Faces that are looked at first; only where one of them lies on another are all looked at."""


@dataclass(frozen=True, eq=False)
class CoincidentFaces:
    """Which faces lie on others.

    Parameters
    ----------
    left_out : (F,) bool
        Faces of parts that lie wholly on others.
    lies : (F,) bool
        Faces of the other parts that lie on a face that is kept.
    """

    left_out: Bools
    lies: Bools


def find_coincident(vertices: Floats, faces: Ints, weld: Ints, tolerance: float) -> CoincidentFaces:
    """Find faces that lie on other parts.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        With an area.
    weld : (V,) int64
        The least vertex of the place of each vertex.
    tolerance : float

    Returns
    -------
    CoincidentFaces
    """
    nothing = CoincidentFaces(np.zeros(len(faces), bool), np.zeros(len(faces), bool))
    normal, area = _normals(vertices, faces)
    part, partner = _parts(faces, weld, normal)
    if part.max() == 0:
        return nothing
    above, beside = (tolerance + margin for margin in _chord(vertices, faces, normal, area, partner))
    search = _OverlapSearch(vertices, faces, part, normal, above, beside)
    some = np.arange(0, len(faces), max(1, len(faces) // _SAMPLED))
    if not (search.cover(search.samples(some)[:, 0], some) >= 0).any():
        return nothing
    cover = np.stack([search.cover(points, np.arange(len(faces))) for points in search.samples().swapaxes(0, 1)], 1)
    n_parts = int(part.max()) + 1
    is_wide = 2 * area > _NARROW * tolerance * _longest_edges(vertices, faces)
    lies = (cover >= 0).all(1)
    is_out = np.zeros(n_parts, bool)
    whole = (np.bincount(part, ~lies, n_parts) == 0) & (np.bincount(part, is_wide, n_parts) > 0)
    size = np.bincount(part, area, n_parts)
    rows_of_part = np.argsort(part, kind="stable")
    offsets = np.r_[0, np.cumsum(np.bincount(part, minlength=n_parts))]
    for p in sorted(np.flatnonzero(whole).tolist(), key=lambda p: (float(np.float32(size[p])), -p)):
        others = np.unique(part[cover[rows_of_part[offsets[p] : offsets[p + 1]]]])
        is_out[p] = not is_out[others].any()
    left_out = is_out[part]
    on_kept = (cover >= 0) & ~left_out[np.maximum(cover, 0)]
    return CoincidentFaces(left_out, on_kept.any(1) & ~left_out & is_wide)


def without_folded_pairs(partner: Ints, faces: Ints, lies: Bools) -> Ints:
    """Partners of halfedges without those that would join two coincident faces that share no vertex index.

    Parameters
    ----------
    partner : (3F,) int64
    faces : (F, 3) int64
    lies : (F,) bool
        Faces that lie on others.

    Returns
    -------
    (3F,) int64
    """
    h = np.flatnonzero(partner != NO_PARTNER)
    apart = h[lies[h // 3] & lies[partner[h] // 3] & ~_shares_vertices(faces, h, partner[h])]
    cleaned = partner.copy()
    cleaned[apart] = NO_PARTNER
    return cleaned


def _shares_vertices(faces: Ints, h: Ints, g: Ints) -> Bools:
    """Whether two halfedges name the same two vertices."""
    (a, b), (c, d) = ([end[k] for end in halfedge_ends(faces)] for k in (h, g))
    same: Bools = ((a == c) & (b == d)) | ((a == d) & (b == c))
    return same


def _normals(vertices: Floats, faces: Ints) -> tuple[Floats, Floats]:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    cross = np.cross(b - a, c - a)
    double = np.linalg.norm(cross, axis=1)
    return cross / np.maximum(double, np.finfo(float).tiny)[:, None], double / 2


def _longest_edges(vertices: Floats, faces: Ints) -> Floats:
    ends = vertices[faces]
    longest: Floats = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2).max(1)
    return longest


def _parts(faces: Ints, weld: Ints, normal: Floats) -> tuple[Ints, Ints]:
    """Part of each face (F,) and partners (3F,), without pairs that are folded onto each other."""
    partner, _ = pair_edges(faces, weld)
    h = np.flatnonzero(partner > np.arange(len(partner)))
    g = partner[h]
    sign = np.where(runs_alike(faces, weld, h, g), -1.0, 1.0)
    flat = sign * np.einsum("ij,ij->i", normal[h // 3], normal[g // 3]) > _FOLDED
    flat |= _shares_vertices(faces, h, g)
    joined = np.full(len(partner), NO_PARTNER, np.int64)
    joined[h[flat]], joined[g[flat]] = g[flat], h[flat]
    return connected(h[flat] // 3, g[flat] // 3, len(faces))[1], joined


def _chord(vertices: Floats, faces: Ints, normal: Floats, area: Floats, partner: Ints) -> tuple[Floats, Floats]:
    """How far (F,) a curved surface may be from the middle of a face, by the bend at its edges, and beside its sides.

    Normals at an edge differ by the bend: a point at height h over it may lie h tan(bend / 2) beside both faces.
    """
    owner = np.arange(len(partner)) // 3
    across = np.where(partner == NO_PARTNER, owner, partner // 3)
    cosine = np.clip(np.abs(np.einsum("ij,ij->i", normal[owner], normal[across])), 0, 1)
    bend = np.arccos(cosine).reshape(-1, 3)
    bend[bend > _MOST_BEND] = 0.0
    ends = vertices[faces]
    length = np.linalg.norm(np.roll(ends, -1, axis=1) - ends, axis=2)
    chord: Floats = (_CHORD * bend * 2 * area[:, None] / length).max(1)
    return chord, chord * np.tan(bend.max(1) / 2)


class _OverlapSearch:
    """Finds the face of another part that a point lies on."""

    def __init__(
        self, vertices: Floats, faces: Ints, part: Ints, normal: Floats, above: Floats, beside: Floats
    ) -> None:
        from scipy.spatial import cKDTree

        self._corners, self._part, self._normal = vertices[faces], part, normal
        self._above, self._beside = above, beside
        self._middle = self._corners.mean(1)
        self._tree = cKDTree(self._middle)
        self._k = min(_NEAREST, len(faces))

    def samples(self, which: Ints | slice = slice(None)) -> Floats:
        """The centroid of each face and three points halfway to its corners, (f, 4, 3)."""
        middle = self._middle[which][:, None]
        return np.concatenate([middle, 0.5 * (middle + self._corners[which])], axis=1)

    def cover(self, points: Floats, owner: Ints) -> Ints:
        """A face (n,) of another part that each point of a face ``owner`` lies on, or -1."""
        found = np.full(len(points), -1, np.int64)
        for begin in range(0, len(points), 20_000):  # bounds the memory of the candidates
            block = slice(begin, begin + 20_000)
            near = self._tree.query(points[block], k=self._k)[1].reshape(-1, self._k)
            own = owner[block][:, None]
            is_other = self._part[near] != self._part[own]
            row, column = np.nonzero(is_other)
            face, mine, point = near[row, column], owner[block][row], points[block][row]
            hit = self._holds(face, mine, point)
            found[begin + row[hit][::-1]] = face[hit][::-1]
        return found

    def _holds(self, face: Ints, mine: Ints, point: Floats) -> Bools:
        normal, corners = self._normal[face], self._corners[face]
        parallel: Bools = np.abs(np.einsum("ij,ij->i", normal, self._normal[mine])) > _PARALLEL
        height = np.abs(np.einsum("ij,ij->i", point - corners[:, 0], normal))
        inside: Bools = parallel & (height <= self._above[face] + self._above[mine])
        beside = self._beside[face] + self._beside[mine]
        for k in range(3):
            along = corners[:, (k + 1) % 3] - corners[:, k]
            depth = np.einsum("ij,ij->i", point - corners[:, k], np.cross(normal, along))
            inside &= depth >= -beside * np.linalg.norm(along, axis=1)
        return inside
