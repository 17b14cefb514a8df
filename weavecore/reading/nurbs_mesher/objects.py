"""`mesh_object`: whatever surface rhino3dm holds → one welded triangle mesh."""

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
from weavecore.reading.nurbs_mesher.meshed_object import UNTOLD, MeshedObject
from weavecore.reading.nurbs_mesher.sizing import Fineness
from weavecore.reading.nurbs_mesher.stitching import join_meshes, split_parts
from weavecore.reading.nurbs_mesher.subd import mesh_subd
from weavecore.reading.polygon_triangulation import split_faces
from weavecore.reading.raw import RawMesh, is_rhino_mesh, rhino_faces, rhino_vertices
from weavecore.reading.repair import checked_faces, checked_vertices

MESHED_KINDS = ("Brep", "Extrusion", "Surface", "SubD")
"""Rhino's names for the kinds of object that `mesh_object` takes."""

_MOST_TOLERANCE = 1e-2
"""A tolerance beyond this part of the size would join what only lies near."""


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

    Edges of a Brep are divided once, in space, so that the faces on them share their vertices; seams are closed
    and sides that are single points become one vertex.  Border vertices lie on the edges' own curves.

    Parameters
    ----------
    geometry : rhino3dm.Brep, Surface of any kind, Extrusion or SubD
    edge_target : float, optional
        Longest wanted edge, in the object's unit; a fiftieth of the size where it is not given.
    chord : float, optional
        Greatest wanted distance between mesh and surface; a thousandth of the size where it is not given.
        Edges are shorter than ``edge_target`` where the curvature asks for it.
    spacing : float, optional
        Spacing that the surface will be woven at: where the two above are not given, edges are at most half as
        long, and the chord error is a fiftieth of it at most, down to a 150th and a 10,000th of the size.
    tolerance : float, optional
        The model's absolute tolerance: a Brep whose edges are further than this from its faces is told in the notes.
    transform : (4, 4) array_like, optional
        Moves the object first, as a block does; the other lengths are meant after it.
    progress : callable, optional
        Called with a fraction and a label; may raise to cancel.

    Returns
    -------
    MeshedObject
        Consistently oriented, outside where the object says so.  The same input gives the same bytes.

    Raises
    ------
    Unsupported, Unreadable, NonFinite, Degenerate, TooMuchWork
    """
    moved, wanted = _checked_transform(transform), Fineness(edge_target, chord, spacing)
    if progress is not None:
        progress(0.0, "Reading the surface")
    if type(geometry).__name__ == "SubD":
        meshed = mesh_subd(geometry, wanted=wanted, transform=moved, progress=progress)
    else:
        (shape,), origin = recentred([brep_shape(as_brep(geometry), moved)])
        meshed = mesh_brep(shape, wanted=wanted, tolerance=tolerance, progress=progress)
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
        Moves each of them first.
    edge_target, chord, spacing, progress
        As in `mesh_object`.

    Raises
    ------
    Unsupported, Unreadable, NonFinite, Degenerate, TooMuchWork, NotOrientable
    """
    moved = [_checked_transform(t) for t in (transforms or [None] * len(geometries))]
    wanted = Fineness(edge_target, chord, spacing)
    pairs = list(zip(geometries, moved))
    shapes = [brep_shape(as_brep(g), t) for g, t in pairs if not (type(g).__name__ == "SubD" or is_rhino_mesh(g))]
    meshes = []
    if shapes:
        shapes, origin = recentred(shapes)
        joined = join_shapes(shapes, min(tolerance, _MOST_TOLERANCE * extent_of(shapes)))
        meshed = mesh_brep(joined, wanted=wanted, tolerance=tolerance, progress=progress)
        meshes.append(replace(meshed, vertices=meshed.vertices + origin))
    for geometry, transform in pairs:
        if type(geometry).__name__ == "SubD":
            meshes.append(mesh_subd(geometry, wanted=wanted, transform=transform))
        elif is_rhino_mesh(geometry):
            meshes.append(_plain_mesh(geometry, transform))
    extent = float(np.linalg.norm(np.ptp(np.concatenate([m.vertices for m in meshes]), axis=0)))
    return join_meshes(split_parts(meshes), tolerance=min(tolerance, _MOST_TOLERANCE * extent))


def _plain_mesh(mesh: Any, transform: Floats | None) -> MeshedObject:
    """A Rhino mesh by itself, moved."""
    moved = np.eye(4) if transform is None else transform
    vertices = checked_vertices(rhino_vertices(mesh))
    polygons, _ = checked_faces(RawMesh(vertices, rhino_faces(mesh)))
    faces, _ = split_faces(vertices, first_equal_point(vertices)[polygons])
    if np.linalg.det(moved[:3, :3]) < 0:
        faces = faces[:, [0, 2, 1]]
    return MeshedObject(vertices @ moved[:3, :3].T + moved[:3, 3], faces, UNTOLD)


def as_brep(geometry: Any) -> Any:
    """A ``rhino3dm.Brep`` of a Brep, an extrusion or a surface.

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
