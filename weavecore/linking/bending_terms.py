"""Bending energy of rods over the places of their nodes, with bounds on edge lengths and angles.

A rod that is held at its joints takes the shape of a C2 cubic spline.  Its second derivative M_j at joint j solves

    h_p/6 M_p + (h_p + h_n)/3 M_j + h_n/6 M_n = (x_n - x_j)/h_n - (x_j - x_p)/h_p        (de Boor 1978, ch. IV)

where p and n are the joints before and after and h the chords; at free ends M = 0.  M is linear between joints, so the
spline is bent most sharply at a joint.  Going over and under adds offsets of d/2 out of the surface and into it.  Their
share v_j solves the same system with negated entries off the diagonal and d/h_p + d/h_n on the right: 6 d/h² for
even chords.  Which rod is over is not known here, so the worse case counts:

    curvature² = (tangential part of M)² + (|normal part of M| + v)²

Each term gives its value f, and A and b with the gradient Aᵀ b and the Hessian (of the convex outer function) Aᵀ A over
the coordinates (3N,) of the nodes.  Time and memory are linear in the number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, diags, identity
from scipy.sparse.linalg import splu

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop
from weavecore.geometry.matching import ALONE
from weavecore.geometry.polygon_mesh import edges_between
from weavecore.model.lattice import Lattice
from weavecore.model.rod_pairing import pair_darts

BROKEN_TURN = np.radians(60.0)
"""A rod that turns more than this at a joint is taken for two that end there: no stock rod follows such a turn."""

EASY, HOPELESS = 0.9, 1.5
"""Curvature over the admissible one from which it counts, and beyond which its cost grows in proportion only."""

_EVENNESS = 0.03
"""Weight of the squared curvature everywhere, against that of what exceeds `EASY`."""

_KEPT = 3e-3
"""Entries of the inverse below this part of the diagonal are left out; they fall by 0.27 from joint to joint."""

SHORTEST, LONGEST = 0.6, 1.55
"""Edge length over the median at which the bounds begin to push back."""

_EDGE_BOUND, _EDGE_PULL = 10.0, 0.3
"""Weights of the logarithm of an edge length beyond its bounds, and of that against the median anywhere."""

LEAST_ANGLE = np.radians(33.0)
"""Corner of a face at which its bound begins to push back."""

_ANGLE_BOUND = 8.0


@dataclass(frozen=True, eq=False)
class Term:
    """Value and derivatives: gradient ``matrix.T @ rest``, Hessian ``matrix.T @ matrix`` over the coordinates (3N,)."""

    value: float
    matrix: csr_matrix
    rest: Floats


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
    """

    node: Ints
    before: Ints
    after: Ints
    edge_before: Ints
    edge_after: Ints
    beyond_before: Ints
    beyond_after: Ints


