"""Inputs of components: any geometry as a surface in the unit of the document, curves, and lists of numbers."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import Any, Optional, Union

import numpy as np

from weavecore import pipeline
from weavecore.canvas.solve import Run
from weavecore.errors import NoSurface, Unsupported
from weavecore.geometry.arrays import Floats
from weavecore.model import SurfaceMesh
from weavecore.rhino_geometry import plane_from
from weavecore.units import METRES, Length

USUAL_STYLE = "usual"
"""The style of over and under that goes with a pattern, on a list beside the others."""


def read_geometry(
    run: Run,
    geometry: Any,
    *,
    layer: Optional[str] = None,
    name: Optional[str] = None,
    edge: Optional[float] = None,
    plane: Any = None,
    weld: Optional[float] = None,
    fill_holes: Optional[float] = None,
    largest: Optional[bool] = None,
    side: Optional[str] = None,
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
    weld, fill_holes, largest, side
        As in `weavecore.read_surface`; lengths are in the document's unit.

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
        lengths = {"edge_target": edge, "weld": weld, "fill_holes": fill_holes}
        options: dict[str, Any] = {key: _with_unit(length, unit) for key, length in lengths.items()}
        options.update(largest=bool(largest), side=side, cut_plane=cut_plane, progress=run.progress)
        surface = pipeline.read_surface(path, layer=layer, object=name, guarded=_can_be_guarded(), **options)
        return _in_unit(surface, unit, run.remark)
    geometry = referenced(geometry)
    unit, tolerance = run.document
    return pipeline.surface_from(
        geometry,
        unit=unit,
        tolerance=tolerance,
        edge_target=edge,
        cut_plane=cut_plane,
        progress=run.progress,
        weld=weld,
        fill_holes=fill_holes,
        largest=bool(largest),
        side=side,
    )


def _with_unit(length: Optional[float], unit: str) -> Union[Length, float, None]:
    """A length of the document, for a file in a unit of its own; a number where the document's is not known."""
    return Length(length, unit) if length is not None and unit in METRES else length


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


def numbers(values: Any, label: str = "spacing") -> Union[float, list[float], None]:
    """The numbers that come to an input of list access.

    Parameters
    ----------
    values : None, number, text of a number, or iterable of these
    label : str
        Name of the input, for the message.

    Returns
    -------
    None, float or list of float
        None where there are none, a single one by itself.

    Raises
    ------
    Unsupported
        Where one of them is not a number.
    """
    found = [_number(value, label) for value in _items(values)]
    return found if len(found) > 1 else found[0] if found else None


def read_factors(points: Any, factors: Any) -> list[tuple[Floats, float]]:
    """Points with factors of the spacing; the last factor is taken for the points that have none.

    Parameters
    ----------
    points, factors : None or iterable
        Points of Rhino or ids of such objects, and numbers.

    Returns
    -------
    list of ((3,), float)

    Raises
    ------
    Unsupported
        Where there are points without factors, more factors than points, or one of them is neither.
    """
    places = [coordinates(referenced(value)) for value in _items(points)]
    values = [_number(value, "factors") for value in _items(factors)]
    if any(place is None for place in places):
        raise Unsupported("The points must be points", remedy="Wire points to points, and factors to factors.")
    if bool(places) != bool(values):
        raise Unsupported("Points need factors, and factors points", remedy="Wire both, or none.")
    if len(values) > len(places):
        raise Unsupported(
            f"There are {len(values)} factors for {len(places)} points", remedy="Wire a point for each factor."
        )
    values += values[-1:] * (len(places) - len(values))
    return [(place, value) for place, value in zip(places, values) if place is not None]


def diameters(values: Any) -> Optional[list[float]]:
    """The stock diameters that come to an input of list access.

    Parameters
    ----------
    values : None, number or iterable of numbers and None

    Returns
    -------
    list of float, or None where there are none

    Raises
    ------
    Unsupported
    """
    return [_number(value, "stock") for value in _items(values)] or None


def chosen(run: Run, values: Any, surface: SurfaceMesh) -> Optional[list[int]]:
    """The borders that come to an input of list access: by their places, or by points and curves near them.

    Parameters
    ----------
    run : Run
    values : None, number or iterable of numbers, points, curves and None
    surface : SurfaceMesh

    Returns
    -------
    list of int, or None where there are none
        Each border once.

    Raises
    ------
    Unsupported
        Where a number is not whole, or the surface has no border to be near to.
    """
    found = []
    for value in _items(values):
        if isinstance(value, (int, float, str)):
            number = _number(value, "borders")
            if number != round(number):
                raise Unsupported(f"A border has a whole number (got {number:g})", remedy="Wire 0, 1, 2…")
            found.append(round(number))
        else:
            found.append(_nearest_border(run, value, surface))
    return list(dict.fromkeys(found)) or None


def _nearest_border(run: Run, value: Any, surface: SurfaceMesh) -> int:
    """The border that is nearest to a point, or on average to a curve."""
    if not surface.borders:
        raise Unsupported("The surface has no border to be near to", remedy="Leave borders unwired.")
    geometry = referenced(value)
    place = coordinates(geometry)
    points = place[None] if place is not None else _curve_points(run, geometry)
    gaps = [_gaps(points, surface.vertices[loop]).mean() for loop in surface.borders]
    return int(np.argmin(gaps))


def _curve_points(run: Run, curve: Any) -> Floats:
    (points,) = pipeline.curves_from([curve], tolerance=run.document.tolerance)
    return points


def _gaps(points: Floats, vertices: Floats) -> Floats:
    gaps: Floats = np.sqrt(((points[:, None] - vertices) ** 2).sum(2).min(1))
    return gaps


def coordinates(value: Any) -> Optional[Floats]:
    """(3,) of a point or vector of Rhino; None of anything else.

    Parameters
    ----------
    value : object
    """
    place = getattr(value, "Location", value)
    if all(hasattr(place, name) for name in "XYZ"):
        return np.array([place.X, place.Y, place.Z], np.float64)
    return None


def _items(values: Any) -> list[Any]:
    """What comes to an input of list access, without the Nones; a single value, or geometry, by itself."""
    if values is None:
        return []
    if isinstance(values, (int, float, str)) or coordinates(values) is not None or hasattr(values, "Domain"):
        return [values]
    return [value for value in values if value is not None]


def _number(value: Any, label: str) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise Unsupported(f"{label} must be a number (got {value!r})", remedy="Wire a number.") from None


def plain(text: Optional[str]) -> Optional[str]:
    """A name as weavecore writes it: small letters, no quotes or spaces about it; None where there is no text.

    Parameters
    ----------
    text : str, optional
    """
    return (text or "").strip().strip('"').lower() or None


def style_or_none(text: Optional[str]) -> Optional[str]:
    """The style of over and under; None where there is no text, or it asks for the usual one of the pattern.

    Parameters
    ----------
    text : str, optional
    """
    style = plain(text)
    return None if style == USUAL_STYLE else style


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
    wanted = plain(value)
    if wanted is None:
        return None
    for name in names:
        if name.lower() == wanted:
            return name
    raise Unsupported(f"Unknown {label} {value!r}", remedy=f"Use one of: {', '.join(names)}.")
