"""Tangential smoothing: nodes slide along their polylines until the rods that cross these run straight and evenly.

The division of a ring depends on its parent alone, so a longitudinal rod turns slightly at every node.  With one
unknown x a node, its slide along its polyline in edge lengths of that ring, the energy

    E(x) = Σ |u₊ - u₋|²              turns of the rods other than rings
         + w_r Σ (g/ḡ - 1)²           strains of the edges along the rings (g arc length, ḡ mean of the ring)
         + Σ w(ε) ε²,  ε = l/l̃ - 1    strains of the other edges (l̃ median), the longest weighted most
         + w_s Σ x²                   slides, so that the minimum is unique

is minimised by three Gauss–Newton steps; u₋ and u₊ are the unit vectors along a rod before and after a node.  Nodes
move along the surface, so the part of a turn that the surface itself makes hardly changes: with or without it the
turns on the surface differ by 0.2° at most (root mean square, samples and test shapes).  Each step solves a sparse
symmetric positive definite system with conjugate gradients, or directly where these do not converge.

Nodes of borders, nodes on cusps and Steiner vertices do not move, and none moves by more than 0.3 edges.  Slides that
invert or turn a face, or make a corner sharp, are taken back.

Time is linear in the number of nodes for each conjugate gradient step.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity, vstack
from scipy.sparse.linalg import spsolve

from weavecore.geometry.arrays import Bools, Floats, Ints, cross, next_in_loop, offsets_of, rows_of, unit_vectors
from weavecore.geometry.conjugate_gradients import conjugate_gradients
from weavecore.geometry.elementary import angles_between, arctangents
from weavecore.geometry.matching import ALONE, match_greedily, pairs_of_equals
from weavecore.linking.arc_length import points_at
from weavecore.linking.flips import FaceOrientation
from weavecore.model.lattice import LATITUDINAL, Lattice
from weavecore.model.polylines import Polylines
from weavecore.polling import poll

_ROUNDS = 3
"""Gauss–Newton steps: the third moves nodes by less than a hundredth of an edge on the sample surfaces."""
_MOST_SLIDE = 0.3
"""Part of its ring's edge length by which a node slides at most: two neighbours cannot meet."""
_RING_WEIGHT, _LINK_WEIGHT, _SLIDE_WEIGHT = 2.0, 2.0, 0.05
"""Weights of the strains along rings, of the strains of links, and of the slides, against 1 for a turn in radians."""
_LEAST_LINK_WEIGHT, _LONG_LINK_WEIGHT = 0.1, 4.0
"""The weight of a link of strain ε is 0.1 + 4 ε² times `_LINK_WEIGHT`, so that outliers are pulled in first."""
_MOST_BEND = np.radians(75.0)
"""Two edges at a node that bend more are not taken for one rod."""
_PROBE = 1e-3
"""Part of an edge for the difference quotient of a node's point by its slide."""
_ON_CUSP = 1e-6
"""Part of an edge: a node that is nearer to a cusp lies on it."""
_CG_TOLERANCE, _MOST_CG_STEPS = 1e-8, 400
"""Relative residual of a Gauss–Newton step, and conjugate gradient steps for it: up to 132 on the sample surfaces."""
_LEAST_ANGLE = np.radians(25.0)
"""No slide makes a corner sharper than this."""
_LEAST_COSINE = 0.5
"""Cosine between the normals of a corner before and after: no slide turns a corner by more than 60°."""


Term = tuple[csr_matrix, Floats]
"""Jacobian (r, k) and residual (r,) of one sum of squares, both times the root of its weight."""


@dataclass(frozen=True, eq=False)
class _RodTurns:
    """Three nodes in a row of every rod but the rings, (k,) each."""

    before: Ints
    node: Ints
    after: Ints


@dataclass(frozen=True, eq=False)
class _Slides:
    """Where nodes may go: polyline, station, mean edge of the polyline and whether they are free, (N,) each."""

    polylines: Polylines
    polyline: Ints
    station: Floats
    edge: Floats
    free: Bools

    def points(self, slide: Floats) -> Floats:
        """Points (k, 3) of the free nodes after slides (k,), which are arc lengths."""
        polyline = self.polyline[self.free]
        length = self.polylines.lengths[polyline]
        return points_at(self.polylines, polyline, (self.station[self.free] + slide) % length)


def smooth_tangentially(lattice: Lattice, cusps: Mapping[int, Floats]) -> Lattice:
    """The same lattice with its nodes moved along their polylines.

    Parameters
    ----------
    lattice : Lattice
    cusps : mapping of int to (k,) float64
        By polyline: stations of its cusps, where nodes stay.
    """
    slides = _slides_of(lattice, cusps)
    rods = _rod_turns(lattice)
    if not slides.free.any() or len(rods.node) == 0:
        return lattice
    slide = np.zeros(int(slides.free.sum()))
    nodes = lattice.nodes.copy()
    for _ in range(_ROUNDS):
        poll()
        step = _gauss_newton_step(lattice, slides, rods, nodes, slide)
        slide = np.clip(slide + step, -_MOST_SLIDE, _MOST_SLIDE)
        nodes[slides.free] = slides.points(slide * slides.edge[slides.free])
    slide = _without_harm(lattice, slides, slide)
    nodes[slides.free] = slides.points(slide * slides.edge[slides.free])
    station = slides.station.copy()
    length = lattice.latitudes.polylines.lengths[lattice.node_latitude[slides.free]]
    station[slides.free] = (station[slides.free] + slide * slides.edge[slides.free]) % length
    return replace(lattice, nodes=nodes, node_station=station)