def find_joints(lattice: Lattice, most_turn: float = BROKEN_TURN) -> RodJoints:
    """The joints of all rods, without those at which a rod turns by more than ``most_turn``: it is broken there."""
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
    return RodJoints(tail[one], head[one], head[other], one // 2, other // 2, at_dart[one ^ 1], at_dart[other ^ 1])


@dataclass(frozen=True, eq=False)
class Chords:
    """Edges as vectors (E, 3), their lengths (E,), and the Jacobian (E, 3N) of these."""

    edges: Ints
    unit: Floats
    length: Floats
    jacobian: csr_matrix


def chords_of(edges: Ints, nodes: Floats) -> Chords:
    """The chords of the edges of a lattice."""
    a, b = edges.T
    vector = nodes[b] - nodes[a]
    length = np.maximum(np.linalg.norm(vector, axis=1), np.finfo(float).tiny)
    unit = vector / length[:, None]
    rows = np.tile(np.repeat(np.arange(len(a)), 3), 2)
    columns = np.concatenate([_coordinates(b), _coordinates(a)])
    values = np.concatenate([unit.ravel(), -unit.ravel()])
    jacobian = coo_matrix((values, (rows, columns)), shape=(len(a), nodes.size)).tocsr()
    return Chords(edges, unit, length, jacobian)


def _coordinates(nodes: Ints) -> Ints:
    columns: Ints = (3 * nodes[:, None] + np.arange(3)).ravel()
    return columns


# Bending


def bending_curvatures(joints: RodJoints, nodes: Floats, normals: Floats, chords: Chords, rise: float) -> Floats:
    """(J,) greatest curvature of the rods at each joint, undulation included; see `bending_term`."""
    return _Bends(joints, nodes, normals, chords, rise).curvature


def bending_term(
    joints: RodJoints,
    nodes: Floats,
    normals: Floats,
    chords: Chords,
    *,
    rise: float,
    admissible: float,
    weight: Floats,
    derivatives: bool = True,
) -> Term:
    """Cost of the curvature at all joints.

    Parameters
    ----------
    joints : RodJoints
    nodes, normals : (N, 3) float64
        Places, and unit normals of the surface there.
    chords : Chords
    rise : float
        Height between the layers of two rods that cross and change sides at each joint; 0 where they keep to a layer.
    admissible : float
        The greatest curvature that the rod bears.
    weight : (J,) float64
    derivatives : bool
        Whether more than the value is wanted.
    """
    bends = _Bends(joints, nodes, normals, chords, rise)
    ratio = bends.curvature / admissible
    value, slope, second = _cost(ratio)
    total = float((weight * value).sum())
    if not derivatives:
        return Term(total, csr_matrix((0, nodes.size)), np.zeros(0))
    # Square root of weight · [second e eᵀ + slope/ratio (1 - e eᵀ)] with e the direction of the curvature.
    along = np.sqrt(weight * second) / admissible
    across = np.sqrt(weight * slope / np.maximum(ratio, 1e-12)) / admissible
    e = bends.vector / np.maximum(bends.curvature, np.finfo(float).tiny)[:, None]
    root = (along - across)[:, None, None] * (e[:, :, None] * e[:, None, :]) + across[:, None, None] * np.eye(3)
    matrix = _blocks(root) @ bends.jacobian()
    rest = e * (weight * slope / admissible / along)[:, None]
    return Term(total, csr_matrix(matrix), rest.ravel())


def _cost(ratio: Floats) -> tuple[Floats, Floats, Floats]:
    """Cost of the curvature over the admissible one, with its first and a bound on its second derivative."""
    over = np.maximum(ratio - EASY, 0.0)
    most = HOPELESS - EASY
    beyond = over > most
    value = np.where(beyond, most * (over - most / 2.0), over**2 / 2.0) + _EVENNESS * ratio**2 / 2.0
    slope = np.minimum(over, most) + _EVENNESS * ratio
    second = np.where(beyond, slope / np.maximum(ratio, 1e-12), (over > 0) + _EVENNESS)
    return value, slope, second


class _Bends:
    """The splines through the joints: curvature vectors (J, 3) with the undulation on top, and their derivatives."""

    def __init__(self, joints: RodJoints, nodes: Floats, normals: Floats, chords: Chords, rise: float) -> None:
        self._joints, self._chords, self._rise = joints, chords, rise
        self._n_coordinates = nodes.size
        h = chords.length
        self._before, self._after = h[joints.edge_before], h[joints.edge_after]
        # Along the rod, whichever way the edges are listed.
        self._back = _along(chords, joints.edge_before, joints.before)
        self._forth = _along(chords, joints.edge_after, joints.node)
        self._system = self._matrix(1.0)
        change = self._forth - self._back
        self._moment = _solve(self._system, change)
        tangent = self._forth + self._back
        tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), np.finfo(float).tiny)
        self._normal = _orthogonal(normals[joints.node], tangent)
        self._normal /= np.maximum(np.linalg.norm(self._normal, axis=1, keepdims=True), np.finfo(float).tiny)
        self._tangent = tangent
        bend = _orthogonal(self._moment, tangent)
        self._side = np.where((bend * self._normal).sum(1) < 0, -1.0, 1.0)
        self._weave = np.zeros(len(h[joints.edge_before]))
        if rise > 0:
            self._weave_system = self._matrix(-1.0)
            self._weave = _solve(self._weave_system, rise * (1.0 / self._before + 1.0 / self._after))
        self.vector = bend + (self._side * self._weave)[:, None] * self._normal
        self.curvature: Floats = np.linalg.norm(self.vector, axis=1)

    def _matrix(self, sign: float) -> csr_matrix:
        """The system of the spline, with ``sign`` times its entries off the diagonal."""
        joints, row = self._joints, np.arange(len(self._before))
        parts = [(row, row, (self._before + self._after) / 3.0)]
        for beyond, length in ((joints.beyond_before, self._before), (joints.beyond_after, self._after)):
            known = beyond != ALONE
            parts.append((row[known], beyond[known], sign * length[known] / 6.0))
        rows, columns, values = (np.concatenate([part[k] for part in parts]) for k in range(3))
        return coo_matrix((values, (rows, columns)), shape=(len(row), len(row))).tocsr()

    def jacobian(self) -> csr_matrix:
        """Derivative (3J, 3N) of the curvature vectors; frames and sides count as fixed."""
        inverse = _banded_inverse(self._system)
        right = self._change_jacobian() - self._chord_blocks(self._moment, 1.0) @ self._chords.jacobian
        spline = _blocks(_projectors(self._tangent)) @ _expand(inverse) @ right
        if self._rise == 0:
            return csr_matrix(spline)
        joints, row = self._joints, np.arange(len(self._before))
        shape = (len(row), len(self._chords.length))
        steeper = coo_matrix(
            (
                np.concatenate([-self._rise / self._before**2, -self._rise / self._after**2]),
                (np.tile(row, 2), np.concatenate([joints.edge_before, joints.edge_after])),
            ),
            shape=shape,
        ).tocsr()
        by_chord = steeper - self._chord_blocks(self._weave[:, None], -1.0)
        weave = _banded_inverse(self._weave_system) @ by_chord @ self._chords.jacobian
        return csr_matrix(spline + _columns(self._side[:, None] * self._normal) @ weave)

    def _change_jacobian(self) -> csr_matrix:
        """Derivative (3J, 3N) of the right-hand side of the spline's system, chords on the left fixed."""
        joints = self._joints
        forth = _projectors(self._forth) / self._after[:, None, None]
        back = _projectors(self._back) / self._before[:, None, None]
        rows = np.repeat(np.arange(3 * len(joints.node)).reshape(-1, 3), 3, axis=1).ravel()
        parts = [(joints.after, forth), (joints.before, back), (joints.node, -(forth + back))]
        columns = np.concatenate([np.tile(3 * node[:, None] + np.arange(3), 3).ravel() for node, _ in parts])
        values = np.concatenate([block.ravel() for _, block in parts])
        shape = (3 * len(joints.node), self._n_coordinates)
        return coo_matrix((values, (np.tile(rows, 3), columns)), shape=shape).tocsr()

    def _chord_blocks(self, moment: Floats, sign: float) -> csr_matrix:
        """(kJ, E) derivative of the system by the chords, times the moments (J, k)."""
        joints, width = self._joints, moment.shape[1]
        rows, columns, values = [], [], []
        for edge, beyond in ((joints.edge_before, joints.beyond_before), (joints.edge_after, joints.beyond_after)):
            far = np.where((beyond != ALONE)[:, None], moment[beyond], 0.0)
            rows.append(np.arange(moment.size))
            columns.append(np.repeat(edge, width))
            values.append((moment / 3.0 + sign * far / 6.0).ravel())
        shape = (moment.size, len(self._chords.length))
        return coo_matrix(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))), shape=shape
        ).tocsr()


