"""Stage 1: a file, or geometry, → `SurfaceMesh`."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Optional, Union

import numpy as np

from weavecore.errors import NoSurface, UnitUnknown, Unsupported
from weavecore.files import PathLike
from weavecore.model import SurfaceMesh
from weavecore.reading.choose import Names, choose_objects
from weavecore.reading.formats.mesh_file import MESH_READERS, read_mesh_file
from weavecore.reading.formats.rhino_3dm import BLOCK, RhinoDocument, RhinoObject, open_document
from weavecore.reading.join_objects import join_objects
from weavecore.reading.nurbs_mesher import UNTOLD, MeshedObject, mesh_block, mesh_object, mesh_objects
from weavecore.reading.raw import Plane, RawMesh, is_array_mesh, is_rhino_mesh, rhino_faces, rhino_vertices
from weavecore.reading.repair import repair
from weavecore.reading.sandbox import call_guarded, limits_for
from weavecore.rhino_geometry import is_to_be_meshed, mesh_in_rhino
from weavecore.units import Length

Progress = Callable[[float, str], None]

RHINO = ".3dm"
TypedLength = Union[float, Length]
"""A length in the file's unit, or with a unit of its own."""

ENDINGS = (RHINO, *MESH_READERS)


def read_surface(
    path: PathLike,
    *,
    layer: Names = None,
    object: Names = None,  # noqa: A002 - what a user calls it
    cut_plane: Optional[Plane] = None,
    edge_target: Optional[TypedLength] = None,
    spacing: Optional[TypedLength] = None,
    guarded: bool = False,
    time_limit: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> SurfaceMesh:
    """Read the surface that a file holds.

    Parameters
    ----------
    path : path
        Ends with ``.3dm``, ``.obj``, ``.off``, ``.ply`` or ``.stl``.
    layer, object : str or sequence of str, optional
        Which object of a Rhino file is meant: see `choose_objects`.  Several are joined where their edges
        coincide; those of one layer or one name must hang together.
    cut_plane : (point, normal), optional
        Closed parts that this plane meets are cut in two by it; others by themselves.
    edge_target : float or Length, optional
        Longest edge where the surface is no mesh yet, in the file's unit, or with a unit of its own; by default
        from the size, the curvature and the spacing: see `mesh_object`.
    spacing : float or Length, optional
        Spacing that the surface will be woven at.
    guarded : bool
        Read in a process of its own, so that a damaged file can neither end this one nor hold it up.
    time_limit : float, optional
        Seconds that this process may take, by default what suits the file: see `limits_for`.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.

    Returns
    -------
    SurfaceMesh

    Raises
    ------
    Unreadable, Unsupported, TooMuchWork, NoSurface, AmbiguousSurface
    NonFinite, BadIndex, TooFarFromOrigin, Degenerate, NonManifold, NotOrientable

    Warns
    -----
    UnitUnknown
        Where a Rhino file says no unit.
    """
    fineness = {"edge_target": edge_target, "spacing": spacing}
    options: dict[str, Any] = {"layer": layer, "object": object, **fineness, "progress": progress}
    if guarded:
        limits = limits_for(path, time_limit=time_limit, is_fineness_asked=edge_target is not None)
        # What comes from another process is checked and frozen again.
        surface: SurfaceMesh = replace(
            call_guarded(_read_and_repair, path, cut_plane=cut_plane, limits=limits, **options)
        )
    else:
        surface = _read_and_repair(path, cut_plane=cut_plane, **options)
    if surface.unit == "None" and is_rhino(path):
        warnings.warn(UnitUnknown(f"{path} says no unit; lengths are taken as they are"), stacklevel=2)
    return surface


def _read_and_repair(path: PathLike, *, cut_plane: Optional[Plane], **options: Any) -> SurfaceMesh:
    raw = read_raw(path, **options)
    tell = options["progress"]
    if tell is not None:
        tell(1.0, "Mending the mesh")
    return repair(raw, cut_plane=cut_plane)


def surface_from(
    geometry: Any,
    *,
    unit: str = "None",
    tolerance: float = 0.0,
    name: str = "",
    cut_plane: Optional[Plane] = None,
    edge_target: Optional[float] = None,
    spacing: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> SurfaceMesh:
    """Make the surface of geometry that is in memory.

    Parameters
    ----------
    geometry : object
        A mesh, Brep, surface, extrusion or SubD of rhino3dm or RhinoCommon, a pair (vertices, faces),
        or what has ``vertices`` and ``faces``, as a trimesh.Trimesh.
    unit, tolerance, name
        As in `SurfaceMesh`.
    cut_plane, edge_target, spacing, progress
        As in `read_surface`; lengths are in the unit of the geometry.

    Raises
    ------
    Unsupported
        Where it is none of these; else as `read_surface`.
    """
    raw = raw_from(geometry, edge_target=edge_target, spacing=spacing, tolerance=tolerance, progress=progress)
    return repair(replace(raw, unit=unit, tolerance=tolerance, name=name), cut_plane=cut_plane)


def read_raw(
    path: PathLike,
    *,
    layer: Names = None,
    object: Names = None,  # noqa: A002 - what a user calls it
    edge_target: Optional[TypedLength] = None,
    spacing: Optional[TypedLength] = None,
    progress: Optional[Progress] = None,
) -> RawMesh:
    """Read a file as plain arrays, with nothing checked or mended that the format does not ask for.

    This is the part that touches the file: it can run in a process of its own.
    """
    if is_rhino(path):
        document = open_document(path)
        choice = choose_objects(document, layer=layer, object=object)
        options: dict[str, Any] = {
            "edge_target": _in_unit(edge_target, document.unit),
            "spacing": _in_unit(spacing, document.unit),
            "progress": progress,
        }
        if len(choice.objects) == 1:
            return raw_from_document(document, choice.objects[0], **options)
        return join_objects(document, choice.objects, must_hang_together=not choice.is_listed, **options)
    check_ending(path)
    if layer is not None or object is not None:
        raise NoSurface(
            f"{Path(path).name} is a mesh file, which has no layers or named objects",
            remedy="Leave the layer and the name of the object away.",
        )
    return read_mesh_file(path)


def raw_from_document(
    document: RhinoDocument,
    chosen: RhinoObject,
    *,
    edge_target: Optional[float] = None,
    spacing: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> RawMesh:
    """The arrays of one object of a Rhino file."""
    name = chosen.name or Path(document.file_name).stem
    options: dict[str, Any] = {
        "tolerance": document.tolerance,
        "edge_target": edge_target,
        "spacing": spacing,
        "progress": progress,
    }
    if chosen.kind == BLOCK:
        raw = _raw_from_meshed(mesh_block(document.source, chosen.geometry, **options))
    else:
        raw = raw_from(chosen.geometry, **options)
    return replace(raw, unit=document.unit, tolerance=document.tolerance, name=name)


def raw_from(
    geometry: Any,
    *,
    edge_target: Optional[float] = None,
    spacing: Optional[float] = None,
    tolerance: float = 0.0,
    progress: Optional[Progress] = None,
) -> RawMesh:
    """The arrays of geometry that is in memory.

    Raises
    ------
    Unsupported
        Where it is none of the kinds that `surface_from` names.
    """
    if is_rhino_mesh(geometry):
        return RawMesh(rhino_vertices(geometry), rhino_faces(geometry))
    if is_array_mesh(geometry):
        return raw_from((geometry.vertices, geometry.faces))
    if isinstance(geometry, (tuple, list)) and len(geometry) == 2:
        try:
            return RawMesh(np.asarray(geometry[0]), np.asarray(geometry[1]))
        except ValueError:
            raise Unsupported("Rows of different lengths", remedy="Give arrays (V, 3) and (F, 3) or (F, 4).") from None
    if type(geometry).__module__.split(".")[0].lstrip("_") == "rhino3dm":
        options: dict[str, Any] = {"edge_target": edge_target, "spacing": spacing, "progress": progress}
        return _raw_from_meshed(mesh_object(geometry, tolerance=tolerance or None, **options))
    if is_to_be_meshed(geometry):
        meshes = mesh_in_rhino(geometry, edge_target=edge_target)
        return raw_from(meshes[0]) if len(meshes) == 1 else _raw_from_meshed(mesh_objects(meshes, tolerance=tolerance))
    raise Unsupported(
        f"Geometry of the kind {type(geometry).__name__}",
        remedy="Give a mesh or a surface of Rhino, or a pair (vertices, faces).",
    )


def _raw_from_meshed(meshed: MeshedObject) -> RawMesh:
    n_borders = None if meshed.loops_expected == UNTOLD else meshed.loops_expected
    return RawMesh(meshed.vertices, meshed.faces, notes=meshed.notes, n_borders_expected=n_borders)


def _in_unit(length: Optional[TypedLength], unit: str) -> Optional[float]:
    return length.in_unit(unit) if isinstance(length, Length) else length


def is_rhino(path: PathLike) -> bool:
    """Whether the ending is that of a Rhino file."""
    return Path(path).suffix.lower() == RHINO


def check_ending(path: PathLike) -> None:
    """Refuse a file whose ending is not one of those that are read.

    Raises
    ------
    Unsupported
    """
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise Unsupported(
            f"{path} ends with {ending or 'nothing'}, which is not read" if ending else f"{path} has no ending",
            remedy=f"Give one of: {', '.join(ENDINGS)}.",
        )
