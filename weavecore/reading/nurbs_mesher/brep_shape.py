"""A Brep as arrays: its edges in space, and its faces as NURBS surfaces with trims in (u, v).

All surfaces are taken in their NURBS form.  Its parameters differ from the surface's own where that
is a surface of revolution or a sum of arcs, so trims are carried over point by point.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from weavecore.errors import NonFinite, Unreadable, Unsupported, WeaveError
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
_MOST_COORDINATE = 1e60
_POINTS_PER_SPAN = 16
_LEAST_POINTS = 33
_MOST_POINTS = 1_000


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
    """Read a ``rhino3dm.Brep`` into arrays, moved by a (4, 4) transform where one is given."""
    try:
        return _brep_shape(brep, transform)
    except (TypeError, AttributeError, IndexError, RuntimeError) as error:
        if isinstance(error, WeaveError):
            raise
        # Parts that are damaged come as None from rhino3dm, or not at all.
        raise _damaged(f"A part of a Brep is missing ({error})") from error


def _brep_shape(brep: Any, transform: Floats | None) -> BrepShape:
    archive = read_brep_archive(brep.Encode())
    _check_indices(archive, len(brep.Vertices), len(brep.Edges), len(brep.Faces))
    moved = np.eye(4) if transform is None else np.asarray(transform, np.float64)
    locations = [brep.Vertices[i].Location for i in range(len(brep.Vertices))]
    points = np.array([(p.X, p.Y, p.Z) for p in locations], np.float64).reshape(-1, 3)
    edges = tuple(nurbs_curve(brep.Edges[i], moved) for i in range(len(brep.Edges)))
    curves = _PlaneCurves(archive)
    faces = tuple(_face_shape(brep.Faces[i], i, archive, curves, moved) for i in range(len(brep.Faces)))
    return BrepShape(
        vertices=points @ moved[:3, :3].T + moved[:3, 3],
        edges=edges,
        edge_vertices=np.array([e.vertices for e in archive.edges], np.int64).reshape(-1, 2),
        edge_trims=np.array([len(e.trims) for e in archive.edges], np.int64),
        faces=faces,
    )


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
    """The NURBS form of a ``rhino3dm.Curve`` as arrays; a 2D curve keeps z = 0."""
    form = curve.ToNurbsCurve()
    if form is None:
        raise _damaged("A curve has no NURBS form")
    points = np.array([(p.X, p.Y, p.Z, p.W) for p in form.Points], np.float64)
    knots = _padded(list(form.Knots), len(points), form.Degree)
    return NurbsCurve(form.Degree, knots, _moved(_checked(points), transform))


def nurbs_surface(surface: Any, transform: Floats | None = None) -> NurbsSurface:
    """The NURBS form of a ``rhino3dm.Surface`` as arrays."""
    form = surface.ToNurbsSurface()
    if form is None:
        raise Unsupported("A surface has no NURBS form", remedy="Convert it to NURBS in Rhino.")
    grid = form.Points
    rows = [[grid.GetControlPoint(i, j) for j in range(grid.CountV)] for i in range(grid.CountU)]
    points = np.array([[(p.X, p.Y, p.Z, p.W) for p in row] for row in rows], np.float64)
    degrees = form.Degree(0), form.Degree(1)
    given = form.KnotsU.ToList(), form.KnotsV.ToList()
    knots = _padded(given[0], grid.CountU, degrees[0]), _padded(given[1], grid.CountV, degrees[1])
    return NurbsSurface(degrees, knots, _moved(_checked(points), transform))


def _padded(knots: Any, n_points: int, degree: int) -> Floats:
    """Restore the end knots: openNURBS leaves out the first and the last knot, which no point depends on."""
    inner = np.asarray(knots, np.float64)
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


def decode(data: dict[str, Any]) -> Any:
    """The rhino3dm object of its bytes, or None."""
    import rhino3dm

    kind: Any = rhino3dm.CommonObject
    return kind.Decode(data)


class _PlaneCurves:
    """The 2D curves of an archive, decoded when first asked for."""

    def __init__(self, archive: BrepArchive) -> None:
        self._bytes = archive.curves
        self._decoded: dict[int, Any] = {}

    def polyline(self, trim: TrimRecord, least: int) -> Floats:
        """At least so many fine points (M, 2) along a trim, in its own direction."""
        curve = self._native(trim.curve)
        low, high = trim.domain
        start, end = curve.Domain.T0, curve.Domain.T1
        if abs(low - start) + abs(high - end) > 1e-9 * (end - start):
            curve = curve.Trim(low, high)
        form = nurbs_curve(curve)
        uv = curve_points(form, fine_parameters(form, least))[:, :2]
        return uv[::-1].copy() if trim.reversed_curve else uv

    def _native(self, index: int) -> Any:
        if index not in self._decoded:
            data = self._bytes[index] if index >= 0 else None
            curve = decode(data) if data is not None else None
            if curve is None:
                raise Unreadable("A trim of a Brep has no 2D curve", remedy="Rebuild its edges in Rhino.")
            self._decoded[index] = curve
        return self._decoded[index]


def fine_parameters(curve: NurbsCurve, least: int = _LEAST_POINTS) -> Floats:
    """Parameters close together along a curve, its knots among them; at least so many."""
    spans = np.unique(curve.knots[curve.degree : len(curve.points) + 1])
    if len(spans) < 2:
        return np.repeat(spans, 2)
    per_span = max(_POINTS_PER_SPAN if curve.degree > 1 else 2, -(-least // (len(spans) - 1)))
    steps = np.linspace(0.0, 1.0, per_span, endpoint=False)
    inner = spans[:-1, None] + np.diff(spans)[:, None] * steps
    return np.append(inner.ravel(), spans[-1])


def _face_shape(face: Any, index: int, archive: BrepArchive, curves: _PlaneCurves, moved: Floats) -> FaceShape:
    record = archive.faces[index]
    native = face.UnderlyingSurface()
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


def _trim_curve(trim: TrimRecord, curves: _PlaneCurves, native: Any, same: bool, least: int) -> TrimCurve:
    uv = curves.polyline(trim, least)
    if not same:
        uv = _to_nurbs_parameters(native, uv)
    edge = NO_EDGE if trim.kind == SINGULAR else trim.edge
    return TrimCurve(edge, trim.against_edge, trim.vertices, uv)


def _to_nurbs_parameters(native: Any, uv: Floats) -> Floats:
    carried = [native.GetNurbsFormParameterFromSurfaceParameter(u, v) for u, v in uv.tolist()]
    return np.array([(u, v) for _, u, v in carried], np.float64)


def _same_parameters(native: Any, surface: NurbsSurface) -> bool:
    """Whether the surface's own parameters are those of its NURBS form."""
    ways = [np.linspace(*surface.domain(way), 8)[1:-1] for way in (0, 1)]
    uv = np.column_stack([axis.ravel() for axis in np.meshgrid(*ways)])
    own = np.array([(p.X, p.Y, p.Z) for p in (native.PointAt(u, v) for u, v in uv.tolist())])
    size = float(np.ptp(own, axis=0).max())
    return bool(np.abs(own - surface_points(surface, uv)).max() <= 1e-9 * size)


