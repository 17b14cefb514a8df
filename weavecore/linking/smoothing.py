"""Fairing: nodes slide along their polylines until the rods that cross these run straight and evenly.

The division of a ring looks at the ring above it alone, so that a longitude takes a small turn at every
node.  Sliding takes these turns out where nothing speaks against them.  What is made least is the sum of

* the squares of the turns of the longitudes, as seen on the surface,
* twice the squares of the strains of the edges along the rings,
* the squares of the strains of the other edges, the longest counting most, and
* a little of the squares of the slides, so that there is one best place for every node,

over a few rounds of Gauss and Newton.  Nodes of borders, on spikes, and hubs stay where they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, identity, vstack
from scipy.sparse.linalg import cg

from weavecore.geometry.arrays import Bools, Floats, Ints, next_in_loop, offsets_of, rows_of
from weavecore.geometry.matching import ALONE, match_greedily, pairs_of_equals
from weavecore.linking.flips import Uprightness
from weavecore.linking.resample import points_at
from weavecore.model.lattice import LATITUDINAL, Lattice
from weavecore.model.polylines import Polylines

_ROUNDS = 3
_MOST_SLIDE = 0.3
"""A node slides no further than this part of its ring's edges."""
_RING_STRAIN, _LINK_STRAIN, _SLIDE = 2.0, 2.0, 0.05
_LEAST_LINK_WEIGHT, _LONG_LINK_WEIGHT = 0.1, 4.0
_MOST_BEND = np.radians(75.0)
_PROBE = 1e-3
_ON_SPIKE = 1e-6
_TOLERANCE, _MOST_STEPS = 1e-8, 400
_LEAST_ANGLE = np.radians(25.0)
_SAME_SIDE = 0.5
"""Cosine to its old normal that a face keeps."""


Term = tuple[csr_matrix, Floats]
"""Jacobian (r, k) and residual (r,), both times the root of the weight."""


@dataclass(frozen=True, eq=False)
class _Rods:
    """Three nodes in a row of every rod but the rings, and where the surface looks at the middle one, (k, 3)."""

    before: Ints
    node: Ints
    after: Ints
    normal: Floats


@dataclass(frozen=True, eq=False)
class _Track:
    """Where nodes may go: polyline, station, mean edge and whether they are free, (N,) each."""

    polylines: Polylines
    polyline: Ints
    station: Floats
    edge: Floats
    free: Bools

    def places(self, slide: Floats) -> Floats:
        """Points (k, 3) of the free nodes."""
        polyline = self.polyline[self.free]
        length = self.polylines.lengths[polyline]
        return points_at(self.polylines, polyline, (self.station[self.free] + slide) % length)


def fair(lattice: Lattice, spikes: Mapping[int, Floats]) -> Lattice:
    """The same lattice with its nodes slid along their polylines.

    Parameters
    ----------
    lattice : Lattice
    spikes : mapping
        By polyline: stations of its spikes, where nodes stay.
    """
    track = _track_of(lattice, spikes)
    rods = _rods_of(lattice)
    if not track.free.any() or len(rods.node) == 0:
        return lattice
    slide = np.zeros(int(track.free.sum()))
    nodes = lattice.nodes.copy()
    for _ in range(_ROUNDS):
        step = _step(lattice, track, rods, nodes, slide)
        slide = np.clip(slide + step, -_MOST_SLIDE, _MOST_SLIDE)
        nodes[track.free] = track.places(slide * track.edge[track.free])
    slide = _without_harm(lattice, track, slide)
    nodes[track.free] = track.places(slide * track.edge[track.free])
    station = track.station.copy()
    length = lattice.latitudes.polylines.lengths[lattice.node_latitude[track.free]]
    station[track.free] = (station[track.free] + slide * track.edge[track.free]) % length
    return replace(lattice, nodes=nodes, node_station=station)


