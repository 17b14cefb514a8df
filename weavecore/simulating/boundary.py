"""Supports and loads: which nodes are held, and the forces on the points of the rods.

A support holds all rods at a node in place; they may turn.  Loads keep their direction as the weave moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
from scipy.spatial import cKDTree

from weavecore.errors import Unsupported
from weavecore.geometry.arrays import Bools, Floats, next_in_loop, rows_of
from weavecore.model import Weave
from weavecore.simulating.discretise import RodPoints
from weavecore.units import with_unit

NONE, BORDERS = "none", "borders"
Supports = Union[str, Sequence[Any]]

_GRAVITY = 9.80665
_REACH = 0.75
"""A node is held by a curve that passes within this part of the median edge: nodes on a row of edges lie within half of
one, and the next row of a triangular lattice is 0.87 away."""


_SAME_PLACE = 1e-6
"""A support point this part of the median edge from its node lies on it."""


@dataclass(frozen=True)
class Loads:
    """Loads on a weave.

    Parameters
    ----------
    gravity : (3,) sequence of float or None
        Direction of the rods' weight; none where it is left out.
    pressure : float
        In Pa, on the surface from outside, against its normal as drawn.
    forces : sequence of ((3,), (3,))
        Places, in the model's unit, and the forces in N on the nodes nearest to them.
    """

    gravity: Any = None
    pressure: float = 0.0
    forces: Sequence[tuple[Any, Any]] = ()

    def __str__(self) -> str:
        parts = ["self-weight"] if self.gravity is not None else []
        parts += [f"pressure {self.pressure:g} Pa"] if self.pressure else []
        parts += [f"{len(self.forces)} forces"] if len(self.forces) else []
        return ", ".join(parts) or NONE


def supported_nodes(weave: Weave, supports: Supports) -> Bools:
    """(N,) which nodes are held.

    Parameters
    ----------
    weave : Weave
    supports : str or sequence of (n, 3) array_like
        ``"none"``, ``"borders"``, or points and polylines: a single point holds the nearest node, a polyline all nodes
        that it passes.

    Raises
    ------
    Unsupported
    """
    held = np.zeros(weave.lattice.n_nodes, np.bool_)
    if isinstance(supports, str):
        if supports not in (NONE, BORDERS):
            raise Unsupported(
                f"There are no supports {supports!r}",
                remedy=f"Use {NONE!r}, {BORDERS!r}, or a list of points and polylines.",
            )
        held[:] = weave.is_border_node if supports == BORDERS else False
        return held
    nodes = weave.lattice.nodes
    reach = _REACH * float(np.median(weave.lattice.edge_lengths))
    for one in supports:
        line = np.asarray(one, np.float64).reshape(-1, 3)
        if not np.isfinite(line).all() or len(line) == 0:
            raise Unsupported("A support is not a point or polyline", remedy="Give rows of three finite numbers.")
        if len(line) == 1:
            held[cKDTree(nodes).query(line[0])[1]] = True
        else:
            near = np.asarray(cKDTree(_sampled(line, reach / 8)).query(nodes)[0]) <= reach
            if not near.any():
                raise Unsupported("A support curve passes no node", remedy="Draw it on the surface that is woven.")
            held |= near
    if not held.any():
        raise Unsupported("The list of supports is empty", remedy=f"Give points, polylines, or {NONE!r}.")
    return held


def describe_supports(weave: Weave, supports: Supports, held: Bools) -> str:
    """What was asked for in words; for points also how far they lie from the nodes that they hold."""
    if isinstance(supports, str):
        return supports
    points = [np.asarray(one, np.float64).reshape(-1, 3) for one in supports]
    single = [point for point in points if len(point) == 1]
    count = f"{int(held.sum())} nodes"
    if not single:
        return count
    distance = float(np.max(cKDTree(weave.lattice.nodes).query(np.concatenate(single))[0]))
    if distance <= _SAME_PLACE * float(np.median(weave.lattice.edge_lengths)):
        return count
    away = with_unit(distance, weave.lattice.latitudes.surface.unit, digits=3)
    return f"{count}, the support points at most {away} away"


def load_forces(weave: Weave, rods: RodPoints, loads: Loads, *, diameter: Floats, metres: float) -> Floats:
    """(n, 3) forces in N on the points of the rods; the diameters (n,) are in metres, `metres` in one unit."""
    forces = np.zeros((len(rods.points), 3))
    if loads.gravity is not None:
        direction = np.asarray(loads.gravity, np.float64)
        size = np.linalg.norm(direction)
        if direction.shape != (3,) or not 0 < size < np.inf:
            raise Unsupported(f"Gravity has no direction {loads.gravity!r}", remedy="Give three numbers, not all 0.")
        mass = weave.material.density * np.pi * diameter**2 / 4 * rods.widths
        forces += _GRAVITY * mass[:, None] * direction / size
    on_nodes = -loads.pressure * node_areas(weave) * metres**2
    for place, force in loads.forces:
        nearest = int(cKDTree(weave.lattice.nodes).query(np.asarray(place, np.float64))[1])
        on_nodes[nearest] += np.asarray(force, np.float64)
    nodes = weave.strands.nodes
    share = on_nodes / np.maximum(np.bincount(nodes, minlength=len(on_nodes)), 1)[:, None]
    forces[rods.of_visit] += share[nodes]
    return forces


def loads_on_nodes(weave: Weave, rods: RodPoints, forces: Floats) -> Floats:
    """(N, 3) forces (n, 3) on the points of the rods, each shared by the two nodes that it lies between."""
    strands = weave.strands
    index = np.arange(len(rods.points))
    before = np.searchsorted(rods.of_visit, index, side="right") - 1
    after = np.where(index == rods.of_visit[before], before, next_in_loop(strands.offsets)[before])
    wrapped = np.where(rods.of_visit[after] < index, rods.offsets[rods.rod + 1], rods.of_visit[after])
    part = (index - rods.of_visit[before]) / np.maximum(wrapped - rods.of_visit[before], 1)
    n = weave.lattice.n_nodes
    nodes = np.concatenate([strands.nodes[before], strands.nodes[after]])
    shares = np.concatenate([(1 - part)[:, None] * forces, part[:, None] * forces])
    return np.stack([np.bincount(nodes, shares[:, d], n) for d in range(3)], axis=1)


def node_areas(weave: Weave) -> Floats:
    """(N, 3) area vectors of the nodes: each face's, out of the surface, in equal parts to its corners."""
    lattice = weave.lattice
    face = rows_of(lattice.face_offsets)
    corner, after = (
        lattice.nodes[n] for n in (lattice.face_nodes, lattice.face_nodes[next_in_loop(lattice.face_offsets)])
    )
    origin = corner[lattice.face_offsets[:-1]][face]
    area = np.add.reduceat(np.cross(corner - origin, after - origin) / 2, lattice.face_offsets[:-1], axis=0)
    part = (area / np.diff(lattice.face_offsets)[:, None])[face]
    areas = [np.bincount(lattice.face_nodes, part[:, d], lattice.n_nodes) for d in range(3)]
    return np.stack(areas, axis=1)


