"""A Brep as arrays: its edges in space, and its faces as NURBS surfaces with trims in (u, v).

All surfaces are taken in their NURBS form.  Its parameters differ from the surface's own if that is a surface of
revolution or a sum of arcs, so trims are then converted point by point::

                 v ▲   ┌──◀──┐        loops run with the face on their left;
    surface(u, v)  │   │face ▲        each trim lies on an edge in space,
                   │   └──▶──┘        along it or against it
                   └──────────▶ u

A shape far from the origin is moved near to it: coordinates of ten million leave nine digits for the shape.  The
origin is a whole multiple of a power of two above the size, so that subtracting it is exact.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from weavecore.errors import NonFinite, Unreadable, Unsupported
from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.nurbs import NurbsCurve, NurbsSurface, curve_points, surface_points
from weavecore.reading.nurbs_mesher.brep_archive import (
    INNER_LOOP,
    OUTER_LOOP,
    SINGULAR,
    SLIT_LOOP,
    BrepArchive,
    TrimRecord,
    read_brep_archive,
)

NO_EDGE = -1
"""Edge of a trim on which the surface collapses to a point."""

_MOST_COORDINATE = 1e60
"""Squares of greater distances overflow."""

_POINTS_PER_SPAN = 16
"""Points on each knot span of a curved trim: the length of a quarter circle is then good to 4e-4."""

_LEAST_POINTS = 33
"""Least points on a curve: a straight trim may still be curved in space."""

_MOST_POINTS = 1_000
"""Most points on a trim that follow from the spans of its surface."""


_FAR = 8.0
"""A surface that is further from the origin than so many times its size is recentred: below, it loses three bits at
most."""


@dataclass(frozen=True, eq=False)
class TrimCurve:
    """One side of a face in (u, v): a fine polyline (M, 2), along the loop, the face on its left.

    ``edge`` is -1 where the surface collapses to a point.
    """

    edge: int
    against_edge: bool
    vertices: tuple[int, int]
    uv: Floats


@dataclass(frozen=True, eq=False)
class FaceShape:
    """A face: its surface, its loops of trims, and whether it looks against the surface's normal."""

    surface: NurbsSurface
    is_reversed: bool
    loops: tuple[tuple[TrimCurve, ...], ...]


@dataclass(frozen=True, eq=False)
class BrepShape:
    """Vertices (N, 3), edges with their end vertices (E, 2) and their number of trims (E,), and faces."""

    vertices: Floats
    edges: tuple[NurbsCurve, ...]
    edge_vertices: Ints
    edge_trims: Ints
    faces: tuple[FaceShape, ...]


def brep_shape(brep: Any, transform: Floats | None = None) -> BrepShape:
    """Read a Brep into arrays.

    Parameters
    ----------
    brep : rhino3dm.Brep
    transform : (4, 4) float64, optional
        Applied to it.

    Returns
    -------
    BrepShape

    Raises
    ------
    Unreadable, NonFinite, Unsupported
    """
    with _rhino3dm_calls("A part of a Brep is missing"):
        encoded = brep.Encode()
        locations = [brep.Vertices[i].Location for i in range(len(brep.Vertices))]
        points = [(p.X, p.Y, p.Z) for p in locations]
        native_edges = [brep.Edges[i] for i in range(len(brep.Edges))]
        native_surfaces = [brep.Faces[i].UnderlyingSurface() for i in range(len(brep.Faces))]
    archive = read_brep_archive(encoded)
    _check_indices(archive, len(points), len(native_edges), len(native_surfaces))
    moved = np.eye(4) if transform is None else np.asarray(transform, np.float64)
    edges = tuple(nurbs_curve(edge, moved) for edge in native_edges)
    curves = _TrimPolylines(archive)
    faces = tuple(_face_shape(native, i, archive, curves, moved) for i, native in enumerate(native_surfaces))
    return BrepShape(
        vertices=np.array(points, np.float64).reshape(-1, 3) @ moved[:3, :3].T + moved[:3, 3],
        edges=edges,
        edge_vertices=np.array([e.vertices for e in archive.edges], np.int64).reshape(-1, 2),
        edge_trims=np.array([len(e.trims) for e in archive.edges], np.int64),
        faces=faces,
    )


