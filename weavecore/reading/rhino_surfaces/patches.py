"""All faces of a Brep as triangulated patches side by side, which share vertices by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.nurbs import surface_points
from weavecore.reading.rhino_surfaces.borders import EdgeVertices
from weavecore.reading.rhino_surfaces.filling import FREE, FacePatch
from weavecore.reading.rhino_surfaces.grids import FaceGrid
from weavecore.reading.rhino_surfaces.shape import FaceShape


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
