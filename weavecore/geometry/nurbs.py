"""NURBS curves and surfaces as arrays, evaluated many parameters at a time.

Control points are *homogeneous*: ``(w·x, w·y, w·z, w)``.  Knots are in full form,
``len(knots) == number of control points + degree + 1``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Floats, Ints

_MOST_AT_ONCE = 20_000
_NOISE = 1e-16


@dataclass(frozen=True, eq=False)
class NurbsCurve:
    """A rational B-spline curve: homogeneous control points (N, D + 1), knots (N + degree + 1,)."""

    degree: int
    knots: Floats
    points: Floats

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter."""
        return float(self.knots[self.degree]), float(self.knots[len(self.points)])


@dataclass(frozen=True, eq=False)
class NurbsSurface:
    """A rational B-spline surface: homogeneous control points (N, M, 4), knots and degree each way."""

    degrees: tuple[int, int]
    knots: tuple[Floats, Floats]
    points: Floats

    def domain(self, way: int) -> tuple[float, float]:
        """First and last parameter along u (0) or v (1)."""
        return float(self.knots[way][self.degrees[way]]), float(self.knots[way][self.points.shape[way]])


@dataclass(frozen=True, eq=False)
class SurfaceJet:
    """Points (N, 3) of a surface and their partial derivatives; the second ones only where asked for."""

    point: Floats
    du: Floats
    dv: Floats
    duu: Floats | None = None
    duv: Floats | None = None
    dvv: Floats | None = None


def basis_functions(
    knots: Floats, degree: int, n_points: int, t: Floats, n_derivatives: int = 0
) -> tuple[Ints, Floats]:
    """Values and derivatives of the basis functions that are not zero at ``t``.

    Parameters
    ----------
    knots : (n_points + degree + 1,)
    t : (N,)
        Clipped to the domain.

    Returns
    -------
    first : (N,) int64
        Index of the first control point that counts.
    values : (n_derivatives + 1, N, degree + 1)
        Row d holds the d-th derivatives (de Boor, *A Practical Guide to Splines*, ch. X).
    """
    start, end = knots[degree], knots[n_points]
    t = np.clip(t, start, end)
    last_span = np.searchsorted(knots, end, side="left") - 1
    span = np.clip(np.searchsorted(knots, t, side="right") - 1, degree, last_span)
    tables = [np.ones((len(t), 1))]
    for d in range(1, degree + 1):
        left, right = _knot_windows(knots, span, d)
        share = np.divide(tables[-1], right - left, out=np.zeros_like(tables[-1]), where=right > left)
        table = np.zeros((len(t), d + 1))
        table[:, :-1] += share * (right - t[:, None])
        table[:, 1:] += share * (t[:, None] - left)
        tables.append(table)
    values = np.zeros((n_derivatives + 1, len(t), degree + 1))
    values[0] = tables[degree]
    for order in range(1, min(n_derivatives, degree) + 1):
        derived = tables[degree - order]
        for d in range(degree - order + 1, degree + 1):
            left, right = _knot_windows(knots, span, d)
            share = d * np.divide(derived, right - left, out=np.zeros_like(derived), where=right > left)
            derived = np.zeros((len(t), d + 1))
            derived[:, 1:] = share
            derived[:, :-1] -= share
        values[order] = derived
    return span - degree, values


def _knot_windows(knots: Floats, span: Ints, degree: int) -> tuple[Floats, Floats]:
    """Knots (N, degree) where the supports of the functions one degree lower begin and end."""
    steps = np.arange(degree)
    return knots[span[:, None] - degree + 1 + steps], knots[span[:, None] + 1 + steps]


def curve_points(curve: NurbsCurve, t: Floats) -> Floats:
    """Points (N, D) of the curve at ``t`` (N,)."""
    first, values = basis_functions(curve.knots, curve.degree, len(curve.points), np.asarray(t, np.float64))
    local = curve.points[first[:, None] + np.arange(curve.degree + 1)]
    homogeneous = np.einsum("ni,nic->nc", values[0], local)
    points: Floats = homogeneous[:, :-1] / homogeneous[:, -1:]
    return points


