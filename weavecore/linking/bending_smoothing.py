"""Smoothing that bends rods least: nodes move on the surface until rods run straight.

What is made least over the places x of the nodes, on the surface or along the polylines that hold them, is

    Σ cost(κ_j / κ_max)  +  bounds on edge lengths  +  bounds on angles

with κ_j the curvature of the C2 spline of a rod at joint j, going over and under included, and κ_max the curvature that
its material allows.  The cost is small below 0.9 κ_max, grows with the square beyond and in proportion beyond
1.5 κ_max, so that a place where nothing helps does not hold up all others.  See `bending_terms`.

A Levenberg-Marquardt method: each node has as many unknowns as ways to go, two in the tangent plane of the surface, one
along a polyline, none at corners.  The linear systems are sparse and solved roughly, by preconditioned conjugate
gradients.  A step is taken in space and put back on the exact mesh at the closest point.  A step that lowers the sum is
kept, but for nodes where it would invert a face, or bring an edge or an angle out of its hard bounds.  Each node has a
damping of its own, which rises where the costs around it rose and falls elsewhere: a sharp place that goes forward in
small steps does not hold up the others.

Compare the relaxed kagome of Ayres, Martin and Zwierzycki 2018 and the foliations of Vekhter et al. 2019.
Complexity: a bounded number of steps, each of time and memory linear in the number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np
from scipy.sparse import csr_matrix

from weavecore.geometry.arrays import (
    Bools,
    Floats,
    Ints,
    cross,
    dots,
    offsets_of,
    order_by,
    ranges,
    rows_of,
    sorted_unique,
    unit_vectors,
)
from weavecore.geometry.elementary import arctangents
from weavecore.linking.arc_length import Located, points_at
from weavecore.linking.bending_terms import (
    REACH,
    AngleTerm,
    Bends,
    CornerArms,
    EdgeTerm,
    Segments,
    corners_of,
    edge_of_sides,
    summed_at_nodes,
)
from weavecore.linking.node_placement import CORNER_TURN
from weavecore.linking.normal_equations import BandTerm, NormalEquations
from weavecore.linking.rod_runs import RodRuns, find_runs, partners_of
from weavecore.model.lattice import Lattice
from weavecore.model.surface import SurfaceMesh
from weavecore.polling import poll

FREE_ON_SURFACE = ("kagome", "diagonal")
"""Patterns without inner rings: their nodes go anywhere on the surface."""

WEAVE_RISE = {"triangular": 0.0, "twill": 0.25}
"""Undulation of rods over that of a plain weave: none in stacked layers, a quarter in over two, under two."""

_ADMISSIBLE_RADIUS = 93.75
"""Least radius over diameter that is aimed at: that of pultruded GFRP under long-term load."""

_ROUNDS = 3
"""Times that edges are paired into rods and nodes moved, at most: rods that run straighter may go on other ways."""

_MOST_STEPS = 40
"""Steps of the descent at most; `_ENOUGH` ends most sooner."""

_MOST_TRIES = 6
"""Steps that are tried from one place, each with more damping."""

_LONGEST_STEP = 0.15
"""Part of the mean edge by which a node moves in a step at most: normals and closest points stay near those before."""

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-2, 1e-5, 1e4
"""Levenberg-Marquardt damping, relative to the diagonal of the Hessian."""

_ENOUGH = 5e-4
"""Steps end when one lowers the sum by less than this part."""

_LEAST_EDGE, _MOST_EDGE = 0.5, 1.45
_LEAST_ANGLE = np.radians(25.0)
"""Hard bounds: edges over the median, and corners; what is beyond at the start gets no worse."""

_PROBE = 0.05
"""Tangents of polylines are taken over this part of a mean edge, to both sides."""


def smooth_bending(
    lattice: Lattice,
    *,
    rod_diameter: Optional[float] = None,
    admissible_radius: float = _ADMISSIBLE_RADIUS,
    free_rings: bool = False,
) -> Lattice:
    """The same lattice with its nodes moved so that rods bend least.

    Parameters
    ----------
    lattice : Lattice
    rod_diameter : float, optional
        That of the rods that are to pass, in the model's unit; by default `Lattice.assumed_diameter`.
    admissible_radius : float
        Least radius to which these rods can be bent, in diameters.
    free_rings : bool
        Whether nodes leave the latitudes in patterns that have rings.

    Returns
    -------
    Lattice
        Faces, edges and families are the same.  Nodes on borders stay on them, those at corners stay where they are.
    """
    is_free = free_rings or lattice.pattern in FREE_ON_SURFACE
    sites = _find_sites(lattice, is_free=is_free)
    if sites.n_unknowns == 0:
        return lattice
    diameter = lattice.assumed_diameter if rod_diameter is None else rod_diameter
    place = sites.start()
    problem = _Problem(lattice, sites, diameter, 1.0 / (admissible_radius * diameter))
    smoothed, known = lattice, None
    for _ in range(_ROUNDS):
        partner = partners_of(smoothed)
        if known is not None and np.array_equal(partner, known):
            break
        problem.take(find_runs(lattice.edges, partner))
        place, known = _descend(problem, place), partner
        smoothed = replace(lattice, nodes=place.nodes, node_station=place.station, off_latitudes=is_free)
    return smoothed


@dataclass(frozen=True, eq=False)
class _Place:
    """Nodes (N, 3), their stations (N,), and the normals of the surface there (N, 3)."""

    nodes: Floats
    station: Floats
    normals: Floats


class _Sites:
    """Which nodes move along polylines, and which anywhere on the surface; the others stay.

    Parameters
    ----------
    lattice : Lattice
    slides, roams : (N,) bool
    """

    def __init__(self, lattice: Lattice, slides: Bools, roams: Bools) -> None:
        self._lattice = lattice
        self.slides, self.roams = slides, roams
        self._surface = lattice.latitudes.surface
        self._vertex_normals = _vertex_normals(self._surface)
        polylines = lattice.latitudes.polylines
        self._polyline_normals = self._weighted_normals(polylines.face, polylines.barycentric)
        self._mean = float(lattice.edge_lengths.mean())
        self.first = np.concatenate([[0], np.cumsum(slides + 2 * roams)])
        self.n_unknowns = int(self.first[-1])

    def start(self) -> _Place:
        """The nodes as they are."""
        lattice, normals = self._lattice, np.empty_like(self._lattice.nodes)
        # Segments of polylines lie within faces, where the normals are blended as they are along the segments.
        on = np.flatnonzero(lattice.node_latitude >= 0)
        located = Located(lattice.latitudes.polylines, lattice.node_latitude[on], lattice.node_station[on])
        normals[on] = unit_vectors(located.values(self._polyline_normals))
        off = np.flatnonzero(lattice.node_latitude < 0)
        normals[off] = self._blend(*self._surface.face_finder.find(lattice.nodes[off]))
        return _Place(lattice.nodes, lattice.node_station, normals)

    def _blend(self, face: Ints, points: Floats) -> Floats:
        corners = self._surface.vertices[self._surface.faces[face]]
        a, b, c = (corners[:, k] for k in range(3))
        area = cross(b - a, c - a)
        size = np.maximum(dots(area, area), np.finfo(float).tiny)
        pairs = ((b, c), (c, a), (a, b))
        weight = np.stack([dots(cross(p - points, q - points), area) / size for p, q in pairs], axis=1)
        return unit_vectors(self._weighted_normals(face, np.clip(weight, 0.0, 1.0)))

    def _weighted_normals(self, face: Ints, weight: Floats) -> Floats:
        """Normals of the corners of faces, blended by weights (n, 3), not of unit length."""
        normals: Floats = np.einsum("nk,nkd->nd", weight, self._vertex_normals[self._surface.faces[face]])
        return normals

    def directions(self, place: _Place) -> Floats:
        """(N, 3, 2) unit directions in which nodes move: one along a polyline, two in the tangent plane, or none."""
        slide, roam = np.flatnonzero(self.slides), np.flatnonzero(self.roams)
        ways = np.zeros((len(self.slides), 3, 2))
        ways[slide, :, 0] = self._ring_tangents(place.station)
        ways[roam, :, 0], ways[roam, :, 1] = _tangents(place.normals[roam])
        return ways

    def _ring_tangents(self, station: Floats) -> Floats:
        slide = np.flatnonzero(self.slides)
        probe = _PROBE * self._mean
        ahead, behind = (self._located(slide, station[slide] + step)[0] for step in (probe, -probe))
        points = self._lattice.latitudes.polylines.points
        return unit_vectors(ahead.values(points) - behind.values(points))

    def _located(self, nodes: Ints, station: Floats) -> tuple[Located, Floats]:
        """Stations on the polylines of nodes, and the same from 0 to their lengths."""
        polylines, latitude = self._lattice.latitudes.polylines, self._lattice.node_latitude[nodes]
        length = polylines.lengths[latitude]
        station = np.where(polylines.closed[latitude], station % length, np.clip(station, 0.0, length))
        return Located(polylines, latitude, station), station

    def moved(self, place: _Place, step: Floats) -> _Place:
        """The nodes after a step (unknowns,), none further than `_LONGEST_STEP`."""
        nodes, station, normals = place.nodes.copy(), place.station.copy(), place.normals.copy()
        most = _LONGEST_STEP * self._mean
        slide, roam = np.flatnonzero(self.slides), np.flatnonzero(self.roams)
        along = np.clip(step[self.first[slide]], -most, most)
        located, station[slide] = self._located(slide, station[slide] + along)
        nodes[slide] = located.values(self._lattice.latitudes.polylines.points)
        normals[slide] = unit_vectors(located.values(self._polyline_normals))
        u, v = _tangents(place.normals[roam])
        way = u * step[self.first[roam], None] + v * step[self.first[roam] + 1, None]
        way *= np.minimum(1.0, most / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), np.finfo(float).tiny))
        face, nodes[roam] = self._surface.face_finder.find(nodes[roam] + way)
        normals[roam] = self._blend(face, nodes[roam])
        return _Place(nodes, station, normals)


def _find_sites(lattice: Lattice, *, is_free: bool) -> _Sites:
    """Nodes of borders move along these, but for corners; those of rings along their rings, or anywhere if free."""
    latitudes = lattice.latitudes
    polylines = latitudes.polylines
    _, is_border = edge_of_sides(lattice)
    on_border = np.zeros(lattice.n_nodes, bool)
    on_border[lattice.edges[is_border]] = True
    on_ring = lattice.node_latitude >= 0
    turn = _turns_about(lattice)
    is_end = on_ring & ~polylines.closed[lattice.node_latitude]
    length = polylines.lengths[lattice.node_latitude]
    is_end &= (lattice.node_station <= 0.0) | (lattice.node_station >= length * (1 - 1e-12))
    slides = on_ring & ~is_end & (turn < CORNER_TURN)
    if is_free:
        roams = ~on_border
        return _Sites(lattice, slides & on_border & (latitudes.generation[lattice.node_latitude] == 0), roams)
    return _Sites(lattice, slides, ~on_ring & ~on_border)


def _turns_about(lattice: Lattice) -> Floats:
    """(N,) how far its polyline turns within a tenth of an edge to both sides of a node; 0 off the polylines."""
    polylines = lattice.latitudes.polylines
    on = np.flatnonzero(lattice.node_latitude >= 0)
    latitude, station = lattice.node_latitude[on], lattice.node_station[on]
    length = polylines.lengths[latitude]
    reach = 2 * _PROBE * lattice.edge_lengths.mean()

    def at(shift: float) -> Floats:
        place = station + shift
        place = np.where(polylines.closed[latitude], place % length, np.clip(place, 0.0, length))
        return points_at(polylines, latitude, place)

    behind, here, ahead = at(-reach), at(0.0), at(reach)
    one, other = here - behind, ahead - here
    turn = np.zeros(lattice.n_nodes)
    turn[on] = arctangents(np.linalg.norm(cross(one, other), axis=1), dots(one, other))
    return turn


def _tangents(normals: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (n, 3) each, normal to the given and to each other."""
    least = np.argmin(np.abs(normals), axis=1)
    u = unit_vectors(cross(normals, np.eye(3)[least]))
    return u, cross(normals, u)