def _slides_of(lattice: Lattice, cusps: Mapping[int, Floats]) -> _Slides:
    latitudes = lattice.latitudes
    polyline = lattice.node_latitude
    on_ring = polyline >= 0
    counts = np.bincount(polyline[on_ring], minlength=len(latitudes))
    closed = latitudes.polylines.closed
    mean = latitudes.polylines.lengths / np.maximum(counts - ~closed, 1)
    free = on_ring.copy()
    free[on_ring] = latitudes.generation[polyline[on_ring]] > 0
    free &= ~_are_ends(polyline, counts, closed)
    for p, stations in cusps.items():
        nodes = np.flatnonzero(polyline == p)
        apart = (lattice.node_station[nodes, None] - stations) / mean[p] % counts[p]
        free[nodes[(np.minimum(apart, counts[p] - apart) < _ON_CUSP).any(1)]] = False
    return _Slides(latitudes.polylines, polyline, lattice.node_station, np.where(on_ring, mean[polyline], 1.0), free)


def _are_ends(polyline: Ints, counts: Ints, closed: Bools) -> Bools:
    """(N,) whether a node is the first or the last of an open polyline; nodes on polylines come first, in order."""
    offsets = offsets_of(counts)
    flag = np.zeros(len(polyline), bool)
    flag[offsets[:-1][~closed]] = flag[offsets[1:][~closed] - 1] = True
    return flag


def _rod_turns(lattice: Lattice) -> _RodTurns:
    """Edges at each node other than along rings, paired so that they bend least, as rods will run."""
    edges = lattice.edges[lattice.edge_family != LATITUDINAL]
    tail, head = edges.ravel(), edges[:, ::-1].ravel()
    away = unit_vectors(lattice.nodes[head] - lattice.nodes[tail])
    one, other = pairs_of_equals(tail)
    bend = np.pi - angles_between(away[one], away[other])
    good = bend <= _MOST_BEND
    partner = match_greedily(one[good], other[good], bend[good], len(tail))
    first = np.flatnonzero(partner > np.where(partner == ALONE, len(tail), np.arange(len(tail))))
    return _RodTurns(head[first], tail[first], head[partner[first]])


def _vertex_normals(lattice: Lattice) -> Floats:
    """Unit normal (N, 3) of the faces around each node: the mean of their corners' normals."""
    normals = np.zeros_like(lattice.nodes)
    np.add.at(normals, lattice.face_nodes, _corner_shapes(lattice, lattice.nodes)[0])
    return unit_vectors(normals)


def _gauss_newton_step(lattice: Lattice, slides: _Slides, rods: _RodTurns, nodes: Floats, slide: Floats) -> Floats:
    """How far (k,) the free nodes go on, in edges of their rings."""
    edge = slides.edge[slides.free]
    ahead, behind = (slides.points((slide + probe) * edge) for probe in (_PROBE, -_PROBE))
    tangent = np.zeros_like(nodes)
    tangent[slides.free] = (ahead - behind) / (2 * _PROBE)
    variable = np.where(slides.free, np.cumsum(slides.free) - 1, -1)
    terms: list[Term] = [
        _turn_term(rods, nodes, tangent, variable),
        _ring_strain_term(lattice, slides, slide, variable),
        _link_strain_term(lattice, nodes, tangent, variable),
    ]
    jacobian = csr_matrix(vstack([jacobian for jacobian, _ in terms]))
    residual = np.concatenate([residual for _, residual in terms])
    matrix = csr_matrix(jacobian.T @ jacobian + csr_matrix(_SLIDE_WEIGHT * identity(len(slide))))
    gradient = jacobian.T @ residual + _SLIDE_WEIGHT * slide
    step, is_solved = conjugate_gradients(matrix, -gradient, tolerance=_CG_TOLERANCE, most_iterations=_MOST_CG_STEPS)
    if not is_solved:
        step = spsolve(matrix.tocsc(), -gradient)
    steps: Floats = step
    return steps


def _jacobian(rows: Ints, nodes: Ints, values: Floats, variable: Ints, n_rows: int) -> csr_matrix:
    """Entries ``values`` by row and node, without those of nodes that are not free."""
    free = variable[nodes] >= 0
    shape = (n_rows, int(variable.max()) + 1)
    return coo_matrix((values[free], (rows[free], variable[nodes][free])), shape=shape).tocsr()