def _track_of(lattice: Lattice, spikes: Mapping[int, Floats]) -> _Track:
    latitudes = lattice.latitudes
    polyline = lattice.node_latitude
    on_ring = polyline >= 0
    counts = np.bincount(polyline[on_ring], minlength=len(latitudes))
    closed = latitudes.polylines.closed
    mean = latitudes.polylines.lengths / np.maximum(counts - ~closed, 1)
    free = on_ring.copy()
    free[on_ring] = latitudes.generation[polyline[on_ring]] > 0
    free &= ~_are_ends(polyline, counts, closed)
    for p, stations in spikes.items():
        nodes = np.flatnonzero(polyline == p)
        apart = (lattice.node_station[nodes, None] - stations) / mean[p] % counts[p]
        free[nodes[(np.minimum(apart, counts[p] - apart) < _ON_SPIKE).any(1)]] = False
    return _Track(latitudes.polylines, polyline, lattice.node_station, np.where(on_ring, mean[polyline], 1.0), free)


def _are_ends(polyline: Ints, counts: Ints, closed: Bools) -> Bools:
    """(N,) whether a node is the first or the last of an open polyline; nodes on polylines come first, in order."""
    offsets = offsets_of(counts)
    flag = np.zeros(len(polyline), bool)
    flag[offsets[:-1][~closed]] = flag[offsets[1:][~closed] - 1] = True
    return flag


def _rods_of(lattice: Lattice) -> _Rods:
    """Links of each node paired so that they bend least, as the rods will run."""
    edges = lattice.edges[lattice.edge_family != LATITUDINAL]
    tail, head = edges.ravel(), edges[:, ::-1].ravel()
    away = lattice.nodes[head] - lattice.nodes[tail]
    away /= np.maximum(np.linalg.norm(away, axis=1, keepdims=True), np.finfo(float).tiny)
    one, other = pairs_of_equals(tail)
    bend = np.pi - np.arccos(np.clip((away[one] * away[other]).sum(1), -1.0, 1.0))
    good = bend <= _MOST_BEND
    partner = match_greedily(one[good], other[good], bend[good], len(tail))
    first = np.flatnonzero(partner > np.where(partner == ALONE, len(tail), np.arange(len(tail))))
    node = tail[first]
    return _Rods(head[first], node, head[partner[first]], _node_normals(lattice)[node])


def _node_normals(lattice: Lattice) -> Floats:
    """Where the faces around each node look together (N, 3)."""
    normals = np.zeros_like(lattice.nodes)
    np.add.at(normals, lattice.face_nodes, _corner_shapes(lattice, lattice.nodes)[0])
    size = np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    unit: Floats = normals / size
    return unit


def _step(lattice: Lattice, track: _Track, rods: _Rods, nodes: Floats, slide: Floats) -> Floats:
    """How far (k,) the free nodes should go on, in edges of their rings."""
    edge = track.edge[track.free]
    ahead, behind = (track.places((slide + probe) * edge) for probe in (_PROBE, -_PROBE))
    tangent = np.zeros_like(nodes)
    tangent[track.free] = (ahead - behind) / (2 * _PROBE)
    variable = np.where(track.free, np.cumsum(track.free) - 1, -1)
    terms: list[Term] = [
        _turns(rods, nodes, tangent, variable),
        _ring_strains(lattice, track, slide, variable),
        _link_strains(lattice, nodes, tangent, variable),
    ]
    jacobian = csr_matrix(vstack([jacobian for jacobian, _ in terms]))
    residual = np.concatenate([residual for _, residual in terms])
    matrix = jacobian.T @ jacobian + csr_matrix(_SLIDE * identity(len(slide)))
    step, _ = cg(matrix, -(jacobian.T @ residual + _SLIDE * slide), rtol=_TOLERANCE, maxiter=_MOST_STEPS)
    steps: Floats = step
    return steps


def _jacobian(rows: Ints, nodes: Ints, values: Floats, variable: Ints, n_rows: int) -> csr_matrix:
    free = variable[nodes] >= 0
    shape = (n_rows, int(variable.max()) + 1)
    return coo_matrix((values[free], (rows[free], variable[nodes][free])), shape=shape).tocsr()