def _vertex_normals(surface: SurfaceMesh) -> Floats:
    """Unit normals (V, 3), faces weighted by area."""
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    area = cross(b - a, c - a)
    total: Floats = np.stack(
        [np.bincount(surface.faces.ravel(), np.repeat(area[:, k], 3), surface.n_vertices) for k in range(3)], axis=1
    )
    return unit_vectors(total)


@dataclass(frozen=True, eq=False)
class _Sum:
    """All terms at one place of the nodes."""

    bends: Bends
    edges: EdgeTerm
    angles: AngleTerm
    arms: CornerArms
    segments: Segments

    @property
    def value(self) -> float:
        return float(self.bends.costs.sum() + self.edges.costs.sum() + self.angles.costs.sum())


class _Groups:
    """Indices by the value below ``n`` that they have."""

    def __init__(self, values: Ints, n: int) -> None:
        self._order, self._offsets = order_by(values, n), offsets_of(np.bincount(values, minlength=n))

    def of(self, values: Ints) -> Ints:
        """The indices of some values, one value after the other."""
        first = self._offsets[values]
        return self._order[ranges(first, self._offsets[values + 1] - first)]


class _Problem:
    """The sum of all terms over the places of the nodes."""

    def __init__(self, lattice: Lattice, sites: _Sites, diameter: float, admissible: float) -> None:
        self.sites, self.n_nodes = sites, lattice.n_nodes
        self.corners, self.face = corners_of(lattice), rows_of(lattice.face_offsets)
        self._face_offsets, self._corners_by_node = lattice.face_offsets, _Groups(self.corners.node, self.n_nodes)
        self._rise = diameter * WEAVE_RISE.get(lattice.pattern, 1.0)
        self._admissible = admissible
        length = lattice.edge_lengths
        self.median, self.mean = float(np.median(length)), float(length.mean())

    def take(self, runs: RodRuns) -> None:
        """Take the rods whose bending counts, and set up the equations for them."""
        self.runs, self._places_by_node = runs, _Groups(runs.node, self.n_nodes)
        diagonals = self.corners.stencils[::2, (np.diff(self._face_offsets) > 3)[self.face]]
        self.equations = NormalEquations(runs, diagonals, np.diff(self.sites.first))

    def corners_at(self, nodes: Ints) -> Ints:
        """The corners at some nodes."""
        return self._corners_by_node.of(nodes)

    def corners_of_faces_at(self, corner: Ints) -> Ints:
        """All corners of the faces that have some corners."""
        face, offsets = sorted_unique(self.face[corner]), self._face_offsets
        return ranges(offsets[face], offsets[face + 1] - offsets[face])

    def segments_at(self, nodes: Ints) -> Ints:
        """The segments that lead from some nodes or to them."""
        at = self._places_by_node.of(nodes)
        at = sorted_unique(np.concatenate([at, np.maximum(at - 1, 0)]))
        return at[self.runs.is_segment[at]]

    def arms(self, place: _Place) -> CornerArms:
        """The corners at a place."""
        return CornerArms(self.corners, place.nodes, place.normals)

    def at(self, place: _Place, segments: Segments, arms: CornerArms) -> _Sum:
        """The terms at a place, from the edges and the corners there."""
        poll()
        bends = Bends(self.runs, place.normals, segments, rise=self._rise, admissible=self._admissible)
        angles = AngleTerm(self.corners, arms, place.nodes, place.normals)
        return _Sum(bends, EdgeTerm(self.runs, segments, self.median), angles, arms, segments)

    def equations_at(self, here: _Sum, place: _Place) -> tuple[csr_matrix, Floats]:
        """Hessian and gradient over the unknowns."""
        directions = self.sites.directions(place)
        bands = [BandTerm(-REACH - 1, here.bends.rows), BandTerm(0, here.edges.rows)]
        hessian = self.equations.assemble(bands, (here.angles.stencils, here.angles.slopes), directions)
        forces = here.bends.forces() + here.edges.forces()
        pulls = -forces
        pulls[:, 1:] += forces[:, :-1]
        gradient = summed_at_nodes(self.runs.node, pulls, self.n_nodes) + here.angles.gradient(self.n_nodes)
        return hessian, self.equations.gradient(gradient, directions)

    def costs_around(self, here: _Sum) -> Floats:
        """(N,) the costs of all terms that a node takes part in, the nearest joints of its rods."""
        costs = here.bends.costs.copy()
        costs[1:] += here.bends.costs[:-1]
        costs[:-1] += here.bends.costs[1:]
        costs += here.edges.costs
        costs[1:] += here.edges.costs[:-1]
        total: Floats = np.bincount(self.runs.node, costs, self.n_nodes).astype(np.float64)
        for nodes in here.angles.stencils:
            total += np.bincount(nodes, here.angles.costs, self.n_nodes)
        return total


