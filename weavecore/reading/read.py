"""Stage 1: a file, or geometry in memory → `SurfaceMesh`.

file ─▶ choose ─▶ (join) ─▶ nurbs_mesher or rhino3dm mesh or formats ─▶ RawMesh ─▶ repair ─▶ SurfaceMesh
"""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any, Callable, Optional, Union

import numpy as np

from weavecore.errors import NoSurface, UnitUnknown, Unsupported
from weavecore.files import PathLike
from weavecore.model import Note, SurfaceMesh
from weavecore.model.surface import Origins
from weavecore.polling import pollable
from weavecore.reading.choose import Names, choose_objects, listed_names
from weavecore.reading.formats.mesh_file import MESH_READERS, read_mesh_file
from weavecore.reading.formats.rhino_3dm import BLOCK, RhinoDocument, RhinoObject, open_document
from weavecore.reading.join_objects import join_objects
from weavecore.reading.nurbs_mesher import MeshedObject, mesh_block, mesh_object, mesh_objects
from weavecore.reading.pieces import select_parts
from weavecore.reading.raw import Plane, RawMesh, RepairOptions, is_array_mesh
from weavecore.reading.repair import repair
from weavecore.reading.sandbox import call_guarded, limits_for
from weavecore.rhino_geometry import is_to_be_meshed, mesh_in_rhino
from weavecore.rhino_geometry.conversion import is_rhino_mesh, rhino_faces, rhino_vertices
from weavecore.texts import printable
from weavecore.units import Length

Progress = Callable[[float, str], None]

RHINO = ".3dm"
"""Ending of Rhino files."""

LengthOrNumber = Union[float, Length]
"""A length in the file's unit, or with a unit of its own."""

OUTER = "outer"
"""The side of a thin solid that can be chosen."""

ENDINGS = (RHINO, *MESH_READERS)
"""Endings of all files that hold a surface."""


@pollable
def read_surface(
    path: PathLike,
    *,
    layer: Names = None,
    object: Names = None,  # noqa: A002 - what a user calls it
    cut_plane: Optional[Plane] = None,
    edge_target: Optional[LengthOrNumber] = None,
    spacing: Optional[LengthOrNumber] = None,
    guarded: bool = False,
    time_limit: Optional[float] = None,
    progress: Optional[Progress] = None,
    weld: Optional[LengthOrNumber] = None,
    fill_holes: Optional[LengthOrNumber] = None,
    largest: bool = False,
    side: Optional[str] = None,
) -> SurfaceMesh:
    """Read the surface that a file holds.

    Parameters
    ----------
    path : path
        Ends with ``.3dm``, ``.obj``, ``.off``, ``.ply`` or ``.stl``.
    layer, object : str or sequence of str, optional
        Which object of a Rhino file to read: see `choose_objects`.  Several are joined where their edges coincide;
        those of one layer or one name must be connected.  In an ``.obj`` the name of an object or a group.
    cut_plane : (point, normal), optional
        Cuts the closed components that it intersects; the others are cut automatically.
    edge_target : float or Length, optional
        Longest edge if the surface is not a mesh yet, in the file's unit, or with a unit of its own; by default from
        the size, the curvature and the spacing: see `mesh_object`.
    spacing : float or Length, optional
        Spacing at which the surface will be woven.
    guarded : bool
        Read in a sandboxed worker, so that a damaged file can neither end this process nor block it.
    time_limit : float, optional
        Seconds that the worker may take; by default from the size of the file: see `limits_for`.
    progress : callable, optional
        Called with a fraction and a label; raising in it cancels.
    weld : float or Length, optional
        Vertices of borders that are no further apart are welded; by default the file's tolerance, or a millionth of the
        size where it states none.
    fill_holes : float or Length, optional
        Borders up to this length are closed, but the longest of each piece.
    largest : bool
        Whether only the piece with the largest area is read.
    side : str, optional
        ``"outer"``: only the outer side of a thin solid.

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
        Where a Rhino file has no unit.
    """
    fineness = {"edge_target": edge_target, "spacing": spacing}
    _check_side(side)
    options: dict[str, Any] = {"layer": layer, "object": object, **fineness, "progress": progress}
    options["repairs"] = {"weld": weld, "fill_holes": fill_holes, "is_largest_only": largest, "side": side}
    if guarded:
        limits = limits_for(path, time_limit=time_limit, is_fineness_asked=edge_target is not None)
        surface: SurfaceMesh = call_guarded(
            _read_and_repair, path, cut_plane=cut_plane, limits=limits, classes=(SurfaceMesh, Origins, Note), **options
        )
    else:
        surface = _read_and_repair(path, cut_plane=cut_plane, **options)
    if surface.unit == "None" and is_rhino(path):
        guess = f"{path} has no unit; lengths are used as they are"
        warnings.warn(UnitUnknown(guess), stacklevel=3)  # `pollable` lies between.
        surface = surface.with_notes((*surface.notes, Note(UnitUnknown.code, f"{guess}.")))
    return surface


def _read_and_repair(
    path: PathLike, *, cut_plane: Optional[Plane], repairs: dict[str, Any], **options: Any
) -> SurfaceMesh:
    raw = read_raw(path, **options)
    progress = options["progress"]
    if progress is not None:
        progress(1.0, "Repairing the mesh")
    lengths = {key: _in_unit(repairs[key], raw.unit) for key in ("weld", "fill_holes")}
    return repair(raw, cut_plane=cut_plane, options=RepairOptions(**{**repairs, **lengths}))


