"""Free borders: the stretches of border from which no distance starts, divided and numbered.

Open polylines end on them:

           o────────── polyline g+1 ──────────o
           |                                  |
    free   |  ← these two stretches, each     |  free        A stretch runs with the surface on its left, from the
    border |    from the end of one polyline  |  border      end of one polyline to the end of the next.
           |    to the end of the next        |
           o────────── polyline g ────────────o

A stretch keeps its corners and, where it is longer than an edge, gets nodes of its own.  A border that no polyline
ends on is one closed stretch.  A *border cap* is a band between one open polyline and one stretch of border.

*Boundary refinement.*  A free border may be far smaller than an edge, nearly touch another, or have a corner right
beside a polyline.  The nodes are then too few for the shape: a chord leaves the surface, and faces beyond it are
inverted.  Every edge of a polyline or border at an inverted face then gets the point farthest from it as a node.

Time is linear in the number of border edges, but for the sorting of the ends on each border.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Optional

import numpy as np
from scipy.spatial import cKDTree

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of
from weavecore.geometry.halfedges import NO_TWIN, halfedge_ends
from weavecore.linking.node_counts import FEWEST_NODES
from weavecore.linking.node_placement import divide_closed_border, divide_open_border
from weavecore.linking.ring_to_parent import DividedPolylines
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh

NONE = -1
_ON_CHORD = 1e-6
"""Part of the height of a border over its chord: nodes no higher than this are the ends of the
chord, but for rounding."""
_STRAIGHT = 1e-6
"""Part of a chord: a border that rises no higher over it is straight, but for rounding, and needs no more nodes."""


class PolylineEnd(NamedTuple):
    """The beginning or the end of an open polyline.

    Parameters
    ----------
    polyline : int
    is_last : int
        0 for its first point, 1 for its last.
    """

    polyline: int
    is_last: int

    def element(self, offsets: Ints) -> int:
        """Index of this end among the elements (points, nodes) of all polylines.

        Parameters
        ----------
        offsets : (P+1,) int64
            Where the elements of each polyline begin.
        """
        return int(offsets[self.polyline + 1]) - 1 if self.is_last else int(offsets[self.polyline])


@dataclass(frozen=True, eq=False)
class FreeBorder:
    """One stretch of border from which no distance starts; it runs with the surface on its left.

    Parameters
    ----------
    points : (n, 3) float64
        Its beginning, the vertices along it, and its end; of a closed one its vertices alone.
    halfedge : (n,) int64
        The halfedge of the surface's mesh on which the segment from each point lies; -1 at the end of an open one.
    part : (n,) float64
        Where on that halfedge the segment begins, 0 to 1.
    stations : (n,) float64
        Arc length of each point.
    length : float
    first, last : PolylineEnd, optional
        The ends of polylines between which it lies; None of a closed one.
    """

    points: Floats
    halfedge: Ints
    part: Floats
    stations: Floats
    length: float
    first: Optional[PolylineEnd]
    last: Optional[PolylineEnd]

    @property
    def closed(self) -> bool:
        """Whether it is a whole border that no polyline ends on."""
        return self.first is None


def find_free_borders(latitudes: Latitudes) -> list[FreeBorder]:
    """All free borders of a surface, loop after loop.

    Parameters
    ----------
    latitudes : Latitudes
    """
    surface = latitudes.surface
    if not surface.is_free_border.any():
        return []
    loops = _border_halfedges(surface)
    loop, place, ends = _ends_on_borders(latitudes, loops)
    found: list[FreeBorder] = []
    for k, halfedges in enumerate(loops):
        here = np.flatnonzero(loop == k)
        here = here[np.argsort(place[here], kind="stable")]
        if len(here) == 0:
            if surface.is_free_border[halfedges].all():
                found.append(_whole_border(surface, halfedges))
            continue
        for one, other in zip(here, np.roll(here, -1)):
            if surface.is_free_border[halfedges[int(place[one])]]:
                between = float(place[one]), float(place[other])
                found.append(_stretch(surface, halfedges, between, (ends[one], ends[other])))
    return found


def _border_halfedges(surface: SurfaceMesh) -> list[Ints]:
    """The halfedges of every border, in its order."""
    border = np.flatnonzero(surface.twins == NO_TWIN)
    at = np.full(surface.n_vertices, NONE, np.int64)
    at[halfedge_ends(surface.faces)[0][border]] = border
    return [at[loop] for loop in surface.borders]


def _ends_on_borders(latitudes: Latitudes, loops: list[Ints]) -> tuple[Ints, Floats, list[PolylineEnd]]:
    """For every end of an open polyline on a border: the border, its place in edges of that, and the end."""
    surface, polylines = latitudes.surface, latitudes.polylines
    rank, loop_of = np.full(3 * surface.n_faces, NONE, np.int64), np.full(3 * surface.n_faces, NONE, np.int64)
    for k, halfedges in enumerate(loops):
        rank[halfedges], loop_of[halfedges] = np.arange(len(halfedges)), k
    outgoing = np.full(surface.n_vertices, NONE, np.int64)
    outgoing[halfedge_ends(surface.faces)[0][np.concatenate(loops)]] = np.concatenate(loops)
    ends = [PolylineEnd(p, is_last) for p in np.flatnonzero(~polylines.closed).tolist() for is_last in (0, 1)]
    point = np.array([end.element(polylines.offsets) for end in ends], np.int64)
    face, weights = polylines.face[point], polylines.barycentric[point]
    row, apex = np.arange(len(point)), weights.argmin(1)
    halfedge = 3 * face + (apex + 1) % 3
    part = weights[row, (apex + 2) % 3]
    at_vertex = latitudes.generation[[end.polyline for end in ends]] == 0
    vertex = surface.faces[face, weights.argmax(1)]
    halfedge = np.where(at_vertex, outgoing[vertex], halfedge)
    part = np.where(at_vertex, 0.0, part)
    on_border = np.flatnonzero((halfedge != NONE) & (loop_of[halfedge] != NONE))
    place = (rank[halfedge] + part)[on_border]
    return loop_of[halfedge][on_border], place, [ends[k] for k in on_border.tolist()]


def _whole_border(surface: SurfaceMesh, halfedges: Ints) -> FreeBorder:
    points = surface.vertices[halfedge_ends(surface.faces)[0][halfedges]]
    step = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    stations = np.cumsum(step) - step
    return FreeBorder(points, halfedges, np.zeros(len(points)), stations, float(step.sum()), None, None)


def _stretch(
    surface: SurfaceMesh, halfedges: Ints, between: tuple[float, float], ends: tuple[PolylineEnd, PolylineEnd]
) -> FreeBorder:
    """The stretch of a border between two places, which are counted in edges from its first vertex."""
    n = len(halfedges)
    start, end = between[0], between[1] if between[1] > between[0] else between[1] + n
    inner = np.arange(int(np.floor(start)) + 1, int(np.ceil(end)))
    place = np.concatenate([[start], inner, [end]])
    edge = np.minimum(np.floor(place), np.ceil(end) - 1)
    at, part = edge.astype(np.int64) % n, place - edge
    tail, head = (ends_[halfedges[at]] for ends_ in halfedge_ends(surface.faces))
    points = surface.vertices[tail] * (1.0 - part)[:, None] + surface.vertices[head] * part[:, None]
    step = np.linalg.norm(np.diff(points, axis=0), axis=1)
    stations = np.concatenate([[0.0], np.cumsum(step)])
    halfedge = halfedges[at]
    halfedge[-1] = NONE
    return FreeBorder(points, halfedge, part, stations, float(stations[-1]), *ends)


@dataclass(frozen=True, eq=False)
class FreeBorderNodes:
    """The free borders of a surface with their nodes.

    Parameters
    ----------
    borders : list of FreeBorder
    stations : list of (k,) float64
        Stations of the nodes of each; of an open one the first and the last are ends of polylines.
    nodes : list of (k,) int64
        Numbers of these nodes.
    points : (m, 3) float64
        The nodes that are on no polyline; their numbers follow those of the polylines' nodes.
    """

    borders: list[FreeBorder]
    stations: list[Floats]
    nodes: list[Ints]
    points: Floats

    def edges(self) -> Ints:
        """(e, 2) the edges along the free borders, the lesser node first."""
        rows = [np.zeros((0, 2), np.int64)]
        for border, nodes in zip(self.borders, self.nodes):
            after = np.roll(nodes, -1)
            rows.append(np.c_[nodes, after] if border.closed else np.c_[nodes, after][:-1])
        edges: Ints = np.sort(np.concatenate(rows), axis=1)
        return edges


def number_border_nodes(borders: list[FreeBorder], stations: list[Floats], counts: Ints) -> FreeBorderNodes:
    """Number the nodes of the free borders and compute their points.

    Parameters
    ----------
    borders : list of FreeBorder
    stations : list of (k,) float64
        Of the nodes of each border, its ends among them.
    counts : (P,) int64
        Number of nodes of each polyline.
    """
    first_node = offsets_of(counts)
    count = int(first_node[-1])
    nodes, points = [], [np.zeros((0, 3))]
    for border, at in zip(borders, stations):
        inner = at if border.closed else at[1:-1]
        own = count + np.arange(len(inner))
        count += len(inner)
        first, last = ([] if end is None else [end.element(first_node)] for end in (border.first, border.last))
        nodes.append(np.array([*first, *own.tolist(), *last], np.int64))
        points.append(points_on_border(border, inner))
    return FreeBorderNodes(borders, stations, nodes, np.concatenate(points))


def points_on_border(border: FreeBorder, stations: Floats) -> Floats:
    """Points (k, 3) at stations along a free border.

    Parameters
    ----------
    border : FreeBorder
    stations : (k,) float64
        From 0 to its length.
    """
    known = np.append(border.stations, border.length) if border.closed else border.stations
    points = np.concatenate([border.points, border.points[:1]]) if border.closed else border.points
    return np.stack([np.interp(stations, known, points[:, k]) for k in range(3)], axis=1)


def divide_free_borders(borders: list[FreeBorder], edge_length: float) -> list[Floats]:
    """Stations of the nodes of each free border, its ends among them.

    Parameters
    ----------
    borders : list of FreeBorder
    edge_length : float
        Wanted length of the edges.

    Returns
    -------
    list of (k,) float64
    """
    all_ends = {(border.first, border.last) for border in borders}
    divided = []
    for border in borders:
        count = int(np.rint(border.length / edge_length))
        if border.first is None or border.last is None:
            count = max(count, FEWEST_NODES)
            stations = divide_closed_border(border.points, border.stations, border.length, count)
        else:
            has_two = (border.last, border.first) in all_ends
            count = max(count, _fewest_edges(border.first, border.last, has_two=has_two))
            stations = divide_open_border(border.points, border.stations, border.length, count)
        divided.append(stations)
    return divided


def _fewest_edges(first: PolylineEnd, last: PolylineEnd, *, has_two: bool) -> int:
    """A whole border needs three edges, each of the two stretches of one (``has_two``) and of a border cap two."""
    if first == last:
        return FEWEST_NODES
    return 2 if has_two or _bounds_border_cap(first, last) else 1


def _bounds_border_cap(first: PolylineEnd, last: PolylineEnd) -> bool:
    """Whether a stretch leads from the end of a polyline to its beginning, on its left; on its right it is a gap."""
    return first == PolylineEnd(last.polyline, 1) and last.is_last == 0


def find_border_caps(latitudes: Latitudes, borders: list[FreeBorder]) -> Bools:
    """(P,) open polylines beyond which there is only a border cap.

    Parameters
    ----------
    latitudes : Latitudes
    borders : list of FreeBorder
    """
    is_border_cap = np.zeros(len(latitudes), bool)
    for border in borders:
        if border.first is not None and border.last is not None and _bounds_border_cap(border.first, border.last):
            is_border_cap[border.first.polyline] = True
    return is_border_cap


def split_obstructed_chords(border: FreeBorder, stations: Floats, nodes: cKDTree) -> Floats:
    """Add a node to every chord of a free border that cuts off a node of a polyline.

               v                 v: vertex of the border, h over the chord
           ╱       ╲             x: node of a polyline; it is cut off where it lies between the chord and the border,
        ╱      x      ╲             0 < height of x < h, and nearer to v than the chord is
      o─────────────────o        then v becomes a node

    A node beyond v (height ≥ h) belongs to another part of the surface, as across a narrow slit.

    Parameters
    ----------
    border : FreeBorder
    stations : (k,) float64
        Of the border's nodes.
    nodes : cKDTree
        Points of the nodes of all polylines.

    Returns
    -------
    (k',) float64
        Rising.
    """
    points = points_on_border(border, stations)
    if border.closed:
        chord = np.searchsorted(stations, border.stations, side="right") - 1
        ends = points_on_border(border, np.roll(stations, -1))
    else:
        chord = np.clip(np.searchsorted(stations, border.stations, side="right") - 1, 0, len(stations) - 2)
        ends = np.roll(points, -1, axis=0)
    start, end = points[chord], ends[chord]
    along = end - start
    chord_square = np.maximum((along * along).sum(1), np.finfo(float).tiny)
    part = np.clip(((border.points - start) * along).sum(1) / chord_square, 0.0, 1.0)
    foot = start + part[:, None] * along
    off = border.points - foot
    square = (off * off).sum(1)
    nearest, which = (np.asarray(found) for found in nodes.query(border.points))
    height = ((nodes.data[which] - foot) * off).sum(1)
    is_cut_off = (nearest**2 < square) & (height > _ON_CHORD * square) & (height < square)
    vertex = np.flatnonzero(is_cut_off & (square > _STRAIGHT**2 * chord_square))
    vertex = vertex[np.lexsort((nearest[vertex], chord[vertex]))]
    _, first = np.unique(chord[vertex], return_index=True)
    return np.sort(np.concatenate([stations, border.stations[vertex[first]]]))


def find_open_strips(latitudes: Latitudes, borders: list[FreeBorder], stations: list[Floats]) -> Bools:
    """(B,) bands between one open parent and one open child whose free borders have no nodes of their own.

    Parameters
    ----------
    latitudes : Latitudes
    borders : list of FreeBorder
    stations : list of (k,) float64
        Of the nodes of each border, its ends among them.
    """
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
    for border, at in zip(borders, stations):
        if border.first is not None and len(at) > 2:
            # Beyond the end of a polyline lies its left side, beyond its beginning its right one.
            strip[band_of[border.first.polyline, border.first.is_last == 1]] = False
    return np.asarray(strip)


class _Curve(NamedTuple):
    """Points (n, 3) of a polyline or a free border, their stations (n,), its length, and whether it is closed."""

    points: Floats
    stations: Floats
    length: float
    closed: bool


def refine_boundary(
    polylines: Polylines, divided: DividedPolylines, border_nodes: FreeBorderNodes, inverted: Ints
) -> tuple[DividedPolylines, FreeBorderNodes]:
    """Add a node to each edge of a polyline or free border that lies on an inverted face.

    The new node is the point of the curve that is farthest from the edge; an edge that the curve follows gets none.

    Parameters
    ----------
    polylines : Polylines
    divided : DividedPolylines
    border_nodes : FreeBorderNodes
    inverted : (k, 3) int64
        Nodes of the inverted triangles.
    """
    sides = np.sort(np.concatenate([inverted[:, [0, 1]], inverted[:, [1, 2]], inverted[:, [2, 0]]]), axis=1)
    first = offsets_of(divided.counts)
    stations = [
        _with_split_edges(_curve_of(polylines, p), own, first[p] + np.arange(len(own)), sides)
        for p, own in enumerate(divided.stations)
    ]
    refined = divided.with_stations(stations)
    border_stations = [
        _with_split_edges(_Curve(border.points, border.stations, border.length, border.closed), own, nodes, sides)
        for border, own, nodes in zip(border_nodes.borders, border_nodes.stations, border_nodes.nodes)
    ]
    return refined, number_border_nodes(border_nodes.borders, border_stations, refined.counts)


def _curve_of(polylines: Polylines, p: int) -> _Curve:
    part = slice(polylines.offsets[p], polylines.offsets[p + 1])
    closed = bool(polylines.closed[p])
    return _Curve(polylines.points[part], polylines.stations[part], float(polylines.lengths[p]), closed)


def _with_split_edges(curve: _Curve, stations: Floats, nodes: Ints, sides: Ints) -> Floats:
    """The stations, rising, and one more on each edge between two nodes that is one of the sides."""
    after = np.append(nodes, nodes[0]) if curve.closed else nodes
    ends = np.append(stations, stations[0] + curve.length) if curve.closed else stations
    edges = np.sort(np.stack([after[:-1], after[1:]], axis=1), axis=1)
    n = max(int(edges.max(initial=0)), int(sides.max(initial=0))) + 1
    chosen = np.flatnonzero(np.isin(edges[:, 0] * n + edges[:, 1], sides[:, 0] * n + sides[:, 1]))
    more = [_farthest_off(curve, float(ends[k]), float(ends[k + 1])) for k in chosen.tolist()]
    return np.unique(np.concatenate([stations, *more]))


def _farthest_off(curve: _Curve, start: float, end: float) -> Floats:
    """The station of the point between two stations that is farthest from their chord; none where all lie on it."""
    known = np.concatenate([curve.stations, curve.stations + curve.length, [2 * curve.length]])
    points = np.concatenate([curve.points, curve.points, curve.points[:1]])
    if not curve.closed:
        known, points = curve.stations, curve.points
    ends = np.stack([np.interp([start, end], known, points[:, k]) for k in range(3)], axis=1)
    inner = np.flatnonzero((known > start) & (known < end))
    chord = float(np.linalg.norm(ends[1] - ends[0]))
    along = (ends[1] - ends[0]) / max(chord, np.finfo(float).tiny)
    arm = points[inner] - ends[0]
    off = np.linalg.norm(arm - (arm @ along)[:, None] * along, axis=1)
    if off.max(initial=0.0) <= _STRAIGHT * chord:
        return np.zeros(0)
    return np.array([known[inner[off.argmax()]] % curve.length])
