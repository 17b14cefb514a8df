"""Bending energy of rods over the places of their nodes, with bounds on edge lengths and angles.

A rod that is held at its joints takes the shape of a C2 cubic spline.  Its second derivative M_j at joint j solves

    h_p/6 M_p + (h_p + h_n)/3 M_j + h_n/6 M_n = (x_n - x_j)/h_n - (x_j - x_p)/h_p        (de Boor 1978, ch. IV)

where p and n are the joints before and after and h the chords; at free ends M = 0.  M is linear between joints, so the
spline is bent most sharply at a joint.  Going over and under adds offsets of d/2 out of the surface and into it.  Their
share v_j solves the same system with negated entries off the diagonal and d/h_p + d/h_n on the right: 6 d/h² for
even chords.  Which rod is over is not known here, so the worse case counts:

    curvature² = (tangential part of M)² + (|normal part of M| + v)²

Each term gives its value, its gradient, and the derivatives that make up the Gauss-Newton Hessian (`normal_equations`).
The inverse of the system falls by 0.27 from joint to joint.  In the Hessian, which only steers, it reaches `REACH`
joints each way, in the gradient all.  Arrays are over the places of `rod_runs`: what a joint shares with the next is
a shift.  Linear in the number of nodes.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Optional

import numpy as np
from scipy.linalg.lapack import dpttrf, dpttrs

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, previous_in_loop
from weavecore.geometry.elementary import arctangents, logarithms, sines_and_cosines
from weavecore.geometry.polygon_mesh import edges_between
from weavecore.linking.rod_runs import RodRuns
from weavecore.model.lattice import Lattice
from weavecore.polling import each, poll

EASY, HOPELESS = 0.9, 1.5
"""Curvature over the admissible one from which it counts, and beyond which its cost grows in proportion only."""

_EVENNESS = 0.03
"""Weight of the squared curvature everywhere, against that of what exceeds `EASY`."""

REACH = 2
"""Joints on both sides by which a joint is bent, in the Hessian: those beyond count for less than 0.27³ = 2 %."""

SHORTEST, LONGEST = 0.65, 1.38
"""Edge length over the median at which the bounds begin to push back."""

_EDGE_BOUND, _EDGE_PULL = 10.0, 0.3
"""Weights of the logarithm of an edge length beyond its bounds, and of that against the median anywhere."""

LEAST_ANGLE = np.radians(33.0)
"""Corner of a face at which its bound begins to push back."""

_ANGLE_BOUND = 8.0
"""Weight of an angle, in radians, below `LEAST_ANGLE`."""

_TINY = np.finfo(float).tiny
_NOTHING = np.zeros((0, 0))


# Vectors with coordinates in rows of their own: several times as fast as short rows.


def _dot(a: Floats, b: Floats) -> Floats:
    """Inner products (n,) of columns (3, n)."""
    product: Floats = a[0] * b[0]
    product += a[1] * b[1]
    product += a[2] * b[2]
    return product


def _cross(a: Floats, b: Floats) -> Floats:
    """Cross products (3, n) of columns."""
    return np.stack([a[i] * b[j] - a[j] * b[i] for i, j in ((1, 2), (2, 0), (0, 1))])


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.maximum(np.sqrt(_dot(vectors, vectors)), _TINY)
    return unit


def _orthogonal(vectors: Floats, unit: Floats) -> Floats:
    """The parts (3, n) of vectors that are normal to unit vectors."""
    rest: Floats = vectors - _dot(vectors, unit) * unit
    return rest


def _before(values: Floats) -> Floats:
    """The value one place before each; at the first place 0."""
    shifted = np.zeros_like(values)
    shifted[..., 1:] = values[..., :-1]
    return shifted


def _after(values: Floats) -> Floats:
    """The value one place after each; at the last place 0."""
    shifted = np.zeros_like(values)
    shifted[..., :-1] = values[..., 1:]
    return shifted


def summed_at_nodes(node: Ints, values: Floats, n_nodes: int) -> Floats:
    """Sums (N, 3) of columns (3, n) over each node.

    Parameters
    ----------
    node : (n,) int64
    values : (3, n) float64
    n_nodes : int
    """
    poll()
    return np.stack([np.bincount(node, row, n_nodes) for row in values], axis=1)


class Segments:
    """The edges along rods: unit vectors (3, Q) to the next place, and their lengths (Q,).

    Ghosts have theirs too; between rods the vectors are 0 and the lengths 1.

    Parameters
    ----------
    runs : RodRuns
    nodes : (N, 3) float64
    """

    def __init__(self, runs: RodRuns, nodes: Floats) -> None:
        poll()
        place = np.ascontiguousarray(nodes.T).take(runs.node, axis=1)
        way = _after(place) - place
        is_segment = runs.has_next
        way *= is_segment
        length = np.sqrt(_dot(way, way))
        self.length: Floats = np.where(is_segment, np.maximum(length, _TINY), 1.0)
        self.unit: Floats = way / self.length


class _SplineSystem:
    """The systems of all splines, factored, with the entries off the diagonal times ``sign``: -1 for the undulation.

    Tridiagonal along each rod; the corner entries of a closed one are a change of rank one (Sherman and Morrison 1950).
    LAPACK calls no BLAS for tridiagonal systems, so that every processor gives the same last bit.
    """

    def __init__(self, runs: RodRuns, length: Floats, sign: float) -> None:
        self._runs, self._sign = runs, sign
        joint = runs.is_joint
        diagonal = np.where(joint, (_before(length) + length) / 3.0, 1.0)
        beside = (sign / 6.0) * (length[:-1] * (joint[:-1] & joint[1:]))
        first, last = runs.first, runs.last
        corner = length[last] / 6.0
        diagonal[first] -= corner
        diagonal[last] -= corner
        self._factors = dpttrf(diagonal, beside)[:2]
        unit = np.zeros(len(diagonal))
        unit[first], unit[last] = 1.0, sign
        self._response = self._without_corners(unit[None])[0]
        self._share = corner / (1.0 + corner * self._at_ends(self._response))

    def solve(self, right: Floats) -> Floats:
        """The solution (k, Q), at ghosts too, for right-hand sides that are 0 but at joints."""
        found = self._without_corners(right)
        runs = self._runs
        share = self._share * self._at_ends(found)
        for first, last, part in each(zip(runs.first.tolist(), runs.last.tolist(), share.T)):
            found[:, first : last + 1] -= part[:, None] * self._response[first : last + 1]
        found[:, runs.ghost] = found[:, runs.original]
        return found

    def _without_corners(self, right: Floats) -> Floats:
        found: Floats = dpttrs(*self._factors, right.T)[0].T
        return found

    def _at_ends(self, values: Floats) -> Floats:
        added: Floats = values[..., self._runs.first] + self._sign * values[..., self._runs.last]
        return added


class _Parts(NamedTuple):
    """What the derivatives are made of: (…, Q) each, in the order of places.

    ``one`` and ``other`` are what the length of a segment adds to the systems of the joints at its start and its end.
    """

    unit: Floats
    length: Floats
    joints: Floats
    one: Floats
    other: Floats
    shares: Floats
    frame: Floats
    woven_one: Floats = _NOTHING
    woven_other: Floats = _NOTHING
    woven_shares: Floats = _NOTHING
    lift: Floats = _NOTHING


class Bends:
    """The splines through the joints: curvature vectors (3, Q) with the undulation on top, and their derivatives.

    Derivatives take tangents, normals and the side to which a rod bends as fixed.

    Parameters
    ----------
    runs : RodRuns
    normals : (N, 3) float64
        Unit normals of the surface at the nodes.
    segments : Segments
    rise : float
        Height between the layers of two rods that cross and change sides at each joint; 0 where they keep to a layer.
    admissible : float
        The greatest curvature that the material of the rod allows.
    """

    def __init__(self, runs: RodRuns, normals: Floats, segments: Segments, *, rise: float, admissible: float) -> None:
        poll()
        self._runs, self._rise, self._admissible = runs, rise, admissible
        self._unit, self._length = segments.unit, segments.length
        self._joints = runs.is_joint | runs.is_ghost
        joint = runs.is_joint
        self._system = _SplineSystem(runs, self._length, 1.0)
        back = _before(self._unit)
        self._moment = self._system.solve((self._unit - back) * joint)
        self._tangent = _unit(self._unit + back)
        self._normal = _unit(_orthogonal(np.ascontiguousarray(normals.T).take(runs.node, axis=1), self._tangent))
        vector = _orthogonal(self._moment, self._tangent)
        self._side = np.where(_dot(vector, self._normal) < 0, -1.0, 1.0)
        if rise > 0:
            self._weave_system = _SplineSystem(runs, self._length, -1.0)
            inverse = 1.0 / self._length
            self._weave = self._weave_system.solve((rise * (_before(inverse) + inverse) * joint)[None])[0]
            vector += (self._side * self._weave) * self._normal
        self._vector = vector
        self.curvature: Floats = np.sqrt(_dot(vector, vector)) * joint

    @cached_property
    def _cost(self) -> tuple[Floats, Floats, Floats]:
        return _cost(self.curvature / self._admissible)

    @property
    def costs(self) -> Floats:
        """(Q,) cost of the curvature at each joint."""
        return self._cost[0]

    @cached_property
    def _direction(self) -> Floats:
        """(3, Q) unit vectors of the curvature."""
        direction: Floats = self._vector / np.maximum(np.sqrt(_dot(self._vector, self._vector)), _TINY)
        return direction

    def _by_lengths(self) -> tuple[Floats, Floats]:
        """What the moments at both ends of each segment (3, Q) times its length add to the systems of its ends."""
        here, there = self._moment, _after(self._moment)
        return here / 3.0 + there / 6.0, there / 3.0 + here / 6.0

    def _woven_by_lengths(self) -> tuple[Floats, Floats]:
        """The same (Q,) of the undulation, with its right-hand side."""
        here, there = self._weave, _after(self._weave)
        steeper = -self._rise / (self._length * self._length)
        return steeper - (here / 3.0 - there / 6.0), steeper - (there / 3.0 - here / 6.0)

    def forces(self) -> Floats:
        """Gradient (3, Q) of the sum of costs by the node at the end of each segment; by that at its start minus it."""
        poll()
        slopes = self._direction * (self._cost[1] * self._runs.is_joint / self._admissible)
        pull = self._system.solve(_orthogonal(slopes, self._tangent))
        far = _after(pull)
        gap = pull - far
        one, other = self._by_lengths()
        along = _dot(one, pull) + _dot(other, far)
        along += _dot(gap, self._unit) / self._length
        if self._rise > 0:
            lift = self._weave_system.solve((self._side * _dot(slopes, self._normal))[None])[0]
            one_woven, other_woven = self._woven_by_lengths()
            along -= one_woven * lift + other_woven * _after(lift)
        forces: Floats = (gap / self._length - along * self._unit) * self._runs.is_segment
        return forces

    def rows(self, places: Optional[Ints], directions: Floats) -> Floats:
        """Derivatives of the residuals of each joint by the unknowns of the places around it.

        Parameters
        ----------
        places : (P,) int64, optional
            Those to look at; by default all.  Wrong at joints whose stencils reach beyond them.
        directions : (m, 3, Q) float64
            Directions in which the node of each place goes, 0 for those in which it does not.

        Returns
        -------
        (2 REACH + 3, m, 2, Q) float64
            By the place `REACH` + 1 before the joint to that as far after it; 0 where there is no joint.
        """
        parts = (
            self._parts
            if places is None
            else _Parts(*(part[..., places] if part.size else part for part in self._parts))
        )
        n_places = 2 * REACH + 3
        rows = np.zeros((n_places, len(directions), 2, len(parts.length)))
        for m, way in each(enumerate(directions)):
            start, end = _dot(parts.unit, way), _dot(parts.unit, _after(way))
            by_places = _by_places(parts, way, start, end)
            by_places_woven = _woven_by_places(parts, start, end) if self._rise > 0 else []
            for s in range(n_places):
                total = _stencil_sum(parts.shares, by_places, s)
                rows[s, m] = [_dot(axis, total) for axis in parts.frame]
                if by_places_woven:
                    rows[s, m] += parts.lift * _stencil_sum(parts.woven_shares, by_places_woven, s)
        return rows

    @cached_property
    def _parts(self) -> _Parts:
        poll()
        _, slope, second = self._cost
        joint = self._runs.is_joint
        # Roots of the second derivatives along the curvature and across it, in the plane normal to the rod.
        along = np.sqrt(second) * joint / self._admissible
        ratio = self.curvature / self._admissible
        across = np.sqrt(slope / np.maximum(ratio, 1e-12)) * joint / self._admissible
        frame = np.stack([along * self._direction, across * _cross(self._tangent, self._direction)])
        joints = self._joints.astype(np.float64)
        parts = _Parts(self._unit, self._length, joints, *self._by_lengths(), self._shares(1.0), frame)
        if self._rise > 0:
            lift = np.stack([self._side * _dot(axis, self._normal) for axis in frame])
            parts = _Parts(*parts[:7], *self._woven_by_lengths(), self._shares(-1.0), lift)
        return parts

    def _shares(self, sign: float) -> Floats:
        """Rows (2 REACH + 1, Q) of the inverse of the system, those beyond the stencil left out.

        With pivots p from both ends inwards, p' = d' - o²/p, the entry at the joint is 1 / (d - Σ o²/p), and each
        further one -o/p times the one before.
        """
        joint = self._joints
        diagonal = np.where(joint, (_before(self._length) + self._length) / 3.0, 1.0)
        beside = (sign / 6.0) * self._length * (joint & np.append(joint[1:], False))
        centre = diagonal.copy()
        shares = [np.zeros(0)] * (2 * REACH + 1)
        for way in (-1, 1):
            # Entry beside the diagonal between joints k - 1 and k, counted from the middle one outwards.
            off = [_shifted(beside, way * k if way < 0 else k - 1) for k in range(1, REACH + 1)]
            pivot = _shifted(diagonal, way * REACH)
            for k in range(REACH, 0, -1):
                shares[REACH + way * k] = -off[k - 1] / np.where(pivot > 0, pivot, 1.0)
                inner = _shifted(diagonal, way * (k - 1)) if k > 1 else centre
                pivot = inner + off[k - 1] * shares[REACH + way * k]
            centre = pivot
        shares[REACH] = 1.0 / centre
        for k in range(1, REACH + 1):
            for at in (REACH - k, REACH + k):
                shares[at] = shares[at] * shares[at + (1 if at < REACH else -1)]
        return np.stack(shares)


def _by_places(parts: _Parts, way: Floats, start: Floats, end: Floats) -> list[Floats]:
    """(3, Q) derivatives of the system of each joint as the nodes before it, at it and after it go their ways.

    ``start`` and ``end`` are how far each segment's ends go along it.
    """
    unit, length, joints = parts.unit, parts.length, parts.joints
    start_turn, end_turn = (way - start * unit) / length, (_after(way) - end * unit) / length
    before = _before(start_turn + parts.other * start)
    here = -_before(end_turn + parts.other * end) - (start_turn - parts.one * start)
    return [before * joints, here * joints, (end_turn - parts.one * end) * joints]


def _woven_by_places(parts: _Parts, start: Floats, end: Floats) -> list[Floats]:
    """The same (Q,) of the undulation."""
    one, other, joints = parts.woven_one, parts.woven_other, parts.joints
    return [_before(-other * start) * joints, (_before(other * end) - one * start) * joints, one * end * joints]


def _stencil_sum(shares: Floats, by_places: list[Floats], s: int) -> Floats:
    """What place ``s`` of the stencil of each joint adds, through the systems of all joints of the stencil."""
    total, n = np.zeros_like(by_places[0]), shares.shape[1]
    for j in range(3):
        k = s - j
        if 0 <= k <= 2 * REACH:
            by = k - REACH
            here, there = slice(max(-by, 0), n - max(by, 0)), slice(max(by, 0), n - max(-by, 0))
            total[..., here] += shares[k, here] * by_places[j][..., there]
    return total


def _shifted(values: Floats, by: int) -> Floats:
    """The values (…, Q) so many places after each; 0 beyond the ends."""
    if by == 0:
        return values
    shifted = np.zeros_like(values)
    if by > 0:
        shifted[..., :-by] = values[..., by:]
    else:
        shifted[..., -by:] = values[..., :by]
    return shifted


def _cost(ratio: Floats) -> tuple[Floats, Floats, Floats]:
    """Cost of the curvature over the admissible one, with its first and a bound on its second derivative."""
    over = np.maximum(ratio - EASY, 0.0)
    most = HOPELESS - EASY
    beyond = over > most
    value = np.where(beyond, most * (over - most / 2.0), over * over / 2.0) + _EVENNESS * (ratio * ratio) / 2.0
    slope = np.minimum(over, most) + _EVENNESS * ratio
    second = np.where(beyond, slope / np.maximum(ratio, 1e-12), (over > 0) + _EVENNESS)
    return value, slope, second


class EdgeTerm:
    """Cost of edge lengths away from the median, small within the bounds, large beyond.

    Parameters
    ----------
    runs : RodRuns
    segments : Segments
    median : float
    """

    def __init__(self, runs: RodRuns, segments: Segments, median: float) -> None:
        self._segments = segments
        self._is_segment = runs.is_segment
        log = logarithms(segments.length / median)
        self._beyond = log - np.clip(log, _LOG_SHORTEST, _LOG_LONGEST)
        self._log = log
        cost = _EDGE_PULL**2 * (log * log) + _EDGE_BOUND**2 * (self._beyond * self._beyond)
        self.costs: Floats = cost * runs.is_segment / 2.0

    def forces(self) -> Floats:
        """As `Bends.forces`."""
        slope = _EDGE_PULL**2 * self._log + _EDGE_BOUND**2 * self._beyond
        forces: Floats = slope * self._is_segment / self._segments.length * self._segments.unit
        return forces

    def rows(self, places: Optional[Ints], directions: Floats) -> Floats:
        """(2, m, 1, Q) derivatives of the residual of each segment by the unknowns of its places; see `Bends.rows`."""
        stiffness = np.where(self._beyond != 0, np.sqrt(_EDGE_PULL**2 + _EDGE_BOUND**2), _EDGE_PULL)
        row = stiffness * self._is_segment / self._segments.length * self._segments.unit
        row = row if places is None else row[:, places]
        return np.stack([[[-_dot(row, way)], [_dot(row, _after(way))]] for way in directions], axis=1)


_LOG_SHORTEST, _LOG_LONGEST = logarithms(np.array([SHORTEST, LONGEST])).tolist()


@dataclass(frozen=True, eq=False)
class FaceCorners:
    """Corners of faces: the node, and those before and after it around the face, (C,) each."""

    node: Ints
    before: Ints
    after: Ints

    @cached_property
    def stencils(self) -> Ints:
        """(3, C) nodes before, at and after each corner."""
        return np.stack([self.before, self.node, self.after])

    def some(self, corner: Ints) -> FaceCorners:
        """Some of them."""
        return FaceCorners(self.node[corner], self.before[corner], self.after[corner])


def corners_of(lattice: Lattice) -> FaceCorners:
    """The corners of all faces of a lattice.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    FaceCorners
        In the order of ``lattice.face_nodes``.
    """
    following = next_in_loop(lattice.face_offsets)
    preceding = previous_in_loop(lattice.face_offsets)
    nodes = lattice.face_nodes
    return FaceCorners(nodes, nodes[preceding], nodes[following])


class CornerArms:
    """Sine and cosine (C,) of each corner, counter-clockwise about the normal of the surface, times its arms.

    Parameters
    ----------
    corners : FaceCorners
    nodes, normals : (N, 3) float64
        Places, and unit normals of the surface there.
    """

    def __init__(self, corners: FaceCorners, nodes: Floats, normals: Floats) -> None:
        poll()
        columns = np.ascontiguousarray(nodes.T)
        here, before, after = (columns.take(at, axis=1) for at in (corners.node, corners.before, corners.after))
        u, v = after - here, before - here
        self.sine: Floats = _dot(_cross(u, v), np.ascontiguousarray(normals.T).take(corners.node, axis=1))
        self.cosine: Floats = _dot(u, v)

    def some(self, corner: Ints) -> CornerArms:
        """Those of some corners."""
        arms = copy(self)
        arms.sine, arms.cosine = self.sine[corner], self.cosine[corner]
        return arms

    def with_some(self, corner: Ints, some: CornerArms) -> CornerArms:
        """All, with those of some corners in the place of their own."""
        arms = copy(self)
        arms.sine, arms.cosine = self.sine.copy(), self.cosine.copy()
        arms.sine[corner], arms.cosine[corner] = some.sine, some.cosine
        return arms

    def are_below(self, angle: float) -> Bools:
        """Corners from -90° up to an angle, below 0 where a face lies inverted; a face of many sides may have corners
        of more than 180°, and these are not.

        Parameters
        ----------
        angle : float
            Radians, below 90°.
        """
        sine, cosine = sines_and_cosines(angle)
        below: Bools = (self.cosine >= 0) & (self.sine * cosine < sine * self.cosine)
        return below


class AngleTerm:
    """Cost of corners below `LEAST_ANGLE`.

    Parameters
    ----------
    corners : FaceCorners
    arms : CornerArms
    nodes, normals : (N, 3) float64
        Places, and unit normals of the surface there.
    """

    def __init__(self, corners: FaceCorners, arms: CornerArms, nodes: Floats, normals: Floats) -> None:
        self._tight = tight = np.flatnonzero(arms.are_below(LEAST_ANGLE))
        self._sine, self._cosine = arms.sine[tight], arms.cosine[tight]
        self._short = _ANGLE_BOUND * (LEAST_ANGLE - arctangents(self._sine, self._cosine))
        self.stencils = corners.stencils[:, tight]
        self._nodes, self._normals = nodes, normals
        self.costs: Floats = self._short * self._short / 2.0

    @cached_property
    def slopes(self) -> Floats:
        """(3, 3, T) derivatives of the residuals by the nodes before, at and after each sharp corner."""
        before, here, after = (self._nodes[nodes].T for nodes in self.stencils)
        u, v, n = after - here, before - here, self._normals[self.stencils[1]].T
        square = np.maximum(self._sine**2 + self._cosine**2, _TINY)
        sine, cosine = self._sine / square, self._cosine / square
        by_u, by_v = cosine * _cross(v, n) - sine * v, cosine * _cross(n, u) - sine * u
        slopes: Floats = -_ANGLE_BOUND * np.stack([by_v, -(by_u + by_v), by_u])
        return slopes

    def gradient(self, n_nodes: int) -> Floats:
        """(N, 3) by the nodes."""
        values = (self._short * self.slopes).transpose(1, 0, 2).reshape(3, -1)
        return summed_at_nodes(self.stencils.ravel(), values, n_nodes)


def edge_of_sides(lattice: Lattice) -> tuple[Ints, Bools]:
    """Find the edges of the sides of all faces.

    Parameters
    ----------
    lattice : Lattice

    Returns
    -------
    edge : (C,) int64
        Edge of each side, from a corner of ``lattice.face_nodes`` to the next.
    on_border : (E,) bool
    """
    after = lattice.face_nodes[next_in_loop(lattice.face_offsets)]
    side = edges_between(lattice.edges, lattice.face_nodes, after)
    return side, np.bincount(side, minlength=lattice.n_edges) == 1