def _turns(rods: _Rods, nodes: Floats, tangent: Floats, variable: Ints) -> Term:
    """The turn at each middle node, in radians, as a vector in the tangent plane."""

    def in_plane(vectors: Floats) -> Floats:
        flat: Floats = vectors - (vectors * rods.normal).sum(1, keepdims=True) * rods.normal
        return flat

    forth, back = nodes[rods.after] - nodes[rods.node], nodes[rods.node] - nodes[rods.before]
    one, other = (1.0 / np.linalg.norm(v, axis=1, keepdims=True) for v in (forth, back))
    turn = in_plane(forth * one - back * other)
    parts = [(rods.after, one), (rods.before, other), (rods.node, -(one + other))]
    values = np.concatenate([in_plane(tangent[node] * factor) for node, factor in parts])
    rows = np.tile(np.arange(turn.size), 3)
    which = np.repeat(np.concatenate([node for node, _ in parts]), 3)
    jacobian = _jacobian(rows, which, values.ravel(), variable, turn.size)
    return jacobian, turn.ravel()


def _ring_strains(lattice: Lattice, track: _Track, slide: Floats, variable: Ints) -> Term:
    """How much longer than the mean of its ring each edge along it is, as a part of that."""
    on_ring = np.flatnonzero(track.polyline >= 0)
    order = on_ring[np.lexsort((track.station[on_ring], track.polyline[on_ring]))]
    counts = np.bincount(track.polyline[order], minlength=len(lattice.latitudes))
    offsets, closed = offsets_of(counts), track.polylines.closed
    after = order[next_in_loop(offsets)]
    slides = np.zeros(len(track.free))
    slides[track.free] = slide
    edge = track.edge[order]
    gap = (track.station[after] - track.station[order]) % (edge * counts[track.polyline[order]])
    # From the end of an open one to the next node it may be less than an edge.
    near_end = np.concatenate([offsets[:-1][~closed], offsets[1:][~closed] - 2])
    gap[near_end] = edge[near_end]
    strain = gap / edge - 1.0 + slides[after] - slides[order]
    kept = np.ones(len(order), bool)
    kept[offsets[1:][~closed] - 1] = False
    order, after, strain = order[kept], after[kept], strain[kept]
    n = len(order)
    rows, root = np.tile(np.arange(n), 2), np.full(n, np.sqrt(_RING_STRAIN))
    jacobian = _jacobian(rows, np.concatenate([after, order]), np.concatenate([root, -root]), variable, n)
    return jacobian, root * strain


def _link_strains(lattice: Lattice, nodes: Floats, tangent: Floats, variable: Ints) -> Term:
    """How much longer than the median each edge between polylines is, as a part of that."""
    a, b = lattice.edges[lattice.edge_family != LATITUDINAL].T
    way = nodes[b] - nodes[a]
    length = np.linalg.norm(way, axis=1)
    median = float(np.median(length))
    strain = length / median - 1.0
    root = np.sqrt(_LINK_STRAIN * (_LEAST_LINK_WEIGHT + _LONG_LINK_WEIGHT * strain**2))
    along = way * (root / (length * median))[:, None]
    values = np.concatenate([(along * tangent[b]).sum(1), -(along * tangent[a]).sum(1)])
    jacobian = _jacobian(np.tile(np.arange(len(a)), 2), np.concatenate([b, a]), values, variable, len(a))
    return jacobian, root * strain


def _without_harm(lattice: Lattice, track: _Track, slide: Floats) -> Floats:
    """The slides with those left out that turn a face, or turn it over, or give it too sharp a corner."""
    corners = lattice.face_nodes
    face = rows_of(lattice.face_offsets)
    normal, angle = _corner_shapes(lattice, lattice.nodes)
    look = Uprightness(lattice.latitudes.surface, _node_normals(lattice))
    was_fallen = look.of(lattice.nodes, corners, lattice.face_offsets) <= 0
    variable = np.where(track.free, np.cumsum(track.free) - 1, -1)[corners]
    slide = slide.copy()
    while True:
        nodes = lattice.nodes.copy()
        nodes[track.free] = track.places(slide * track.edge[track.free])
        new_normal, new_angle = _corner_shapes(lattice, nodes)
        is_bad = (normal * new_normal).sum(1) < _SAME_SIDE
        is_bad |= (new_angle < _LEAST_ANGLE) & (new_angle < angle * (1 - 1e-9))
        bad_faces = ~was_fallen & (look.of(nodes, corners, lattice.face_offsets) <= 0)
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
    cross = np.cross(u, v)
    size = np.linalg.norm(cross, axis=1)
    unit = cross / np.maximum(size, np.finfo(float).tiny)[:, None]
    return unit, np.arctan2(size, (u * v).sum(1))
