"""Creases inside a face: parameter lines along which the surface has a fold, kept as rows of mesh edges.

A surface of degree p can have a fold only along a knot of multiplicity p or more; there the normals on both sides are
compared.  Rhino splits faces at their folds; other programs, and surfaces made of polylines, do not.  Where a crease
meets an edge of the Brep, the edge gets a vertex, so that the crease runs up to its ends::

    ┌───────┬───────┐      u = knot: crease, divided like an edge by arc length over wanted size
    │       │       │
    │     ──┼──     │      crossings of creases and vertices on the border are among its points
    └───────┴───────┘

Linear in the points along the creases.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.nurbs import NurbsSurface, surface_jet
from weavecore.geometry.triangulate2d import inside_polygons
from weavecore.reading.nurbs_mesher.brep_shape import NO_EDGE, BrepShape, FaceShape, TrimCurve
from weavecore.reading.nurbs_mesher.face_borders import FaceBorder, arc_length_shares
from weavecore.reading.nurbs_mesher.face_grid import FaceGrid, interpolate_grid

_FOLD = np.cos(np.radians(2.0))
"""Cosine of the angle between normals from which on they make a fold: less than 2 degrees is within smooth
modelling tolerance."""

_BESIDE = 1e-7
"""Distance on either side of a knot at which normals are compared, in widths of the face: curvature turns them by
less than 1e-3 there."""

_PROBES = 9
"""Places along a knot line at which a fold is looked for."""

_FINE = 257
"""Points along a line between which it is followed into and out of the face: 1/256 of the width."""

_ON_LINE = 1e-7
"""A border vertex this near to a line, in widths of the face, lies on it."""

_SNAP = 0.5
"""A line ends in a border vertex that is within this part of a fine step of its end."""

_SAME = 1e-9
"""Points nearer than this part of the face's extent are one."""


_AT_END = 1e-6
"""A crossing this near to an end of an edge, in lengths of the edge, is the end."""


_TOO_NEAR = 0.4
"""An edge vertex within this part of its segment from the end of a crease is dropped."""


@dataclass(frozen=True, eq=False)
class FaceCreases:
    """The creases of a face.

    Parameters
    ----------
    uv : (K, 2) float64
        Points on creases.
    segments : (S, 2) int64
        Segments along them, numbering the points of the border first, then those of the creases.
    """

    uv: Floats
    segments: Ints


def face_creases(face: FaceShape, grid: FaceGrid, sizes: Floats, border: FaceBorder) -> FaceCreases:
    """Find the creases of a face and divide them like its edges; they end in border vertices that lie on them.

    Parameters
    ----------
    face : FaceShape
    grid : FaceGrid
    sizes : (N, M) float64
        Wanted edge lengths at the grid.
    border : FaceBorder

    Returns
    -------
    FaceCreases
    """
    lines = [(way, at) for way in (0, 1) for at in _fold_parameters(face.surface, grid, way)]
    places: list[Floats] = []
    segments: list[tuple[Floats, Floats]] = []
    for way, at in lines:
        crossing = np.array([other for across, other in lines if across != way])
        for run in _runs(way, at, grid, border):
            row = _divided(way, at, run, crossing, grid, sizes, border)
            segments += list(zip(row[:-1], row[1:]))
            places += list(row)
    if not places:
        return FaceCreases(np.zeros((0, 2)), np.zeros((0, 2), np.int64))
    return _numbered(np.array(places), np.array(segments), border)


def _fold_parameters(surface: NurbsSurface, grid: FaceGrid, way: int) -> list[float]:
    """Parameters inside the face's box at which the surface's normal jumps."""
    axis, other = (grid.u, grid.v) if way == 0 else (grid.v, grid.u)
    knots, times = np.unique(surface.knots[way], return_counts=True)
    width = float(axis[-1] - axis[0])
    inside = (knots > axis[0] + _ON_LINE * width) & (knots < axis[-1] - _ON_LINE * width)
    _fold_parameters = []
    for at in knots[inside & (times >= surface.degrees[way])].tolist():
        probes = np.linspace(other[0], other[-1], _PROBES + 2)[1:-1]
        left, right = (_normals(surface, way, at + s * _BESIDE * width, probes) for s in (-1, 1))
        if (np.einsum("ij,ij->i", left, right) < _FOLD).any():
            _fold_parameters.append(at)
    return _fold_parameters


def _normals(surface: NurbsSurface, way: int, at: float, other: Floats) -> Floats:
    jet = surface_jet(surface, _on_line(way, at, other))
    normal = np.cross(jet.du, jet.dv)
    normals: Floats = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    return normals


def _on_line(way: int, at: float, other: Floats) -> Floats:
    pair = (np.full(len(other), at), other)
    return np.column_stack(pair if way == 0 else pair[::-1])


def _runs(way: int, at: float, grid: FaceGrid, border: FaceBorder) -> list[tuple[float, float]]:
    """Intervals of a line inside the face, each from parameter to parameter."""
    axis, other = (grid.u, grid.v) if way == 0 else (grid.v, grid.u)
    fine = np.linspace(other[0], other[-1], _FINE)
    middle = (fine[1:] + fine[:-1]) / 2
    tail, head = border.uv[border.segments[:, 0]], border.uv[border.segments[:, 1]]
    shift = 1e-6 * (axis[-1] - axis[0])
    inside = np.ones(len(middle), bool)
    for side in (-shift, shift):
        inside &= inside_polygons(_on_line(way, at + side, middle), tail, head)
    change = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]]).astype(int)))
    return [(float(fine[a]), float(fine[b])) for a, b in zip(change[::2], change[1::2])]


