"""Smoothing that bends rods least: nodes move on the surface until rods run straight.

What is made least over the places x of the nodes, on the surface or along the polylines that hold them, is

    Σ cost(κ_j / κ_max)  +  bounds on edge lengths  +  bounds on angles

with κ_j the curvature of the C2 spline of a rod at joint j, going over and under included, and κ_max the curvature that
its material allows.  The cost is small below 0.9 κ_max, grows with the square beyond and in proportion beyond
1.5 κ_max, so that a place where nothing helps does not hold up all others.  See `bending_terms`.

A Levenberg-Marquardt method: each node has as many unknowns as ways to go, two in the tangent plane of the surface, one
along a polyline, none at corners.  The linear systems are sparse and solved roughly, by preconditioned conjugate
gradients.  A step is taken in space and put back on the exact mesh at the closest point.  A step that lowers the sum is
kept, but for nodes where it would invert a face, or bring an edge or an angle out of its hard bounds.

Compare the relaxed kagome of Ayres, Martin and Zwierzycki 2018 and the foliations of Vekhter et al. 2019.
Complexity: a bounded number of steps, each of time and memory linear in the number of nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Optional

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, cross, dots, inner, rows_of, unit_vectors
from weavecore.linking.arc_length import interpolated_at, points_at
from weavecore.linking.bending_terms import (
    BROKEN_TURN,
    LONGEST,
    SHORTEST,
    Chords,
    FaceCorners,
    RodJoints,
    angle_term,
    bending_cost,
    bending_term,
    chords_of,
    corner_angles,
    corners_of,
    edge_of_sides,
    edge_term,
    find_joints,
    find_stencils,
)
from weavecore.linking.node_placement import CORNER_TURN
from weavecore.linking.normal_equations import NormalEquations, Term
from weavecore.model.lattice import Lattice
from weavecore.model.surface import SurfaceMesh
from weavecore.polling import poll

FREE_ON_SURFACE = ("kagome", "diagonal")
"""Patterns without inner rings: their nodes go anywhere on the surface."""

WEAVE_RISE = {"triangular": 0.0, "twill": 0.25}
"""Undulation of rods over that of a plain weave: none in stacked layers, a quarter in over two, under two."""

_ADMISSIBLE_RADIUS = 93.75
"""Least radius over diameter that is aimed at: that of pultruded GFRP under long-term load."""

_MOST_STEPS = 40
"""Steps of the descent at most; `_ENOUGH` ends most sooner."""

_MOST_TRIES = 6
"""Steps that are tried from one place, each with more damping."""

_LONGEST_STEP = 0.15
"""Part of the mean edge by which a node moves in a step at most: normals and closest points stay near those before."""

_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-2, 1e-5, 1e4
"""Levenberg-Marquardt damping, relative to the diagonal of the Hessian."""

_GOOD, _FAIR = 0.5, 0.1
"""Fall of the sum over that of the quadratic model: above these, damping is divided by 4 or 2; below, it doubles."""

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
    place = _Place(lattice.nodes, lattice.node_station, sites.normals(lattice.nodes))
    problem = _Problem(lattice, sites, diameter, 1.0 / (admissible_radius * diameter))
    # On the surface nodes straighten most turns; what turns then as sharply as to be broken holds up no other.
    for most_turn in (np.pi, BROKEN_TURN) if is_free else (BROKEN_TURN, BROKEN_TURN):
        joints = find_joints(replace(lattice, nodes=place.nodes), most_turn)
        if len(joints.node):
            problem.take(joints)
            place = _descend(problem, place)
    return replace(lattice, nodes=place.nodes, node_station=place.station, off_latitudes=is_free)


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

    def normals(self, nodes: Floats) -> Floats:
        """Unit normals (N, 3) of the surface, blended between its vertices."""
        return self._blend(*self._surface.face_finder.find(nodes))

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
        ahead, behind = (self._on_polylines(slide, station[slide] + step) for step in (probe, -probe))
        return unit_vectors(ahead[0] - behind[0])

    def _on_polylines(self, nodes: Ints, station: Floats) -> tuple[Floats, Floats]:
        polylines, latitude = self._lattice.latitudes.polylines, self._lattice.node_latitude[nodes]
        length = polylines.lengths[latitude]
        station = np.where(polylines.closed[latitude], station % length, np.clip(station, 0.0, length))
        return points_at(polylines, latitude, station), station

    def moved(self, place: _Place, step: Floats) -> _Place:
        """The nodes after a step (unknowns,), none further than `_LONGEST_STEP`."""
        nodes, station, normals = place.nodes.copy(), place.station.copy(), place.normals.copy()
        most = _LONGEST_STEP * self._mean
        slide, roam = np.flatnonzero(self.slides), np.flatnonzero(self.roams)
        along = np.clip(step[self.first[slide]], -most, most)
        nodes[slide], station[slide] = self._on_polylines(slide, station[slide] + along)
        u, v = _tangents(place.normals[roam])
        way = u * step[self.first[roam], None] + v * step[self.first[roam] + 1, None]
        way *= np.minimum(1.0, most / np.maximum(np.linalg.norm(way, axis=1, keepdims=True), np.finfo(float).tiny))
        face, nodes[roam] = self._surface.face_finder.find(nodes[roam] + way)
        normals[roam] = self._blend(face, nodes[roam])
        # Segments of polylines lie within faces, where the normals are blended as they are along the segments.
        polylines, latitude = self._lattice.latitudes.polylines, self._lattice.node_latitude[slide]
        normals[slide] = unit_vectors(interpolated_at(polylines, self._polyline_normals, latitude, station[slide]))
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
    turn[on] = np.arctan2(np.linalg.norm(cross(one, other), axis=1), (one * other).sum(1))
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


class _Problem:
    """The sum of all terms over the places of the nodes."""

    def __init__(self, lattice: Lattice, sites: _Sites, diameter: float, admissible: float) -> None:
        self.sites, self.edges = sites, lattice.edges
        self.face_nodes, self.face_offsets = lattice.face_nodes, lattice.face_offsets
        self._corners = corners_of(lattice)
        self._rise = diameter * WEAVE_RISE.get(lattice.pattern, 1.0)
        self._admissible = admissible
        length = lattice.edge_lengths
        self.median = np.full(lattice.n_edges, float(np.median(length)))
        self._shortest, self._longest = (np.full(lattice.n_edges, bound) for bound in (SHORTEST, LONGEST))
        self.mean = float(length.mean())

    def take(self, joints: RodJoints) -> None:
        """Take the joints whose bending counts, and set up the equations for them."""
        self._joints, self._stencils = joints, find_stencils(joints)
        stencils = [self._stencils.nodes, self.edges, self._corners.stencils]
        self.equations = NormalEquations(stencils, np.diff(self.sites.first))

    @property
    def corners(self) -> FaceCorners:
        return self._corners

    def terms(self, place: _Place) -> list[Term]:
        poll()
        chords = chords_of(self.edges, place.nodes)
        bending = bending_term(
            self._joints,
            self._stencils,
            place.normals,
            chords,
            rise=self._rise,
            admissible=self._admissible,
        )
        return [bending, *self._bounds(chords, place)]

    def _bounds(self, chords: Chords, place: _Place) -> list[Term]:
        return [
            edge_term(chords, self.median, self._shortest, self._longest, len(place.nodes)),
            angle_term(self._corners, place.nodes, place.normals),
        ]

    def value(self, place: _Place) -> float:
        poll()
        chords = chords_of(self.edges, place.nodes)
        bending = bending_cost(self._joints, place.normals, chords, rise=self._rise, admissible=self._admissible)
        return bending + sum(term.value for term in self._bounds(chords, place))


def _descend(problem: _Problem, place: _Place) -> _Place:
    """Take steps of Levenberg and Marquardt until the sum hardly falls."""
    value, damping = problem.value(place), _FIRST_DAMPING
    equations = problem.equations
    for _ in range(_MOST_STEPS):
        poll()
        hessian, gradient = equations.assemble(problem.terms(place), problem.sites.directions(place))
        for _try in range(_MOST_TRIES):
            poll()
            step = equations.solve(hessian, damping / problem.mean**2, -gradient)
            promised = -(inner(gradient, step) + inner(step, hessian @ step) / 2.0)
            after = _without_harm(problem, place, problem.sites.moved(place, step))
            new = problem.value(after)
            if new < value:
                break
            damping = min(damping * 8.0, _MOST_DAMPING)
        else:
            return place
        fell, place, value = value - new, after, new
        easing = 4.0 if fell > _GOOD * promised else 2.0 if fell > _FAIR * promised else 0.5
        damping = max(damping / easing, _LEAST_DAMPING)
        if fell < _ENOUGH * value:
            break
    return place


def _without_harm(problem: _Problem, before: _Place, after: _Place) -> _Place:
    """The places after a step, with nodes left where they were at faces and edges that it would spoil."""
    corners = problem.corners
    face = rows_of(problem.face_offsets)
    old_angle = corner_angles(corners, before.nodes, before.normals)
    old_length = np.linalg.norm(np.diff(before.nodes[problem.edges], axis=1)[:, 0], axis=1)
    low, high = (
        np.minimum(_LEAST_EDGE * problem.median, old_length),
        np.maximum(_MOST_EDGE * problem.median, old_length),
    )
    nodes, station, normals = after.nodes.copy(), after.station.copy(), after.normals.copy()
    moved = (nodes != before.nodes).any(1)
    while True:
        angle = corner_angles(corners, nodes, normals)
        is_bad = angle < np.minimum(_LEAST_ANGLE, old_angle)
        bad_faces = np.zeros(len(problem.face_offsets) - 1, bool)
        bad_faces[face[is_bad]] = True
        length = np.linalg.norm(np.diff(nodes[problem.edges], axis=1)[:, 0], axis=1)
        bad_edges = (length < low * (1 - 1e-12)) | (length > high * (1 + 1e-12))
        harmful = np.zeros(len(nodes), bool)
        harmful[corners.node[bad_faces[face]]] = True
        harmful[problem.edges[bad_edges]] = True
        harmful &= moved
        if not harmful.any():
            return _Place(nodes, station, normals)
        nodes[harmful], station[harmful] = before.nodes[harmful], before.station[harmful]
        normals[harmful] = before.normals[harmful]
        moved &= ~harmful
