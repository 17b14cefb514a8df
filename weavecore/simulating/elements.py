"""Energies of rods and ties on plain arrays, with exact gradients and Hessians.

Discrete elastic rods without twist (Bergou, Wardetzky, Robinson, Audoly and Grinspun 2008, §4.2)::

      e        f            stretch of a segment   E = EA (l - l0)^2 / (2 l0)
    o-----o-----o           bend at an inner point E = EI |k|^2 / (2 w),   |k| = 2 tan(theta / 2)
          | theta           w: half the rest length of the two segments
      ----o----  rod b      tie                    E = sum_i s_i (c_i - r_i)^2 / 2,
          | g               c = (|g|, g.ta, g.tb)  g: gap from rod a to rod b, ta and tb: unit tangents there
      ----o----  rod a

          | phi       scissors               E = s (cos phi - cos phi0)^2 / 2,   cos phi = ta.tb

A tie holds two rods one above the other: their distance, and the gap perpendicular to both.  The tangents come from the
points beside the tied ones, so the couple of a force across the gap reaches the rods, and rigid motion
changes no energy.  Rods may turn about the gap as scissors do; where ties resist it, a spring acts on the angle.

A tie with *friction* F slides along a rod where the force along it reaches F: there the energy ``s (c - r)^2 / 2`` goes
on with the slope F.  This is Coulomb friction under a load that only grows.  The first component of such a tie is the
distance of the two tangents, which sliding leaves as it is: ``g.n`` with ``n = a x b / |a x b|`` of the chords a and b.

Stretch and ties are stiff *constraints* ``c`` with a force ``m = s (c - r)``.  Their Hessian is
``s dc dc^T + m ddc``; `weavecore.simulating.newton` passes forces of its own for ``m``.  Units are SI.  All is
linear in the number of elements.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints

_IDENTITY = np.eye(3)


@dataclass(frozen=True, eq=False)
class Bends:
    """Inner points of rods.

    Parameters
    ----------
    points : (B, 3) int64
        The point before, the point, and the point after it.
    stiffness : (B,) float64
        ``EI / w`` in N·m, ``w`` the length of rod that belongs to the point.
    """

    points: Ints
    stiffness: Floats


@dataclass(frozen=True, eq=False)
class Stretches:
    """Segments of rods.

    Parameters
    ----------
    points : (M, 2) int64
    rest : (M,) float64
        Length without force, in m.
    stiffness : (M,) float64
        ``EA / rest`` in N/m.
    """

    points: Ints
    rest: Floats
    stiffness: Floats


@dataclass(frozen=True, eq=False)
class TieElements:
    """Pairs of rods that are tied where they cross.

    Parameters
    ----------
    points : (T, 6) int64
        The tied point of rod a and that of rod b, then the points before and after each: a, b, a-, a+, b-, b+.
    rest : (T, 3) float64
        Distance of the axes, and how far b lies along a and along b, in m.
    stiffness : (T, 3) float64
        In N/m; of the distance, and along each rod.
    friction : (T,) float64, optional
        Force in N at which the tie slides along either rod; infinite where it does not.
    """

    points: Ints
    rest: Floats
    stiffness: Floats
    friction: Optional[Floats] = None

    @cached_property
    def slides(self) -> Optional[Bools]:
        """(T,) which ties may slide, None where none may."""
        return None if self.friction is None else np.isfinite(self.friction)

    def forces(self, elongation: Floats) -> Floats:
        """(T, 3) forces at elongations (T, 3): those along the rods go up to the friction."""
        force: Floats = self.stiffness * elongation
        if self.friction is not None:
            force[:, 1:] = np.clip(force[:, 1:], -self.friction[:, None], self.friction[:, None])
        return force

    def energy(self, elongation: Floats) -> float:
        """Energy of all at elongations (T, 3), in J; beyond the friction it rises with the slope F."""
        force = self.forces(elongation)
        return float((force * (elongation - force / self.stiffness / 2)).sum())

    def tangents(self, force: Floats) -> Floats:
        """(T, 3) stiffness at forces (T, 3): none along a rod where the tie slides."""
        if self.friction is None:
            return self.stiffness
        tangents = self.stiffness.copy()
        tangents[:, 1:][np.abs(force[:, 1:]) >= self.friction[:, None]] = 0.0
        return tangents


@dataclass(frozen=True, eq=False)
class Scissors:
    """Springs against the turn of tied rods about their tie.

    Parameters
    ----------
    points : (T, 4) int64
        Those before and after the tied point on either rod: a-, a+, b-, b+.
    rest : (T,) float64
        Cosine of the angle between the rods without moment.
    stiffness : (T,) float64
        In J: the torsional stiffness in N·m/rad over the squared sine of the angle at rest.
    """

    points: Ints
    rest: Floats
    stiffness: Floats


SCISSOR_SIGNS = np.array([[-1.0, 1.0, 0, 0], [0, 0, -1.0, 1.0]])
"""The two chords from the four points of a pair of scissors."""

TIE_SIGNS = np.array([[-1.0, 1.0, 0, 0, 0, 0], [0, 0, -1.0, 1.0, 0, 0], [0, 0, 0, 0, -1.0, 1.0]])
"""Gap and the two chords of a tie from its six points."""

BEND_SIGNS = np.array([[-1.0, 1.0, 0], [0, -1.0, 1.0]])
STRETCH_SIGNS = np.array([[-1.0, 1.0]])


def outer(a: Floats, b: Floats) -> Floats:
    """(n, 3, 3) dyadic products of rows."""
    return a[:, :, None] * b[:, None, :]


def normalised(vectors: Floats) -> tuple[Floats, Floats]:
    """Lengths (n,) and unit vectors (n, 3)."""
    length = np.sqrt(np.einsum("nd,nd->n", vectors, vectors))
    return length, vectors / length[:, None]


def projectors(unit: Floats) -> Floats:
    """(n, 3, 3) projections onto the planes that are normal to unit vectors."""
    across: Floats = _IDENTITY - outer(unit, unit)
    return across


def half_angle_tangents(x: Floats, bends: Bends) -> Floats:
    """(B,) ``2 tan(theta / 2)`` at each inner point; its quotient with ``w`` is the curvature."""
    i, j, k = bends.points.T
    _, e = normalised(x[j] - x[i])
    _, f = normalised(x[k] - x[j])
    across, along = np.linalg.norm(e - f, axis=1), np.linalg.norm(e + f, axis=1)
    tangents: Floats = 2.0 * across / along
    return tangents


def bend_gradient(x: Floats, bends: Bends) -> tuple[Floats, Floats]:
    """Energies (B,) and their derivatives (B, 2, 3) by the edges before and after each point."""
    i, j, k = bends.points.T
    le, e = normalised(x[j] - x[i])
    lf, f = normalised(x[k] - x[j])
    cosine, difference = np.einsum("nd,nd->n", e, f), e - f
    energy = bends.stiffness * np.einsum("nd,nd->n", difference, difference) / (1.0 + cosine)
    slope = (-4.0 * bends.stiffness / (1.0 + cosine) ** 2)[:, None]
    by_e = slope * (f - cosine[:, None] * e) / le[:, None]
    by_f = slope * (e - cosine[:, None] * f) / lf[:, None]
    return energy, np.stack([by_e, by_f], axis=1)


def bend_hessian(x: Floats, bends: Bends) -> Floats:
    """(B, 2, 2, 3, 3) second derivatives by the two edges: ``E'' grad c grad c^T + E' Hess c``, ``c = cos theta``."""
    i, j, k = bends.points.T
    le, e = normalised(x[j] - x[i])
    lf, f = normalised(x[k] - x[j])
    cosine = np.einsum("nd,nd->n", e, f)
    slope = (-4.0 * bends.stiffness / (1.0 + cosine) ** 2)[:, None, None]
    curve = (8.0 * bends.stiffness / (1.0 + cosine) ** 3)[:, None, None]
    p, q = f - cosine[:, None] * e, e - cosine[:, None] * f
    across_e, across_f = projectors(e), projectors(f)
    c = cosine[:, None, None]
    le2, lf2, lef = ((a * b)[:, None, None] for a, b in ((le, le), (lf, lf), (le, lf)))
    blocks = np.empty((len(cosine), 2, 2, 3, 3))
    blocks[:, 0, 0] = (curve * outer(p, p) - slope * (outer(p, e) + outer(e, p) + c * across_e)) / le2
    blocks[:, 1, 1] = (curve * outer(q, q) - slope * (outer(q, f) + outer(f, q) + c * across_f)) / lf2
    blocks[:, 0, 1] = (curve * outer(p, q) + slope * (across_e @ across_f)) / lef
    blocks[:, 1, 0] = blocks[:, 0, 1].transpose(0, 2, 1)
    return blocks


