"""Curves of Rhino as points along them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from weavecore.errors import Degenerate
from weavecore.geometry.arrays import Floats
from weavecore.rhino_geometry.arrays import rows_from

_ANGLE = math.radians(10)


def is_rhino_curve(geometry: Any) -> bool:
    """Whether it is a curve, line, arc, circle, rectangle or polyline of rhino3dm or RhinoCommon."""
    return hasattr(geometry, "ToNurbsCurve") or _is_line(geometry)


def is_curve_in_rhino(geometry: Any) -> bool:
    """Whether it is one that Rhino, not rhino3dm, holds in memory."""
    return is_rhino_curve(geometry) and hasattr(geometry, "GetType")


def line_points(geometry: Any) -> Floats | None:
    """Both ends (2, 3) of a line; None of any other curve."""
    return rows_from([geometry.From, geometry.To], "XYZ") if _is_line(geometry) else None


def curve_in_rhino_points(curve: Any, tolerance: float) -> Floats:
    """Points (n, 3) along a curve of RhinoCommon, no further from the lines between them than a tolerance.

    Raises
    ------
    Degenerate
        Where Rhino makes no polyline of it.
    """
    ends = line_points(curve)
    if ends is not None:
        return ends
    form = curve if hasattr(curve, "ToPolyline") else curve.ToNurbsCurve()
    drawn = form.ToPolyline(tolerance, _ANGLE, 0.0, 0.0) if form is not None else None
    if drawn is None:
        raise Degenerate(
            f"Rhino makes no polyline of this {type(curve).__name__}",
            remedy="Look with Rhino's command Check at what is wrong with it.",
        )
    points: Floats = np.asarray(rows_from([drawn.Point(i) for i in range(drawn.PointCount)], "XYZ"), np.float64)
    return points


def _is_line(geometry: Any) -> bool:
    return hasattr(geometry, "From") and hasattr(geometry, "To")
