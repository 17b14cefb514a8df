"""All faces of a Brep as triangulated patches side by side: relaxed together, then welded by name."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.nurbs import NurbsSurface, surface_jet, surface_points
from weavecore.geometry.relaxing import flip_edges, take_back_folds, wanted_shift
from weavecore.reading.rhino_surfaces.borders import EdgeVertices
from weavecore.reading.rhino_surfaces.filling import FacePatch
from weavecore.reading.rhino_surfaces.grids import FaceGrid, lookup
from weavecore.reading.rhino_surfaces.shape import FaceShape

_ROUNDS = 6
_STEP = 0.8
_MOST_SPLITS = 8


@dataclass(frozen=True, eq=False)
class Patches:
    """Patches end to end.

    ``uv`` (N, 2) are parameters, ``plane`` (N, 2) chart coordinates, ``points`` (N, 3) positions, ``names``
    (N,) the vertex of the whole that each is, ``owner`` (N,) the Brep face that each lies in, ``inner``
    (N,) whether it may move, ``faces`` (F, 3) triangles.
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
    inner = names < 0
    names[inner] = len(vertices.points) + np.arange(inner.sum())
    points = np.zeros((len(names), 3))
    points[~inner] = vertices.points[names[~inner]]
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
    )


def relaxed(patches: Patches, tell: Callable[[float, str], None]) -> Patches:
    """Flip edges and shift inner vertices until the triangles are well shaped."""
    patches = _flipped(patches)
    for k in range(_ROUNDS):
        tell(0.7 + 0.25 * k / _ROUNDS, "Shaping triangles")
        patches = _flipped(_shifted(patches))
    return patches


def _flipped(p: Patches) -> Patches:
    return replace(p, faces=flip_edges(p.faces, p.plane, p.points, p.names))


def _by_owner(p: Patches, which: Ints) -> list[tuple[int, Ints]]:
    """The points ``which`` grouped by the face that they lie in."""
    order = which[np.argsort(p.owner[which], kind="stable")]
    owners, first = np.unique(p.owner[order], return_index=True)
    return list(zip(owners.tolist(), np.split(order, first[1:])))


def _shifted(p: Patches) -> Patches:
    wanted = np.zeros(len(p.uv))
    groups = _by_owner(p, np.arange(len(p.uv)))
    for face, index in groups:
        wanted[index] = lookup(p.grids[face], p.sizes[face], p.uv[index])
    shift = _STEP * wanted_shift(p.faces, p.points, wanted)
    uv, plane = p.uv.copy(), p.plane.copy()
    free = _by_owner(p, np.flatnonzero(p.inner))
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


def welded(patches: Patches) -> tuple[Floats, Ints]:
    """Vertices and faces of one mesh: points of one name become one vertex, collapsed triangles go."""
    for _ in range(_MOST_SPLITS):
        doubled = _doubled_edges(patches)
        if len(doubled) == 0:
            break
        patches = _split(patches, doubled)
    turned = np.array([face.is_reversed for face in patches.surfaces])[patches.owner[patches.faces[:, 0]]]
    named = patches.names[patches.faces]
    named[turned] = named[turned][:, [0, 2, 1]]
    named = named[~_collapsed(named)]
    used, faces = np.unique(named, return_inverse=True)
    place = np.zeros((int(patches.names.max()) + 1, 3))
    place[patches.names] = patches.points
    return place[used], faces.reshape(-1, 3)


def _collapsed(named: Ints) -> Bools:
    a, b, c = named.T
    collapsed: Bools = (a == b) | (b == c) | (c == a)
    return collapsed


def _doubled_edges(p: Patches) -> Ints:
    """Inner edges (K, 2) of patches that join two vertices which another edge joins as well.

    An edge inside one patch whose two ends lie on its border can be an edge of another patch too.
    """
    faces = p.faces[~_collapsed(p.names[p.faces])]
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    local, times = np.unique(sides, axis=0, return_counts=True)
    named = np.sort(p.names[local], axis=1)
    _, group, joins = np.unique(named, axis=0, return_inverse=True, return_counts=True)
    total = np.bincount(group.ravel(), times)[group.ravel()]
    return local[(times == 2) & ((joins[group.ravel()] > 1) | (total > 2))]


def _split(p: Patches, edges: Ints) -> Patches:
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
    for face, index in _by_owner(fresh, np.arange(len(p.uv), len(fresh.uv))):
        fresh.plane[index] = p.grids[face].to_chart(fresh.uv[index])
        fresh.points[index] = surface_points(p.surfaces[face].surface, fresh.uv[index])
    return fresh
