"""All faces of a Brep as triangulated patches side by side, which share vertices by name."""

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
from weavecore.reading.nurbs_mesher.face_grid import FaceGrid, lookup


@dataclass(frozen=True, eq=False)
class Patches:
    """Patches end to end.

    ``uv`` (N, 2) are parameters, ``plane`` (N, 2) chart coordinates, ``points`` (N, 3) positions, ``names``
    (N,) the vertex of the whole that each is, ``owner`` (N,) the Brep face that each lies in, ``inner``
    (N,) whether it may move, ``faces`` (F, 3) triangles, ``creases`` (K, 2) inner edges that must stay.
    """

    surfaces: tuple[FaceShape, ...]
    grids: tuple[FaceGrid, ...]
    sizes: tuple[Floats, ...]
    uv: Floats
    plane: Floats
    points: Floats
    names: Ints
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
    """Lay the patches side by side and name their inner points."""
    counts = np.array([len(p.uv) for p in patches])
    starts = np.concatenate([[0], np.cumsum(counts)])
    names = np.concatenate([p.names for p in patches])
    inner, fresh = names == FREE, names < 0
    names[fresh] = len(vertices.points) + np.arange(fresh.sum())
    points = np.zeros((len(names), 3))
    points[~fresh] = vertices.points[names[~fresh]]
    for p, face, start in zip(patches, surfaces, starts.tolist()):
        free = np.flatnonzero(p.names < 0)
        points[start + free] = surface_points(face.surface, p.uv[free])
    return Patches(
        surfaces=tuple(surfaces),
        grids=tuple(grids),
        sizes=tuple(sizes),
        uv=np.concatenate([p.uv for p in patches]),
        plane=np.concatenate([g.to_chart(p.uv) for p, g in zip(patches, grids)]),
        points=points,
        names=names,
        owner=np.repeat(np.arange(len(patches)), counts),
        inner=inner,
        faces=np.concatenate([p.faces + start for p, start in zip(patches, starts.tolist())]),
        creases=np.concatenate([p.creases + start for p, start in zip(patches, starts.tolist())]),
    )


def by_owner(owner: Ints, which: Ints) -> list[tuple[int, Ints]]:
    """What ``which`` (K,) names, grouped by its owner (K,)."""
    order = np.argsort(owner, kind="stable")
    owners, first = np.unique(owner[order], return_index=True)
    return list(zip(owners.tolist(), np.split(which[order], first[1:])))


def collapsed(named: Ints) -> Bools:
    """Which triangles (F, 3), given by names, have a vertex twice."""
    a, b, c = named.T
    twice: Bools = (a == b) | (b == c) | (c == a)
    return twice


def split_edges(p: Patches, edges: Ints) -> Patches:
    """Halve inner edges, each with the two triangles beside it, at new inner points."""
    n = np.int64(len(p.uv))
    wanted = edges[:, 0] * n + edges[:, 1]
    tail, head = p.faces.ravel(), p.faces[:, [1, 2, 0]].ravel()
    key = np.minimum(tail, head) * n + np.maximum(tail, head)
    hit = np.isin(key, wanted)
    # One edge a face and round: the others follow in the next round.
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
        names=np.concatenate([p.names, p.names.max() + 1 + np.arange(len(both))]),
        inner=np.concatenate([p.inner, np.ones(len(both), bool)]),
        faces=np.concatenate([faces, np.column_stack([middle, b, c])]),
        plane=np.concatenate([p.plane, np.zeros((len(both), 2))]),
        points=np.concatenate([p.points, np.zeros((len(both), 3))]),
    )
    for face, index in by_owner(owner, np.arange(len(p.uv), len(fresh.uv))):
        fresh.plane[index] = p.grids[face].to_chart(fresh.uv[index])
        fresh.points[index] = surface_points(p.surfaces[face].surface, fresh.uv[index])
    return fresh


# ----------------------------------------------------------------------
# Patches brought into shape: edges flipped, inner vertices shifted, edges that are too long halved.

_ROUNDS = 6
_ROUNDS_AFTER_SPLIT = 2
_MOST_SPLITS = 8
_STEP = 0.8
_TOO_LONG = 1.45
_RISE = 0.75
"""What the surface may rise over an edge, in chord errors: over a triangle's middle it is a third more."""


def relaxed(patches: Patches, chord: float, tell: Callable[[float, str], None]) -> Patches:
    """Flip edges and shift inner vertices until the triangles are well shaped and keep the chord error."""
    patches = _in_rounds(patches, _ROUNDS)
    for k in range(_MOST_SPLITS):
        tell(0.75 + 0.2 * k / _MOST_SPLITS, "Shaping triangles")
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
    edges = edges[(times == 2) & (p.names[edges[:, 0]] != p.names[edges[:, 1]])]
    n = np.int64(len(p.uv))
    held = np.sort(p.creases, axis=1)
    edges = edges[~np.isin(edges[:, 0] * n + edges[:, 1], held[:, 0] * n + held[:, 1])]
    a, b = edges.T
    length = np.linalg.norm(p.points[a] - p.points[b], axis=1)
    wanted = _wanted_sizes(p)
    long = length > _TOO_LONG * (wanted[a] + wanted[b]) / 2
    # At a singular side the parameters of the two ends are far apart and their mean says nothing.
    inner = np.flatnonzero(p.inner[a] | p.inner[b])
    for face, which in by_owner(p.owner[a[inner]], inner):
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
    for face, index in by_owner(p.owner, np.arange(len(p.uv))):
        wanted[index] = lookup(p.grids[face], p.sizes[face], p.uv[index])
    return wanted


def _flipped(p: Patches) -> Patches:
    return replace(p, faces=flip_edges(p.faces, p.plane, p.points, p.names, p.creases))


def _shifted(p: Patches) -> Patches:
    shift = _STEP * wanted_shift(p.faces, p.points, _wanted_sizes(p))
    uv, plane = p.uv.copy(), p.plane.copy()
    free = by_owner(p.owner[p.inner], np.flatnonzero(p.inner))
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


# ----------------------------------------------------------------------
# How far a mesh lies from the surface that it stands for.


def chord_error(patches: Patches) -> float:
    """The greatest distance between triangles and surface, measured in their middles and those of their edges.

    It is measured along the surface's normal, at the mean of the corners' parameters.  Triangles at
    a side that is a single point are left out: their parameters say nothing.
    """
    weights = np.array([[1, 1, 1], [1.5, 1.5, 0], [0, 1.5, 1.5], [1.5, 0, 1.5]]) / 3
    worst = 0.0
    whole = ~_at_singular(patches)
    owner = patches.owner[patches.faces[:, 0]]
    for i, face in enumerate(patches.surfaces):
        corners = patches.faces[(owner == i) & whole]
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
    singular = np.zeros(int(patches.names.max()) + 1, bool)
    for face in patches.surfaces:
        for trim in (t for loop in face.loops for t in loop if t.edge == NO_EDGE):
            singular[trim.vertices[0]] = True
    at: Bools = np.any(singular[patches.names[patches.faces]], axis=1)
    return at


def border_gap(patches: Patches) -> tuple[float, int]:
    """How far the edges lie from the faces that they bound, at the mesh's vertices, and the face where most."""
    worst, where = 0.0, 0
    along = _border_directions(patches)
    for i, face in enumerate(patches.surfaces):
        border = np.flatnonzero((patches.owner == i) & ~patches.inner)
        lifted = surface_points(face.surface, patches.uv[border])
        apart = lifted - patches.points[border]
        # A vertex may be a little further along the trim than along the edge: that is no gap.
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
