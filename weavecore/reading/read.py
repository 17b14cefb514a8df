"""Stage 1: a file, or geometry, → `SurfaceMesh`."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any, Optional

import numpy as np

from weavecore.errors import NoSurface, UnitUnknown, Unsupported
from weavecore.files import PathLike
from weavecore.model import SurfaceMesh
from weavecore.reading.choosing import choose_object
from weavecore.reading.mesh_files import MESH_READERS, read_mesh_file
from weavecore.reading.raw import RawMesh
from weavecore.reading.repair import Plane, repair
from weavecore.reading.rhino_file import RhinoDocument, RhinoObject, open_document
from weavecore.reading.rhino_meshes import is_array_mesh, is_rhino_mesh, rhino_faces, rhino_vertices

RHINO = ".3dm"
ENDINGS = (RHINO, *MESH_READERS)


def read_surface(
    path: PathLike,
    *,
    layer: Optional[str] = None,
    object: Optional[str] = None,  # noqa: A002
    cut_plane: Optional[Plane] = None,
    edge_target: Optional[float] = None,
) -> SurfaceMesh:
    """Read the surface that a file holds.

    Parameters
    ----------
    path : path
        Ends with ``.3dm``, ``.obj``, ``.off``, ``.ply`` or ``.stl``.
    layer, object : str, optional
        Which object of a Rhino file is meant: see `choose_object`.
    cut_plane : (point, normal), optional
        Closed parts that this plane meets are cut in two by it; others by themselves.
    edge_target : float, optional
        Length of an edge where the surface is no mesh yet, in the file's unit.

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
    raw = read_raw(path, layer=layer, object=object, edge_target=edge_target)
    if raw.unit == "None" and is_rhino(path):
        warnings.warn(UnitUnknown(f"{path} says no unit; lengths are taken as they are"), stacklevel=2)
    return repair(raw, cut_plane=cut_plane)


def surface_from(
    geometry: Any,
    *,
    unit: str = "None",
    tolerance: float = 0.0,
    name: str = "",
    cut_plane: Optional[Plane] = None,
    edge_target: Optional[float] = None,
) -> SurfaceMesh:
    """Make the surface of geometry that is in memory.

    Parameters
    ----------
    geometry : object
        A mesh of rhino3dm or RhinoCommon, other rhino3dm geometry, a pair (vertices, faces),
        or what has ``vertices`` and ``faces``, as a trimesh.Trimesh.
    unit, tolerance, name
        As in `SurfaceMesh`.
    cut_plane, edge_target
        As in `read_surface`.

    Raises
    ------
    Unsupported
        Where it is none of these; else as `read_surface`.
    """
    raw = raw_from(geometry, unit=unit, tolerance=tolerance, name=name, edge_target=edge_target)
    return repair(raw, cut_plane=cut_plane)


def read_raw(
    path: PathLike,
    *,
    layer: Optional[str] = None,
    object: Optional[str] = None,  # noqa: A002
    edge_target: Optional[float] = None,
) -> RawMesh:
    """Read a file as plain arrays, with nothing checked or mended that the format does not ask for.

    This is the part that touches the file: it can run in a process of its own.
    """
    if is_rhino(path):
        document = open_document(path)
        return raw_from_document(document, choose_object(document, layer=layer, object=object), edge_target=edge_target)
    check_ending(path)
    if layer is not None or object is not None:
        raise NoSurface(
            f"{Path(path).name} is a mesh file, which has no layers or named objects",
            remedy="Leave the layer and the name of the object away.",
        )
    return read_mesh_file(path)


def raw_from_document(document: RhinoDocument, chosen: RhinoObject, *, edge_target: Optional[float] = None) -> RawMesh:
    """The arrays of one object of a Rhino file."""
    return raw_from(
        chosen.geometry,
        unit=document.unit,
        tolerance=document.tolerance,
        name=chosen.name or Path(document.file_name).stem,
        edge_target=edge_target,
    )


def raw_from(geometry: Any, *, unit: str, tolerance: float, name: str, edge_target: Optional[float] = None) -> RawMesh:
    """The arrays of geometry that is in memory."""
    notes: tuple[str, ...] = ()
    if is_rhino_mesh(geometry):
        vertices, faces = rhino_vertices(geometry), rhino_faces(geometry)
    elif is_array_mesh(geometry):
        vertices, faces = np.asarray(geometry.vertices), np.asarray(geometry.faces)
    elif isinstance(geometry, (tuple, list)) and len(geometry) == 2:
        vertices, faces = np.asarray(geometry[0]), np.asarray(geometry[1])
    elif hasattr(geometry, "ObjectType"):
        from weavecore.reading.rhino_surfaces import mesh_object

        vertices, faces, notes = mesh_object(geometry, edge_target=edge_target, tolerance=tolerance or None)
    else:
        raise Unsupported(
            f"Geometry of the kind {type(geometry).__name__}",
            remedy="Give a mesh, a surface of rhino3dm, or a pair (vertices, faces).",
        )
    return RawMesh(vertices, faces, unit=unit, tolerance=tolerance, name=name, notes=tuple(notes))


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