@pollable
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
    weld: Optional[float] = None,
    fill_holes: Optional[float] = None,
    largest: bool = False,
    side: Optional[str] = None,
) -> SurfaceMesh:
    """Make the surface of geometry in memory.

    Parameters
    ----------
    geometry : object
        A mesh, Brep, surface, extrusion or SubD of rhino3dm or RhinoCommon, a pair (vertices, faces), or an object
        with ``vertices`` and ``faces``, as a trimesh.Trimesh.
    unit, tolerance, name
        As in `SurfaceMesh`.
    cut_plane, edge_target, spacing, progress, weld, fill_holes, largest, side
        As in `read_surface`; lengths are in the unit of the geometry.

    Returns
    -------
    SurfaceMesh

    Raises
    ------
    Unsupported
        Where it is none of these; else as `read_surface`.
    """
    _check_side(side)
    raw = _raw_from(geometry, edge_target=edge_target, spacing=spacing, tolerance=tolerance, progress=progress)
    options = RepairOptions(weld=weld, fill_holes=fill_holes, is_largest_only=largest, side=side)
    return repair(replace(raw, unit=unit, tolerance=tolerance, name=name), cut_plane=cut_plane, options=options)


def read_raw(
    path: PathLike,
    *,
    layer: Names = None,
    object: Names = None,  # noqa: A002 - what a user calls it
    edge_target: Optional[LengthOrNumber] = None,
    spacing: Optional[LengthOrNumber] = None,
    progress: Optional[Progress] = None,
) -> RawMesh:
    """Read a file as plain arrays; only what the format demands is checked or repaired.

    This is the part that touches the file: it can run in a process of its own.

    Parameters
    ----------
    path, layer, object, edge_target, spacing, progress
        As in `read_surface`.

    Returns
    -------
    RawMesh

    Raises
    ------
    Unreadable, Unsupported, TooMuchWork, NoSurface, AmbiguousSurface, NonFinite, BadIndex, Degenerate
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
        return join_objects(document, choice.objects, must_connect=not choice.is_listed, **options)
    check_ending(path)
    if layer is not None or (object is not None and Path(path).suffix.lower() != ".obj"):
        raise NoSurface(
            f"{Path(path).name} is a mesh file, which has no layers or named objects",
            remedy="Omit the layer and the object name.",
        )
    raw = read_mesh_file(path)
    return raw if object is None else select_parts(raw, listed_names(object), Path(path).name)


def raw_from_document(
    document: RhinoDocument,
    chosen: RhinoObject,
    *,
    edge_target: Optional[float] = None,
    spacing: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> RawMesh:
    """The arrays of one object of a Rhino file.

    Parameters
    ----------
    document : RhinoDocument
    chosen : RhinoObject
    edge_target, spacing : float, optional
        As in `mesh_object`, in the unit of the document.
    progress : callable, optional
        Called with a fraction and a label.

    Returns
    -------
    RawMesh

    Raises
    ------
    As `surface_from` and `mesh_block`.
    """
    name = printable(chosen.name or Path(document.file_name).stem)
    options: dict[str, Any] = {
        "tolerance": document.tolerance,
        "edge_target": edge_target,
        "spacing": spacing,
        "progress": progress,
    }
    if chosen.kind == BLOCK:
        raw = _raw_from_meshed(mesh_block(document.source, chosen.geometry, **options))
    else:
        raw = _raw_from(chosen.geometry, **options)
    return replace(raw, unit=document.unit, tolerance=document.tolerance, name=name)


def _raw_from(
    geometry: Any,
    *,
    edge_target: Optional[float] = None,
    spacing: Optional[float] = None,
    tolerance: float = 0.0,
    progress: Optional[Progress] = None,
) -> RawMesh:
    """The arrays of geometry in memory.

    Raises
    ------
    Unsupported
        Where it is none of the kinds that `surface_from` names.
    """
    if is_rhino_mesh(geometry):
        return RawMesh(rhino_vertices(geometry), rhino_faces(geometry))
    if is_array_mesh(geometry):
        return _raw_from((geometry.vertices, geometry.faces))
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
        return _raw_from(meshes[0]) if len(meshes) == 1 else _raw_from_meshed(mesh_objects(meshes, tolerance=tolerance))
    raise Unsupported(
        f"A {type(geometry).__name__} is not geometry that can be read",
        remedy="Give a mesh or a surface of Rhino, or a pair (vertices, faces).",
    )


def _raw_from_meshed(meshed: MeshedObject) -> RawMesh:
    return RawMesh(meshed.vertices, meshed.faces, notes=meshed.notes, n_borders_expected=meshed.n_borders_expected)


def _check_side(side: Optional[str]) -> None:
    if side not in (None, OUTER):
        raise Unsupported(f"Unknown side {side!r}", remedy=f"Take {OUTER!r}, or omit it for the whole surface.")


def _in_unit(length: Optional[LengthOrNumber], unit: str) -> Optional[float]:
    return length.in_unit(unit) if isinstance(length, Length) else length


def is_rhino(path: PathLike) -> bool:
    """Whether the ending is that of a Rhino file.

    Parameters
    ----------
    path : path
    """
    return Path(path).suffix.lower() == RHINO


def check_ending(path: PathLike) -> None:
    """Refuse a file with an ending that is not supported.

    Parameters
    ----------
    path : path

    Raises
    ------
    Unsupported
    """
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise Unsupported(
            f"Files with the ending {ending} are not read ({path})" if ending else f"{path} has no file ending",
            remedy=f"Use one of: {', '.join(ENDINGS)}.",
        )
