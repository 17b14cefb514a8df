"""Bending energy of rods over the places of their nodes, with bounds on edge lengths and angles.

A rod that is held at its joints takes the shape of a C2 cubic spline.  Its second derivative M_j at joint j solves

    h_p/6 M_p + (h_p + h_n)/3 M_j + h_n/6 M_n = (x_n - x_j)/h_n - (x_j - x_p)/h_p        (de Boor 1978, ch. IV)

where p and n are the joints before and after and h the chords; at free ends M = 0.  M is linear between joints, so the
spline is bent most sharply at a joint.  Going over and under adds offsets of d/2 out of the surface and into it.  Their
share v_j solves the same system with negated entries off the diagonal and d/h_p + d/h_n on the right: 6 d/h² for
even chords.  Which rod is over is not known here, so the worse case counts:

    curvature² = (tangential part of M)² + (|normal part of M| + v)²

Each term gives its value, its gradient over the coordinates of the nodes, and the derivatives that make up the
Gauss-Newton Hessian (`normal_equations`).  The inverse of the system falls by 0.27 from joint to joint.  In the
Hessian, which only steers, it reaches `REACH` joints each way, in the gradient all.  Linear in the number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.lapack import dpttrf, dpttrs
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from weavecore.geometry.arrays import (
    Bools,
    Floats,
    Ints,
    connected,
    cross,
    dots,
    inverted,
    next_in_loop,
    previous_in_loop,
    small_products,
)
from weavecore.geometry.matching import ALONE
from weavecore.geometry.polygon_mesh import edges_between
from weavecore.linking.normal_equations import Term
from weavecore.model.lattice import Lattice
from weavecore.model.rod_pairing import pair_darts
from weavecore.polling import each, poll

BROKEN_TURN = np.radians(60.0)
"""A rod that turns more than this at a joint is taken for two that end there: no stock rod follows such a turn."""

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


@dataclass(frozen=True, eq=False)
class RodJoints:
    """The joints at which a rod goes on.

    Parameters
    ----------
    node, before, after : (J,) int64
        The node, and those before and after it along the rod.
    edge_before, edge_after : (J,) int64
    beyond_before, beyond_after : (J,) int64
        The joint at the far end of these edges, -1 at the end of a rod.
    order : (J,) int64
        The joints in an order in which neighbours along a rod are one place apart, but those of closing edges.
    closing : (C,) int64
        Joint of each closed rod whose edge before it closes the rod.
    closed_rod : (J,) int64
        Which of these rods a joint belongs to, or -1.
    """

    node: Ints
    before: Ints
    after: Ints
    edge_before: Ints
    edge_after: Ints
    beyond_before: Ints
    beyond_after: Ints
    order: Ints
    closing: Ints
    closed_rod: Ints


def find_joints(lattice: Lattice, most_turn: float = BROKEN_TURN) -> RodJoints:
    """Find the joints of all rods.

    Parameters
    ----------
    lattice : Lattice
    most_turn : float
        Radians; a rod that turns by more at a joint is taken to be broken there, and the joint is left out.

    Returns
    -------
    RodJoints
    """
    partner = pair_darts(lattice)
    one = np.flatnonzero(partner > np.arange(len(partner)))
    other = partner[one]
    tail, head = lattice.edges.ravel(), lattice.edges[:, ::-1].ravel()
    away = lattice.nodes[head] - lattice.nodes[tail]
    back, forth = -away[one], away[other]
    turn = np.arctan2(np.linalg.norm(np.cross(back, forth), axis=1), (back * forth).sum(1))
    one, other = one[turn <= most_turn], other[turn <= most_turn]
    at_dart = np.full(len(partner), ALONE, np.int64)
    at_dart[one] = at_dart[other] = np.arange(len(one))
    beyond = at_dart[one ^ 1], at_dart[other ^ 1]
    edges = one // 2, other // 2
    return RodJoints(tail[one], head[one], head[other], *edges, *beyond, *_order_along_rods(edges, beyond))


def _order_along_rods(edges: tuple[Ints, Ints], beyond: tuple[Ints, Ints]) -> tuple[Ints, Ints, Ints]:
    """``order``, ``closing`` and ``closed_rod`` of `RodJoints`; without its closing edges every rod is a path."""
    n = len(beyond[0])
    row, column, edge = np.tile(np.arange(n), 2), np.concatenate(beyond), np.concatenate(edges)
    known = column != ALONE
    rod = connected(row[known], column[known], n)[1]
    n_ends = np.bincount(rod, weights=(beyond[0] == ALONE).astype(float) + (beyond[1] == ALONE))
    closing = np.unique(rod, return_index=True)[1][n_ends == 0]
    closed_rod = np.where(n_ends == 0, np.cumsum(n_ends == 0) - 1, -1)[rod]
    known &= ~np.isin(edge, edges[0][closing])
    if not known.any():
        return np.arange(n), closing, closed_rod
    graph = coo_matrix((np.ones(int(known.sum()), np.int8), (row[known], column[known])), shape=(n, n)).tocsr()
    order: Ints = reverse_cuthill_mckee(graph, symmetric_mode=True).astype(np.int64)
    return order, closing, closed_rod


@dataclass(frozen=True, eq=False)
class Stencils:
    """The joints before and after each along its rod, with what lies between: its stencil.

    ::

        nodes     0 ── 1 ── 2 ── 3 ── 4 ── 5 ── 6        of REACH = 2
        joints         0    1    2    3    4             joint 2 is the one that is looked at

    Parameters
    ----------
    joints : (J, 2 REACH + 1) int64
        -1 beyond the ends of the rod.
    is_turned : (J, 2 REACH + 1) bool
        Whether the node before that joint is the one further along the stencil.
    nodes : (J, 2 REACH + 3) int64
        Beyond the ends of the rod the joint's own node.
    """

    joints: Ints
    is_turned: Bools
    nodes: Ints


def find_stencils(joints: RodJoints) -> Stencils:
    """Walk from all joints along their rods at once.

    Parameters
    ----------
    joints : RodJoints

    Returns
    -------
    Stencils
    """
    n = len(joints.node)
    beyond, edge = (np.stack(pair, axis=1) for pair in _both_sides(joints))
    far = np.stack([joints.before, joints.after], axis=1)
    found = np.full((n, 2 * REACH + 1), ALONE, np.int64)
    found[:, REACH] = np.arange(n)
    turned = np.zeros(found.shape, bool)
    nodes = np.repeat(joints.node[:, None], 2 * REACH + 3, axis=1)
    for first_side, way in ((0, -1), (1, 1)):
        at, side = np.arange(n), np.full(n, first_side)
        for k in range(REACH + 1):
            on = np.flatnonzero(at != ALONE)
            nodes[on, REACH + 1 + way * (k + 1)] = far[at[on], side[on]]
            if k == REACH:
                break
            came_by = edge[at[on], side[on]]
            at[on] = beyond[at[on], side[on]]
            on, came_by = on[at[on] != ALONE], came_by[at[on] != ALONE]
            # On through the other side than that of arrival.
            side[on] = np.where(edge[at[on], 0] == came_by, 1, 0)
            found[on, REACH + way * (k + 1)] = at[on]
            turned[on, REACH + way * (k + 1)] = side[on] != first_side
    return Stencils(found, turned, nodes)


def _both_sides(joints: RodJoints) -> tuple[tuple[Ints, Ints], tuple[Ints, Ints]]:
    """The joints beyond the edges on both sides, and these edges."""
    return (joints.beyond_before, joints.beyond_after), (joints.edge_before, joints.edge_after)


@dataclass(frozen=True, eq=False)
class Chords:
    """Edges as unit vectors (E, 3) with their lengths (E,)."""

    edges: Ints
    unit: Floats
    length: Floats


def chords_of(edges: Ints, nodes: Floats) -> Chords:
    """The chords of the edges of a lattice.

    Parameters
    ----------
    edges : (E, 2) int64
        Nodes of each edge.
    nodes : (N, 3) float64

    Returns
    -------
    Chords
    """
    poll()
    a, b = edges.T
    vector = nodes[b] - nodes[a]
    length = np.maximum(np.sqrt(dots(vector, vector)), np.finfo(float).tiny)
    return Chords(edges, vector / length[:, None], length)


def _gathered(nodes: Ints, vectors: Floats, n_nodes: int) -> Floats:
    """Sums (N, 3) of vectors (…, 3) over each node."""
    poll()
    flat = vectors.reshape(-1, 3)
    sums: Floats = np.stack([np.bincount(nodes.ravel(), flat[:, k], n_nodes) for k in range(3)], axis=1)
    return sums


def bending_curvatures(joints: RodJoints, normals: Floats, chords: Chords, rise: float) -> Floats:
    """Greatest curvature of the rods at each joint, undulation included; see `bending_term`.

    Parameters
    ----------
    joints : RodJoints
    normals : (N, 3) float64
        Unit normals of the surface at the nodes.
    chords : Chords
    rise : float
        Height between the layers of two rods that cross; 0 where they keep to a layer.

    Returns
    -------
    (J,) float64
    """
    return _Bends(joints, normals, chords, rise).curvature


def bending_term(
    joints: RodJoints,
    stencils: Stencils,
    normals: Floats,
    chords: Chords,
    *,
    rise: float,
    admissible: float,
) -> Term:
    """Cost of the curvature at all joints.

    Parameters
    ----------
    joints : RodJoints
    stencils : Stencils
    normals : (N, 3) float64
        Unit normals of the surface at the nodes.
    chords : Chords
    rise : float
        Height between the layers of two rods that cross and change sides at each joint; 0 where they keep to a layer.
    admissible : float
        The greatest curvature that the material of the rod allows.

    Returns
    -------
    Term
        Its rows are the joints, its stencils those of ``stencils.nodes``.
    """
    bends = _Bends(joints, normals, chords, rise)
    ratio = bends.curvature / admissible
    value, slope, second = _cost(ratio)
    e = bends.vector / np.maximum(bends.curvature, np.finfo(float).tiny)[:, None]
    # Square root of second e eᵀ + slope/ratio (1 - e eᵀ) with e the direction of the curvature.
    along = np.sqrt(second) / admissible
    across = np.sqrt(slope / np.maximum(ratio, 1e-12)) / admissible
    root = (along - across)[:, None, None] * (e[:, :, None] * e[:, None, :]) + across[:, None, None] * np.eye(3)
    gradient = bends.pull_back(e * (slope / admissible)[:, None], len(normals))
    blocks = small_products(root[:, None], bends.blocks(stencils))
    return Term(float(value.sum()), gradient, blocks, np.arange(len(ratio)))


def bending_cost(joints: RodJoints, normals: Floats, chords: Chords, *, rise: float, admissible: float) -> float:
    """The value alone of `bending_term`, which names the parameters."""
    value, _, _ = _cost(_Bends(joints, normals, chords, rise).curvature / admissible)
    return float(value.sum())


def _cost(ratio: Floats) -> tuple[Floats, Floats, Floats]:
    """Cost of the curvature over the admissible one, with its first and a bound on its second derivative."""
    over = np.maximum(ratio - EASY, 0.0)
    most = HOPELESS - EASY
    beyond = over > most
    value = np.where(beyond, most * (over - most / 2.0), over**2 / 2.0) + _EVENNESS * ratio**2 / 2.0
    slope = np.minimum(over, most) + _EVENNESS * ratio
    second = np.where(beyond, slope / np.maximum(ratio, 1e-12), (over > 0) + _EVENNESS)
    return value, slope, second


class _SplineSystem:
    """The systems of all splines, factored, with the entries off the diagonal times ``sign``: -1 for the undulation.

    Tridiagonal along each rod; the corner entries of a closed one are a change of rank one (Sherman and Morrison 1950).
    LAPACK calls no BLAS for tridiagonal systems, so that every processor gives the same last bit.
    """

    def __init__(self, joints: RodJoints, before: Floats, after: Floats, sign: float) -> None:
        self._joints = joints
        place = inverted(joints.order)
        n = len(place)
        diagonal, beside = np.empty(n), np.zeros(max(n - 1, 1))
        diagonal[place] = (before + after) / 3.0
        closing_edges = joints.edge_before[joints.closing]
        sides = (joints.beyond_before, joints.edge_before, before), (joints.beyond_after, joints.edge_after, after)
        for beyond, edge, length in sides:
            # The system is symmetric: each entry is met from both of its joints and written once.
            known = np.flatnonzero((beyond != ALONE) & (place[beyond] > place) & ~np.isin(edge, closing_edges))
            beside[place[known]] = sign * length[known] / 6.0
        first, last, corner = joints.closing, joints.beyond_before[joints.closing], before[joints.closing] / 6.0
        diagonal[place[first]] -= corner
        diagonal[place[last]] -= corner
        self._factors = dpttrf(diagonal, beside)[:2]
        self._ends, self._sign = (first, last), sign
        unit = np.zeros(n)
        unit[first], unit[last] = 1.0, sign
        self._response = self._without_corners(unit)
        self._share = corner / (1.0 + corner * self._at_ends(self._response))

    def solve(self, right: Floats) -> Floats:
        """The solution (J,) or (J, k) for such a right-hand side."""
        found = self._without_corners(right)
        ends = self._at_ends(found)
        share = self._share.reshape(-1, *[1] * (right.ndim - 1)) * ends
        at = np.flatnonzero(self._joints.closed_rod >= 0)
        response = self._response.reshape(-1, *[1] * (right.ndim - 1))
        found[at] -= response[at] * share[self._joints.closed_rod[at]]
        return found

    def _without_corners(self, right: Floats) -> Floats:
        found = np.empty_like(right)
        found[self._joints.order] = dpttrs(*self._factors, right[self._joints.order])[0].reshape(right.shape)
        return found

    def _at_ends(self, values: Floats) -> Floats:
        first, last = self._ends
        added: Floats = values[first] + self._sign * values[last]
        return added


class _Bends:
    """The splines through the joints: curvature vectors (J, 3) with the undulation on top, and their derivatives.

    Derivatives take tangents, normals and the side to which a rod bends as fixed.
    """

    def __init__(self, joints: RodJoints, normals: Floats, chords: Chords, rise: float) -> None:
        self._joints, self._rise = joints, rise
        h = chords.length
        self._before, self._after = h[joints.edge_before], h[joints.edge_after]
        # Along the rod, whichever way the edges are listed.
        self._back = _along(chords, joints.edge_before, joints.before)
        self._forth = _along(chords, joints.edge_after, joints.node)
        self._system = _SplineSystem(joints, self._before, self._after, 1.0)
        self._moment = self._system.solve(self._forth - self._back)
        tangent = _unit(self._forth + self._back)
        self._normal = _unit(_orthogonal(normals[joints.node], tangent))
        self._tangent = tangent
        bend = _orthogonal(self._moment, tangent)
        self._side = np.where(dots(bend, self._normal) < 0, -1.0, 1.0)
        self._weave = np.zeros(len(tangent))
        if rise > 0:
            self._weave_system = _SplineSystem(joints, self._before, self._after, -1.0)
            self._weave = self._weave_system.solve(rise * (1.0 / self._before + 1.0 / self._after))
        self.vector = bend + (self._side * self._weave)[:, None] * self._normal
        self.curvature: Floats = np.sqrt(dots(self.vector, self.vector))

    def _by_ends(self) -> tuple[Floats, Floats]:
        """Derivatives of the system's right-hand side less its left, moments fixed, by the nodes before and after.

        (J, 2, 3, 3) for the spline, (J, 2, 3) for the undulation; by the joint's own node it is less their sum.
        """
        joints = self._joints
        spline, weave = np.empty((len(self._before), 2, 3, 3)), np.zeros((len(self._before), 2, 3))
        sides = ((-1.0, self._before, self._back), (1.0, self._after, self._forth))
        for k, ((way, length, unit), beyond) in enumerate(zip(sides, _both_sides(joints)[0])):
            known = beyond != ALONE
            far = np.where(known[:, None], self._moment[beyond], 0.0)
            by_length = self._moment / 3.0 + far / 6.0
            projector = np.eye(3) - unit[:, :, None] * unit[:, None, :]
            spline[:, k] = projector / length[:, None, None] - way * by_length[:, :, None] * unit[:, None, :]
            if self._rise > 0:
                far = np.where(known, self._weave[beyond], 0.0)
                steeper = -self._rise / length**2 - (self._weave / 3.0 - far / 6.0)
                weave[:, k] = way * steeper[:, None] * unit
        return spline, weave

    def pull_back(self, slopes: Floats, n_nodes: int) -> Floats:
        """Gradient (N, 3) by the nodes of what has these slopes (J, 3) by the curvature vectors."""
        spline, weave = self._by_ends()
        moment = self._system.solve(_orthogonal(slopes, self._tangent))
        ends = np.einsum("jkcd,jc->jkd", spline, moment)
        if self._rise > 0:
            ends += weave * self._weave_system.solve(self._side * dots(slopes, self._normal))[:, None, None]
        joints = self._joints
        nodes = np.stack([joints.before, joints.after, joints.node], axis=1)
        return _gathered(nodes, np.concatenate([ends, -ends.sum(1, keepdims=True)], axis=1), n_nodes)

    def blocks(self, stencils: Stencils) -> Floats:
        """Derivatives (J, nodes, 3, 3) of the curvature vectors by the nodes of the stencils."""
        spline, weave = self._by_ends()
        found, rows = np.zeros((*stencils.nodes.shape, 3, 3)), np.zeros((*stencils.nodes.shape, 3))
        share, weave_share = self._shares(stencils, 1.0), self._shares(stencils, -1.0)
        for k in each(range(2 * REACH + 1)):
            at, turned = stencils.joints[:, k], stencils.is_turned[:, k].astype(np.int64)
            near, far = (share[:, k, None, None] * spline[at, side] for side in (turned, 1 - turned))
            _add_second_difference(found, k, near, far)
            if self._rise > 0:
                near, far = (weave_share[:, k, None] * weave[at, side] for side in (turned, 1 - turned))
                _add_second_difference(rows, k, near, far)
        projector = np.eye(3) - self._tangent[:, :, None] * self._tangent[:, None, :]
        blocks: Floats = small_products(projector[:, None], found)
        blocks += (self._side[:, None] * self._normal)[:, None, :, None] * rows[:, :, None, :]
        return blocks

    def _shares(self, stencils: Stencils, sign: float) -> Floats:
        """Rows (J, 2 REACH + 1) of the inverse of the system, those beyond the stencil left out.

        With pivots p from both ends inwards, p' = d' - o²/p, the entry at the joint is 1 / (d - Σ o²/p), and each
        further one -o/p times the one before.
        """
        diagonal = (self._before + self._after)[stencils.joints] / 3.0
        chord = np.where(stencils.is_turned, self._before[stencils.joints], self._after[stencils.joints])
        is_joined = (stencils.joints[:, :-1] != ALONE) & (stencils.joints[:, 1:] != ALONE)
        beside = np.where(is_joined, sign * chord[:, :-1] / 6.0, 0.0)
        ratio, centre = np.zeros_like(diagonal), diagonal[:, REACH].copy()
        for way in (-1, 1):
            pivot = diagonal[:, REACH + way * REACH]
            for k in range(REACH, 0, -1):
                off = beside[:, REACH + (k - 1 if way > 0 else -k)]
                ratio[:, REACH + way * k] = -off / pivot
                inner = diagonal[:, REACH + way * (k - 1)] if k > 1 else centre
                pivot = inner - off**2 / pivot
            centre = pivot
        shares = np.zeros_like(diagonal)
        shares[:, REACH] = 1.0 / centre
        for k in range(1, REACH + 1):
            for at in (REACH - k, REACH + k):
                shares[:, at] = shares[:, at + (1 if at < REACH else -1)] * ratio[:, at]
        return shares


def _add_second_difference(found: Floats, k: int, near: Floats, far: Floats) -> None:
    """Add derivatives by nodes k, k + 1 and k + 2 of the stencils to ``found``; that by k + 1 is minus the sum."""
    found[:, k] += near
    found[:, k + 2] += far
    found[:, k + 1] -= near + far


def _unit(vectors: Floats) -> Floats:
    unit: Floats = vectors / np.maximum(np.sqrt(dots(vectors, vectors)), np.finfo(float).tiny)[:, None]
    return unit


def _along(chords: Chords, edge: Ints, start: Ints) -> Floats:
    """Unit vectors (J, 3) of edges, away from their node ``start``."""
    sign = np.where(chords.edges[edge, 0] == start, 1.0, -1.0)
    unit: Floats = sign[:, None] * chords.unit[edge]
    return unit


def _orthogonal(vectors: Floats, unit: Floats) -> Floats:
    """The parts (n, 3) of vectors that are normal to unit vectors."""
    rest: Floats = vectors - dots(vectors, unit)[:, None] * unit
    return rest


def edge_term(chords: Chords, median: Floats, shortest: Floats, longest: Floats, n_nodes: int) -> Term:
    """Cost of edge lengths away from the median of their kind, small within the bounds, large beyond.

    Parameters
    ----------
    chords : Chords
    median : (E,) float64
        Median length of the edges of the same kind.
    shortest, longest : (E,) float64
        Bounds, over the median.
    n_nodes : int

    Returns
    -------
    Term
        Its rows are the edges, its stencils their nodes.
    """
    log = np.log(chords.length / median)
    beyond = log - np.clip(log, np.log(shortest), np.log(longest))
    value = float((_EDGE_PULL**2 * log**2 + _EDGE_BOUND**2 * beyond**2).sum()) / 2.0
    by_length = (_EDGE_PULL**2 * log + _EDGE_BOUND**2 * beyond) / chords.length
    weight = np.sqrt(_EDGE_PULL**2 + _EDGE_BOUND**2 * (beyond != 0)) / chords.length
    slopes = by_length[:, None] * chords.unit
    gradient = _gathered(chords.edges, np.stack([-slopes, slopes], axis=1), n_nodes)
    rows = weight[:, None] * chords.unit
    return Term(value, gradient, np.stack([-rows, rows], axis=1)[:, :, None], np.arange(len(log)))


@dataclass(frozen=True, eq=False)
class FaceCorners:
    """Corners of faces: the node, and those before and after it around the face, (C,) each."""

    node: Ints
    before: Ints
    after: Ints

    @property
    def stencils(self) -> Ints:
        """(C, 3) nodes before, at and after each corner."""
        return np.stack([self.before, self.node, self.after], axis=1)


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


def corner_angles(corners: FaceCorners, nodes: Floats, normals: Floats) -> Floats:
    """Angles at corners, counter-clockwise about the normal of the surface: below 0 where a face lies inverted.

    Parameters
    ----------
    corners : FaceCorners
    nodes, normals : (N, 3) float64
        Places, and unit normals of the surface there.

    Returns
    -------
    (C,) float64
        From -π/2 to 3π/2, for a face of many sides may have a corner that points inwards.
    """
    poll()
    u, v = nodes[corners.after] - nodes[corners.node], nodes[corners.before] - nodes[corners.node]
    angles = np.arctan2(dots(cross(u, v), normals[corners.node]), dots(u, v))
    wrapped: Floats = np.where(angles < -np.pi / 2, angles + 2 * np.pi, angles)
    return wrapped


def angle_term(corners: FaceCorners, nodes: Floats, normals: Floats) -> Term:
    """Cost of corners below `LEAST_ANGLE`.

    Parameters
    ----------
    corners : FaceCorners
    nodes, normals : (N, 3) float64
        Places, and unit normals of the surface there.

    Returns
    -------
    Term
        Its rows are the corners that are too sharp, its stencils those of `FaceCorners`.
    """
    short = LEAST_ANGLE - corner_angles(corners, nodes, normals)
    tight = np.flatnonzero(short > 0)
    node, before, after = (side[tight] for side in (corners.node, corners.before, corners.after))
    u, v, n = nodes[after] - nodes[node], nodes[before] - nodes[node], normals[node]
    sine, cosine = dots(cross(u, v), n), dots(u, v)
    square = np.maximum(sine**2 + cosine**2, np.finfo(float).tiny)
    sine, cosine = (sine / square)[:, None], (cosine / square)[:, None]
    by_u, by_v = cosine * cross(v, n) - sine * v, cosine * cross(n, u) - sine * u
    rows = -_ANGLE_BOUND * np.stack([by_v, -(by_u + by_v), by_u], axis=1)
    rest = _ANGLE_BOUND * short[tight]
    gradient = _gathered(corners.stencils[tight], rest[:, None, None] * rows, len(nodes))
    return Term(float((rest**2).sum()) / 2.0, gradient, rows[:, :, None], tight)


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
