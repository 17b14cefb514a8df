"""All faces of a Brep as triangulated patches side by side, and their relaxation.

Patches share vertices by *vertex id*: a border vertex has the same id in all patches that it belongs to.  Relaxing
repeats two steps that keep each patch an embedding in its chart::

    flip    edges that are not Delaunay in space                                        (Lawson 1977)
    shift   each free vertex to the centroid of its triangles, weighted by density,
            within the surface: (u, v) moves by the solution of  I · (du, dv) = (S_u · d, S_v · d),
            with the first fundamental form I and the shift d in space                  (Du and Wang 2003)

and then splits edges that are too long, or that the surface leaves by more than the chord error allowed.  Each round
is O(n log n).  The chord error and the gap between edges and faces are measured at the end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.lawson_flips import flip_edges, take_back_folds, wanted_shift
from weavecore.geometry.nurbs import NurbsSurface, surface_jet, surface_points
from weavecore.reading.nurbs_mesher.brep_shape import NO_EDGE, FaceShape
from weavecore.reading.nurbs_mesher.face_borders import EdgeVertices
from weavecore.reading.nurbs_mesher.face_fill import FREE, FacePatch
from weavecore.reading.nurbs_mesher.face_grid import FaceGrid, interpolate_grid

_ROUNDS = 6
"""Rounds of flips and shifts before edges are split; most of the gain comes in the first."""


_ROUNDS_AFTER_SPLIT = 2
"""Rounds after each split, which changes few triangles."""


_MOST_SPLITS = 8
"""Rounds of splits; each halves the edges that are too long."""


_STEP = 0.8
"""Part of the shift that is taken: full steps of all vertices at once may oscillate."""


_TOO_LONG = 1.45
"""Edges longer than this in wanted lengths are split: above √2 the halves are nearer to the wanted length than the
whole."""


_RISE = 0.75
"""Rise of the surface over an edge that is allowed, in chord errors: over a triangle's centre it is a third more."""


@dataclass(frozen=True, eq=False)
class Patches:
    """Patches end to end.

    Parameters
    ----------
    surfaces : tuple of FaceShape
    grids : tuple of FaceGrid
    sizes : tuple of (N, M) float64
        Wanted edge lengths at the grids.
    uv : (N, 2) float64
        Parameters.
    plane : (N, 2) float64
        Chart coordinates.
    points : (N, 3) float64
        Positions in space.
    vertex_ids : (N,) int64
        The vertex of the whole mesh that each point is.
    owner : (N,) int64
        The Brep face in which each point lies.
    inner : (N,) bool
        Whether it may move.
    faces : (F, 3) int64
        Triangles, counter-clockwise in the chart.
    creases : (K, 2) int64
        Inner edges that must stay.
    """

    surfaces: tuple[FaceShape, ...]
    grids: tuple[FaceGrid, ...]
    sizes: tuple[Floats, ...]
    uv: Floats
    plane: Floats
    points: Floats
    vertex_ids: Ints
    owner: Ints
    inner: Bools
    faces: Ints
    creases: Ints


def join_patches(
    surfaces: Sequence[FaceShape],
    grids: Sequence[FaceGrid],
    sizes: Sequence[Floats],
    patches: Sequence[FacePatch],
    vertices: EdgeVertices,
) -> Patches:
    """Put patches end to end and number their inner points.

    Parameters
    ----------
    surfaces : sequence of FaceShape
    grids : sequence of FaceGrid
    sizes : sequence of (N, M) float64
        Wanted edge lengths at the grids.
    patches : sequence of FacePatch
    vertices : EdgeVertices

    Returns
    -------
    Patches
    """
    counts = np.array([len(p.uv) for p in patches])
    starts = np.concatenate([[0], np.cumsum(counts)])
    vertex_ids = np.concatenate([p.vertex_ids for p in patches])
    inner, fresh = vertex_ids == FREE, vertex_ids < 0
    vertex_ids[fresh] = len(vertices.points) + np.arange(fresh.sum())
    points = np.zeros((len(vertex_ids), 3))
    points[~fresh] = vertices.points[vertex_ids[~fresh]]
    for p, face, start in zip(patches, surfaces, starts.tolist()):
        free = np.flatnonzero(p.vertex_ids < 0)
        points[start + free] = surface_points(face.surface, p.uv[free])
    return Patches(
        surfaces=tuple(surfaces),
        grids=tuple(grids),
        sizes=tuple(sizes),
        uv=np.concatenate([p.uv for p in patches]),
        plane=np.concatenate([g.to_chart(p.uv) for p, g in zip(patches, grids)]),
        points=points,
        vertex_ids=vertex_ids,
        owner=np.repeat(np.arange(len(patches)), counts),
        inner=inner,
        faces=np.concatenate([p.faces + start for p, start in zip(patches, starts.tolist())]),
        creases=np.concatenate([p.creases + start for p, start in zip(patches, starts.tolist())]),
    )


