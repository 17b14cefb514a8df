"""A triangle or quad mesh repaired until it can be woven, or refused with the reason.

Repaired is what does not change the shape beyond the tolerance, each repair with a note, in this order:

1. refuse bad numbers, bad indices and coordinates that are too coarse;
2. split quads (`polygon_triangulation`);
3. find vertices in the same place (the *weld map*: the least vertex in each place);
4. drop faces without area (`slivers`) and faces that repeat others;
5. leave out parts that lie on others (`coincident_faces`);
6. weld almost equal vertices of borders (`border_welds`), and insert into border edges the vertices that lie on them
   (`border_stitches`), unless faces lie on each other;
7. pair edges and orient the faces alike (`orientation`);
8. make one vertex of each fan of faces around a place, which welds and drops unused vertices;
9. cut closed components in two (`closed_surfaces`).

A vertex at which two fans of faces touch is split if it was one vertex in the input; if the input has several
vertices there, they stay apart.  Sorting makes it O(n log n) in the faces.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from weavecore.errors import BadIndex, Degenerate, NonFinite, NonManifold, TooFarFromOrigin
from weavecore.geometry.arrays import Bools, Floats, Ints, edge_lengths, first_equal_point, first_equal_row, used_rows
from weavecore.geometry.halfedges import next_halfedge
from weavecore.model import Note, SurfaceMesh
from weavecore.model.notes import at
from weavecore.reading.border_gaps import note_gaps
from weavecore.reading.border_stitches import stitch_borders
from weavecore.reading.border_welds import tolerance_of, weld_borders
from weavecore.reading.closed_surfaces import cut_closed_parts
from weavecore.reading.coincident_faces import find_coincident, without_folded_pairs
from weavecore.reading.orientation import label_fans, pair_edges, unify_orientation
from weavecore.reading.pieces import fill_holes, keep_largest, note_pieces
from weavecore.reading.polygon_triangulation import split_faces
from weavecore.reading.raw import DOUBLE, SINGLE, Plane, RawMesh, RepairOptions, counted
from weavecore.reading.slivers import drop_slivers, has_three_places
from weavecore.reading.thickness import keep_outer_side

_LARGEST, _SMALLEST = 1e50, 1e-50
"""Coordinates and extents beyond these overflow or vanish in squared areas and volumes (1e50 to the sixth is
1e300)."""

_COARSEST = 0.01
"""Greatest step between neighbouring coordinates, in median edge lengths: angles are then good to about a
degree."""

_COARSE = 0.001
"""Steps that are noted, in median edge lengths: a tenth of those that are refused, some 0.1 degree."""

_LAST_STEPS = np.float32(8)
"""Coordinates that are all multiples of so many steps of single precision are a grid that it holds exactly."""


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


def repair(
    raw: RawMesh,
    *,
    cut_plane: Optional[Plane] = None,
    options: RepairOptions = RepairOptions(),  # noqa: B008 - frozen
    is_cut: bool = True,
) -> SurfaceMesh:
    """Make the `SurfaceMesh` of a `RawMesh`.

    Parameters
    ----------
    raw : RawMesh
    cut_plane : (point, normal), optional
        As in `surface_from_arrays`.
    options : RepairOptions, optional
        What is to be repaired or left out beyond the usual; lengths in the unit of the mesh.
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
        n_quads = len(faces) - len(polygons)
        notes.append(Note("TRIANGULATED", f"Split {counted(n_quads, 'quad')} into triangles.", {"count": n_quads}))
    ids = ids[row]
    notes += _check_resolution(vertices, faces, _rounding(vertices, raw.epsilon))
    weld = first_equal_point(vertices)
    faces, ids, weld, n_dropped = drop_slivers(vertices, faces, weld, ids)
    if n_dropped:
        notes.append(Note("DROPPED", f"Dropped {counted(n_dropped, 'face')} without area.", {"count": n_dropped}))
    faces, ids = _drop_repeated(faces, ids, weld, notes)
    reach = tolerance_of(vertices, faces, raw.tolerance) if options.weld is None else options.weld
    faces, ids, lies = _drop_coincident(vertices, faces, ids, weld, reach, notes)
    if not lies.any():  # Sheets on each other must not be welded at their rims.
        faces, ids, weld = _close_borders(vertices, faces, ids, weld, reach, notes)
        lies = np.zeros(len(faces), bool)
    partner, non_manifold = pair_edges(faces, weld)
    partner = without_folded_pairs(partner, faces, lies) if lies.any() else partner
    if len(non_manifold):
        raise _non_manifold_error(vertices, faces, ids, non_manifold)
    reversals = unify_orientation(vertices, faces, weld, partner, ids)
    notes += _reversal_notes(int(reversals.minority.sum()), int(reversals.inward.sum()))
    vertices, welded = _one_vertex_per_fan(vertices, faces, weld, partner, notes)
    crowded = pair_edges(welded, np.arange(len(vertices)))[1]
    if len(crowded) and options.weld is None:
        raw = replace(raw, notes=(*raw.notes, _unwelded_note(vertices, welded, crowded, reach)))
        return repair(raw, cut_plane=cut_plane, options=replace(options, weld=0.0), is_cut=is_cut)
    if len(crowded):
        raise _non_manifold_error(vertices, welded, ids, crowded)
    surface = SurfaceMesh(
        vertices, reversals.apply(welded), unit=raw.unit, tolerance=raw.tolerance, name=raw.name, notes=tuple(notes)
    )
    n_expected, n_borders = raw.n_borders_expected, len(surface.borders)
    if n_expected not in (None, n_borders):
        text = f"By its edges the object has {n_expected} borders, and its mesh has {n_borders}."
        note = Note("BORDERS", text, {"expected": float(n_expected or 0), "found": n_borders})
        surface = surface.with_notes((*surface.notes, note))
    surface = _with_options(_without_closed_gaps(surface), options)
    return cut_closed_parts(surface, plane=cut_plane) if is_cut else surface


