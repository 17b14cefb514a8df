"""Selvedges: the stretches of border from one end of an open polyline to the next.

A selvedge is the side edge of a cloth, where the weft turns.  No distance starts from it; the lattice keeps
it as a part of its border, with nodes of its own where it is long.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends
from weavecore.linking.resample import FEWEST_NODES, divide_border, divide_path
from weavecore.linking.strips import Rings
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh

NONE = -1
_ON_CHORD = 1e-6
"""Of the height of a selvedge over its chord: nodes no higher are ends of the chord."""

STRAIGHT = 1e-6
"""Of a chord: a line that rises no higher over it needs no more nodes."""

End = tuple[int, int]
"""A polyline, and 0 for its beginning or 1 for its end."""


@dataclass(frozen=True, eq=False)
class Selvedge:
    """One stretch of border, run with the surface on its left.

    Parameters
    ----------
    points : (n, 3) float64
        Where it begins, the vertices along it, and where it ends; of a closed one its vertices alone.
    halfedge : (n,) int64
        The halfedge of the surface's mesh on which the segment from each point lies; the last of an open one is none.
    part : (n,) float64
        Where on it the segment begins, 0 to 1.
    stations : (n,) float64
    length : float
    first, last : End, optional
        The ends of polylines between which it lies; none of a closed one.
    """

    points: Floats
    halfedge: Ints
    part: Floats
    stations: Floats
    length: float
    first: Optional[End]
    last: Optional[End]

    @property
    def closed(self) -> bool:
        """Whether it is a whole border that no polyline ends on."""
        return self.first is None


def find_selvedges(latitudes: Latitudes) -> list[Selvedge]:
    """All selvedges of a surface, loop after loop."""
    surface = latitudes.surface
    if not surface.is_selvedge.any():
        return []
    along = _border_halfedges(surface)
    loop, place, who = _ends_on_borders(latitudes, along)
    found: list[Selvedge] = []
    for k, halfedges in enumerate(along):
        here = np.flatnonzero(loop == k)
        here = here[np.argsort(place[here], kind="stable")]
        if len(here) == 0:
            if surface.is_selvedge[halfedges].all():
                found.append(_whole(surface, halfedges))
            continue
        for one, other in zip(here, np.roll(here, -1)):
            if surface.is_selvedge[halfedges[int(place[one])]]:
                ends = ((int(who[one, 0]), int(who[one, 1])), (int(who[other, 0]), int(who[other, 1])))
                found.append(_between(surface, halfedges, float(place[one]), float(place[other]), ends))
    return found


def _border_halfedges(surface: SurfaceMesh) -> list[Ints]:
    """The halfedges of every border, in its order."""
    border = np.flatnonzero(surface.twins == NO_TWIN)
    at = np.full(surface.n_vertices, NONE, np.int64)
    at[halfedge_ends(surface.faces)[0][border]] = border
    return [at[loop] for loop in surface.borders]


def _ends_on_borders(latitudes: Latitudes, along: list[Ints]) -> tuple[Ints, Floats, Ints]:
    """For every end of an open polyline on a border: the border, its place in edges of that, and (polyline, end)."""
    surface, polylines = latitudes.surface, latitudes.polylines
    rank, of = np.full(3 * surface.n_faces, NONE, np.int64), np.full(3 * surface.n_faces, NONE, np.int64)
    for k, halfedges in enumerate(along):
        rank[halfedges], of[halfedges] = np.arange(len(halfedges)), k
    leaving = np.full(surface.n_vertices, NONE, np.int64)
    leaving[halfedge_ends(surface.faces)[0][np.concatenate(along)]] = np.concatenate(along)
    open_ = np.flatnonzero(~polylines.closed)
    who = np.stack([np.repeat(open_, 2), np.tile([0, 1], len(open_))], axis=1)
    point = np.stack([polylines.offsets[open_], polylines.offsets[open_ + 1] - 1], axis=1).ravel()
    face, weights = polylines.face[point], polylines.barycentric[point]
    row, apex = np.arange(len(point)), weights.argmin(1)
    halfedge = 3 * face + (apex + 1) % 3
    part = weights[row, (apex + 2) % 3]
    at_vertex = latitudes.generation[who[:, 0]] == 0
    vertex = surface.faces[face, weights.argmax(1)]
    halfedge = np.where(at_vertex, leaving[vertex], halfedge)
    part = np.where(at_vertex, 0.0, part)
    on_border = (halfedge != NONE) & (of[halfedge] != NONE)
    return of[halfedge][on_border], (rank[halfedge] + part)[on_border], who[on_border]


def _whole(surface: SurfaceMesh, halfedges: Ints) -> Selvedge:
    points = surface.vertices[halfedge_ends(surface.faces)[0][halfedges]]
    step = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    stations = np.cumsum(step) - step
    return Selvedge(points, halfedges, np.zeros(len(points)), stations, float(step.sum()), None, None)


def _between(surface: SurfaceMesh, halfedges: Ints, start: float, end: float, ends: tuple[End, End]) -> Selvedge:
    """The stretch of a border between two places, told in edges from its first vertex."""
    n = len(halfedges)
    end = end if end > start else end + n
    inner = np.arange(int(np.floor(start)) + 1, int(np.ceil(end)))
    place = np.concatenate([[start], inner, [end]])
    at = np.minimum(np.floor(place), np.ceil(end) - 1).astype(np.int64) % n
    part = place - np.minimum(np.floor(place), np.ceil(end) - 1)
    tail, head = (ends_[halfedges[at]] for ends_ in halfedge_ends(surface.faces))
    points = surface.vertices[tail] * (1.0 - part)[:, None] + surface.vertices[head] * part[:, None]
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    stations = np.concatenate([[0.0], np.cumsum(step)])
    halfedge = halfedges[at]
    halfedge[-1] = NONE
    return Selvedge(points, halfedge, part, stations, float(stations[-1]), *ends)


@dataclass(frozen=True, eq=False)
class Hem:
    """The selvedges of a surface with their nodes.

    Parameters
    ----------
    selvedges : list of Selvedge
    stations : list of (k,) float64
        Stations of the nodes of each; of an open one the first and the last are ends of polylines.
    nodes : list of (k,) int64
        Numbers of these nodes.
    places : (m, 3) float64
        Where the nodes are that are on no polyline, numbered on from those that are.
    """

    selvedges: list[Selvedge]
    stations: list[Floats]
    nodes: list[Ints]
    places: Floats

    def edges(self) -> Ints:
        """(e, 2) the edges along the selvedges, the lesser node first."""
        rows = [np.zeros((0, 2), np.int64)]
        for selvedge, nodes in zip(self.selvedges, self.nodes):
            after = np.roll(nodes, -1)
            rows.append(np.c_[nodes, after] if selvedge.closed else np.c_[nodes, after][:-1])
        edges: Ints = np.sort(np.concatenate(rows), axis=1)
        return edges


def number_hem(selvedges: list[Selvedge], stations: list[Floats], n_nodes: Ints) -> Hem:
    """Number the nodes of the selvedges, and place them.

    Parameters
    ----------
    stations : list of (k,) float64
    n_nodes : (P,) int64
        Number of nodes of each polyline.
    """
    first = offsets_of(n_nodes)
    count = int(first[-1])
    nodes, places = [], [np.zeros((0, 3))]
    for selvedge, at in zip(selvedges, stations):
        inner = at if selvedge.closed else at[1:-1]
        own = count + np.arange(len(inner))
        count += len(inner)
        ends = [
            np.zeros(0, np.int64) if end is None else np.array([first[end[0] + end[1]] - end[1]])
            for end in (selvedge.first, selvedge.last)
        ]
        nodes.append(np.concatenate([ends[0], own, ends[1]]))
        places.append(points_on(selvedge, inner))
    return Hem(selvedges, stations, nodes, np.concatenate(places))


def points_on(selvedge: Selvedge, stations: Floats) -> Floats:
    """Points (k, 3) at stations along a selvedge."""
    known = np.append(selvedge.stations, selvedge.length) if selvedge.closed else selvedge.stations
    points = np.concatenate([selvedge.points, selvedge.points[:1]]) if selvedge.closed else selvedge.points
    return np.stack([np.interp(stations, known, points[:, k]) for k in range(3)], axis=1)


def divide_selvedges(selvedges: list[Selvedge], edge_length: float) -> list[Floats]:
    """Stations of the nodes of each selvedge, those of its ends among them."""
    ends = {(selvedge.first, selvedge.last) for selvedge in selvedges}
    divided = []
    for selvedge in selvedges:
        count = int(np.rint(selvedge.length / edge_length))
        if selvedge.first is None or selvedge.last is None:
            stations = divide_border(selvedge.points, selvedge.stations, selvedge.length, max(count, FEWEST_NODES))
        else:
            fewest = _fewest_edges(selvedge.first, selvedge.last, is_half=(selvedge.last, selvedge.first) in ends)
            stations = divide_path(selvedge.points, selvedge.stations, selvedge.length, max(count, fewest))
        divided.append(stations)
    return divided


def _fewest_edges(first: End, last: End, *, is_half: bool) -> int:
    """A border keeps three nodes, and what a tongue cuts off a corner; ``is_half``: of a border with two ends."""
    if first == last:
        return FEWEST_NODES
    return 2 if is_half or _is_tongue(first, last) else 1


def _is_tongue(first: End, last: End) -> bool:
    """Whether a stretch lies on the left of the one polyline around it; on the right it is but a gap in a ring."""
    return first == (last[0], 1) and last[1] == 0


def find_tongues(latitudes: Latitudes, selvedges: list[Selvedge]) -> Bools:
    """(P,) polylines beyond which nothing but a stretch of border follows."""
    is_tongue = np.zeros(len(latitudes), bool)
    for selvedge in selvedges:
        if selvedge.first is not None and selvedge.last is not None and _is_tongue(selvedge.first, selvedge.last):
            is_tongue[selvedge.first[0]] = True
    return is_tongue


def give_way(selvedge: Selvedge, stations: Floats, nodes: cKDTree) -> Floats:
    """The stations, and one more wherever a node of a polyline lies between a selvedge and its chord.

    Parameters
    ----------
    stations : (k,) float64
        Of the selvedge's nodes.
    nodes : cKDTree
        Of the nodes of all polylines.
    """
    if selvedge.closed:
        chord = np.searchsorted(stations, selvedge.stations, side="right") - 1
        start, end = points_on(selvedge, stations)[chord], points_on(selvedge, np.roll(stations, -1))[chord]
    else:
        chord = np.clip(np.searchsorted(stations, selvedge.stations, side="right") - 1, 0, len(stations) - 2)
        places = points_on(selvedge, stations)
        start, end = places[chord], places[chord + 1]
    along = end - start
    chord_square = np.maximum((along * along).sum(1), np.finfo(float).tiny)
    part = np.clip(((selvedge.points - start) * along).sum(1) / chord_square, 0.0, 1.0)
    foot = start + part[:, None] * along
    off = selvedge.points - foot
    square = (off * off).sum(1)
    nearest, which = (np.asarray(found) for found in nodes.query(selvedge.points))
    height = ((nodes.data[which] - foot) * off).sum(1)
    # Ends of the chord are nodes themselves, and lie on it; others may lie beyond the selvedge, on another part.
    is_crossed = (nearest**2 < square) & (height > _ON_CHORD * square) & (height < square)
    crossed = np.flatnonzero(is_crossed & (square > STRAIGHT**2 * chord_square))
    crossed = crossed[np.lexsort((nearest[crossed], chord[crossed]))]
    _, first = np.unique(chord[crossed], return_index=True)
    return np.sort(np.concatenate([stations, selvedge.stations[crossed[first]]]))


def plain_strips(latitudes: Latitudes, selvedges: list[Selvedge], stations: list[Floats]) -> Bools:
    """(B,) bands between one open parent and one open child, whose selvedges have no nodes of their own."""
    bands, closed = latitudes.bands, latitudes.polylines.closed
    side = bands.offsets[:-1]
    two = np.diff(bands.offsets) == 2
    second = np.minimum(side + 1, len(bands.polyline) - 1)
    strip = two & (bands.euler == 1) & bands.is_parent[side] & ~bands.is_parent[second]
    strip &= ~closed[bands.polyline[side]] & ~closed[bands.polyline[second]]
    band_of = {
        (int(p), bool(left)): b
        for b in range(len(bands))
        for p, left in zip(
            bands.polyline[bands.offsets[b] : bands.offsets[b + 1]],
            bands.is_left[bands.offsets[b] : bands.offsets[b + 1]],
        )
    }
    for selvedge, at in zip(selvedges, stations):
        if selvedge.first is not None and len(at) > 2:
            # Beyond the end of a polyline lies its left side, beyond its beginning its right one.
            strip[band_of[selvedge.first[0], selvedge.first[1] == 1]] = False
    return np.asarray(strip)


# ----------------------------------------------------------------------
# More nodes where faces of the lattice look against the surface at selvedges.
#
# A border from which no distance starts may be far smaller than an edge, nearly touch another, or have a corner right
# beside a polyline.  The nodes are then too few for the shape: a chord leaves the surface, and faces beyond it are
# turned over.


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