def _divided(
    way: int, at: float, run: tuple[float, float], crossing: Floats, grid: FaceGrid, sizes: Floats, border: FaceBorder
) -> Floats:
    """Points (K, 2) along one interval, in order; crossings with other creases are among them."""
    axis, other = (grid.u, grid.v) if way == 0 else (grid.v, grid.u)
    on_it = border.uv[np.abs(border.uv[:, way] - at) <= _ON_LINE * (axis[-1] - axis[0])][:, 1 - way]
    step = (other[-1] - other[0]) / (_FINE - 1)
    ends, is_end = [], []
    for end in run:
        near = on_it[np.abs(on_it - end) <= _SNAP * step + 1e-12 * abs(end)]
        ends.append(float(near[0]) if len(near) else end)
        is_end.append(len(near) > 0)
    fine = np.linspace(ends[0], ends[1], _FINE)
    at_fine = _on_line(way, at, fine)
    density = interpolate_grid(grid, grid.speeds[..., 1 - way] / sizes, at_fine)
    count = np.concatenate([[0.0], np.cumsum(np.diff(fine) * (density[1:] + density[:-1]) / 2)])
    inner = crossing[(crossing > ends[0]) & (crossing < ends[1])]
    stops = np.interp(np.concatenate([[ends[0]], np.sort(inner), [ends[1]]]), fine, count)
    rows = [
        np.linspace(a, b, max(round(float(b - a)), 1) + 1)[:-1] for a, b in zip(stops[:-1].tolist(), stops[1:].tolist())
    ]
    marks = np.append(np.concatenate(rows), stops[-1])
    # A crease that meets the border where that has no vertex stops short of it.
    marks = marks[(0 if is_end[0] else 1) : (len(marks) if is_end[1] else len(marks) - 1)]
    places = np.interp(marks, count, fine)
    exact = np.concatenate([inner, ends])
    nearest = exact[np.abs(places[:, None] - exact).argmin(1)]
    places = np.where(np.abs(places - nearest) <= 1e-9 * (other[-1] - other[0]), nearest, places)
    return _on_line(way, at, places)


def _numbered(places: Floats, segments: Floats, border: FaceBorder) -> FaceCreases:
    """Number the points: border vertices keep their numbers, points in one place are one."""
    everything = np.concatenate([border.uv, places, segments.reshape(-1, 2)])
    low, extent = border.uv.min(0), np.maximum(np.ptp(border.uv, axis=0), 1e-300)
    key = np.round((everything - low) / extent / _SAME).astype(np.int64)
    n = len(border.uv)
    _, first, same = np.unique(key, axis=0, return_index=True, return_inverse=True)
    row = first[same.ravel()]
    new = np.unique(row[n:][row[n:] >= n])
    number = np.full(len(everything), -1)
    number[:n] = np.arange(n)
    number[new] = n + np.arange(len(new))
    ends = number[row[n + len(places) :]].reshape(-1, 2)
    return FaceCreases(everything[new], ends[ends[:, 0] != ends[:, 1]])


def divide_at_creases(shape: BrepShape, grids: Sequence[FaceGrid], lengths: Sequence[Floats]) -> list[Floats]:
    """Insert the ends of creases into the division of the edges.

    A vertex too near to such a place is dropped; the edge's ends stay.

    Parameters
    ----------
    shape : BrepShape
    grids : sequence of FaceGrid
    lengths : sequence of (K,) float64
        Arc lengths of the vertices of each edge: see `divide_path`.

    Returns
    -------
    list of float64 arrays
    """
    divided = list(lengths)
    for face, grid in zip(shape.faces, grids):
        for way in (0, 1):
            for at in _fold_parameters(face.surface, grid, way):
                for trim in (t for loop in face.loops for t in loop if t.edge != NO_EDGE):
                    shares = _crossings(face, trim, way, at)
                    if len(shares):
                        divided[trim.edge] = _with_stops(divided[trim.edge], shares)
    return divided


def _crossings(face: FaceShape, trim: TrimCurve, way: int, at: float) -> Floats:
    """Shares of the edge's length at which a trim crosses a line of constant parameter."""
    off = trim.uv[:, way] - at
    k = np.flatnonzero(np.sign(off[1:]) * np.sign(off[:-1]) < 0)
    travelled = arc_length_shares(face, trim)
    t = off[k] / (off[k] - off[k + 1])
    shares = np.concatenate([travelled[k] * (1 - t) + travelled[k + 1] * t, travelled[np.flatnonzero(off == 0)]])
    return 1.0 - shares if trim.against_edge else shares


def _with_stops(along: Floats, shares: Floats) -> Floats:
    total = float(along[-1])
    shares = shares[(shares > _AT_END) & (shares < 1 - _AT_END)]
    if total == 0 or len(shares) == 0:
        return along
    stops = np.unique(shares * total)
    stops = stops[np.concatenate([[True], np.diff(stops) > _AT_END * total])]
    apart = np.abs(along[:, None] - stops).min(1)
    room = _TOO_NEAR * np.minimum(np.diff(along, prepend=-np.inf), np.diff(along, append=np.inf))
    kept = apart > room
    kept[[0, -1]] = True
    return np.unique(np.concatenate([along[kept], stops]))
