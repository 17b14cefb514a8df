"""Curves that are in memory, of Rhino or as points, as points along them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from weavecore.errors import BadCurve, TooMuchWork, WeaveError
from weavecore.geometry.arrays import Floats
from weavecore.geometry.nurbs import NurbsCurve, curve_points
from weavecore.reading.rhino_surfaces.shape import nurbs_curve
from weavecore.rhino_geometry import curve_in_rhino_points, is_curve_in_rhino, is_rhino_curve, line_points

_PARTS_OF_SPAN = 4
_TOLERANCE_OF_SIZE = 1e-4
"""Points tell a curve to this part of its size, or to the model's tolerance where that is less."""

_LEAST_OF_SIZE = 1e-7
_MOST_POINTS = 200_000


def curve_from(geometry: Any, *, tolerance: float = 0.0) -> Floats:
    """Points along a curve.

    Parameters
    ----------
    geometry : object
        A curve, line, arc, circle or polyline of rhino3dm or RhinoCommon; or points (n, 3), which are given back.
    tolerance : float
        The model's absolute tolerance; 0 where it is not known.

    Returns
    -------
    (n, 3) float64
        Kinks among them; a closed curve comes back to its first point.

    Raises
    ------
    BadCurve
        Where it is neither.
    Unreadable, NonFinite, TooMuchWork
    """
    ends = line_points(geometry)
    if ends is not None:
        return ends
    if is_curve_in_rhino(geometry):
        box = geometry.BoundingBox if hasattr(geometry, "BoundingBox") else geometry.GetBoundingBox(False)
        return curve_in_rhino_points(geometry, _wanted(float(box.Diagonal.Length), tolerance))
    if is_rhino_curve(geometry):
        form = nurbs_curve(geometry)
        size = float(np.linalg.norm(np.ptp(form.points[:, :3] / form.points[:, 3:], axis=0)))
        return _points_along(form, _wanted(size, tolerance))
    try:
        return np.asarray(geometry, np.float64)
    except (TypeError, ValueError):
        raise BadCurve(
            f"A {type(geometry).__name__} is no curve", remedy="Give a curve of Rhino, or rows of x, y and z."
        ) from None


def curves_from(geometries: Iterable[Any], *, tolerance: float = 0.0) -> list[Floats]:
    """Points along several curves; see `curve_from`.

    Parameters
    ----------
    geometries : iterable
        Of what `curve_from` takes.
    tolerance : float
        The model's absolute tolerance; 0 where it is not known.

    Returns
    -------
    list of (n, 3) float64

    Raises
    ------
    BadCurve
        Where they are no list; or, with its place among them, where one is no curve.
    Unreadable, NonFinite, TooMuchWork
        With the place of the curve.
    """
    try:
        given = list(geometries)
    except TypeError:
        raise BadCurve(
            f"A {type(geometries).__name__} is no list of curves", remedy="Put a single one in a list too: [curve]."
        ) from None
    return [_numbered_curve(number, geometry, tolerance) for number, geometry in enumerate(given)]


def _numbered_curve(number: int, geometry: Any, tolerance: float) -> Floats:
    try:
        return curve_from(geometry, tolerance=tolerance)
    except WeaveError as error:
        raise type(error)(error.what, remedy=error.remedy, ids=[number], kind="curve") from error


def _wanted(size: float, tolerance: float) -> float:
    """How far points may leave a curve of that size."""
    usual = _TOLERANCE_OF_SIZE * size
    return max(min(tolerance, usual), _LEAST_OF_SIZE * size) if tolerance > 0 else usual


def _points_along(curve: NurbsCurve, tolerance: float) -> Floats:
    """Points at all knots, and between them until no middle is further off than the tolerance."""
    knots = np.unique(curve.knots[curve.degree : len(curve.points) + 1])
    t = knots
    if curve.degree > 1:
        shares = np.arange(_PARTS_OF_SPAN) / _PARTS_OF_SPAN
        t = np.append((knots[:-1, None] + np.diff(knots)[:, None] * shares).ravel(), knots[-1])
    points = curve_points(curve, t)
    active = np.arange(len(t) - 1) if curve.degree > 1 else np.zeros(0, np.int64)
    while len(active):
        middle_t = (t[active] + t[active + 1]) / 2
        middle = curve_points(curve, middle_t)
        off = np.linalg.norm(middle - (points[active] + points[active + 1]) / 2, axis=1)
        bent = (off > tolerance) & (middle_t > t[active]) & (middle_t < t[active + 1])
        if len(t) + bent.sum() > _MOST_POINTS:
            raise TooMuchWork(
                f"The curve would need more than {_MOST_POINTS:,} points",
                remedy="Rebuild it with fewer control points, or give it as a polyline.",
            )
        after = active[bent] + 1
        t, points = np.insert(t, after, middle_t[bent]), np.insert(points, after, middle[bent], axis=0)
        first = after - 1 + np.arange(len(after))
        active = np.stack([first, first + 1], axis=1).ravel()
    return points
