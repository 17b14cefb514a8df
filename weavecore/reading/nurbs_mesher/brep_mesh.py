"""A Brep as one welded triangle mesh.

1. Measure each face at a grid of parameters and each edge by arc length (`face_grid`, `edge_paths`).
2. Derive the wanted edge length everywhere from curvature, features and limits (`sizing`).
3. Divide each edge once, in space, and number its vertices; the faces on it find them on their own trims, so
   that they are shared without a tolerance (`edge_paths`, `creases`, `face_borders`).
4. Fill each face with points and triangulate it in its chart (`face_fill`); where border segments cross, bisect
   them in all faces and repeat.
5. Flip edges, shift interior vertices and split long edges (`brep_patches`).
6. Weld the patches by vertex ids, and drop the triangles that collapse at singular sides.

O(n log n) in the triangles.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Floats, Ints
from weavecore.model import Note
from weavecore.reading.nurbs_mesher.brep_patches import (
    Patches,
    border_gap,
    chord_error,
    is_collapsed,
    join_patches,
    relax_patches,
    split_edges,
)
from weavecore.reading.nurbs_mesher.brep_shape import NO_EDGE, BrepShape
from weavecore.reading.nurbs_mesher.creases import divide_at_creases
from weavecore.reading.nurbs_mesher.edge_paths import EdgePath, divide_path, edge_path, least_segments
from weavecore.reading.nurbs_mesher.face_borders import (
    EdgeVertices,
    FaceBorder,
    bisect_segments,
    face_border,
    number_vertices,
)
from weavecore.reading.nurbs_mesher.face_fill import FacePatch, fill_face
from weavecore.reading.nurbs_mesher.face_grid import FaceGrid, face_grid
from weavecore.reading.nurbs_mesher.meshed_object import MeshedObject
from weavecore.reading.nurbs_mesher.sizing import DEFAULT_FINENESS, Fineness, graded_sizes, size_limits

Progress = Callable[[float, str], None]
_MOST_BISECTIONS = 10
"""Rounds of bisecting border segments that cross: each makes the distance between trim and chord
four times less, so ten leave a millionth of it."""

_MOST_GAP = 10.0
"""Gaps between edges and faces up to so many tolerances are not reported: modellers often leave a few."""


_MOST_SPLITS = 8
"""Rounds of splitting doubled edges; each splits one edge of a triangle, and later rounds only what the earlier
ones left."""


def _no_progress(_fraction: float, _label: str) -> None:
    """Stands for a missing callback."""


def mesh_brep(
    shape: BrepShape,
    *,
    fineness: Fineness = DEFAULT_FINENESS,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> MeshedObject:
    """Mesh all faces of a Brep.

    Parameters
    ----------
    shape : BrepShape
    fineness : Fineness
    tolerance : float, optional
        The model's absolute tolerance, for reporting gaps.
    progress : callable, optional
        Called with a fraction and a label; may raise to cancel.

    Returns
    -------
    MeshedObject

    Raises
    ------
    Degenerate, TooMuchWork
    """
    progress = progress or _no_progress
    paths = [edge_path(curve) for curve in shape.edges]
    grids = []
    for i, face in enumerate(shape.faces):
        progress(0.3 * i / len(shape.faces), "Measuring faces")
        grids.append(face_grid(face))
    limits = size_limits(grids, paths, fineness)
    closed = (shape.edge_vertices[:, 0] == shape.edge_vertices[:, 1]).tolist()
    sizes, along = graded_sizes(grids, paths, closed, limits)
    least = least_segments(shape).tolist()
    lengths = divide_at_creases(shape, grids, [divide_path(*row) for row in zip(paths, along, least)])
    vertices = number_vertices(shape, paths, lengths)
    patches, vertices = _fill_all(shape, paths, grids, sizes, vertices, progress)
    joined = relax_patches(join_patches(shape.faces, grids, sizes, patches, vertices), limits.chord, progress)
    meshed = welded(joined)
    gap, where = border_gap(joined)
    notes = []
    if gap > max(_MOST_GAP * (tolerance or 0.0), limits.chord):
        text = f"Face {where} lies up to {gap:.3g} from the edges that bound it."
        notes.append(Note("GAP", text, {"face": where, "gap": gap}))
    return MeshedObject(*meshed, _count_border_loops(shape), chord_error(joined), tuple(notes))


def _fill_all(
    shape: BrepShape,
    paths: Sequence[EdgePath],
    grids: Sequence[FaceGrid],
    sizes: Sequence[Floats],
    vertices: EdgeVertices,
    progress: Progress,
) -> tuple[list[FacePatch], EdgeVertices]:
    """Triangulate the faces; where border segments cross, bisect them in all faces and repeat."""
    patches: dict[int, FacePatch] = {}
    borders: dict[int, FaceBorder] = {}
    stale, filled = set(range(len(shape.faces))), set[int]()
    for _ in range(_MOST_BISECTIONS):
        for i in sorted(stale):
            filled.add(i)
            progress(0.3 + 0.4 * len(filled) / len(shape.faces), "Filling faces")
            borders[i] = face_border(shape.faces[i], vertices)
            patches[i] = fill_face(shape.faces[i], grids[i], sizes[i], borders[i])
        failed = [i for i in sorted(stale) if len(patches[i].missing)]
        if not failed:
            return [patches[i] for i in range(len(shape.faces))], vertices
        origin = np.unique(np.concatenate([borders[i].origin[patches[i].missing] for i in failed]), axis=0)
        origin = origin[origin[:, 0] != NO_EDGE]
        if len(origin) == 0:
            break
        vertices = number_vertices(shape, paths, bisect_segments(vertices, origin))
        touched = set(origin[:, 0].tolist())
        stale = {i for i, face in enumerate(shape.faces) if any(t.edge in touched for loop in face.loops for t in loop)}
        others = set(range(len(shape.faces))) - stale
        for i in others:
            border = face_border(shape.faces[i], vertices)
            old = patches[i]
            vertex_ids = np.concatenate([border.vertex_ids, old.vertex_ids[len(border.vertex_ids) :]])
            patches[i] = replace(old, vertex_ids=vertex_ids)
    raise Degenerate(
        "Faces whose trims cross each other",
        remedy="Rebuild their edges in Rhino, or give a smaller edge target.",
        ids=failed,
        kind="face",
    )


def _count_border_loops(shape: BrepShape) -> int:
    """How many loops the edges with a single trim make: the borders that the mesh must have."""
    ends = shape.edge_vertices[shape.edge_trims == 1]
    root: Ints = np.arange(len(shape.vertices))
    for _ in range(len(ends)):
        low = np.minimum(root[ends[:, 0]], root[ends[:, 1]])
        before = root.copy()
        np.minimum.at(root, ends[:, 0], low)
        np.minimum.at(root, ends[:, 1], low)
        if (before == root).all():
            break
    return len(np.unique(root[ends]))


def welded(patches: Patches) -> tuple[Floats, Ints]:
    """Weld patches by vertex ids into one mesh without doubled edges.

    Parameters
    ----------
    patches : Patches

    Returns
    -------
    vertices : (V, 3) float64
    faces : (F, 3) int64
        Without those that collapse because two of their corners are one vertex.
    """
    for _ in range(_MOST_SPLITS):
        doubled = _doubled_edges(patches)
        if len(doubled) == 0:
            break
        patches = split_edges(patches, doubled)
    turned = np.array([face.is_reversed for face in patches.surfaces])[patches.owner[patches.faces[:, 0]]]
    by_id = patches.vertex_ids[patches.faces]
    by_id[turned] = by_id[turned][:, [0, 2, 1]]
    by_id = by_id[~is_collapsed(by_id)]
    used, faces = np.unique(by_id, return_inverse=True)
    place = np.zeros((int(patches.vertex_ids.max()) + 1, 3))
    place[patches.vertex_ids] = patches.points
    return place[used], faces.reshape(-1, 3)


def _doubled_edges(p: Patches) -> Ints:
    """Inner edges (K, 2) of patches that join two vertices which another edge joins as well.

    An edge inside one patch with both ends on its border can be an edge of another patch too.
    """
    faces = p.faces[~is_collapsed(p.vertex_ids[p.faces])]
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    local, times = np.unique(sides, axis=0, return_counts=True)
    by_id = np.sort(p.vertex_ids[local], axis=1)
    _, group, joins = np.unique(by_id, axis=0, return_inverse=True, return_counts=True)
    total = np.bincount(group.ravel(), times)[group.ravel()]
    doubled: Ints = local[(times == 2) & ((joins[group.ravel()] > 1) | (total > 2))]
    return doubled
