"""NURBS curves and surfaces as arrays, evaluated at many parameters at a time.

A rational B-spline surface of degrees p and q with control points P_ij, weights w_ij and B-spline basis functions
N_i and M_j is the projection of a B-spline surface in four dimensions, whose control points are *homogeneous*::

    A(u, v) = Σ_ij N_i(u) M_j(v) (w_ij P_ij, w_ij) = (w(u, v) S(u, v), w(u, v))

`scipy.interpolate` evaluates A and its partial derivatives A_ab (a times by u, b times by v); the quotient rule
gives those of S (Piegl and Tiller, *The NURBS Book*, 2nd ed., eqs. 4.8 and 4.20)::

    S    = A_00 / w
    S_u  = (A_10 - w_u S) / w                          S_v likewise
    S_uu = (A_20 - 2 w_u S_u - w_uu S) / w             S_vv likewise
    S_uv = (A_11 - w_u S_v - w_v S_u - w_uv S) / w

Evaluating n points takes O(n (p + 1)(q + 1)) per derivative.  Knots are in full form: as many as control points +
degree + 1.  Parameters beyond the domain are clipped to its ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from weavecore.geometry.arrays import Floats

_LEAST_SINE_SQUARED = 1e-10
"""Squared sine of the angle between the derivatives below which they span no tangent plane: 1e-5 radians, well above
the rounding of control points kept in double precision."""

_VANISHING = 1e-16
"""A squared derivative below this part of the greatest of all points (1e-8 in length) is rounding: a pole."""


@dataclass(frozen=True, eq=False)
class NurbsCurve:
    """A rational B-spline curve.

    Parameters
    ----------
    degree : int
    knots : (N + degree + 1,) float64
    points : (N, D + 1) float64
        Homogeneous control points.
    """

    degree: int
    knots: Floats
    points: Floats

    @property
    def domain(self) -> tuple[float, float]:
        """First and last parameter."""
        return float(self.knots[self.degree]), float(self.knots[len(self.points)])

    @cached_property
    def spline(self) -> Any:
        """The homogeneous B-spline, a `scipy.interpolate.BSpline`."""
        from scipy.interpolate import BSpline  # Half of SciPy comes with it, and few files hold NURBS.

        return BSpline(self.knots, self.points, self.degree)


@dataclass(frozen=True, eq=False)
class NurbsSurface:
    """A rational B-spline surface.

    Parameters
    ----------
    degrees : (int, int)
        Along u and along v.
    knots : pair of (N + p + 1,) and (M + q + 1,) float64
    points : (N, M, 4) float64
        Homogeneous control points.
    """

    degrees: tuple[int, int]
    knots: tuple[Floats, Floats]
    points: Floats

    def domain(self, way: int) -> tuple[float, float]:
        """First and last parameter along u (0) or v (1)."""
        return float(self.knots[way][self.degrees[way]]), float(self.knots[way][self.points.shape[way]])

    @cached_property
    def spline(self) -> Any:
        """The homogeneous tensor-product spline, a `scipy.interpolate.NdBSpline`."""
        from scipy.interpolate import NdBSpline

        return NdBSpline(self.knots, self.points, self.degrees)


@dataclass(frozen=True, eq=False)
class SurfaceJet:
    """Points (N, 3) of a surface and their partial derivatives (N, 3); the second ones only where asked for."""

    point: Floats
    du: Floats
    dv: Floats
    duu: Floats | None = None
    duv: Floats | None = None
    dvv: Floats | None = None


def curve_points(curve: NurbsCurve, t: Floats) -> Floats:
    """Points of a curve.

    Parameters
    ----------
    curve : NurbsCurve
    t : (N,) float64
        Parameters.

    Returns
    -------
    (N, D) float64
    """
    homogeneous = curve.spline(np.clip(np.asarray(t, np.float64), *curve.domain))
    points: Floats = homogeneous[:, :-1] / homogeneous[:, -1:]
    return points


def surface_points(surface: NurbsSurface, uv: Floats) -> Floats:
    """Points of a surface.

    Parameters
    ----------
    surface : NurbsSurface
    uv : (N, 2) float64
        Parameters.

    Returns
    -------
    (N, 3) float64
    """
    homogeneous = _derivative(surface, _clipped(surface, uv), 0, 0)
    points: Floats = homogeneous[:, :3] / homogeneous[:, 3:]
    return points


def surface_jet(surface: NurbsSurface, uv: Floats, n_derivatives: int = 1) -> SurfaceJet:
    """Points of a surface with their partial derivatives.

    Parameters
    ----------
    surface : NurbsSurface
    uv : (N, 2) float64
        Parameters.
    n_derivatives : int
        1 for the first derivatives, 2 for the second ones as well.

    Returns
    -------
    SurfaceJet
    """
    uv = _clipped(surface, uv)
    (a, w), (au, wu), (av, wv) = (_split(_derivative(surface, uv, *order)) for order in ((0, 0), (1, 0), (0, 1)))
    point = a / w
    du, dv = (au - wu * point) / w, (av - wv * point) / w
    if n_derivatives < 2:
        return SurfaceJet(point, du, dv)
    (auu, wuu), (auv, wuv), (avv, wvv) = (
        _split(_derivative(surface, uv, *order)) for order in ((2, 0), (1, 1), (0, 2))
    )
    duu = (auu - 2 * wu * du - wuu * point) / w
    dvv = (avv - 2 * wv * dv - wvv * point) / w
    duv = (auv - wu * dv - wv * du - wuv * point) / w
    return SurfaceJet(point, du, dv, duu, duv, dvv)


def _clipped(surface: NurbsSurface, uv: Floats) -> Floats:
    low, high = zip(surface.domain(0), surface.domain(1))
    return np.clip(np.asarray(uv, np.float64), low, high)


def _derivative(surface: NurbsSurface, uv: Floats, by_u: int, by_v: int) -> Floats:
    """Partial derivatives (N, 4) of the homogeneous surface."""
    if len(uv) == 0 or by_u > surface.degrees[0] or by_v > surface.degrees[1]:
        return np.zeros((len(uv), 4))
    values: Floats = surface.spline(uv, nu=(by_u, by_v))
    return values


def _split(homogeneous: Floats) -> tuple[Floats, Floats]:
    return homogeneous[:, :3], homogeneous[:, 3:]


def greatest_curvature(jet: SurfaceJet) -> Floats:
    """The greater principal curvature, without sign.

    With the mean curvature H and the Gaussian curvature K of the two fundamental forms it is |H| + √(H² - K).

    Parameters
    ----------
    jet : SurfaceJet
        With second derivatives.

    Returns
    -------
    (N,) float64
        0 where the surface has no tangent plane.

    Raises
    ------
    ValueError
        Where second derivatives are missing.
    """
    if jet.duu is None or jet.duv is None or jet.dvv is None:
        raise ValueError("second derivatives are needed")
    normal = np.cross(jet.du, jet.dv)
    e, f, g = _dots(jet.du, jet.du), _dots(jet.du, jet.dv), _dots(jet.dv, jet.dv)
    det = e * g - f * f
    # At a pole one derivative vanishes, and only rounding is left of it.
    regular = (
        (det > _LEAST_SINE_SQUARED * e * g)
        & (e > _VANISHING * e.max(initial=0.0))
        & (g > _VANISHING * g.max(initial=0.0))
    )
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
