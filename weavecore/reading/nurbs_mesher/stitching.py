"""Meshes stitched along borders that coincide, whatever they were made from.

The borders of two meshes seldom have the same vertices.  Vertices that are each other's nearest are welded; those
that lie along a segment of another border are inserted into it, which splits its triangle into a fan::

       ───a───────────b───             ───a───────────b───
       ───p────q──────r───    ──▶       welded: a = p, b = r; the triangle on ab gets q on its side

Neighbours are found with k-d trees: O(n log n) in the border vertices, once for each mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, first_equal_point
from weavecore.reading.nurbs_mesher.meshed_object import MeshedObject
from weavecore.reading.orientation import pair_edges, unify_orientation

_MOST_SHIFT = 0.3
"""Welding moves a vertex by less than this part of its shortest border segment, so that no triangle flips."""

_NEAREST = 8
"""Candidates for the nearest vertex or segment: more than the vertices of one mesh that can be nearer to a vertex
than its counterpart."""


def join_meshes(meshes: Sequence[MeshedObject], *, tolerance: float) -> MeshedObject:
    """Join meshes along borders that coincide.

    Parameters
    ----------
    meshes : sequence of MeshedObject
    tolerance : float
        How far apart borders may lie, in addition to the meshes' chord errors.

    Returns
    -------
    MeshedObject
        Oriented alike; its border may have fewer vertices than the meshes' had.  ``n_borders_expected``
        is None: it depends on what was joined.

    Raises
    ------
    NotOrientable
    """
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes])
    vertices = np.concatenate([m.vertices for m in meshes])
    faces = np.concatenate([m.faces + start for m, start in zip(meshes, starts)])
    mesh_of_vertex = np.repeat(np.arange(len(meshes)), [len(m.vertices) for m in meshes])
    tolerance = tolerance + 2 * max(m.chord_error for m in meshes)
    faces = _weld_borders(vertices, faces, mesh_of_vertex, tolerance)
    mesh_of_face = np.repeat(np.arange(len(meshes)), [len(m.faces) for m in meshes])
    faces = _insert_in_borders(vertices, faces, mesh_of_face, tolerance)
    used, named = np.unique(faces, return_inverse=True)
    vertices, faces = vertices[used], named.reshape(-1, 3)
    weld = first_equal_point(vertices)
    partner, _ = pair_edges(faces, weld)
    faces = unify_orientation(vertices, faces, weld, partner, np.arange(len(faces))).apply(faces)
    notes = dict.fromkeys(note for m in meshes for note in m.notes)
    return MeshedObject(vertices, faces, None, max(m.chord_error for m in meshes), tuple(notes))


def split_components(meshes: Sequence[MeshedObject]) -> list[MeshedObject]:
    """Connected components of meshes, each as a mesh.

    Parameters
    ----------
    meshes : sequence of MeshedObject

    Returns
    -------
    list of MeshedObject
    """
    parts = []
    for mesh in meshes:
        key = _side_keys(mesh.faces)
        order = np.argsort(key, kind="stable")
        same = np.flatnonzero(key[order][1:] == key[order][:-1])
        f, g, n = order[same] // 3, order[same + 1] // 3, len(mesh.faces)
        count, label = connected_components(coo_matrix((np.ones(len(f), bool), (f, g)), shape=(n, n)), directed=False)
        for k in range(count):
            used, named = np.unique(mesh.faces[label == k], return_inverse=True)
            parts.append(replace(mesh, vertices=mesh.vertices[used], faces=named.reshape(-1, 3)))
    return parts


def _side_keys(faces: Ints) -> Ints:
    """A number for each side (3F,) that is the same whichever way the side runs."""
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    keys: Ints = np.minimum(tail, head) * np.int64(faces.max() + 1) + np.maximum(tail, head)
    return keys


def _border_sides(faces: Ints) -> tuple[Ints, Ints]:
    """Tail and head (B, 2) of the sides with a single face, and their numbers 3 · face + corner (B,)."""
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    _, index, times = np.unique(_side_keys(faces), return_index=True, return_counts=True)
    alone = np.sort(index[times == 1])
    return np.column_stack([tail[alone], head[alone]]), alone


def _weld_borders(vertices: Floats, faces: Ints, mesh_of_vertex: Ints, tolerance: float) -> Ints:
    """The faces with border vertices welded that are each other's nearest in different meshes and within
    tolerance.
    """
    from scipy.spatial import cKDTree

    sides, _ = _border_sides(faces)
    border = np.unique(sides)
    length = np.linalg.norm(vertices[sides[:, 0]] - vertices[sides[:, 1]], axis=1)
    least = np.full(len(vertices), np.inf)
    np.minimum.at(least, sides.ravel(), np.repeat(length, 2))
    near_line = _near_other_borders(vertices, sides, border, mesh_of_vertex, tolerance)
    border = border[near_line]
    if len(border) < 2:
        return faces
    k = min(_NEAREST, len(border))
    found, near = cKDTree(vertices[border]).query(vertices[border], k=k)
    a, b, distance = np.repeat(border, k), border[np.ravel(near)], np.ravel(found)
    close = (mesh_of_vertex[a] != mesh_of_vertex[b]) & (distance <= _MOST_SHIFT * np.minimum(least[a], least[b]))
    a, b, distance = a[close], b[close], distance[close]
    best = np.full(len(vertices), np.inf)
    np.minimum.at(best, a, distance)
    mutual = (distance <= best[a]) & (distance <= best[b])
    links = coo_matrix((np.ones(mutual.sum()), (a[mutual], b[mutual])), shape=(len(vertices), len(vertices)))
    _, label = connected_components(links, directed=False)
    _, first = np.unique(label, return_index=True)
    welded: Ints = first[label][faces]
    return welded


def _near_other_borders(vertices: Floats, sides: Ints, border: Ints, mesh_of_vertex: Ints, tolerance: float) -> Bools:
    """Which border vertices lie on a border segment of another mesh."""
    found = np.zeros(len(border), bool)
    owner = mesh_of_vertex[sides[:, 0]]
    for k in np.unique(mesh_of_vertex[border]).tolist():
        own, others = mesh_of_vertex[border] == k, owner != k
        if others.any():
            _, distance, _ = _nearest_side(vertices, sides[others], border[own])
            found[own] = distance <= tolerance
    return found


def _nearest_side(vertices: Floats, sides: Ints, which: Ints) -> tuple[Ints, Floats, Floats]:
    """The nearest segment to each vertex in ``which``, the distance, and where along the segment the vertex lies (0
    to 1).
    """
    from scipy.spatial import cKDTree

    tail, head = vertices[sides[:, 0]], vertices[sides[:, 1]]
    middle = (tail + head) / 2
    k = min(_NEAREST, len(sides))
    _, near = cKDTree(middle).query(vertices[which], k=k)
    near = near.reshape(len(which), k)
    along = head[near] - tail[near]
    t = np.einsum("vkx,vkx->vk", vertices[which][:, None] - tail[near], along)
    t = np.clip(t / np.maximum(np.einsum("vkx,vkx->vk", along, along), 1e-300), 0.0, 1.0)
    apart = np.linalg.norm(tail[near] + t[..., None] * along - vertices[which][:, None], axis=2)
    best = apart.argmin(1)
    row = np.arange(len(which))
    return near[row, best], apart[row, best], t[row, best]


def _insert_in_borders(vertices: Floats, faces: Ints, mesh_of_face: Ints, tolerance: float) -> Ints:
    """The faces with border vertices inserted into the segments of other borders that they lie on."""
    sides, number = _border_sides(faces)
    mesh_of_side = mesh_of_face[number // 3]
    rows: list[tuple[int, float, int]] = []
    for k in np.unique(mesh_of_side).tolist():
        others = mesh_of_side != k
        own = np.setdiff1d(sides[~others], sides[others])
        if not others.any() or len(own) == 0:
            continue
        nearest, distance, t = _nearest_side(vertices, sides[others], own)
        hit = (distance <= tolerance) & (t > 0) & (t < 1)
        which = number[others][nearest[hit]]
        rows += zip(which.tolist(), t[hit].tolist(), own[hit].tolist())
    by_face: dict[int, tuple[list[int], list[int], list[int]]] = {}
    for side, _, vertex in sorted(rows):
        by_face.setdefault(side // 3, ([], [], []))[side % 3].append(vertex)
    fresh = [fan for face, inserted in by_face.items() for fan in fan_with_inserted(faces[face].tolist(), inserted)]
    kept = np.delete(faces, sorted(by_face), axis=0)
    return np.concatenate([kept, np.array(fresh, np.int64).reshape(-1, 3)])


def fan_with_inserted(corners: Sequence[int], inserted: Sequence[list[int]]) -> list[tuple[int, int, int]]:
    """Triangles of a triangle (a, b, c) with vertices inserted into its sides ab, bc and ca.

    Parameters
    ----------
    corners : three int
    inserted : three lists of int
        In the order of the sides.

    Returns
    -------
    list of (int, int, int)
    """
    (a, b, c), (ab, bc, ca) = corners, inserted
    if ab:
        row = [*ab, b]
        between = [(p, q, c) for p, q in zip(row[:-2], row[1:-1])]
        return [
            *fan_with_inserted((a, row[0], c), ([], [], ca)),
            *between,
            *fan_with_inserted((row[-2], b, c), ([], bc, [])),
        ]
    if bc:
        return fan_with_inserted((b, c, a), (bc, ca, ab))
    if ca:
        return fan_with_inserted((c, a, b), (ca, ab, bc))
    return [(a, b, c)]