def _by_owner(owner: Ints, which: Ints) -> list[tuple[int, Ints]]:
    """The elements of ``which`` (K,) grouped by their owners (K,)."""
    order = np.argsort(owner, kind="stable")
    owners, first = np.unique(owner[order], return_index=True)
    return list(zip(owners.tolist(), np.split(which[order], first[1:])))


def is_collapsed(by_id: Ints) -> Bools:
    """Which triangles have a vertex twice.

    Parameters
    ----------
    by_id : (F, 3) int64
        Corners by vertex ids.

    Returns
    -------
    (F,) bool
    """
    a, b, c = by_id.T
    twice: Bools = (a == b) | (b == c) | (c == a)
    return twice


def split_edges(p: Patches, edges: Ints) -> Patches:
    """Bisect inner edges, each with the two triangles beside it, at new inner points.

    Parameters
    ----------
    p : Patches
    edges : (K, 2) int64
        Points at their ends, the lower first.  Of two in one triangle only one is split.

    Returns
    -------
    Patches
    """
    n = np.int64(len(p.uv))
    wanted = edges[:, 0] * n + edges[:, 1]
    tail, head = p.faces.ravel(), p.faces[:, [1, 2, 0]].ravel()
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    hit = np.isin(key, wanted)
    # One edge a face: the others follow in the next round.
    first = np.full(len(p.faces), -1)
    where = np.flatnonzero(hit)[::-1]
    first[where // 3] = where % 3
    chosen = np.flatnonzero(first >= 0)
    own = key[3 * chosen + first[chosen]]
    both, times = np.unique(own, return_counts=True)
    both = both[times == 2]
    ready = np.isin(own, both)
    chosen, own = chosen[ready], own[ready]
    middle = n + np.searchsorted(both, own)
    k = first[chosen]
    a, b, c = (p.faces[chosen, (k + i) % 3] for i in range(3))
    faces = p.faces.copy()
    faces[chosen] = np.column_stack([a, middle, c])
    ends = np.column_stack([both // n, both % n])
    uv = p.uv[ends].mean(1)
    owner = p.owner[ends[:, 0]]
    fresh = replace(
        p,
        uv=np.concatenate([p.uv, uv]),
        owner=np.concatenate([p.owner, owner]),
        vertex_ids=np.concatenate([p.vertex_ids, p.vertex_ids.max() + 1 + np.arange(len(both))]),
        inner=np.concatenate([p.inner, np.ones(len(both), bool)]),
        faces=np.concatenate([faces, np.column_stack([middle, b, c])]),
        plane=np.concatenate([p.plane, np.zeros((len(both), 2))]),
        points=np.concatenate([p.points, np.zeros((len(both), 3))]),
    )
    for face, index in _by_owner(owner, np.arange(len(p.uv), len(fresh.uv))):
        fresh.plane[index] = p.grids[face].to_chart(fresh.uv[index])
        fresh.points[index] = surface_points(p.surfaces[face].surface, fresh.uv[index])
    return fresh


def relax_patches(patches: Patches, chord: float, progress: Callable[[float, str], None]) -> Patches:
    """Flip edges, shift inner vertices and split long edges until triangles are well shaped and keep the chord error.

    Parameters
    ----------
    patches : Patches
    chord : float
        Chord error allowed.
    progress : callable
        Called with a fraction and a label.

    Returns
    -------
    Patches
    """
    patches = _in_rounds(patches, _ROUNDS)
    for k in range(_MOST_SPLITS):
        progress(0.75 + 0.2 * k / _MOST_SPLITS, "Shaping triangles")
        long = _long_edges(patches, chord)
        if len(long) == 0:
            break
        patches = _in_rounds(split_edges(patches, long), _ROUNDS_AFTER_SPLIT)
    return patches


def _in_rounds(patches: Patches, n: int) -> Patches:
    patches = _flipped(patches)
    for _ in range(n):
        patches = _flipped(_shifted(patches))
    return patches


def _long_edges(p: Patches, chord: float) -> Ints:
    """Inner edges (K, 2) much longer than wanted, or that the surface leaves by more than ``chord``."""
    sides = np.sort(np.concatenate([p.faces[:, [0, 1]], p.faces[:, [1, 2]], p.faces[:, [2, 0]]]), axis=1)
    edges, times = np.unique(sides, axis=0, return_counts=True)
    edges = edges[(times == 2) & (p.vertex_ids[edges[:, 0]] != p.vertex_ids[edges[:, 1]])]
    n = np.int64(len(p.uv))
    held = np.sort(p.creases, axis=1)
    edges = edges[~np.isin(edges[:, 0] * n + edges[:, 1], held[:, 0] * n + held[:, 1])]
    a, b = edges.T
    length = np.linalg.norm(p.points[a] - p.points[b], axis=1)
    wanted = _wanted_sizes(p)
    long = length > _TOO_LONG * (wanted[a] + wanted[b]) / 2
    # At a singular side the parameters of the two ends are far apart, and their mean is not between them.
    inner = np.flatnonzero(p.inner[a] | p.inner[b])
    for face, which in _by_owner(p.owner[a[inner]], inner):
        uv = (p.uv[a[which]] + p.uv[b[which]]) / 2
        jet = surface_jet(p.surfaces[face].surface, uv)
        normal = np.cross(jet.du, jet.dv)
        middle = (p.points[a[which]] + p.points[b[which]]) / 2
        rise = np.abs(np.einsum("ij,ij->i", jet.point - middle, normal))
        long[which] |= rise > _RISE * chord * np.linalg.norm(normal, axis=1)
    too_long: Ints = edges[long]
    return too_long


def _wanted_sizes(p: Patches) -> Floats:
    wanted = np.zeros(len(p.uv))
    for face, index in _by_owner(p.owner, np.arange(len(p.uv))):
        wanted[index] = interpolate_grid(p.grids[face], p.sizes[face], p.uv[index])
    return wanted


def _flipped(p: Patches) -> Patches:
    return replace(p, faces=flip_edges(p.faces, p.plane, p.points, p.vertex_ids, p.creases))


def _shifted(p: Patches) -> Patches:
    shift = _STEP * wanted_shift(p.faces, p.points, _wanted_sizes(p))
    uv, plane = p.uv.copy(), p.plane.copy()
    free = _by_owner(p.owner[p.inner], np.flatnonzero(p.inner))
    for face, index in free:
        uv[index] += _in_parameters(p.surfaces[face].surface, p.uv[index], shift[index])
        plane[index] = p.grids[face].to_chart(uv[index])
    plane = take_back_folds(p.faces, p.plane, plane)
    points = p.points.copy()
    for face, index in free:
        uv[index] = np.where((plane[index] == p.plane[index]).all(1)[:, None], p.uv[index], uv[index])
        points[index] = surface_points(p.surfaces[face].surface, uv[index])
    return replace(p, uv=uv, plane=plane, points=points)


def _in_parameters(surface: NurbsSurface, uv: Floats, shift: Floats) -> Floats:
    """The step (K, 2) in (u, v) that moves a point by the tangential part of a shift in space."""
    jet = surface_jet(surface, uv)
    e, f, g = (np.einsum("ij,ij->i", a, b) for a, b in ((jet.du, jet.du), (jet.du, jet.dv), (jet.dv, jet.dv)))
    a, b = np.einsum("ij,ij->i", jet.du, shift), np.einsum("ij,ij->i", jet.dv, shift)
    det = e * g - f * f
    regular = det > 1e-8 * e * g
    det = np.where(regular, det, 1.0)
    step = np.column_stack([(g * a - f * b) / det, (e * b - f * a) / det])
    return np.where(regular[:, None], step, 0.0)


def chord_error(patches: Patches) -> float:
    """The greatest distance between triangles and surface, at their centres and at the midpoints of their edges.

    It is measured along the surface's normal at the mean of the corners' parameters.  Triangles at a singular side
    are left out: the mean of their parameters is not inside them.

    Parameters
    ----------
    patches : Patches
    """
    weights = np.array([[1, 1, 1], [1.5, 1.5, 0], [0, 1.5, 1.5], [1.5, 0, 1.5]]) / 3
    worst = 0.0
    regular = ~_at_singular(patches)
    owner = patches.owner[patches.faces[:, 0]]
    for i, face in enumerate(patches.surfaces):
        corners = patches.faces[(owner == i) & regular]
        if len(corners) == 0:
            continue
        uv = np.einsum("kc,fcx->kfx", weights, patches.uv[corners]).reshape(-1, 2)
        flat = np.einsum("kc,fcx->kfx", weights, patches.points[corners]).reshape(-1, 3)
        jet = surface_jet(face.surface, uv)
        normal = np.cross(jet.du, jet.dv)
        length = np.linalg.norm(normal, axis=1)
        rise = np.abs(np.einsum("ij,ij->i", jet.point - flat, normal)) / np.maximum(length, 1e-300)
        worst = max(worst, float(rise.max()))
    return worst


def _at_singular(patches: Patches) -> Bools:
    """Faces with a corner whose vertex has several places in the plane of one face, at a singular side."""
    singular = np.zeros(int(patches.vertex_ids.max()) + 1, bool)
    for face in patches.surfaces:
        for trim in (t for loop in face.loops for t in loop if t.edge == NO_EDGE):
            singular[trim.vertices[0]] = True
    at: Bools = np.any(singular[patches.vertex_ids[patches.faces]], axis=1)
    return at


def border_gap(patches: Patches) -> tuple[float, int]:
    """How far the edges lie from the faces that they bound, at the mesh's vertices.

    Parameters
    ----------
    patches : Patches

    Returns
    -------
    gap : float
    face : int
        The face with the greatest gap.
    """
    worst, where = 0.0, 0
    along = _border_directions(patches)
    for i, face in enumerate(patches.surfaces):
        border = np.flatnonzero((patches.owner == i) & ~patches.inner)
        lifted = surface_points(face.surface, patches.uv[border])
        apart = lifted - patches.points[border]
        # A vertex may be a little further along the trim than along the edge: that does not count.
        apart -= np.einsum("ij,ij->i", apart, along[border])[:, None] * along[border]
        gap = float(np.linalg.norm(apart, axis=1).max(initial=0.0))
        if gap > worst:
            worst, where = gap, i
    return worst, where


def _border_directions(patches: Patches) -> Floats:
    """Unit vectors (N, 3) along the border at the border's points; zero elsewhere."""
    tail, head = patches.faces.ravel(), patches.faces[:, [1, 2, 0]].ravel()
    key = np.minimum(tail, head) * np.int64(len(patches.uv)) + np.maximum(tail, head)
    _, index, times = np.unique(key, return_index=True, return_counts=True)
    a, b = tail[index[times == 1]], head[index[times == 1]]
    along = np.zeros_like(patches.points)
    step = patches.points[b] - patches.points[a]
    np.add.at(along, a, step)
    np.add.at(along, b, step)
    directions: Floats = along / np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    return directions