def stretch_values(x: Floats, stretches: Stretches) -> tuple[Floats, Floats]:
    """Elongations (M,) and unit vectors (M, 3) along the segments."""
    a, b = stretches.points.T
    length, unit = normalised(x[b] - x[a])
    return length - stretches.rest, unit


def stretch_hessian(x: Floats, stretches: Stretches, force: Optional[Floats] = None) -> Floats:
    """(M, 1, 1, 3, 3) second derivatives by the segments' vectors, with axial forces of one's own where given."""
    a, b = stretches.points.T
    length, unit = normalised(x[b] - x[a])
    axial: Floats = stretches.stiffness * (length - stretches.rest) if force is None else force
    dyad = outer(unit, unit)
    geometric = (axial / length)[:, None, None] * (_IDENTITY - dyad)
    blocks: Floats = (stretches.stiffness[:, None, None] * dyad + geometric)[:, None, None]
    return blocks


def tie_values(x: Floats, points: Ints, slides: Optional[Bools] = None) -> tuple[Floats, Floats]:
    """Distance and offsets along both rods (T, 3), and their derivatives (T, 3, 3, 3) by gap and both chords.

    Of ties that slide (T,) the distance is that of the tangents, with a sign.
    """
    gap, (la, ta), (lb, tb) = _tie_vectors(x, points)
    distance, unit = normalised(gap)
    along_a, along_b = np.einsum("nd,nd->n", gap, ta), np.einsum("nd,nd->n", gap, tb)
    slopes = np.zeros((len(points), 3, 3, 3))
    slopes[:, 0, 0] = unit
    slopes[:, 1, 0], slopes[:, 2, 0] = ta, tb
    slopes[:, 1, 1] = (gap - along_a[:, None] * ta) / la[:, None]
    slopes[:, 2, 2] = (gap - along_b[:, None] * tb) / lb[:, None]
    if slides is not None:
        apart, by_vectors = _line_distance(gap, la[:, None] * ta, lb[:, None] * tb)[:2]
        distance = np.where(slides, apart, distance)
        slopes[slides, 0] = by_vectors[slides]
    return np.stack([distance, along_a, along_b], axis=1), slopes