def _along(chords: Chords, edge: Ints, start: Ints) -> Floats:
    """Unit vectors (J, 3) of edges, away from their node ``start``."""
    sign = np.where(chords.edges[edge, 0] == start, 1.0, -1.0)
    unit: Floats = sign[:, None] * chords.unit[edge]
    return unit


def _orthogonal(vectors: Floats, unit: Floats) -> Floats:
    rest: Floats = vectors - (vectors * unit).sum(1, keepdims=True) * unit
    return rest


def _projectors(unit: Floats) -> Floats:
    """Matrices (J, 3, 3) that take out what lies along unit vectors."""
    projectors: Floats = np.eye(3) - unit[:, :, None] * unit[:, None, :]
    return projectors


def _solve(matrix: csr_matrix, right: Floats) -> Floats:
    solution: Floats = splu(matrix.tocsc()).solve(right)
    return solution


def _banded_inverse(matrix: csr_matrix) -> csr_matrix:
    """The inverse of a matrix D (1 + N) with rows of |N| that sum up to a half at most, without its smallest entries.

    (1 + N)⁻¹ = (1 - N) (1 + N²) (1 + N⁴) up to N⁸.
    """
    scale = diags(1.0 / matrix.diagonal())
    one = identity(matrix.shape[0], format="csr")
    off = csr_matrix(scale @ matrix - one)
    square = csr_matrix(off @ off)
    inverse = csr_matrix((one - off) @ (one + square) @ (one + square @ square))
    inverse.data[np.abs(inverse.data) < _KEPT] = 0.0
    inverse.eliminate_zeros()
    return csr_matrix(inverse @ scale)


def _expand(matrix: csr_matrix) -> csr_matrix:
    """The same matrix for each of three coordinates."""
    from scipy.sparse import kron

    return csr_matrix(kron(matrix, identity(3), format="csr"))