def surface_points(surface: NurbsSurface, uv: Floats) -> Floats:
    """Points (N, 3) of the surface at ``uv`` (N, 2)."""
    parts = [_homogeneous(surface, uv[i : i + _MOST_AT_ONCE], 0)[0, 0] for i in _chunks(len(uv))]
    homogeneous = np.concatenate(parts) if parts else np.zeros((0, 4))
    points: Floats = homogeneous[:, :3] / homogeneous[:, 3:]
    return points


def surface_jet(surface: NurbsSurface, uv: Floats, n_derivatives: int = 1) -> SurfaceJet:
    """Points of the surface with their first, or first and second, partial derivatives."""
    parts = [_homogeneous(surface, uv[i : i + _MOST_AT_ONCE], n_derivatives) for i in _chunks(len(uv))]
    wide = np.concatenate(parts, axis=2)
    w = wide[0, 0, :, 3:]
    point = wide[0, 0, :, :3] / w
    du = (wide[1, 0, :, :3] - wide[1, 0, :, 3:] * point) / w
    dv = (wide[0, 1, :, :3] - wide[0, 1, :, 3:] * point) / w
    if n_derivatives < 2:
        return SurfaceJet(point, du, dv)
    wu, wv = wide[1, 0, :, 3:], wide[0, 1, :, 3:]
    duu = (wide[2, 0, :, :3] - 2 * wu * du - wide[2, 0, :, 3:] * point) / w
    dvv = (wide[0, 2, :, :3] - 2 * wv * dv - wide[0, 2, :, 3:] * point) / w
    duv = (wide[1, 1, :, :3] - wu * dv - wv * du - wide[1, 1, :, 3:] * point) / w
    return SurfaceJet(point, du, dv, duu, duv, dvv)


def _chunks(n: int) -> range:
    return range(0, max(n, 1), _MOST_AT_ONCE)


def _homogeneous(surface: NurbsSurface, uv: Floats, n_derivatives: int) -> Floats:
    """Homogeneous points and derivatives (D + 1, D + 1, N, 4); entry [a, b] is taken a times by u and b by v."""
    (p, q), n, m = surface.degrees, surface.points.shape[0], surface.points.shape[1]
    first_u, by_u = basis_functions(surface.knots[0], p, n, uv[:, 0], n_derivatives)
    first_v, by_v = basis_functions(surface.knots[1], q, m, uv[:, 1], n_derivatives)
    rows = first_u[:, None, None] + np.arange(p + 1)[:, None]
    columns = first_v[:, None, None] + np.arange(q + 1)
    along_v = np.einsum("bnj,nijc->bnic", by_v, surface.points[rows, columns])
    wide: Floats = np.einsum("ani,bnic->abnc", by_u, along_v)
    return wide


def greatest_curvature(jet: SurfaceJet) -> Floats:
    """The greater principal curvature (N,), without sign; 0 where the surface has no tangent plane."""
    if jet.duu is None or jet.duv is None or jet.dvv is None:
        raise ValueError("second derivatives are needed")
    normal = np.cross(jet.du, jet.dv)
    e, f, g = _dots(jet.du, jet.du), _dots(jet.du, jet.dv), _dots(jet.dv, jet.dv)
    det = e * g - f * f
    # At a pole one derivative vanishes and what is left of it is noise.
    regular = (det > 1e-10 * e * g) & (e > _NOISE * e.max(initial=0.0)) & (g > _NOISE * g.max(initial=0.0))
    det = np.where(regular, det, 1.0)
    normal = normal / np.sqrt(det)[:, None]
    el, em, en = _dots(jet.duu, normal), _dots(jet.duv, normal), _dots(jet.dvv, normal)
    gauss = (el * en - em * em) / det
    mean = (el * g - 2 * em * f + en * e) / (2 * det)
    curvature: Floats = np.abs(mean) + np.sqrt(np.maximum(mean * mean - gauss, 0.0))
    return np.where(regular, curvature, 0.0)


def _dots(a: Floats, b: Floats) -> Floats:
    dots: Floats = np.einsum("ij,ij->i", a, b)
    return dots
