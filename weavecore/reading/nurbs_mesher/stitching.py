"""`join_meshes`: meshes made one along borders that coincide, whatever they came from.

The borders of two meshes seldom have the same vertices.  Those that are near to each other become one; those
that lie along a segment of another border are put into it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, first_equal_point
from weavecore.reading.nurbs_mesher.meshed_object import UNTOLD, MeshedObject
from weavecore.reading.orientation import find_mates, unify_orientation

_MOST_SHIFT = 0.3
_NEAREST = 8


def join_meshes(meshes: Sequence[MeshedObject], *, tolerance: float) -> MeshedObject:
    """Join meshes along borders that coincide.

    Parameters
    ----------
    meshes : sequence of MeshedObject
    tolerance : float
        How far apart borders may lie, beside the meshes' chord errors.

    Returns
    -------
    MeshedObject
        Oriented alike; its border may have fewer vertices than the meshes' had.  ``loops_expected`` is
        `UNTOLD`: it follows from what was joined.

    Raises
    ------
    NotOrientable
    """
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes])
    points = np.concatenate([m.vertices for m in meshes])
    faces = np.concatenate([m.faces + start for m, start in zip(meshes, starts)])
    part = np.repeat(np.arange(len(meshes)), [len(m.vertices) for m in meshes])
    reach = tolerance + 2 * max(m.chord_error for m in meshes)
    faces = _weld_borders(points, faces, part, reach)
    face_part = np.repeat(np.arange(len(meshes)), [len(m.faces) for m in meshes])
    faces = _insert_in_borders(points, faces, face_part, reach)
    used, named = np.unique(faces, return_inverse=True)
    points, faces = points[used], named.reshape(-1, 3)
    place = first_equal_point(points)
    mates, _ = find_mates(faces, place)
    faces = unify_orientation(points, faces, place, mates, np.arange(len(faces))).apply(faces)
    notes = dict.fromkeys(note for m in meshes for note in m.notes)
    return MeshedObject(points, faces, UNTOLD, max(m.chord_error for m in meshes), tuple(notes))


def split_parts(meshes: Sequence[MeshedObject]) -> list[MeshedObject]:
    """The parts of meshes that hang together along edges, each as a mesh of its own."""
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
    """Tail and head (B, 2) of the sides that one face has, and their numbers 3 · face + corner (B,)."""
    tail, head = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    _, index, times = np.unique(_side_keys(faces), return_index=True, return_counts=True)
    alone = np.sort(index[times == 1])
    return np.column_stack([tail[alone], head[alone]]), alone


def _weld_borders(points: Floats, faces: Ints, part: Ints, reach: float) -> Ints:
    """Make one of border vertices of different meshes that are nearest to each other and near."""
    sides, _ = _border_sides(faces)
    border = np.unique(sides)
    length = np.linalg.norm(points[sides[:, 0]] - points[sides[:, 1]], axis=1)
    least = np.full(len(points), np.inf)
    np.minimum.at(least, sides.ravel(), np.repeat(length, 2))
    near_line = _near_other_borders(points, sides, border, part, reach)
    border = border[near_line]
    if len(border) < 2:
        return faces
    k = min(_NEAREST, len(border))
    found, near = cKDTree(points[border]).query(points[border], k=k)
    a, b, distance = np.repeat(border, k), border[np.ravel(near)], np.ravel(found)
    close = (part[a] != part[b]) & (distance <= _MOST_SHIFT * np.minimum(least[a], least[b]))
    a, b, distance = a[close], b[close], distance[close]
    best = np.full(len(points), np.inf)
    np.minimum.at(best, a, distance)
    mutual = (distance <= best[a]) & (distance <= best[b])
    links = coo_matrix((np.ones(mutual.sum()), (a[mutual], b[mutual])), shape=(len(points), len(points)))
    _, label = connected_components(links, directed=False)
    _, first = np.unique(label, return_index=True)
    welded: Ints = first[label][faces]
    return welded


def _near_other_borders(points: Floats, sides: Ints, border: Ints, part: Ints, reach: float) -> Bools:
    """Which border vertices lie on a border segment of another mesh."""
    found = np.zeros(len(border), bool)
    owner = part[sides[:, 0]]
    for k in np.unique(part[border]).tolist():
        mine, others = part[border] == k, owner != k
        if others.any():
            _, distance, _ = _nearest_side(points, sides[others], border[mine])
            found[mine] = distance <= reach
    return found


def _nearest_side(points: Floats, sides: Ints, vertices: Ints) -> tuple[Ints, Floats, Floats]:
    """The nearest segment to each vertex, the distance, and where along the segment the vertex lies (0 to 1)."""
    tail, head = points[sides[:, 0]], points[sides[:, 1]]
    middle = (tail + head) / 2
    k = min(_NEAREST, len(sides))
    _, near = cKDTree(middle).query(points[vertices], k=k)
    near = near.reshape(len(vertices), k)
    along = head[near] - tail[near]
    t = np.einsum("vkx,vkx->vk", points[vertices][:, None] - tail[near], along)
    t = np.clip(t / np.maximum(np.einsum("vkx,vkx->vk", along, along), 1e-300), 0.0, 1.0)
    apart = np.linalg.norm(tail[near] + t[..., None] * along - points[vertices][:, None], axis=2)
    best = apart.argmin(1)
    row = np.arange(len(vertices))
    return near[row, best], apart[row, best], t[row, best]


def _insert_in_borders(points: Floats, faces: Ints, face_part: Ints, reach: float) -> Ints:
    """Put border vertices into the segments of other borders that they lie on."""
    sides, number = _border_sides(faces)
    side_part = face_part[number // 3]
    rows: list[tuple[int, float, int]] = []
    for k in np.unique(side_part).tolist():
        others = side_part != k
        mine = np.setdiff1d(sides[~others], sides[others])
        if not others.any() or len(mine) == 0:
            continue
        nearest, distance, t = _nearest_side(points, sides[others], mine)
        hit = (distance <= reach) & (t > 0) & (t < 1)
        which = number[others][nearest[hit]]
        rows += zip(which.tolist(), t[hit].tolist(), mine[hit].tolist())
    by_face: dict[int, tuple[list[int], list[int], list[int]]] = {}
    for side, _, vertex in sorted(rows):
        by_face.setdefault(side // 3, ([], [], []))[side % 3].append(vertex)
    fresh = [fan for face, put in by_face.items() for fan in _fan(faces[face].tolist(), put)]
    kept = np.delete(faces, sorted(by_face), axis=0)
    return np.concatenate([kept, np.array(fresh, np.int64).reshape(-1, 3)])


def _fan(corners: Sequence[int], put: Sequence[list[int]]) -> list[tuple[int, int, int]]:
    """Triangles of a triangle (a, b, c) with vertices put into its sides ab, bc and ca."""
    (a, b, c), (ab, bc, ca) = corners, put
    if ab:
        row = [*ab, b]
        between = [(p, q, c) for p, q in zip(row[:-2], row[1:-1])]
        return [*_fan((a, row[0], c), ([], [], ca)), *between, *_fan((row[-2], b, c), ([], bc, []))]
    if bc:
        return _fan((b, c, a), (bc, ca, ab))
    if ca:
        return _fan((c, a, b), (ca, ab, bc))
    return [(a, b, c)]
