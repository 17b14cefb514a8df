"""Curves in files and in memory as points along them.

Files: the curve objects of a Rhino file, or rows of coordinates in a text file.  A NURBS curve is sampled at its
knots and, between them, by bisection until no chord's midpoint is further from the curve than the tolerance:
O(points).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, Optional

import numpy as np

from weavecore.errors import BadCurve, NoCurve, TooMuchWork, Unreadable, WeaveError
from weavecore.files import PathLike
from weavecore.geometry.arrays import Floats
from weavecore.geometry.nurbs import NurbsCurve, curve_points
from weavecore.reading.choose import matching_layers
from weavecore.reading.formats.mesh_file import read_bytes
from weavecore.reading.formats.rhino_3dm import CURVE, IN_BLOCK, RhinoDocument, RhinoObject, open_document
from weavecore.reading.nurbs_mesher.brep_shape import nurbs_curve
from weavecore.reading.sandbox import call_guarded, limits_for
from weavecore.rhino_geometry import (
    curve_in_rhino,
    curve_in_rhino_points,
    is_curve_in_rhino,
    is_rhino_curve,
    line_points,
)
from weavecore.units import METRES

RHINO = ".3dm"
"""Ending of Rhino files."""

TEXTS = (".csv", ".txt", ".xyz")
"""Endings of text files with one point in each line."""

CURVE_ENDINGS = (RHINO, *TEXTS)
"""Endings of all files that hold curves."""


_SEPARATORS = re.compile(rb"[\s,;]+")
"""Between the numbers of a line."""


_PARTS_OF_SPAN = 4
"""Parts of each knot span before bisection: a span of degree 3 has at most one inflection, at which a midpoint
alone would see no deviation."""


_TOLERANCE_OF_SIZE = 1e-4
"""Points follow a curve to this part of its size, or to the model's tolerance where that is less."""

_LEAST_OF_SIZE = 1e-7
"""A model tolerance below this part of the size is not followed: it takes thousands of points around a circle."""


_MOST_POINTS = 200_000
"""Points on a curve: beyond them the tolerance is out of proportion to the size."""


def read_curves(
    path: PathLike,
    *,
    names: Optional[Sequence[str]] = None,
    unit: Optional[str] = None,
    guarded: bool = False,
    time_limit: Optional[float] = None,
    progress: Optional[Callable[[float, str], None]] = None,
) -> list[Floats]:
    """Read curves at which distances are to start.

    Parameters
    ----------
    path : path
        Ends with ``.3dm``, or with ``.csv``, ``.txt`` or ``.xyz`` for a text file of one curve: x, y and z in each
        line, separated by commas, semicolons or blanks; in a line with semicolons commas are decimal.
    names : sequence of str, optional
        Names, ids or layers of curves of a Rhino file; by default the only visible curve.
    unit : str, optional
        Rhino's name of the unit to convert to; by default the file's.  A text file has none and is not converted.
    guarded, time_limit, progress
        As in `read_surface`.

    Returns
    -------
    list of (n, 3) float64
        For each name its curves in the order of the file, each once.

    Raises
    ------
    NoCurve
        Where there is none by that name, or, without names, not exactly one.
    Unreadable, Unsupported, NonFinite, TooMuchWork
    """
    options: dict[str, Any] = {"names": None if names is None else tuple(names), "unit": unit}
    if guarded:
        limits = limits_for(path, time_limit=time_limit)
        read: list[Floats] = call_guarded(_read_curves, path, limits=limits, progress=progress, **options)
        return read
    return _read_curves(path, progress=progress, **options)


def _read_curves(
    path: PathLike,
    *,
    names: Optional[tuple[str, ...]],
    unit: Optional[str],
    progress: Optional[Callable[[float, str], None]],
) -> list[Floats]:
    ending = Path(path).suffix.lower()
    if ending in TEXTS:
        return [_points_of_text(read_bytes(path), Path(path).name)]
    if ending != RHINO:
        raise NoCurve(
            f"{Path(path).name} cannot hold curves", remedy=f"Give the curve in a separate file: {', '.join(TEXTS)}."
        )
    document = open_document(path)
    if progress is not None:
        progress(1.0, "Reading curves")
    curves = [one for one in document.objects if one.kind == CURVE and one.aside != IN_BLOCK]
    chosen = [_only(document, curves)] if names is None else _named(document, curves, names)
    # A division leaves one rounding less: 120 mm are 0.12 m to the last bit.
    per_unit = METRES[unit] / METRES[document.unit] if unit in METRES and document.unit in METRES else 1.0
    return [curve_from(one.geometry, tolerance=document.tolerance) / per_unit for one in chosen]


def _only(document: RhinoDocument, curves: list[RhinoObject]) -> RhinoObject:
    visible = [one for one in curves if not one.aside] or curves
    if len(visible) == 1:
        return visible[0]
    raise NoCurve(
        f"{document.file_name} has {len(visible) or 'no'} curves, and exactly one is needed",
        remedy="Keep one of them in the file." if visible else "Put one in it.",
        ids=[str(one) for one in visible],
    )


