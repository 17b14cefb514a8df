"""Inputs of components: any geometry as a surface in the unit of the document, curves, and lists of numbers."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, Optional, Union

from weavecore import pipeline
from weavecore.canvas.solve import Run
from weavecore.errors import NoSurface, Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.model import SurfaceMesh
from weavecore.rhino_geometry import plane_from
from weavecore.units import METRES, Length


def read_geometry(
    run: Run,
    geometry: Any,
    *,
    layer: Optional[str] = None,
    name: Optional[str] = None,
    edge: Optional[float] = None,
    plane: Any = None,
) -> SurfaceMesh:
    """Read a surface from geometry, the id of an object of Rhino, or the path of a file.

    Parameters
    ----------
    run : Run
    geometry : object
        Geometry of Rhino, a ``Guid``, a path, or a `SurfaceMesh`, which is returned as it is.
    layer, name : str, optional
        Which object of a file is meant.
    edge : float, optional
        Length of an edge where the surface is not a mesh yet, in the document's unit.
    plane : Plane, optional
        Cuts a closed surface in two.

    Returns
    -------
    SurfaceMesh

    Raises
    ------
    WeaveError
        As `weavecore.read_surface` and `weavecore.surface_from`.
    """
    cut_plane = None if plane is None else plane_from(plane)
    if isinstance(geometry, SurfaceMesh):
        return geometry
    if isinstance(geometry, (str, os.PathLike)):
        path = run.folder / os.fspath(geometry).strip().strip('"')
        unit = run.document.unit
        target = Length(edge, unit) if edge is not None and unit in METRES else edge
        options: dict[str, Any] = {"edge_target": target, "cut_plane": cut_plane, "progress": run.progress}
        surface = pipeline.read_surface(path, layer=layer, object=name, guarded=_can_be_guarded(), **options)
        return _in_unit(surface, unit, run.remark)
    geometry = referenced(geometry)
    unit, tolerance = run.document
    return pipeline.surface_from(
        geometry, unit=unit, tolerance=tolerance, edge_target=edge, cut_plane=cut_plane, progress=run.progress
    )


def _in_unit(surface: SurfaceMesh, unit: str, remark: Callable[[str], None]) -> SurfaceMesh:
    """The surface in another unit; unchanged where either unit is not known."""
    if surface.unit == unit or surface.unit not in METRES or unit not in METRES:
        return surface
    # A division leaves one rounding less: 120 mm are 0.12 m to the last bit.
    per_unit = METRES[unit] / METRES[surface.unit]
    remark(f"The file is in {surface.unit}, the document in {unit}: scaled by {1 / per_unit:g}.")
    return replace(surface, vertices=surface.vertices / per_unit, tolerance=surface.tolerance / per_unit, unit=unit)


def _can_be_guarded() -> bool:
    """Whether a child process can read a file, so that a damaged one does not crash this one.

    Not inside Rhino, where ``sys.executable`` would start Rhino once more.
    """
    return Path(sys.executable or "").stem.lower().startswith("python")


def read_curves(run: Run, values: Any) -> Optional[list[Floats]]:
    """Points along the curves that come to an input of list access.

    Parameters
    ----------
    run : Run
    values : iterable
        Curves of Rhino, or the ids of such objects.

    Returns
    -------
    list of (n, 3) float64, or None where there are none

    Raises
    ------
    WeaveError
        As `weavecore.reading.curves_from`.
    """
    found = [referenced(value) for value in values or ()]
    curves = [curve for curve in found if curve is not None]
    return pipeline.curves_from(curves, tolerance=run.document.tolerance) or None


def referenced(value: Any) -> Any:
    """A value, or of an id the geometry of that object of the open document, or of Grasshopper's one for scripts.

    Parameters
    ----------
    value : object
        Geometry, or a ``Guid``.

    Raises
    ------
    NoSurface
        Where no document has such an object.
    """
    if type(value).__name__ != "Guid":
        return value
    for objects in _tables():
        find = getattr(objects, "FindId", None) or objects.Find
        found = find(value)
        if found is not None:
            return found.Geometry
    raise NoSurface("The document has no such object", remedy="Pick it again.", ids=[value], kind="object")


def _tables() -> list[Any]:
    """The objects of both documents, as far as there are any."""
    documents = [import_module("Rhino").RhinoDoc.ActiveDoc, getattr(import_module("scriptcontext"), "doc", None)]
    return [document.Objects for document in documents if document is not None]


def numbers(values: Any) -> Union[float, list[float], None]:
    """The numbers that come to an input of list access.

    Parameters
    ----------
    values : None, number or iterable of numbers and None

    Returns
    -------
    None, float or list of float
        None where there are none, a single one by itself.
    """
    if values is None or isinstance(values, (int, float)):
        return values
    found = [float(value) for value in values if value is not None]
    return found if len(found) > 1 else found[0] if found else None


def diameters(values: Any) -> Optional[list[float]]:
    """The stock diameters that come to an input of list access.

    Parameters
    ----------
    values : None, number or iterable of numbers and None

    Returns
    -------
    list of float, or None where there are none
    """
    found = numbers(values)
    return [float(found)] if isinstance(found, (int, float)) else found


def chosen(values: Any) -> Optional[list[int]]:
    """The whole numbers that come to an input of list access.

    Parameters
    ----------
    values : None, number or iterable of numbers and None

    Returns
    -------
    list of int, or None where there are none
    """
    found = [values] if isinstance(values, (int, float)) else values or ()
    return [int(value) for value in found if value is not None] or None


def named(value: Optional[str], names: Sequence[str], label: str) -> Optional[str]:
    """One of some names, however its letters are written; None where there is no text.

    Parameters
    ----------
    value : str, optional
    names : sequence of str
    label : str
        What is named, for the message.

    Raises
    ------
    Unsupported
        Where it is none of them.
    """
    if value is None or not str(value).strip():
        return None
    wanted = str(value).strip().strip('"').lower()
    for name in names:
        if name.lower() == wanted:
            return name
    raise Unsupported(f"Unknown {label} {value!r}", remedy=f"Use one of: {', '.join(names)}.")
