"""Whatever surface rhino3dm holds → one welded triangle mesh.

    SubD ──────────────────────────────▶ subd ─────────┐
    Brep, Extrusion, Surface ─▶ brep_shape ─▶ brep_mesh ─┼▶ stitching ─▶ MeshedObject
    mesh ──────────────────────────────▶ split quads ────┘

Breps are recentred first, and several are joined edge to edge before they are meshed (`edge_paths`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from weavecore.errors import NonFinite, Unsupported
from weavecore.geometry.arrays import Floats, first_equal_point
from weavecore.reading.nurbs_mesher.brep_mesh import mesh_brep
from weavecore.reading.nurbs_mesher.brep_shape import brep_shape, extent_of, recentred
from weavecore.reading.nurbs_mesher.edge_paths import join_shapes
from weavecore.reading.nurbs_mesher.meshed_object import MeshedObject
from weavecore.reading.nurbs_mesher.sizing import Fineness
from weavecore.reading.nurbs_mesher.stitching import join_meshes, split_components
from weavecore.reading.nurbs_mesher.subd import mesh_subd
from weavecore.reading.polygon_triangulation import split_faces
from weavecore.reading.raw import RawMesh
from weavecore.reading.repair import checked_faces, checked_vertices
from weavecore.rhino_geometry.conversion import is_rhino_mesh, rhino_faces, rhino_vertices

MESHED_KINDS = ("Brep", "Extrusion", "Surface", "SubD")
"""Rhino's names for the kinds of object that `mesh_object` takes."""

_MOST_TOLERANCE = 1e-2
"""A tolerance beyond this part of the size would join edges that are only near each other."""