def _descend(problem: _Problem, place: _Place) -> _Place:
    """Take steps of Levenberg and Marquardt until the sum hardly falls.

    Each node has a damping (N,) of its own: where the costs around it rise it grows, elsewhere it falls.
    """
    here = problem.at(place, Segments(problem.runs, place.nodes), problem.arms(place))
    costs = problem.costs_around(here)
    damping = np.full(problem.n_nodes, _FIRST_DAMPING)
    equations = problem.equations
    for _ in range(_MOST_STEPS):
        hessian, gradient = problem.equations_at(here, place)
        for _try in range(_MOST_TRIES):
            poll()
            step = equations.solve(hessian, damping / problem.mean**2, -gradient)
            after = _without_harm(problem, place, here, problem.sites.moved(place, step))
            there = problem.at(after.place, after.segments, after.arms)
            new_costs = problem.costs_around(there)
            damping = np.where(
                after.held | (new_costs > costs),
                np.minimum(damping * 8.0, _MOST_DAMPING),
                np.maximum(damping / 4.0, _LEAST_DAMPING),
            )
            if there.value < here.value:
                break
        else:
            return place
        fell = here.value - there.value
        place, here, costs = after.place, there, new_costs
        if fell < _ENOUGH * here.value:
            break
    return place


@dataclass(frozen=True, eq=False)
class _Kept:
    """A place after a step with the corners and the edges there, and (N,) which nodes stay that should have moved."""

    place: _Place
    arms: CornerArms
    segments: Segments
    held: Bools


