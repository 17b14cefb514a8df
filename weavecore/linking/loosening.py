"""More nodes where faces of the lattice look against the surface at selvedges.

A border from which no distance starts may be far smaller than an edge, nearly touch another, or have a corner right
beside a polyline.  The nodes are then too few for the shape: a chord leaves the surface, and faces beyond it are
turned over.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.linking.rings import Rings
from weavecore.linking.selvedges import STRAIGHT, Hem, number_hem
from weavecore.model.polylines import Polylines


class _Line(NamedTuple):
    """Points (n, 3) of a polyline or a selvedge, their stations (n,), its length, and whether it is closed."""

    points: Floats
    stations: Floats
    length: float
    closed: bool


def loosen(polylines: Polylines, rings: Rings, hem: Hem, fallen: Ints) -> tuple[Rings, Hem]:
    """Polylines and selvedges with one more node on each edge that a fallen face lies on.

    The new one is the point of the line that is farthest from the edge; an edge that the line follows gets none.

    Parameters
    ----------
    polylines : Polylines
    rings : Rings
    hem : Hem
    fallen : (k, 3) int64
        Nodes of the faces that look against the surface.
    """
    sides = np.sort(np.concatenate([fallen[:, [0, 1]], fallen[:, [1, 2]], fallen[:, [2, 0]]]), axis=1)
    first = offsets_of(rings.counts)
    stations = [
        _with_more(_line_of(polylines, p), own, first[p] + np.arange(len(own)), sides)
        for p, own in enumerate(rings.nodes)
    ]
    loose = rings.with_nodes(stations)
    turns = [
        _with_more(_Line(selvedge.points, selvedge.stations, selvedge.length, selvedge.closed), own, nodes, sides)
        for selvedge, own, nodes in zip(hem.selvedges, hem.stations, hem.nodes)
    ]
    return loose, number_hem(hem.selvedges, turns, loose.counts)


def _line_of(polylines: Polylines, p: int) -> _Line:
    part = slice(polylines.offsets[p], polylines.offsets[p + 1])
    closed = bool(polylines.closed[p])
    return _Line(polylines.points[part], polylines.stations[part], float(polylines.lengths[p]), closed)


def _with_more(line: _Line, stations: Floats, nodes: Ints, sides: Ints) -> Floats:
    """The stations, rising, and one more on each edge between two nodes that is one of the sides."""
    after = np.append(nodes, nodes[0]) if line.closed else nodes
    ends = np.append(stations, stations[0] + line.length) if line.closed else stations
    chosen = np.flatnonzero(_are_among(np.sort(np.stack([after[:-1], after[1:]], axis=1), axis=1), sides))
    more = [_farthest_off(line, float(ends[k]), float(ends[k + 1])) for k in chosen.tolist()]
    return np.unique(np.concatenate([stations, *more]))


def _are_among(edges: Ints, sides: Ints) -> Bools:
    n = max(int(edges.max(initial=0)), int(sides.max(initial=0))) + 1
    return np.asarray(np.isin(edges[:, 0] * n + edges[:, 1], sides[:, 0] * n + sides[:, 1]))


def _farthest_off(line: _Line, start: float, end: float) -> Floats:
    """The station of the point between two stations that is farthest from their chord; none where none is off it."""
    known = np.concatenate([line.stations, line.stations + line.length, [2 * line.length]])
    points = np.concatenate([line.points, line.points, line.points[:1]])
    if not line.closed:
        known, points = line.stations, line.points
    ends = np.stack([np.interp([start, end], known, points[:, k]) for k in range(3)], axis=1)
    inner = np.flatnonzero((known > start) & (known < end))
    chord = float(np.linalg.norm(ends[1] - ends[0]))
    along = (ends[1] - ends[0]) / max(chord, np.finfo(float).tiny)
    arm = points[inner] - ends[0]
    off = np.linalg.norm(arm - (arm @ along)[:, None] * along, axis=1)
    if off.max(initial=0.0) <= STRAIGHT * chord:
        return np.zeros(0)
    return np.array([known[inner[off.argmax()]] % line.length])