def mesh_object(
    geometry: Any,
    *,
    edge_target: float | None = None,
    chord: float | None = None,
    spacing: float | None = None,
    tolerance: float | None = None,
    transform: ArrayLike | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> MeshedObject:
    """Mesh a surface of a Rhino file, without Rhino.

    Edges of a Brep are divided once, in space, so that the faces on them share their vertices; seams are closed and
    sides that are single points become one vertex.  Border vertices lie on the edges' own curves.

    Parameters
    ----------
    geometry : rhino3dm.Brep, Surface of any kind, Extrusion or SubD
    edge_target : float, optional
        Longest edge, in the object's unit; by default a fiftieth of the size.
    chord : float, optional
        Greatest distance between mesh and surface; by default a thousandth of the size.  Edges are shorter than
        ``edge_target`` where the curvature requires it.
    spacing : float, optional
        Spacing at which the surface will be woven: unless the two above are given, edges are at most half as long,
        and the chord error is at most a fiftieth of it, down to a 150th and a 10,000th of the size.
    tolerance : float, optional
        The model's absolute tolerance: edges that lie further than this from the faces they bound are reported in
        the notes.
    transform : (4, 4) array_like, optional
        Applied to the object first, as in a block; the other lengths are meant after it.
    progress : callable, optional
        Called with a fraction and a label; may raise to cancel.

    Returns
    -------
    MeshedObject
        Consistently oriented, outwards if the object says so.  The same input gives the same bytes.

    Raises
    ------
    Unsupported, Unreadable, NonFinite, Degenerate, TooMuchWork
    """
    moved, fineness = _checked_transform(transform), Fineness(edge_target, chord, spacing)
    if progress is not None:
        progress(0.0, "Reading the surface")
    if type(geometry).__name__ == "SubD":
        meshed = mesh_subd(geometry, fineness=fineness, transform=moved, progress=progress)
    else:
        (shape,), origin = recentred([brep_shape(as_brep(geometry), moved)])
        meshed = mesh_brep(shape, fineness=fineness, tolerance=tolerance, progress=progress)
        meshed = replace(meshed, vertices=meshed.vertices + origin)
    if progress is not None:
        progress(1.0, "Meshed")
    return meshed


def mesh_objects(
    geometries: Sequence[Any],
    *,
    tolerance: float,
    transforms: Sequence[ArrayLike | None] | None = None,
    edge_target: float | None = None,
    chord: float | None = None,
    spacing: float | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> MeshedObject:
    """Mesh several surfaces as one, joined where their edges coincide.

    Surfaces of all kinds but SubDs are joined edge to edge before they are meshed, so that both sides share their
    vertices; what coincides only in part, SubDs and meshes, is stitched afterwards (see `join_meshes`).

    Parameters
    ----------
    geometries : sequence of rhino3dm geometry
        What `mesh_object` takes, and meshes.
    tolerance : float
        How far apart edges that are meant to coincide may lie: the model's absolute tolerance.
    transforms : sequence of (4, 4) array_like or None, optional
        Applied to each of them first.
    edge_target, chord, spacing, progress
        As in `mesh_object`.

    Returns
    -------
    MeshedObject

    Raises
    ------
    Unsupported, Unreadable, NonFinite, Degenerate, TooMuchWork, NotOrientable
    """
    moved = [_checked_transform(t) for t in (transforms or [None] * len(geometries))]
    fineness = Fineness(edge_target, chord, spacing)
    pairs = list(zip(geometries, moved))
    shapes = [brep_shape(as_brep(g), t) for g, t in pairs if not (type(g).__name__ == "SubD" or is_rhino_mesh(g))]
    meshes = []
    if shapes:
        shapes, origin = recentred(shapes)
        joined = join_shapes(shapes, min(tolerance, _MOST_TOLERANCE * extent_of(shapes)))
        meshed = mesh_brep(joined, fineness=fineness, tolerance=tolerance, progress=progress)
        meshes.append(replace(meshed, vertices=meshed.vertices + origin))
    for geometry, transform in pairs:
        if type(geometry).__name__ == "SubD":
            meshes.append(mesh_subd(geometry, fineness=fineness, transform=transform))
        elif is_rhino_mesh(geometry):
            meshes.append(_plain_mesh(geometry, transform))
    extent = float(np.linalg.norm(np.ptp(np.concatenate([m.vertices for m in meshes]), axis=0)))
    return join_meshes(split_components(meshes), tolerance=min(tolerance, _MOST_TOLERANCE * extent))


def _plain_mesh(mesh: Any, transform: Floats | None) -> MeshedObject:
    """A Rhino mesh as it is, transformed."""
    moved = np.eye(4) if transform is None else transform
    vertices = checked_vertices(rhino_vertices(mesh))
    polygons, _ = checked_faces(RawMesh(vertices, rhino_faces(mesh)))
    faces, _ = split_faces(vertices, first_equal_point(vertices)[polygons])
    if np.linalg.det(moved[:3, :3]) < 0:
        faces = faces[:, [0, 2, 1]]
    return MeshedObject(vertices @ moved[:3, :3].T + moved[:3, 3], faces)


def as_brep(geometry: Any) -> Any:
    """A ``rhino3dm.Brep`` of a Brep, an extrusion or a surface.

    Parameters
    ----------
    geometry : rhino3dm.Brep, Extrusion, BrepFace or Surface

    Returns
    -------
    rhino3dm.Brep

    Raises
    ------
    Unsupported
    """
    import rhino3dm

    brep: Any = None
    if isinstance(geometry, rhino3dm.Brep):
        brep = geometry
    elif isinstance(geometry, rhino3dm.Extrusion):
        brep = geometry.ToBrep(True)
    elif isinstance(geometry, rhino3dm.BrepFace):
        brep = geometry.DuplicateFace(False)
    elif isinstance(geometry, rhino3dm.Surface):
        brep = rhino3dm.Brep.CreateFromSurface(geometry)
    if brep is None or len(brep.Faces) == 0:
        raise Unsupported(
            f"A {type(geometry).__name__} cannot be made into a surface with borders",
            remedy="Give a mesh, a surface, a polysurface, an extrusion or a SubD.",
        )
    return brep


def _checked_transform(transform: ArrayLike | None) -> Floats | None:
    if transform is None:
        return None
    moved = np.asarray(transform, np.float64).reshape(4, 4)
    if not np.isfinite(moved).all() or np.linalg.det(moved) == 0 or (moved[3] != [0, 0, 0, 1]).any():
        raise NonFinite("A transform that flattens or is not finite", remedy="Explode the block in Rhino.")
    return moved