def _without_harm(problem: _Problem, before: _Place, here: _Sum, after: _Place) -> _Kept:
    """The places after a step, with nodes left where they were at faces and edges that it would spoil."""
    corners, runs = problem.corners, problem.runs
    nodes, station, normals = after.nodes.copy(), after.station.copy(), after.normals.copy()
    was_moved = (nodes != before.nodes).any(1)
    moved = was_moved.copy()
    arms, segments = problem.arms(after), Segments(runs, nodes)
    sharp = np.flatnonzero(_are_sharper(arms, here.arms))
    out = np.flatnonzero(runs.is_segment & _are_out_of_bounds(problem, here.segments.length, segments.length))
    while True:
        spoilt = [corners.node[problem.corners_of_faces_at(sharp)], runs.node[out], runs.node[out + 1]]
        harmful = sorted_unique(np.concatenate(spoilt))
        harmful = harmful[moved[harmful]]
        if len(harmful) == 0:
            break
        nodes[harmful], station[harmful] = before.nodes[harmful], before.station[harmful]
        normals[harmful] = before.normals[harmful]
        moved[harmful] = False
        # Nodes that were moved back may spoil the faces and edges that they are part of, and no others.
        near = problem.corners_of_faces_at(problem.corners_at(harmful))
        some = CornerArms(corners.some(near), nodes, normals)
        arms = arms.with_some(near, some)
        sharp = near[_are_sharper(some, here.arms.some(near))]
        out = problem.segments_at(harmful)
        way = nodes[runs.node[out + 1]] - nodes[runs.node[out]]
        out = out[_are_out_of_bounds(problem, here.segments.length[out], np.sqrt(dots(way, way)))]
    held = was_moved & ~moved
    return _Kept(_Place(nodes, station, normals), arms, Segments(runs, nodes) if held.any() else segments, held)


def _are_sharper(arms: CornerArms, old: CornerArms) -> Bools:
    """(C,) corners that are sharper than `_LEAST_ANGLE`, and than they were."""
    # Of two angles below 90° the lesser has the lesser tangent.
    is_sharper = arms.sine * old.cosine < old.sine * arms.cosine
    sharper: Bools = arms.are_below(_LEAST_ANGLE) & (~old.are_below(_LEAST_ANGLE) | is_sharper)
    return sharper


def _are_out_of_bounds(problem: _Problem, old: Floats, length: Floats) -> Bools:
    """(S,) segments whose lengths are out of bounds, and further than they were."""
    low, high = np.minimum(_LEAST_EDGE * problem.median, old), np.maximum(_MOST_EDGE * problem.median, old)
    bad: Bools = (length < low * (1 - 1e-12)) | (length > high * (1 + 1e-12))
    return bad