def _named(document: RhinoDocument, curves: list[RhinoObject], names: Sequence[str]) -> list[RhinoObject]:
    chosen = list[RhinoObject]()
    for name in names:
        found = [one for one in curves if one.id.casefold() == name.strip("{}").casefold()]
        found = found or [one for one in curves if name and one.name == name]
        if not found:
            layers = matching_layers(document.layers, name)
            found = [one for one in curves if one.layer in layers]
        if not found:
            raise NoCurve(
                f"{document.file_name} has no curve with the name {name!r}, nor a layer with that name that has curves",
                remedy="Name one of these by its name, id or layer." if curves else "Draw one on the surface.",
                ids=[str(one) for one in curves],
                kind="there is",
            )
        chosen += [one for one in found if all(one is not other for other in chosen)]
    return chosen


def _points_of_text(data: bytes, file_name: str) -> Floats:
    """Points from lines of three numbers; further words, text after ``#`` and a heading are ignored."""
    lines = (line.partition(b"#")[0].strip(b"\xef\xbb\xbf \t\r,;") for line in data.splitlines())
    rows = [(number, _words(line)) for number, line in enumerate(lines, 1) if line]
    if rows and not _is_number(rows[0][1][0]):
        rows = rows[1:]
    wrong = [number for number, words in rows if len(words) < 3 or not all(map(_is_number, words))]
    if wrong or not rows:
        raise Unreadable(
            f"{file_name} has {'a line without three numbers' if wrong else 'no points'}",
            remedy="Give x, y and z in each line, separated by commas, semicolons or blanks.",
            ids=wrong,
            kind="line",
        )
    return np.array([words for _, words in rows], np.float64)


def _words(line: bytes) -> list[bytes]:
    """The first three words; in a line with semicolons commas are decimal."""
    if b";" in line:
        line = line.replace(b",", b".")
    return _SEPARATORS.split(line)[:3]


def _is_number(word: bytes) -> bool:
    try:
        np.float64(word)
    except ValueError:
        return False
    return True


def curve_from(geometry: Any, *, tolerance: float = 0.0) -> Floats:
    """Points along a curve.

    Parameters
    ----------
    geometry : object
        A curve, line, arc, circle or polyline of rhino3dm or RhinoCommon; or points (n, 3), which are returned.
    tolerance : float
        The model's absolute tolerance; 0 if unknown.

    Returns
    -------
    (n, 3) float64
        Kinks are among them; a closed curve ends at its first point.

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
        curve = curve_in_rhino(geometry)
        size = float(curve.GetBoundingBox(False).Diagonal.Length)
        return curve_in_rhino_points(curve, _sampling_tolerance(size, tolerance))
    if is_rhino_curve(geometry):
        form = nurbs_curve(geometry)
        size = float(np.linalg.norm(np.ptp(form.points[:, :3] / form.points[:, 3:], axis=0)))
        return _points_along(form, _sampling_tolerance(size, tolerance))
    try:
        return np.asarray(geometry, np.float64)
    except (TypeError, ValueError):
        raise BadCurve(
            f"A {type(geometry).__name__} is not a curve", remedy="Give a curve of Rhino, or rows of x, y and z."
        ) from None


def curves_from(geometries: Iterable[Any], *, tolerance: float = 0.0) -> list[Floats]:
    """Points along several curves; see `curve_from`.

    Parameters
    ----------
    geometries : iterable
        Of what `curve_from` takes.
    tolerance : float
        The model's absolute tolerance; 0 if unknown.

    Returns
    -------
    list of (n, 3) float64

    Raises
    ------
    BadCurve
        Where they are not a list; or, with its place among them, where one is not a curve.
    Unreadable, NonFinite, TooMuchWork
        With the place of the curve.
    """
    try:
        given = list(geometries)
    except TypeError:
        raise BadCurve(
            f"A {type(geometries).__name__} is not a list of curves", remedy="Put a single curve in a list: [curve]."
        ) from None
    return [_numbered_curve(number, geometry, tolerance) for number, geometry in enumerate(given)]


def _numbered_curve(number: int, geometry: Any, tolerance: float) -> Floats:
    try:
        return curve_from(geometry, tolerance=tolerance)
    except WeaveError as error:
        raise type(error)(error.what, remedy=error.remedy, ids=[number], kind="curve") from error


def _sampling_tolerance(size: float, tolerance: float) -> float:
    """How far points may lie from a curve of that size."""
    usual = _TOLERANCE_OF_SIZE * size
    return max(min(tolerance, usual), _LEAST_OF_SIZE * size) if tolerance > 0 else usual


def _points_along(curve: NurbsCurve, tolerance: float) -> Floats:
    """Points at all knots, and between them until no midpoint is further off than the tolerance."""
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