# ----------------------------------------------------------------------
# Shapes far from the origin, brought near to it while they are meshed.
#
# Coordinates of ten million leave nine digits for the shape, and evaluating a NURBS surface there loses some of them.
# The way to the origin is a whole multiple of a power of two above the size, so that subtracting it is exact.

_FAR = 8.0
"""A surface that is further from the origin than so many times its size is brought near."""


def recentred(shapes: Sequence[BrepShape]) -> tuple[list[BrepShape], Floats]:
    """The shapes moved towards the origin, and the vector (3,) that brings them back; zero where they are near."""
    places = np.concatenate([_places(face.surface.points) for shape in shapes for face in shape.faces])
    low, high = places.min(0), places.max(0)
    size = float((high - low).max())
    if not size > 0 or np.abs(low + high).max() / 2 <= _FAR * size:
        return list(shapes), np.zeros(3)
    step = 2.0 ** np.ceil(np.log2(size))
    origin: Floats = np.round((low + high) / 2 / step) * step
    return [_shifted(shape, origin) for shape in shapes], origin


def extent_of(shapes: Sequence[BrepShape]) -> float:
    """Diagonal of the box about the control points."""
    places = np.concatenate([_places(face.surface.points) for shape in shapes for face in shape.faces])
    return float(np.linalg.norm(np.ptp(places, axis=0)))


def _places(points: Floats) -> Floats:
    flat = points.reshape(-1, 4)
    places: Floats = flat[:, :3] / flat[:, 3:]
    return places


def _shifted(shape: BrepShape, origin: Floats) -> BrepShape:
    return replace(
        shape,
        vertices=shape.vertices - origin,
        edges=tuple(replace(edge, points=_less(edge.points, origin)) for edge in shape.edges),
        faces=tuple(
            replace(face, surface=replace(face.surface, points=_less(face.surface.points, origin)))
            for face in shape.faces
        ),
    )


def _less(points: Floats, origin: Floats) -> Floats:
    """Homogeneous points (..., 4) moved by -origin."""
    moved = points.copy()
    moved[..., :3] -= points[..., 3:] * origin
    return moved