def _line_distance(gap: Floats, a: Floats, b: Floats) -> tuple[Floats, Floats, Floats]:
    """Distance (T,) of two lines along a and b (T, 3), with a sign, and its derivatives by the gap, a and b.

    The first are (T, 3, 3), the second (T, 3, 3, 3, 3).
    """
    length, n = normalised(np.cross(a, b))
    distance = np.einsum("nd,nd->n", gap, n)
    # What the distance gains by a turn of n: d(gap . n) = q . d(a x b).
    q = (gap - distance[:, None] * n) / length[:, None]
    by_a, by_b = -_cross_matrices(b), _cross_matrices(a)  # Derivatives of a x b.
    across = projectors(n) / length[:, None, None]
    inner = (-outer(n, q) - outer(q, n)) / length[:, None, None]
    inner -= (distance / length)[:, None, None] * across
    second = np.zeros((len(gap), 3, 3, 3, 3))
    for k, by_k in ((1, by_a), (2, by_b)):
        second[:, 0, k] = across @ by_k
        second[:, k, 0] = second[:, 0, k].transpose(0, 2, 1)
        second[:, k, k] = by_k.transpose(0, 2, 1) @ inner @ by_k
    second[:, 1, 2] = by_a.transpose(0, 2, 1) @ inner @ by_b - _cross_matrices(q)
    second[:, 2, 1] = second[:, 1, 2].transpose(0, 2, 1)
    return distance, np.stack([n, np.cross(b, q), np.cross(q, a)], axis=1), second


