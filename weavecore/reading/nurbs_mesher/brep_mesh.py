"""A Brep as one welded triangle mesh."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.nurbs_mesher.brep_patches import (
    Patches,
    border_gap,
    chord_error,
    collapsed,
    join_patches,
    relaxed,
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
_MOST_GAP = 10.0


def _quiet(_share: float, _label: str) -> None:
    """Tell nobody."""


def mesh_brep(
    shape: BrepShape,
    *,
    wanted: Fineness = DEFAULT_FINENESS,
    tolerance: float | None = None,
    progress: Progress | None = None,
) -> MeshedObject:
    """Mesh all faces of a Brep; see `mesh_object`."""
    tell = progress or _quiet
    paths = [edge_path(curve) for curve in shape.edges]
    grids = []
    for i, face in enumerate(shape.faces):
        tell(0.3 * i / len(shape.faces), "Measuring faces")
        grids.append(face_grid(face))
    limits = size_limits(grids, paths, wanted)
    closed = (shape.edge_vertices[:, 0] == shape.edge_vertices[:, 1]).tolist()
    sizes, along = graded_sizes(grids, paths, closed, limits)
    least = least_segments(shape).tolist()
    lengths = divide_at_creases(shape, grids, [divide_path(*row) for row in zip(paths, along, least)])
    vertices = number_vertices(shape, paths, lengths)
    patches, vertices = _fill_all(shape, paths, grids, sizes, vertices, tell)
    joined = relaxed(join_patches(shape.faces, grids, sizes, patches, vertices), limits.chord, tell)
    meshed = welded(joined)
    gap, where = border_gap(joined)
    notes = []
    if gap > max(_MOST_GAP * (tolerance or 0.0), limits.chord):
        notes.append(f"Face {where} lies up to {gap:.3g} from the edges that bound it.")
    return MeshedObject(*meshed, loops_of_edges(shape), chord_error(joined), tuple(notes))


def _fill_all(
    shape: BrepShape,
    paths: Sequence[EdgePath],
    grids: Sequence[FaceGrid],
    sizes: Sequence[Floats],
    vertices: EdgeVertices,
    tell: Progress,
) -> tuple[list[FacePatch], EdgeVertices]:
    """Triangulate the faces; where border segments cross, halve them in all faces and try again."""
    patches: dict[int, FacePatch] = {}
    borders: dict[int, FaceBorder] = {}
    stale, filled = set(range(len(shape.faces))), set[int]()
    for _ in range(_MOST_BISECTIONS):
        for i in sorted(stale):
            filled.add(i)
            tell(0.3 + 0.4 * len(filled) / len(shape.faces), "Filling faces")
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
        renumbered = set(range(len(shape.faces))) - stale
        for i in renumbered:
            border = face_border(shape.faces[i], vertices)
            old = patches[i]
            names = np.concatenate([border.names, old.names[len(border.names) :]])
            patches[i] = replace(old, names=names)
    raise Degenerate(
        "Faces whose trims cross each other",
        remedy="Rebuild their edges in Rhino, or give a smaller edge target.",
        ids=failed,
        kind="face",
    )


def loops_of_edges(shape: BrepShape) -> int:
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


# ----------------------------------------------------------------------
# Patches welded by name into one mesh, without doubled edges.

_MOST_SPLITS = 8


def welded(patches: Patches) -> tuple[Floats, Ints]:
    """Vertices and faces of one mesh: points of one name become one vertex, collapsed triangles go."""
    for _ in range(_MOST_SPLITS):
        doubled = _doubled_edges(patches)
        if len(doubled) == 0:
            break
        patches = split_edges(patches, doubled)
    turned = np.array([face.is_reversed for face in patches.surfaces])[patches.owner[patches.faces[:, 0]]]
    named = patches.names[patches.faces]
    named[turned] = named[turned][:, [0, 2, 1]]
    named = named[~collapsed(named)]
    used, faces = np.unique(named, return_inverse=True)
    place = np.zeros((int(patches.names.max()) + 1, 3))
    place[patches.names] = patches.points
    return place[used], faces.reshape(-1, 3)


def _doubled_edges(p: Patches) -> Ints:
    """Inner edges (K, 2) of patches that join two vertices which another edge joins as well.

    An edge inside one patch whose two ends lie on its border can be an edge of another patch too.
    """
    faces = p.faces[~collapsed(p.names[p.faces])]
    sides = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    local, times = np.unique(sides, axis=0, return_counts=True)
    named = np.sort(p.names[local], axis=1)
    _, group, joins = np.unique(named, axis=0, return_inverse=True, return_counts=True)
    total = np.bincount(group.ravel(), times)[group.ravel()]
    doubled: Ints = local[(times == 2) & ((joins[group.ravel()] > 1) | (total > 2))]
    return doubled