def _turn_term(rods: _RodTurns, nodes: Floats, tangent: Floats, variable: Ints) -> Term:
    """The turn at each middle node: the difference of the unit vectors after and before it, about its angle."""
    forth, back = nodes[rods.after] - nodes[rods.node], nodes[rods.node] - nodes[rods.before]
    one, other = (1.0 / np.linalg.norm(v, axis=1, keepdims=True) for v in (forth, back))
    turn = forth * one - back * other
    parts = [(rods.after, one), (rods.before, other), (rods.node, -(one + other))]
    values = np.concatenate([tangent[node] * factor for node, factor in parts])
    rows = np.tile(np.arange(turn.size), 3)
    which = np.repeat(np.concatenate([node for node, _ in parts]), 3)
    jacobian = _jacobian(rows, which, values.ravel(), variable, turn.size)
    return jacobian, turn.ravel()


def _ring_strain_term(lattice: Lattice, slides: _Slides, slide: Floats, variable: Ints) -> Term:
    """Strain of each edge along a ring against the mean of that ring."""
    on_ring = np.flatnonzero(slides.polyline >= 0)
    order = on_ring[np.lexsort((slides.station[on_ring], slides.polyline[on_ring]))]
    counts = np.bincount(slides.polyline[order], minlength=len(lattice.latitudes))
    offsets, closed = offsets_of(counts), slides.polylines.closed
    after = order[next_in_loop(offsets)]
    of_node = np.zeros(len(slides.free))
    of_node[slides.free] = slide
    edge = slides.edge[order]
    gap = (slides.station[after] - slides.station[order]) % (edge * counts[slides.polyline[order]])
    # From the end of an open one to the next node it may be less than an edge.
    near_end = np.concatenate([offsets[:-1][~closed], offsets[1:][~closed] - 2])
    gap[near_end] = edge[near_end]
    strain = gap / edge - 1.0 + of_node[after] - of_node[order]
    kept = np.ones(len(order), bool)
    kept[offsets[1:][~closed] - 1] = False
    order, after, strain = order[kept], after[kept], strain[kept]
    n = len(order)
    rows, root = np.tile(np.arange(n), 2), np.full(n, np.sqrt(_RING_WEIGHT))
    jacobian = _jacobian(rows, np.concatenate([after, order]), np.concatenate([root, -root]), variable, n)
    return jacobian, root * strain


def _link_strain_term(lattice: Lattice, nodes: Floats, tangent: Floats, variable: Ints) -> Term:
    """Strain of each edge that is not along a ring, against the median of these."""
    a, b = lattice.edges[lattice.edge_family != LATITUDINAL].T
    way = nodes[b] - nodes[a]
    length = np.linalg.norm(way, axis=1)
    median = float(np.median(length))
    strain = length / median - 1.0
    root = np.sqrt(_LINK_WEIGHT * (_LEAST_LINK_WEIGHT + _LONG_LINK_WEIGHT * strain**2))
    along = way * (root / (length * median))[:, None]
    values = np.concatenate([(along * tangent[b]).sum(1), -(along * tangent[a]).sum(1)])
    jacobian = _jacobian(np.tile(np.arange(len(a)), 2), np.concatenate([b, a]), values, variable, len(a))
    return jacobian, root * strain


def _without_harm(lattice: Lattice, slides: _Slides, slide: Floats) -> Floats:
    """The slides, set to 0 at faces that they would invert, turn too far or give too sharp a corner."""
    corners = lattice.face_nodes
    face = rows_of(lattice.face_offsets)
    normal, angle = _corner_shapes(lattice, lattice.nodes)
    orientation = FaceOrientation(lattice.latitudes.surface, _vertex_normals(lattice))
    was_inverted = orientation.of_polygons(lattice.nodes, corners, lattice.face_offsets) <= 0
    variable = np.where(slides.free, np.cumsum(slides.free) - 1, -1)[corners]
    slide = slide.copy()
    while True:
        poll()
        nodes = lattice.nodes.copy()
        nodes[slides.free] = slides.points(slide * slides.edge[slides.free])
        new_normal, new_angle = _corner_shapes(lattice, nodes)
        is_bad = (normal * new_normal).sum(1) < _LEAST_COSINE
        is_bad |= (new_angle < _LEAST_ANGLE) & (new_angle < angle * (1 - 1e-9))
        bad_faces = ~was_inverted & (orientation.of_polygons(nodes, corners, lattice.face_offsets) <= 0)
        bad_faces[face[is_bad]] = True
        harmful = variable[bad_faces[face]]
        harmful = harmful[harmful >= 0]
        if not slide[harmful].any():
            return slide
        slide[harmful] = 0.0


def _corner_shapes(lattice: Lattice, nodes: Floats) -> tuple[Floats, Floats]:
    """Unit normal (C, 3) and angle (C,) at each corner of each face."""
    after = next_in_loop(lattice.face_offsets)
    before = np.empty_like(after)
    before[after] = np.arange(len(after))
    corner = nodes[lattice.face_nodes]
    u, v = corner[after] - corner, corner[before] - corner
    normal = cross(u, v)
    size = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(size, np.finfo(float).tiny)[:, None]
    return unit, arctangents(size, (u * v).sum(1))
