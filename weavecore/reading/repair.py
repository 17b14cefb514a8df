"""Any triangle or quad mesh → the mesh that can be woven, or a refusal that says why.

What can be mended without changing the shape is mended, and told in one sentence each:
quads split, equal places welded, faces without area and repeated faces dropped, faces
turned to one side, unused vertices dropped.
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
from weavecore.reading.orientation import fans_of_corners, find_mates, unify_orientation
from weavecore.reading.polygon_triangulation import split_faces
from weavecore.reading.raw import DOUBLE, Plane, RawMesh, counted
from weavecore.reading.slivers import drop_slivers


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
    """Make the `SurfaceMesh` of a mesh given as arrays.

    Parameters
    ----------
    vertices : (V, 3) array_like
    faces : (F, 3) or (F, 4) array_like of int
        A triangle among quads repeats its last corner, as in Rhino, or has -1 there.
    unit, tolerance, name
        As in `SurfaceMesh`.
    cut_plane : (point, normal), optional
        Closed parts that this plane meets are cut in two by it; others by themselves.
    face_ids : (F,) int array, optional
        How errors number the faces; by their row where it is not given.
    epsilon : float, optional
        Relative precision of the numbers that the coordinates were kept in.

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
    """Make the `SurfaceMesh` of a `RawMesh`: see `surface_from_arrays`.

    With ``is_cut`` False closed parts are left whole.
    """
    points = checked_vertices(raw.vertices)
    polygons, ids = checked_faces(raw)
    said = list(raw.notes)
    faces, row = split_faces(points, polygons)
    if len(faces) > len(polygons):
        said.append(f"Split {counted(len(faces) - len(polygons), 'quad')} into triangles.")
    ids = ids[row]
    check_resolution(points, faces, raw.epsilon)
    place = first_equal_point(points)
    faces, ids, place, n_dropped = drop_slivers(points, faces, place, ids)
    if n_dropped:
        said.append(f"Dropped {counted(n_dropped, 'face')} without area.")
    faces, ids = _drop_repeated(faces, ids, place, said)
    mates, crowded = find_mates(faces, place)
    if len(crowded):
        raise _crowded(ids[np.unique(crowded // 3)])
    turning = unify_orientation(points, faces, place, mates, ids)
    said += _turned(int(turning.odd.sum()), int(turning.inside_out.sum()))
    points, welded = _weld(points, faces, place, mates, said)
    n_expected = raw.n_borders_expected
    surface = SurfaceMesh(
        points, turning.apply(welded), unit=raw.unit, tolerance=raw.tolerance, name=raw.name, mendings=tuple(said)
    )
    if n_expected not in (None, len(surface.borders)):
        told = f"The object says that it has {n_expected} borders, and its mesh has {len(surface.borders)}."
        surface = replace(surface, mendings=(*surface.mendings, told))
    return cut_closed_parts(surface, plane=cut_plane) if is_cut else surface


def _drop_repeated(faces: Ints, ids: Ints, place: Ints, said: list[str]) -> tuple[Ints, Ints]:
    """Drop faces that repeat another, and connected parts that lie on others face for face."""
    keep = _first_of_each(faces)
    faces, ids = faces[keep], ids[keep]
    keep_part = ~_lies_on_others(faces, place)
    n_dropped = int((~keep).sum() + (~keep_part).sum())
    if n_dropped:
        said.append(f"Dropped {counted(n_dropped, 'face')} that repeat others.")
    return faces[keep_part], ids[keep_part]


def _first_of_each(faces: Ints) -> Bools:
    first: Bools = first_equal_row(np.sort(faces, axis=1).astype(np.uint64)) == np.arange(len(faces))
    return first


def _lies_on_others(faces: Ints, place: Ints) -> Bools:
    """Faces (F,) of parts, joined by their indices, of which each face repeats one of an earlier part."""
    if (place == np.arange(len(place))).all():
        return np.zeros(len(faces), bool)
    is_new = _first_of_each(place[faces])
    if is_new.all():
        return ~is_new
    part = _parts_by_index(faces, len(place))
    has_new = np.zeros(int(part.max()) + 1, bool)
    has_new[part[is_new]] = True
    lies: Bools = ~has_new[part]
    return lies


def _parts_by_index(faces: Ints, n_vertices: int) -> Ints:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    start, end = faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    links = coo_matrix((np.ones(len(start), bool), (start, end)), shape=(n_vertices, n_vertices))
    label = connected_components(links, directed=False)[1]
    return np.asarray(label[faces[:, 0]], np.int64)


def _weld(points: Floats, faces: Ints, place: Ints, mates: Ints, said: list[str]) -> tuple[Floats, Ints]:
    """One vertex for each fan of faces, in the order of the input; points and faces of these.

    Raises
    ------
    NonManifold
        Where two fans share a vertex of the input that is the only one in its place.
    """
    fan = fans_of_corners(faces, place, mates)
    corner = faces.ravel()
    least = np.full(int(fan.max()) + 1, len(points), np.int64)
    np.minimum.at(least, fan, corner)
    used = np.zeros(len(points), bool)
    used[corner] = True
    n_apart = _check_pinched(place[least], np.bincount(place[used], minlength=len(points)))
    order = np.argsort(least, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    said += _welded(int(used.sum()) - len(least), n_apart, int((~used).sum()))
    return points[least[order]], rank[fan].reshape(-1, 3)


def _check_pinched(fan_place: Ints, n_given: Ints) -> int:
    """How many fans more than places there are; refused where the input has a single vertex in such a place.

    Where it has several, its indices do not say what belongs together, and the fans stay apart.
    """
    n_fans = np.bincount(fan_place, minlength=len(n_given))
    pinched = np.flatnonzero((n_fans > 1) & (n_given == 1))
    if len(pinched):
        raise NonManifold(
            "Fans of faces that touch in a single vertex",
            remedy="Pull the touching parts apart, or join them along an edge.",
            ids=pinched.tolist(),
            kind="vertex",
        )
    return int(np.maximum(n_fans - 1, 0).sum())


def _crowded(faces: NDArray[Any]) -> NonManifold:
    return NonManifold(
        "Edges with more than two faces",
        remedy="Remove the extra faces, so that at most two meet along each edge.",
        ids=np.unique(faces).tolist(),
        kind="face",
    )


def _turned(n_odd: int, n_inside_out: int) -> list[str]:
    said = []
    if n_odd:
        said.append(f"Turned {counted(n_odd, 'face')} to look to the side of the others.")
    if n_inside_out:
        said.append(f"Turned a closed part of {counted(n_inside_out, 'face')} to look outwards.")
    return said


def _welded(n_welded: int, n_apart: int, n_unused: int) -> list[str]:
    said = []
    if n_welded > 0:
        said.append(f"Welded {counted(n_welded, 'vertex')} to others in the same place.")
    if n_apart:
        said.append(f"Left {counted(n_apart, 'vertex')} apart from others in the same place: sheets only touch there.")
    if n_unused:
        said.append(f"Dropped {counted(n_unused, 'vertex')} that no face uses.")
    return said


# ----------------------------------------------------------------------
# What is refused before anything is mended: bad numbers, bad indices, coordinates without resolution.

_LARGEST, _SMALLEST = 1e50, 1e-50
"""Beyond these an area squared, or a volume, is no number any more."""

_COARSEST = 0.01


def checked_vertices(vertices: NDArray[Any]) -> Floats:
    """The vertices as float64 (V, 3).

    Raises
    ------
    NonFinite, TooFarFromOrigin, Degenerate
    """
    array = np.asarray(vertices)
    if array.dtype.kind not in "iuf":
        raise NonFinite("Coordinates that are no numbers", remedy="Give three numbers for each vertex.")
    if array.ndim != 2 or array.shape[1:] != (3,):
        if array.size == 0:
            raise Degenerate("The mesh has no vertices", remedy="Give a surface that has an area.")
        raise Degenerate(
            f"Vertices of shape {array.shape} instead of (V, 3)", remedy="Give three coordinates for each vertex."
        )
    points = array.astype(np.float64)
    bad = np.flatnonzero(~np.isfinite(points).all(1))
    if len(bad):
        raise NonFinite(
            "Coordinates that are not finite numbers",
            remedy="Repair or delete these vertices.",
            ids=bad.tolist(),
            kind="vertex",
        )
    bad = np.flatnonzero((np.abs(points) > _LARGEST).any(1))
    if len(bad):
        raise TooFarFromOrigin(
            f"Coordinates beyond {_LARGEST:g}",
            remedy="Move the surface nearer to the origin, or use a larger unit.",
            ids=bad.tolist(),
            kind="vertex",
        )
    return points


def checked_faces(raw: RawMesh) -> tuple[Ints, Ints]:
    """The faces as int64 (F, 3 or 4) and the number of each for the user (F,).

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
            f"Faces that name vertices beyond the {n} that there are",
            remedy="Repair the mesh: its face list does not fit its vertices.",
            ids=np.unique(ids[bad]).tolist(),
            kind="face",
        )
    return faces.astype(np.int64), ids


def check_resolution(points: Floats, triangles: Ints, epsilon: float) -> None:
    """Refuse a mesh whose coordinates are too coarse for the length of its edges.

    The step between two neighbouring numbers grows with their distance from 0.

    Raises
    ------
    TooFarFromOrigin, Degenerate
    """
    ends = points[triangles]
    furthest, extent = float(np.abs(ends).max()), float(np.ptp(ends, axis=(0, 1)).max())
    if extent < _SMALLEST:
        raise Degenerate(f"The surface is only {extent:.2g} large", remedy="Give a surface that has an area.")
    step = epsilon * furthest
    lengths = np.linalg.norm(ends - np.roll(ends, 1, axis=1), axis=2)
    edge = float(np.median(lengths[lengths > 0])) if lengths.any() else np.inf  # no edge is too short for its place
    if step > _COARSEST * edge:
        raise TooFarFromOrigin(
            f"Coordinates up to {furthest:.3g} are kept in steps of {step:.2g}, too coarse for edges of {edge:.3g}",
            remedy="Move the surface nearer to the origin before saving it.",
        )
