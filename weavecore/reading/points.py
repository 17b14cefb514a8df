"""Points and curves on a layer of a Rhino file, at which a weave is held or loaded.

A point or point cloud gives single places, a curve the points along it (`weavecore.reading.curves`).  The force on a
place is a user text of its object, ``force`` = ``x, y, z`` in newtons.  Lengths are converted to the weave's unit.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Optional

import numpy as np

from weavecore.errors import NoCurve, Unreadable
from weavecore.files import PathLike
from weavecore.geometry.arrays import Floats
from weavecore.reading.choose import matching_layers
from weavecore.reading.curves import curve_from
from weavecore.reading.formats.rhino_3dm import CURVE, IN_BLOCK, RhinoDocument, RhinoObject, open_document
from weavecore.reading.sandbox import call_guarded, limits_for
from weavecore.units import METRES

FORCE = "force"
"""Key of the user text that holds the force on a place."""

_POINT, _CLOUD = "Point", "PointSet"
"""Rhino's names for points and point clouds."""

Progress = Callable[[float, str], None]
Places = list[tuple[Floats, Optional[Floats]]]
"""Points (n, 3) of each point or curve, and the force (3,) in N on it where its object has one."""


def read_places(
    path: PathLike,
    *,
    layer: Optional[str] = None,
    unit: Optional[str] = None,
    guarded: bool = False,
    time_limit: Optional[float] = None,
    progress: Optional[Progress] = None,
) -> Places:
    """Read the points and curves of a Rhino file.

    Parameters
    ----------
    path : path
        Ends with ``.3dm``.
    layer : str, optional
        Full path or name of a layer; by default all that is visible.
    unit : str, optional
        Rhino's name of the unit to convert to; by default the file's.
    guarded, time_limit, progress
        As in `read_surface`.

    Returns
    -------
    list of ((n, 3) float64, (3,) float64 or None)
        A single row for a point, more for a curve; and the force.

    Raises
    ------
    NoCurve
        Where the layer is not there, or has no points and curves.
    Unreadable, Unsupported, NonFinite, TooMuchWork
    """
    if guarded:
        limits = limits_for(path, time_limit=time_limit)
        read: Places = call_guarded(_read_places, path, limits=limits, progress=progress, layer=layer, unit=unit)
        return read
    return _read_places(path, layer=layer, unit=unit, progress=progress)


def _read_places(
    path: PathLike, *, layer: Optional[str], unit: Optional[str], progress: Optional[Progress] = None
) -> Places:
    document = open_document(path)
    if progress is not None:
        progress(1.0, "Reading points and curves")
    # A division leaves one rounding less: 120 mm are 0.12 m to the last bit.
    per_unit = METRES[unit] / METRES[document.unit] if unit in METRES and document.unit in METRES else 1.0
    return [
        (points / per_unit, force)
        for one in _chosen(document, layer)
        for force in [_force_of(document, one)]
        for points in _points_of(one, document.tolerance)
    ]


def _chosen(document: RhinoDocument, layer: Optional[str]) -> list[RhinoObject]:
    known = [one for one in document.objects if one.kind in (CURVE, _POINT, _CLOUD) and one.aside != IN_BLOCK]
    if layer is None:
        found, where = [one for one in known if not one.aside], "that are visible"
    else:
        layers = matching_layers(document.layers, layer)
        found, where = [one for one in known if one.layer in layers], f"on a layer {layer!r}"
    if not found:
        used = sorted({one.layer for one in known})
        raise NoCurve(
            f"{document.file_name} has no points and curves {where}",
            remedy="Name one of these layers: FILE.3dm:LAYER." if used else "Draw them where the weave is held.",
            ids=used,
            kind="layer",
        )
    return found


def _points_of(one: RhinoObject, tolerance: float) -> list[Floats]:
    """Points (n, 3) of a curve, or (1, 3) of each point."""
    if one.kind == CURVE:
        return [curve_from(one.geometry, tolerance=tolerance)]
    points = [one.geometry.Location] if one.kind == _POINT else one.geometry.GetPoints()
    return [np.array([[point.X, point.Y, point.Z]]) for point in points]


def _force_of(document: RhinoDocument, one: RhinoObject) -> Optional[Floats]:
    text = _user_texts(document, one).get(FORCE)
    if text is None:
        return None
    try:
        force = np.array([float(word) for word in text.split(",")])
    except ValueError:
        force = np.zeros(0)
    if force.shape != (3,) or not np.isfinite(force).all():
        raise Unreadable(
            f"The user text {FORCE} of {one} is not a force: {text[:40]!r}",
            remedy="Write its parts in newtons with commas between: 0, 0, -10.",
        )
    return force


def _user_texts(document: RhinoDocument, one: RhinoObject) -> dict[str, str]:
    """The user texts of an object."""
    found: Any = document.source.Objects.FindId(one.id)
    return dict(found.Attributes.GetUserStrings()) if found is not None else {}