@contextlib.contextmanager
def _rhino3dm_calls(what: str) -> Iterator[None]:
    """Raise `Unreadable` where rhino3dm fails, or gives None in the place of a damaged part.

    Only calls of rhino3dm belong inside, so that an error of this package is not reported as a damaged file.
    """
    try:
        yield
    except (TypeError, AttributeError, IndexError, RuntimeError) as error:
        raise _damaged(f"{what} ({error})") from error


def _damaged(what: str) -> Unreadable:
    return Unreadable(what, remedy="Repair the object in Rhino (SelBadObjects).")


def _check_indices(archive: BrepArchive, n_vertices: int, n_edges: int, n_faces: int) -> None:
    trims, loops = archive.trims, archive.loops
    fits = (
        len(archive.edges) == n_edges
        and len(archive.faces) == n_faces
        and all(0 <= v < n_vertices for e in archive.edges for v in e.vertices)
        and all(0 <= t < len(trims) for loop in loops for t in loop.trims)
        and all(0 <= k < len(loops) for f in archive.faces for k in f.loops)
        and all(NO_EDGE <= t.edge < n_edges and -1 <= t.curve < len(archive.curves) for t in trims)
        and all(0 <= v < n_vertices for t in trims for v in t.vertices)
    )
    if not fits:
        raise _damaged("A Brep names parts that it does not have")


def nurbs_curve(curve: Any, transform: Floats | None = None) -> NurbsCurve:
    """The NURBS form of a curve as arrays.

    Parameters
    ----------
    curve : rhino3dm.Curve
        A 2D curve has z = 0.
    transform : (4, 4) float64, optional
        Applied to it.

    Returns
    -------
    NurbsCurve

    Raises
    ------
    Unreadable, NonFinite
    """
    with _rhino3dm_calls("A curve has no NURBS form"):
        form = curve.ToNurbsCurve()
        degree, knots = form.Degree, list(form.Knots)
        rows = [(p.X, p.Y, p.Z, p.W) for p in form.Points]
    points = np.array(rows, np.float64).reshape(-1, 4)
    return NurbsCurve(degree, _padded(knots, len(points), degree), _moved(_checked(points), transform))


def nurbs_surface(surface: Any, transform: Floats | None = None) -> NurbsSurface:
    """The NURBS form of a surface as arrays.

    Parameters
    ----------
    surface : rhino3dm.Surface
    transform : (4, 4) float64, optional
        Applied to it.

    Returns
    -------
    NurbsSurface

    Raises
    ------
    Unreadable, NonFinite, Unsupported
    """
    with _rhino3dm_calls("A part of a Brep is missing"):
        form = surface.ToNurbsSurface()
    if form is None:
        raise Unsupported("A surface has no NURBS form", remedy="Convert it to NURBS in Rhino.")
    with _rhino3dm_calls("The control points of a surface are missing"):
        grid, degrees = form.Points, (form.Degree(0), form.Degree(1))
        n_u, n_v, knots_u, knots_v = grid.CountU, grid.CountV, form.KnotsU.ToList(), form.KnotsV.ToList()
        controls = [grid.GetControlPoint(i, j) for i in range(n_u) for j in range(n_v)]
        rows = [(p.X, p.Y, p.Z, p.W) for p in controls]
    points = np.array(rows, np.float64).reshape(n_u, n_v, 4)
    knots = _padded(knots_u, n_u, degrees[0]), _padded(knots_v, n_v, degrees[1])
    return NurbsSurface(degrees, knots, _moved(_checked(points), transform))