def _blocks(blocks: Floats) -> csr_matrix:
    """Block diagonal matrix of (J, 3, 3)."""
    n = len(blocks)
    rows = np.repeat(np.arange(3 * n), 3)
    columns = np.repeat(np.arange(3 * n).reshape(-1, 3), 3, axis=0).ravel()
    return coo_matrix((blocks.ravel(), (rows, columns)), shape=(3 * n, 3 * n)).tocsr()


def _columns(vectors: Floats) -> csr_matrix:
    """(3J, J) with one vector of (J, 3) a column."""
    n = len(vectors)
    return coo_matrix((vectors.ravel(), (np.arange(3 * n), np.repeat(np.arange(n), 3))), shape=(3 * n, n)).tocsr()


# Bounds


def edge_term(chords: Chords, median: Floats, shortest: Floats, longest: Floats) -> Term:
    """Cost of edge lengths away from the median of their kind, small within the bounds, large beyond."""
    log = np.log(chords.length / median)
    beyond = log - np.clip(log, np.log(shortest), np.log(longest))
    relative = csr_matrix(diags(1.0 / chords.length) @ chords.jacobian)
    pushed = np.flatnonzero(beyond)
    from scipy.sparse import vstack

    rest = np.concatenate([_EDGE_PULL * log, _EDGE_BOUND * beyond[pushed]])
    matrix = csr_matrix(vstack([_EDGE_PULL * relative, _EDGE_BOUND * relative[pushed]]))
    return Term(float((rest**2).sum()) / 2.0, matrix, rest)


@dataclass(frozen=True, eq=False)
class Corners:
    """Corners of faces: the node, and those before and after it around the face, (C,) each."""

    node: Ints
    before: Ints
    after: Ints


def corners_of(lattice: Lattice) -> Corners:
    """The corners of all faces of a lattice."""
    following = next_in_loop(lattice.face_offsets)
    preceding = np.empty_like(following)
    preceding[following] = np.arange(len(following))
    nodes = lattice.face_nodes
    return Corners(nodes, nodes[preceding], nodes[following])


def corner_angles(corners: Corners, nodes: Floats, normals: Floats) -> Floats:
    """Angles (C,) at corners, counter-clockwise about the normal of the surface: below 0 where a face lies inverted.

    They run from -90 to 270 degrees, for a face of many sides may have a corner that points inwards.
    """
    u, v = nodes[corners.after] - nodes[corners.node], nodes[corners.before] - nodes[corners.node]
    angles = np.arctan2((np.cross(u, v) * normals[corners.node]).sum(1), (u * v).sum(1))
    wrapped: Floats = np.where(angles < -np.pi / 2, angles + 2 * np.pi, angles)
    return wrapped


def angle_term(corners: Corners, nodes: Floats, normals: Floats) -> Term:
    """Cost of corners below `LEAST_ANGLE`."""
    short = LEAST_ANGLE - corner_angles(corners, nodes, normals)
    tight = np.flatnonzero(short > 0)
    node, before, after = (side[tight] for side in (corners.node, corners.before, corners.after))
    u, v, n = nodes[after] - nodes[node], nodes[before] - nodes[node], normals[node]
    sine, cosine = (np.cross(u, v) * n).sum(1), (u * v).sum(1)
    square = np.maximum(sine**2 + cosine**2, np.finfo(float).tiny)
    sine, cosine = (sine / square)[:, None], (cosine / square)[:, None]
    by_u, by_v = cosine * np.cross(v, n) - sine * v, cosine * np.cross(n, u) - sine * u
    values = -_ANGLE_BOUND * np.concatenate([by_u, by_v, -(by_u + by_v)])
    columns = np.concatenate([_coordinates(part) for part in (after, before, node)])
    rows = np.tile(np.repeat(np.arange(len(tight)), 3), 3)
    matrix = coo_matrix((values.ravel(), (rows, columns)), shape=(len(tight), nodes.size)).tocsr()
    rest = _ANGLE_BOUND * short[tight]
    return Term(float((rest**2).sum()) / 2.0, matrix, rest)


def edge_of_sides(lattice: Lattice) -> tuple[Ints, Bools]:
    """The edge of each side of each face (C,), and whether each edge (E,) lies on a border."""
    after = lattice.face_nodes[next_in_loop(lattice.face_offsets)]
    side = edges_between(lattice.edges, lattice.face_nodes, after)
    return side, np.bincount(side, minlength=lattice.n_edges) == 1