def _without_closed_gaps(surface: SurfaceMesh) -> SurfaceMesh:
    """Without the notes of gaps between pieces that were welded since."""
    n_pieces = int(surface.component_of_face.max()) + 1
    notes = [note for note in surface.notes if dict(note.numbers).get("pieces", 0) <= n_pieces or note.code != "GAP"]
    return surface if len(notes) == len(surface.notes) else surface.with_notes(notes)


def _with_options(surface: SurfaceMesh, options: RepairOptions) -> SurfaceMesh:
    """What was asked for is left out and filled; what else may not be meant is noted."""
    if options.is_largest_only:
        surface = keep_largest(surface)
    if options.side is not None:
        surface = keep_outer_side(surface)
    if options.fill_holes is not None:
        surface = fill_holes(surface, options.fill_holes)
    return note_gaps(note_pieces(surface))


def _close_borders(
    vertices: Floats, faces: Ints, ids: Ints, weld: Ints, reach: float, notes: list[Note]
) -> tuple[Ints, Ints, Ints]:
    """Weld almost equal vertices of borders, and insert into border edges the vertices that lie on them."""
    welding = weld_borders(vertices, faces, weld, reach)
    if welding.n_welded:
        text = f"Welded {counted(welding.n_welded, 'vertex')} of borders to others up to {welding.furthest:.3g} away."
        numbers = {"count": welding.n_welded, "distance": welding.furthest, "tolerance": reach}
        notes.append(Note("WELDED", text, numbers, vertices[welding.where]))
        weld = welding.weld
        keep = has_three_places(faces, weld)
        faces, ids = faces[keep], ids[keep]
        if len(faces) == 0:
            raise Degenerate(
                f"All faces are narrower than the tolerance of {reach:.3g}",
                remedy="Give a surface that has an area, or weld over a shorter length (--weld).",
            )
    stitches = stitch_borders(vertices, faces, weld, reach)
    if len(stitches.where):
        where = vertices[stitches.where]
        text = f"Inserted {counted(len(where), 'vertex')} into border edges that they lie on, first at {at(where[0])}."
        notes.append(Note("STITCHED", text, {"count": len(where)}, where))
    return stitches.faces, ids[stitches.row], weld