def _padded(knots: Any, n_points: int, degree: int) -> Floats:
    """The knots with their first and last repeated: openNURBS omits these two, on which no point depends."""
    inner = np.asarray(knots, np.float64).reshape(-1)
    padded = np.concatenate([inner[:1], inner, inner[-1:]])
    rising = len(padded) == n_points + degree + 1 and np.isfinite(padded).all() and (np.diff(padded) >= 0).all()
    if degree < 1 or n_points <= degree or not rising or not padded[degree] < padded[n_points]:
        raise _damaged("A curve or surface has knots that are out of order")
    return padded


def _checked(points: Floats) -> Floats:
    # Beyond these the squares of distances overflow.
    if not (np.abs(points) < _MOST_COORDINATE).all() or (points[..., 3] <= 1 / _MOST_COORDINATE).any():
        raise NonFinite("Control points that are not finite, or of no weight", remedy="Repair the object in Rhino.")
    return points


def _moved(points: Floats, transform: Floats | None) -> Floats:
    return points if transform is None else points @ transform.T


def _decode(data: dict[str, Any]) -> Any:
    """The rhino3dm object of its encoded form, or None."""
    import rhino3dm

    kind: Any = rhino3dm.CommonObject
    return kind.Decode(data)


class _TrimPolylines:
    """The 2D curves of an archive as fine polylines, decoded when first needed."""

    def __init__(self, archive: BrepArchive) -> None:
        self._bytes = archive.curves
        self._decoded: dict[int, Any] = {}

    def polyline(self, trim: TrimRecord, least: int) -> Floats:
        """At least so many fine points (M, 2) along a trim, in its own direction."""
        curve = self._native(trim.curve)
        low, high = trim.domain
        with _rhino3dm_calls("A trim of a Brep has no 2D curve"):
            start, end = curve.Domain.T0, curve.Domain.T1
            if abs(low - start) + abs(high - end) > 1e-9 * (end - start):
                curve = curve.Trim(low, high)
        form = nurbs_curve(curve)
        uv = curve_points(form, fine_parameters(form, least))[:, :2]
        return uv[::-1].copy() if trim.reversed_curve else uv

    def _native(self, index: int) -> Any:
        if index not in self._decoded:
            data = self._bytes[index] if index >= 0 else None
            with _rhino3dm_calls("A trim of a Brep has no 2D curve"):
                curve = _decode(data) if data is not None else None
            if curve is None:
                raise Unreadable("A trim of a Brep has no 2D curve", remedy="Rebuild its edges in Rhino.")
            self._decoded[index] = curve
        return self._decoded[index]