def _cross_matrices(v: Floats) -> Floats:
    """(T, 3, 3) skew matrices of the cross product with v (T, 3) on the left."""
    matrix = np.zeros((len(v), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrix[:, i, j], matrix[:, j, i] = -v[:, k], v[:, k]
    return matrix


def tie_hessian(x: Floats, ties: TieElements, force: Optional[Floats] = None) -> Floats:
    """(T, 3, 3, 3, 3) second derivatives by gap and chords, with tie forces (T, 3) of one's own where given."""
    values, slopes = tie_values(x, ties.points, ties.slides)
    force = ties.forces(values - ties.rest) if force is None else force
    flat = slopes.reshape(len(slopes), 3, 9)
    full = np.einsum("nk,nki,nkj->nij", ties.tangents(force), flat, flat, optimize=True)
    blocks: Floats = full.reshape(-1, 3, 3, 3, 3).transpose(0, 1, 3, 2, 4).copy()
    gap, *rods = _tie_vectors(x, ties.points)
    distance, unit = normalised(gap)
    is_stuck = 1.0 if ties.slides is None else ~ties.slides
    blocks[:, 0, 0] += (is_stuck * force[:, 0] / distance)[:, None, None] * projectors(unit)
    if ties.slides is not None:
        a, b = (length[:, None] * tangent for length, tangent in rods)
        apart = _line_distance(gap, a, b)[2][ties.slides]
        blocks[ties.slides] += force[ties.slides, 0, None, None, None, None] * apart
    for k, (length, tangent) in enumerate(rods, start=1):
        across = projectors(tangent)
        mixed = (force[:, k] / length)[:, None, None] * across
        blocks[:, 0, k] += mixed
        blocks[:, k, 0] += mixed
        p = gap - values[:, k, None] * tangent
        second = outer(p, tangent) + outer(tangent, p) + values[:, k, None, None] * across
        blocks[:, k, k] -= (force[:, k] / length**2)[:, None, None] * second
    return blocks


def scissor_cosines(x: Floats, points: Ints) -> Floats:
    """(T,) cosine of the angle between the chords of both rods."""
    _, (_, ta), (_, tb) = _chords(x, points)
    cosines: Floats = np.einsum("nd,nd->n", ta, tb)
    return cosines


def scissor_gradient(x: Floats, scissors: Scissors) -> tuple[Floats, Floats]:
    """Energies (T,) and their derivatives (T, 2, 3) by both chords."""
    cosine, (la, ta), (lb, tb) = _chords(x, scissors.points)
    turned = cosine - scissors.rest
    force = scissors.stiffness * turned
    by_a = (force / la)[:, None] * (tb - cosine[:, None] * ta)
    by_b = (force / lb)[:, None] * (ta - cosine[:, None] * tb)
    return force * turned / 2, np.stack([by_a, by_b], axis=1)


def scissor_hessian(x: Floats, scissors: Scissors) -> Floats:
    """(T, 2, 2, 3, 3) second derivatives by both chords."""
    cosine, (la, ta), (lb, tb) = _chords(x, scissors.points)
    force, c = (scissors.stiffness * (cosine - scissors.rest))[:, None, None], cosine[:, None, None]
    p, q = tb - cosine[:, None] * ta, ta - cosine[:, None] * tb
    stiff = scissors.stiffness[:, None, None]
    la2, lb2, lab = ((a * b)[:, None, None] for a, b in ((la, la), (lb, lb), (la, lb)))
    across_a, across_b = projectors(ta), projectors(tb)
    blocks = np.empty((len(cosine), 2, 2, 3, 3))
    blocks[:, 0, 0] = (stiff * outer(p, p) - force * (outer(p, ta) + outer(ta, p) + c * across_a)) / la2
    blocks[:, 1, 1] = (stiff * outer(q, q) - force * (outer(q, tb) + outer(tb, q) + c * across_b)) / lb2
    blocks[:, 0, 1] = (stiff * outer(p, q) + force * (across_a @ across_b)) / lab
    blocks[:, 1, 0] = blocks[:, 0, 1].transpose(0, 2, 1)
    return blocks


def _chords(x: Floats, points: Ints) -> tuple[Floats, tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Cosine (T,) between both chords, and length and unit vector of each."""
    before_a, after_a, before_b, after_b = points.T
    a, b = normalised(x[after_a] - x[before_a]), normalised(x[after_b] - x[before_b])
    return np.einsum("nd,nd->n", a[1], b[1]), a, b


def _tie_vectors(x: Floats, points: Ints) -> tuple[Floats, tuple[Floats, Floats], tuple[Floats, Floats]]:
    """Gap (T, 3) from a to b, and length and unit vector of the chord about each tied point."""
    a, b, before_a, after_a, before_b, after_b = points.T
    return x[b] - x[a], normalised(x[after_a] - x[before_a]), normalised(x[after_b] - x[before_b])
