"""A triangle or quad mesh repaired until it can be woven, or refused with the reason.

Repaired is what does not change the shape, each repair reported in one sentence, in this order:

1. refuse bad numbers, bad indices and coordinates that are too coarse;
2. split quads (`polygon_triangulation`);
3. find vertices in the same place (the *weld map*: the least vertex in each place);
4. drop faces without area (`slivers`) and faces that repeat others;
5. pair edges and orient the faces alike (`orientation`);
6. make one vertex of each fan of faces around a place, which welds and drops unused vertices;
7. cut closed components in two (`closed_surfaces`).

A vertex at which two fans of faces touch is refused if it was one vertex in the input; if the input has several
vertices there, they stay apart.  Sorting makes it O(n log n) in the faces.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from weavecore.errors import BadIndex, Degenerate, NonFinite, NonManifold, TooFarFromOrigin
from weavecore.geometry.arrays import Bools, Floats, Ints, first_equal_point, first_equal_row
from weavecore.model import SurfaceMesh
from weavecore.reading.closed_surfaces import cut_closed_parts
from weavecore.reading.orientation import label_fans, pair_edges, unify_orientation
from weavecore.reading.polygon_triangulation import split_faces
from weavecore.reading.raw import DOUBLE, Plane, RawMesh, counted
from weavecore.reading.slivers import drop_slivers

_LARGEST, _SMALLEST = 1e50, 1e-50
"""Coordinates and extents beyond these overflow or vanish in squared areas and volumes (1e50 to the sixth is
1e300)."""

_COARSEST = 0.01
"""Greatest step between neighbouring coordinates, in median edge lengths: angles are then good to about a
degree."""


def surface_from_arrays(
    vertices: ArrayLike,
    faces: ArrayLike,
    *,
    unit: str = "None",
    tolerance: float = 0.0,
    name: str = "",
    cut_plane: Optional[Plane] = None,
    face_ids: Optional[Ints] = None,
    epsilon: float = DOUBLE,
) -> SurfaceMesh:
    """Make the `SurfaceMesh` of a mesh in arrays.

    Parameters
    ----------
    vertices : (V, 3) array_like
    faces : (F, 3) or (F, 4) array_like of int
        A triangle among quads repeats its last corner, as in Rhino, or has -1 there.
    unit, tolerance, name
        As in `SurfaceMesh`.
    cut_plane : (point, normal), optional
        Cuts the closed components that it intersects; the others are cut automatically.
    face_ids : (F,) int array, optional
        How errors number the faces; by default by their rows.
    epsilon : float, optional
        Relative rounding of the stored coordinates.

    Returns
    -------
    SurfaceMesh
        Its vertices and faces keep the order of the input.

    Raises
    ------
    NonFinite, BadIndex, TooFarFromOrigin, Degenerate, NonManifold, NotOrientable
    """
    raw = RawMesh(np.asarray(vertices), np.asarray(faces), face_ids, unit, tolerance, name, (), epsilon)
    return repair(raw, cut_plane=cut_plane)


def repair(raw: RawMesh, *, cut_plane: Optional[Plane] = None, is_cut: bool = True) -> SurfaceMesh:
    """Make the `SurfaceMesh` of a `RawMesh`.

    Parameters
    ----------
    raw : RawMesh
    cut_plane : (point, normal), optional
        As in `surface_from_arrays`.
    is_cut : bool
        Whether closed components are cut in two.

    Returns
    -------
    SurfaceMesh

    Raises
    ------
    NonFinite, BadIndex, TooFarFromOrigin, Degenerate, NonManifold, NotOrientable
    """
    vertices = checked_vertices(raw.vertices)
    polygons, ids = checked_faces(raw)
    notes = list(raw.notes)
    faces, row = split_faces(vertices, polygons)
    if len(faces) > len(polygons):
        notes.append(f"Split {counted(len(faces) - len(polygons), 'quad')} into triangles.")
    ids = ids[row]
    _check_resolution(vertices, faces, raw.epsilon)
    weld = first_equal_point(vertices)
    faces, ids, weld, n_dropped = drop_slivers(vertices, faces, weld, ids)
    if n_dropped:
        notes.append(f"Dropped {counted(n_dropped, 'face')} without area.")
    faces, ids = _drop_repeated(faces, ids, weld, notes)
    partner, non_manifold = pair_edges(faces, weld)
    if len(non_manifold):
        raise _non_manifold_error(ids[np.unique(non_manifold // 3)])
    reversals = unify_orientation(vertices, faces, weld, partner, ids)
    notes += _reversal_notes(int(reversals.minority.sum()), int(reversals.inward.sum()))
    vertices, welded = _one_vertex_per_fan(vertices, faces, weld, partner, notes)
    n_expected = raw.n_borders_expected
    surface = SurfaceMesh(
        vertices, reversals.apply(welded), unit=raw.unit, tolerance=raw.tolerance, name=raw.name, mendings=tuple(notes)
    )
    if n_expected not in (None, len(surface.borders)):
        note = f"By its edges the object has {n_expected} borders, and its mesh has {len(surface.borders)}."
        surface = replace(surface, mendings=(*surface.mendings, note))
    return cut_closed_parts(surface, plane=cut_plane) if is_cut else surface


def _drop_repeated(faces: Ints, ids: Ints, weld: Ints, notes: list[str]) -> tuple[Ints, Ints]:
    """Drop faces that repeat another, and components that coincide with others face for face."""
    keep = _first_of_each(faces)
    faces, ids = faces[keep], ids[keep]
    keep_part = ~_repeats_others(faces, weld)
    n_dropped = int((~keep).sum() + (~keep_part).sum())
    if n_dropped:
        notes.append(f"Dropped {counted(n_dropped, 'face')} that repeat others.")
    return faces[keep_part], ids[keep_part]


def _first_of_each(faces: Ints) -> Bools:
    first: Bools = first_equal_row(np.sort(faces, axis=1).astype(np.uint64)) == np.arange(len(faces))
    return first


def _repeats_others(faces: Ints, weld: Ints) -> Bools:
    """Faces (F,) of components by index of which each face repeats one of an earlier component."""
    if (weld == np.arange(len(weld))).all():
        return np.zeros(len(faces), bool)
    is_new = _first_of_each(weld[faces])
    if is_new.all():
        return ~is_new
    part = _components_by_index(faces, len(weld))
    has_new = np.zeros(int(part.max()) + 1, bool)
    has_new[part[is_new]] = True
    lies: Bools = ~has_new[part]
    return lies


def _components_by_index(faces: Ints, n_vertices: int) -> Ints:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    start, end = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    links = coo_matrix((np.ones(len(start), bool), (start, end)), shape=(n_vertices, n_vertices))
    label = connected_components(links, directed=False)[1]
    return np.asarray(label[faces[:, 0]], np.int64)


def _one_vertex_per_fan(
    vertices: Floats, faces: Ints, weld: Ints, partner: Ints, notes: list[str]
) -> tuple[Floats, Ints]:
    """Vertices and faces with one vertex for each fan of faces, in the order of the input.

    Raises
    ------
    NonManifold
        Where two fans share a vertex that is the only one of the input in its place.
    """
    fan = label_fans(faces, weld, partner)
    corner = faces.ravel()
    least = np.full(int(fan.max()) + 1, len(vertices), np.int64)
    np.minimum.at(least, fan, corner)
    used = np.zeros(len(vertices), bool)
    used[corner] = True
    n_apart = _check_pinched(weld[least], np.bincount(weld[used], minlength=len(vertices)))
    order = np.argsort(least, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    notes += _weld_notes(int(used.sum()) - len(least), n_apart, int((~used).sum()))
    return vertices[least[order]], rank[fan].reshape(-1, 3)


def _check_pinched(fan_place: Ints, n_given: Ints) -> int:
    """Number of fans beyond one in each place; refused where the input has a single vertex in such a place.

    Where it has several, its indices do not say what belongs together, and the fans stay apart.
    """
    n_fans = np.bincount(fan_place, minlength=len(n_given))
    pinched = np.flatnonzero((n_fans > 1) & (n_given == 1))
    if len(pinched):
        raise NonManifold(
            "Parts of the surface touch in a single vertex",
            remedy="Pull the touching parts apart, or join them along an edge.",
            ids=pinched.tolist(),
            kind="vertex",
        )
    return int(np.maximum(n_fans - 1, 0).sum())


def _non_manifold_error(faces: NDArray[Any]) -> NonManifold:
    return NonManifold(
        "Edges with more than two faces",
        remedy="Remove the extra faces, so that at most two meet along each edge.",
        ids=np.unique(faces).tolist(),
        kind="face",
    )


def _reversal_notes(n_minority: int, n_inward: int) -> list[str]:
    notes = []
    if n_minority:
        notes.append(f"Reversed {counted(n_minority, 'face')} to orient all alike.")
    if n_inward:
        notes.append(f"Reversed {counted(n_inward, 'face')} of a closed part to face outwards.")
    return notes


def _weld_notes(n_welded: int, n_apart: int, n_unused: int) -> list[str]:
    notes = []
    if n_welded > 0:
        notes.append(f"Welded {counted(n_welded, 'vertex')} to others in the same place.")
    if n_apart:
        notes.append(f"Left {counted(n_apart, 'vertex')} apart from others in the same place: only there parts touch.")
    if n_unused:
        notes.append(f"Dropped {counted(n_unused, 'vertex')} that no face uses.")
    return notes


def checked_vertices(vertices: NDArray[Any]) -> Floats:
    """Check the vertices.

    Parameters
    ----------
    vertices : (V, 3) array of numbers

    Returns
    -------
    (V, 3) float64

    Raises
    ------
    NonFinite, TooFarFromOrigin, Degenerate
    """
    array = np.asarray(vertices)
    if array.dtype.kind not in "iuf":
        raise NonFinite("Coordinates are not numbers", remedy="Give three numbers for each vertex.")
    if array.ndim != 2 or array.shape[1:] != (3,):
        if array.size == 0:
            raise Degenerate("The mesh has no vertices", remedy="Give a surface that has an area.")
        raise Degenerate(
            f"Vertices of shape {array.shape} instead of (V, 3)", remedy="Give three coordinates for each vertex."
        )
    vertices = array.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(vertices).all(1))
    if len(bad):
        raise NonFinite(
            "Coordinates are not finite",
            remedy="Repair or delete these vertices.",
            ids=bad.tolist(),
            kind="vertex",
        )
    bad = np.flatnonzero((np.abs(vertices) > _LARGEST).any(1))
    if len(bad):
        raise TooFarFromOrigin(
            f"Coordinates beyond {_LARGEST:g}",
            remedy="Move the surface nearer to the origin, or use a larger unit.",
            ids=bad.tolist(),
            kind="vertex",
        )
    return vertices


def checked_faces(raw: RawMesh) -> tuple[Ints, Ints]:
    """Check the faces.

    Parameters
    ----------
    raw : RawMesh

    Returns
    -------
    faces : (F, 3) or (F, 4) int64
    ids : (F,) int64
        How errors number them.

    Raises
    ------
    BadIndex, Degenerate
    """
    faces = np.asarray(raw.faces)
    if faces.size == 0:
        raise Degenerate("The mesh has no faces", remedy="Give a surface that has an area.")
    if faces.ndim != 2 or faces.shape[1] not in (3, 4) or faces.dtype.kind not in "iuf":
        raise BadIndex(
            f"Faces of shape {faces.shape} and kind {faces.dtype} instead of (F, 3) or (F, 4) whole numbers",
            remedy="Give triangles or quads.",
        )
    whole = np.asarray(faces, np.float64)
    ids = np.arange(len(faces)) if raw.face_ids is None else np.asarray(raw.face_ids, np.int64)
    n = len(raw.vertices)
    outside = (whole < 0) | (whole >= n) | (whole != np.floor(whole))
    if faces.shape[1] == 4:
        outside[:, 3] &= whole[:, 3] != -1
    bad = np.flatnonzero(outside.any(1))
    if len(bad):
        raise BadIndex(
            f"Faces refer to vertices beyond the {n} of the mesh",
            remedy="Repair the mesh: its face list does not fit its vertices.",
            ids=np.unique(ids[bad]).tolist(),
            kind="face",
        )
    return faces.astype(np.int64), ids


def _check_resolution(vertices: Floats, triangles: Ints, epsilon: float) -> None:
    """Refuse a mesh whose coordinates are too coarse for its edges: rounding grows with the distance from 0.

    Raises
    ------
    TooFarFromOrigin, Degenerate
    """
    ends = vertices[triangles]
    furthest, extent = float(np.abs(ends).max()), float(np.ptp(ends, axis=(0, 1)).max())
    if extent < _SMALLEST:
        raise Degenerate(f"The surface is only {extent:.2g} large", remedy="Give a surface that has an area.")
    step = epsilon * furthest
    lengths = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2)
    edge = float(np.median(lengths[lengths > 0])) if lengths.any() else np.inf  # Zero-length edges are dropped later.
    if step > _COARSEST * edge:
        raise TooFarFromOrigin(
            f"Coordinates up to {furthest:.3g} are kept in steps of {step:.2g}, too coarse for edges of {edge:.3g}",
            remedy="Move the surface nearer to the origin before saving it.",
        )