def fine_parameters(curve: NurbsCurve, least: int = _LEAST_POINTS) -> Floats:
    """Closely spaced parameters along a curve, its knots among them.

    Parameters
    ----------
    curve : NurbsCurve
    least : int
        Least number of parameters.

    Returns
    -------
    (M,) float64
    """
    spans = np.unique(curve.knots[curve.degree : len(curve.points) + 1])
    if len(spans) < 2:
        return np.repeat(spans, 2)
    per_span = max(_POINTS_PER_SPAN if curve.degree > 1 else 2, -(-least // (len(spans) - 1)))
    steps = np.linspace(0.0, 1.0, per_span, endpoint=False)
    inner = spans[:-1, None] + np.diff(spans)[:, None] * steps
    return np.append(inner.ravel(), spans[-1])


def _face_shape(native: Any, index: int, archive: BrepArchive, curves: _TrimPolylines, moved: Floats) -> FaceShape:
    record = archive.faces[index]
    surface = nurbs_surface(native)
    same = _same_parameters(native, surface)
    # A straight trim may run over many spans of its surface.
    least = min(_LEAST_POINTS + _POINTS_PER_SPAN * sum(surface.points.shape[:2]), _MOST_POINTS)
    loops = []
    for loop in (archive.loops[i] for i in record.loops):
        if loop.kind not in (OUTER_LOOP, INNER_LOOP, SLIT_LOOP) or not loop.trims:
            continue
        loops.append(tuple(_trim_curve(archive.trims[t], curves, native, same, least) for t in loop.trims))
    if not loops:
        raise Unreadable("A face of a Brep has no loop", remedy="Repair the object in Rhino.", ids=[index], kind="face")
    final = NurbsSurface(surface.degrees, surface.knots, _moved(surface.points, moved))
    turned = np.linalg.det(moved[:3, :3]) < 0
    return FaceShape(final, record.reversed != bool(turned), tuple(loops))


def _trim_curve(trim: TrimRecord, curves: _TrimPolylines, native: Any, same: bool, least: int) -> TrimCurve:
    uv = curves.polyline(trim, least)
    if not same:
        uv = _to_nurbs_parameters(native, uv)
    edge = NO_EDGE if trim.kind == SINGULAR else trim.edge
    return TrimCurve(edge, trim.against_edge, trim.vertices, uv)


def _to_nurbs_parameters(native: Any, uv: Floats) -> Floats:
    with _rhino3dm_calls("A surface has no NURBS form"):
        carried = [native.GetNurbsFormParameterFromSurfaceParameter(u, v) for u, v in uv.tolist()]
    return np.array([(u, v) for _, u, v in carried], np.float64)


def _same_parameters(native: Any, surface: NurbsSurface) -> bool:
    """Whether the surface's own parameters are those of its NURBS form."""
    ways = [np.linspace(*surface.domain(way), 8)[1:-1] for way in (0, 1)]
    uv = np.column_stack([axis.ravel() for axis in np.meshgrid(*ways)])
    with _rhino3dm_calls("A surface cannot be evaluated"):
        own = np.array([(p.X, p.Y, p.Z) for p in (native.PointAt(u, v) for u, v in uv.tolist())])
    size = float(np.ptp(own, axis=0).max())
    return bool(np.abs(own - surface_points(surface, uv)).max() <= 1e-9 * size)


def recentred(shapes: Sequence[BrepShape]) -> tuple[list[BrepShape], Floats]:
    """Move shapes that are far from the origin near to it.

    Parameters
    ----------
    shapes : sequence of BrepShape

    Returns
    -------
    shapes : list of BrepShape
    origin : (3,) float64
        To be added to bring them back; zero if they were near.
    """
    places = np.concatenate([_positions(face.surface.points) for shape in shapes for face in shape.faces])
    low, high = places.min(0), places.max(0)
    size = float((high - low).max())
    if not size > 0 or np.abs(low + high).max() / 2 <= _FAR * size:
        return list(shapes), np.zeros(3)
    step = 2.0 ** np.ceil(np.log2(size))
    origin: Floats = np.round((low + high) / 2 / step) * step
    return [_translated_shape(shape, origin) for shape in shapes], origin


def extent_of(shapes: Sequence[BrepShape]) -> float:
    """Diagonal of the bounding box of the control points.

    Parameters
    ----------
    shapes : sequence of BrepShape
    """
    places = np.concatenate([_positions(face.surface.points) for shape in shapes for face in shape.faces])
    return float(np.linalg.norm(np.ptp(places, axis=0)))


def _positions(points: Floats) -> Floats:
    flat = points.reshape(-1, 4)
    places: Floats = flat[:, :3] / flat[:, 3:]
    return places


def _translated_shape(shape: BrepShape, origin: Floats) -> BrepShape:
    return replace(
        shape,
        vertices=shape.vertices - origin,
        edges=tuple(replace(edge, points=_translated(edge.points, origin)) for edge in shape.edges),
        faces=tuple(
            replace(face, surface=replace(face.surface, points=_translated(face.surface.points, origin)))
            for face in shape.faces
        ),
    )


def _translated(points: Floats, origin: Floats) -> Floats:
    """Homogeneous points (..., 4) moved by -origin."""
    moved = points.copy()
    moved[..., :3] -= points[..., 3:] * origin
    return moved