def _drop_coincident(
    vertices: Floats, faces: Ints, ids: Ints, weld: Ints, reach: float, notes: list[Note]
) -> tuple[Ints, Ints, Bools]:
    """Leave out parts that lie on others; what is left, and which of it lies on other faces.

    Parts are those after almost equal vertices are welded: each face of a soup would be a part.
    """
    found = find_coincident(vertices, faces, weld_borders(vertices, faces, weld, reach).weld, reach)
    left = ~found.left_out
    middle = vertices[faces].mean(1)
    if found.left_out.any():
        n, where = int(found.left_out.sum()), middle[found.left_out]
        text = f"Left out {counted(n, 'face')} that lie on others, first at {at(where[0])}: the surface is there twice."
        notes.append(Note("COINCIDENT", text, {"count": n}, where))
    if found.lies.any():
        n, where = int(found.lies.sum()), middle[found.lies]
        text = (
            f"{counted(n, 'face')} on other faces, first at {at(where[0])}: kept, and not joined to what they lie on."
        )
        notes.append(Note("COINCIDENT", text, {"count": n}, where))
    return faces[left], ids[left], found.lies[left]


def _drop_repeated(faces: Ints, ids: Ints, weld: Ints, notes: list[Note]) -> tuple[Ints, Ints]:
    """Drop faces that repeat another, and components that coincide with others face for face."""
    keep = _first_of_each(faces)
    faces, ids = faces[keep], ids[keep]
    keep_part = ~_repeats_others(faces, weld)
    n_dropped = int((~keep).sum() + (~keep_part).sum())
    if n_dropped:
        text = f"Dropped {counted(n_dropped, 'face')} that repeat others."
        notes.append(Note("DROPPED", text, {"count": n_dropped}))
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
    vertices: Floats, faces: Ints, weld: Ints, partner: Ints, notes: list[Note]
) -> tuple[Floats, Ints]:
    """Vertices and faces with one vertex for each fan of faces, in the order of the input."""
    fan = label_fans(faces, weld, partner)
    corner = faces.ravel()
    least = np.full(int(fan.max()) + 1, len(vertices), np.int64)
    np.minimum.at(least, fan, corner)
    used = np.zeros(len(vertices), bool)
    used[corner] = True
    pinches = _pinch_notes(vertices, weld[least], np.bincount(weld[used], minlength=len(vertices)))
    order = np.argsort(least, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    n_near = sum(int(dict(note.numbers)["count"]) for note in notes if note.code == "WELDED")
    notes += _weld_notes(vertices, used, len(least), n_near, pinches)
    return vertices[least[order]], rank[fan].reshape(-1, 3)


def _pinch_notes(vertices: Floats, fan_place: Ints, n_given: Ints) -> list[Note]:
    """What is said of places with more than one fan.

    Where the input has one vertex in such a place, it is split; where it has several, its indices do not say what
    belongs together, and the fans stay apart.
    """
    n_fans = np.bincount(fan_place, minlength=len(n_given))
    split = np.flatnonzero((n_fans > 1) & (n_given == 1))
    apart = np.flatnonzero((n_fans > 1) & (n_given > 1))
    notes = []
    if len(split):
        where = at(vertices[split[0]])
        text = f"Split {counted(len(split), 'vertex')} at which parts of the surface touch, first at {where}."
        notes.append(Note("SPLIT", text, {"count": len(split)}, vertices[split]))
    if len(apart):
        n_apart = int((n_fans[apart] - 1).sum())
        text = f"Left {counted(n_apart, 'vertex')} apart from others in the same place: only there parts touch."
        notes.append(Note("APART", text, {"count": n_apart}, vertices[apart]))
    return notes


def _non_manifold_error(vertices: Floats, faces: Ints, ids: Ints, halfedges: Ints) -> NonManifold:
    corner = faces.ravel()
    ends = np.stack([vertices[corner[halfedges]], vertices[corner[next_halfedge(halfedges)]]], axis=1)
    middle = ends[0].mean(0)
    return NonManifold(
        f"Edges with more than two faces, first at {at(middle)}",
        remedy="Remove the extra faces, so that at most two meet along each edge; weavecore info --marks shows them.",
        ids=np.unique(ids[halfedges // 3]).tolist(),
        kind="face",
        points=ends.reshape(-1, 3).tolist(),
    )


def _unwelded_note(vertices: Floats, faces: Ints, halfedges: Ints, reach: float) -> Note:
    """Borders that stay apart, since more than two faces would meet at edges whose halfedges are given."""
    places = vertices[np.unique(faces.ravel()[halfedges])]
    text = f"Borders nearer to each other than the tolerance of {reach:.3g} stay apart, first at {at(places[0])}: "
    text += "welded, more than two faces would meet along an edge. Close the slit there, or widen it."
    return Note("GAP", text, {"count": len(places), "tolerance": reach}, places)


def _reversal_notes(n_minority: int, n_inward: int) -> list[Note]:
    notes = []
    if n_minority:
        text = f"Reversed {counted(n_minority, 'face')} to orient all alike."
        notes.append(Note("REVERSED", text, {"count": n_minority}))
    if n_inward:
        text = f"Reversed {counted(n_inward, 'face')} of a closed part to face outwards."
        notes.append(Note("REVERSED", text, {"count": n_inward}))
    return notes


def _weld_notes(vertices: Floats, used: Bools, n_made: int, n_near: int, pinches: list[Note]) -> list[Note]:
    """Notes of vertices in the same place, without the near ones that are noted already, and of unused vertices."""
    notes = []
    n_split = sum(int(dict(note.numbers)["count"]) for note in pinches if note.code == "SPLIT")
    n_welded, n_unused = int(used.sum()) - n_made + n_split - n_near, int((~used).sum())
    if n_welded > 0:
        text = f"Welded {counted(n_welded, 'vertex')} to others in the same place."
        notes.append(Note("WELDED", text, {"count": n_welded}))
    notes += pinches
    if n_unused:
        text = f"Dropped {counted(n_unused, 'vertex')} that no face uses."
        notes.append(Note("DROPPED", text, {"count": n_unused}, vertices[~used]))
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


def _rounding(vertices: Floats, epsilon: float) -> float:
    """Relative rounding of the coordinates: that of single precision if they all went through it.

    Whole numbers and other coarse grids are exact in single precision too: only where the last bits are in use were
    digits lost.
    """
    rounded = vertices.astype(np.float32)
    if epsilon >= SINGLE or not (rounded == vertices).all():
        return epsilon
    size = np.abs(rounded)
    large = size[size > size.max() / 2]
    step = np.spacing(large)
    return SINGLE if (large % (_LAST_STEPS * step) != 0).any() else epsilon


def _check_resolution(vertices: Floats, triangles: Ints, epsilon: float) -> list[Note]:
    """Refuse a mesh whose coordinates are too coarse for its edges: rounding grows with the distance from 0.

    Returns
    -------
    list of Note
        The note FAR where the steps are not too coarse but can be seen.

    Raises
    ------
    TooFarFromOrigin, Degenerate
    """
    used = used_rows(vertices, triangles)
    furthest, extent = float(np.abs(used).max()), float(np.ptp(used, axis=0).max())
    if extent < _SMALLEST:
        raise Degenerate(f"The surface is only {extent:.2g} large", remedy="Give a surface that has an area.")
    step = epsilon * furthest
    lengths = edge_lengths(vertices, triangles)
    edge = float(np.median(lengths[lengths > 0])) if lengths.any() else np.inf  # Zero-length edges are dropped later.
    where = vertices[np.unravel_index(np.abs(vertices).argmax(), vertices.shape)[0]]
    text = f"Coordinates up to {furthest:.3g} are kept in steps of {step:.2g}"
    if step > _COARSEST * edge:
        raise TooFarFromOrigin(
            f"{text}, too coarse for edges of {edge:.3g}, as at {at(where)}",
            remedy="Move the surface to the origin in the program that made it, and export it again.",
        )
    if step > _COARSE * edge:
        text += f", which edges of {edge:.3g} show; move the surface to the origin and export it again."
        return [Note("FAR", text, {"step": step, "furthest": furthest, "edge": edge}, [where])]
    return []