def three_point_gauge(points: Floats) -> Bools:
    """(n, 3) six coordinates whose hold stops rigid motion and nothing else, so that it takes no force."""
    fixed = np.zeros(points.shape, bool)
    a = int(np.argmax(np.linalg.norm(points - points.mean(0), axis=1)))
    b = int(np.argmax(np.linalg.norm(points - points[a], axis=1)))
    normals = np.cross(points[b] - points[a], points - points[a])
    c = int(np.argmax(np.linalg.norm(normals, axis=1)))
    fixed[a] = True
    fixed[b] = True
    fixed[b, int(np.argmax(np.abs(points[b] - points[a])))] = False
    fixed[c, int(np.argmax(np.abs(normals[c])))] = True
    return fixed


def _sampled(line: Floats, step: float) -> Floats:
    """Points along a polyline, no further apart than a step."""
    pieces = np.maximum(np.ceil(np.linalg.norm(np.diff(line, axis=0), axis=1) / step), 1).astype(np.int64)
    row = np.repeat(np.arange(len(pieces)), pieces)
    part = (np.arange(len(row)) - np.repeat(np.cumsum(pieces) - pieces, pieces)) / pieces[row]
    points: Floats = np.concatenate([line[:-1][row] + part[:, None] * np.diff(line, axis=0)[row], line[-1:]])
    return points
