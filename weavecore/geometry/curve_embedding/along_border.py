"""Curves beside the border of a mesh: ends that are put on it, and curves that become a stretch of it.

Each point of a curve, and the middle of each segment, has its nearest place on the border; it is *beside* the border
if that is nearer than a tenth of the edges there.  A curve beside one border loop all the way runs along it; one that
only ends there gets its ends put on it; a curve that runs along a border in part, or touches one between its ends, is
refused.

Work: that of the closest border edges.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from weavecore.errors import BadCurve
from weavecore.geometry.arrays import Bools, Floats, Ints
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.curve_embedding.growing_mesh import GrowingMesh
from weavecore.geometry.curve_embedding.local_refinement import flags_of_edges
from weavecore.geometry.curve_embedding.sampling import CurveOnMesh, segments_of
from weavecore.geometry.halfedges import NO_TWIN, border_loops, halfedge_ends

_NEAR, _NEAR_OF_SIZE = 0.1, 0.01
"""Of the edges there, and of the mesh's size (the lesser counts): a border nearer than this is beside a point."""

_MAX_RUN = 30.0
"""Times that distance for which a curve may run beside a border without running along it: more would be slivers."""

_ON_BORDER = 1e-3  # of the edges there: as good as on it

_AT_VERTEX = 1e-3
"""Of the edge: the end of a stretch is put on a vertex that is no further away."""


@dataclass(frozen=True, eq=False)
class CurveBesideBorder:
    """A curve with its nearest places on the border.

    Parameters
    ----------
    curve : CurveOnMesh
    border : BorderPlaces
        Of its points and, between each and the next, of the middles.
    near : (k,) float64
        How near to the border each of these counts as beside it.
    """

    curve: CurveOnMesh
    border: BorderPlaces
    near: Floats

    @property
    def is_beside(self) -> Bools:
        """(k,) whether each point and middle is beside the border."""
        flags: Bools = self.border.distance <= self.near
        return flags

    @property
    def runs_along(self) -> bool:
        """Whether all of the curve runs along one border."""
        return bool(self.is_beside.all() and (self.border.loop == self.border.loop[0]).all())

    def refuse_in_part(self) -> None:
        """Refuse a curve that stays beside a border for long, or touches one between its ends.

        Raises
        ------
        BadCurve
        """
        is_beside = self.is_beside
        run, longest, where = 0.0, 0.0, 0
        start, end = segments_of(self.curve.places, self.curve.is_closed)
        half = np.repeat(np.linalg.norm(end - start, axis=1) / 2, 2)
        n = len(half)
        for row in range(2 * n if self.curve.is_closed else n):
            k = row % n
            both = is_beside[k] and is_beside[(k + 1) % len(is_beside)]
            run = run + half[k] / self.near[k] if both else 0.0
            if run > longest:
                longest, where = run, k
        if longest > _MAX_RUN:
            raise BadCurve(
                f"The curve runs along a border in part, near {_written(self.curve.places[where // 2])}",
                remedy="Let it run along the border altogether, or only end there; split it in two if it does both.",
            )
        first, last = self._inner()
        inner = 2 * np.arange(first, last + 1)
        touches = self.border.distance[inner] <= _ON_BORDER * self.border.edge_length[inner]
        if touches.any():
            raise BadCurve(
                f"The curve touches a border between its ends near "
                f"{_written(self.curve.places[first + int(np.argmax(touches))])}",
                remedy="Keep it clear of the border, or let it end there.",
            )

    def with_ends_on_border(self) -> tuple[CurveOnMesh, Bools]:
        """The curve with its ends put on the border where they are beside it, and which of its points these are."""
        n = len(self.curve.places)
        on_border = np.zeros(n, bool)
        if self.curve.is_closed:
            return self.curve, on_border
        on_border[[0, -1]] = self.is_beside[[0, -1]]
        places = np.where(on_border[:, None], self.border.place[::2], self.curve.places)
        first, last = self._inner()
        rows = np.unique(np.concatenate([[0], np.arange(first, last + 1), [n - 1]]))
        face = np.where(on_border, self.border.halfedge[::2] // 3, self.curve.face)
        return replace(self.curve, places=places, face=face).take(rows), on_border[rows]

    def _inner(self) -> tuple[int, int]:
        """The first and the last point that are no ends, nor as near to one that is put on the border."""
        n = len(self.curve.places)
        if self.curve.is_closed:
            return 0, n - 1
        first, last = 1, n - 2
        nearest, near, places = self.border.place[::2], self.near[::2], self.curve.places
        if self.is_beside[0]:
            clear = np.linalg.norm(places - nearest[0], axis=1) > near[0]
            first = max(first, int(np.argmax(clear)) if clear.any() else n)
        if self.is_beside[-1]:
            clear = np.linalg.norm(places - nearest[-1], axis=1) > near[-1]
            last = min(last, n - 1 - int(np.argmax(clear[::-1])) if clear.any() else -1)
        return first, last


def curve_beside_border(
    vertices: Floats, faces: Ints, twins: Ints, curve: CurveOnMesh, tolerance: float
) -> CurveBesideBorder | None:
    """Find the nearest places of a curve on the border.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    twins : (3F,) int64
    curve : CurveOnMesh
    tolerance : float
        Places no further from the border than this are beside it.

    Returns
    -------
    CurveBesideBorder or None
        None on a closed mesh.
    """
    start, end = segments_of(curve.places, curve.is_closed)
    middles = (start + end) / 2
    points = np.empty((len(curve.places) + len(middles), 3))
    points[0::2], points[1::2] = curve.places, middles
    border = _nearest_on_border(vertices, faces, twins, points)
    if border is None:
        return None
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    height = np.repeat(curve.height, 2)[: len(points)]
    near = np.minimum(_NEAR * np.minimum(border.edge_length, 2 * height), _NEAR_OF_SIZE * size)
    return CurveBesideBorder(curve, border, np.maximum(near, max(tolerance, np.finfo(float).tiny)))


def _written(place: Floats) -> str:
    x, y, z = place.tolist()
    return f"({x:.6g}, {y:.6g}, {z:.6g})"


@dataclass(frozen=True, eq=False)
class BorderPlaces:
    """The nearest places on the border, one for each of some points.

    Parameters
    ----------
    place : (n, 3) float64
    distance : (n,) float64
    halfedge : (n,) int64
    loop : (n,) int64
        Which border loop.
    along : (n,) float64
        Arc length along the loop, from its first vertex.
    loop_length : (n,) float64
        Length of that loop.
    edge_length : (n,) float64
        Length of that halfedge.
    """

    place: Floats
    distance: Floats
    halfedge: Ints
    loop: Ints
    along: Floats
    loop_length: Floats
    edge_length: Floats


def _nearest_on_border(vertices: Floats, faces: Ints, twins: Ints, points: Floats) -> BorderPlaces | None:
    """Find the nearest places of points on the border.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    twins : (3F,) int64
    points : (n, 3) float64

    Returns
    -------
    BorderPlaces or None
        None for a closed mesh.
    """
    loops = border_loops(faces, twins)
    if not loops:
        return None
    border = np.flatnonzero(twins == NO_TWIN)
    tail, head = (ends[border] for ends in halfedge_ends(faces))
    which, place = closest_faces(points, vertices, np.stack([tail, head, head], axis=1))
    loop_of, before, lengths = np.zeros(len(vertices), np.int64), np.zeros(len(vertices)), np.zeros(len(loops))
    for number, loop in enumerate(loops):
        step = np.linalg.norm(vertices[np.roll(loop, -1)] - vertices[loop], axis=1)
        loop_of[loop], before[loop], lengths[number] = number, np.cumsum(step) - step, step.sum()
    start = tail[which]
    return BorderPlaces(
        place=place,
        distance=np.linalg.norm(points - place, axis=1),
        halfedge=border[which],
        loop=loop_of[start],
        along=before[start] + np.linalg.norm(place - vertices[start], axis=1),
        loop_length=lengths[loop_of[start]],
        edge_length=np.linalg.norm(vertices[head[which]] - vertices[start], axis=1),
    )


def stretch_of_border(mesh: GrowingMesh, places: BorderPlaces, is_closed: bool, fixed: Ints) -> tuple[Ints, bool]:
    """Path along the border edges between the first and the last of some places, split there, surface on the left.

    Parameters
    ----------
    mesh : GrowingMesh
        As it was when the places were found.
    places : BorderPlaces
        Along one loop, one after the other.
    is_closed : bool
    fixed : (m, 2) int64
        Edges of other paths, whose vertices the path may not have.

    Returns
    -------
    path : (k,) int64
    is_closed : bool
        Also true where an open curve goes around the whole loop.

    Raises
    ------
    BadCurve
    """
    if flags_of_edges(mesh.faces, fixed)[places.halfedge[[0, -1]]].any():
        raise _touching()
    length = float(places.loop_length[0])
    step = np.diff(places.along, append=places.along[:1] if is_closed else [])
    came = float(((step + length / 2) % length - length / 2).sum())
    ends = (0, len(places.along) - 1) if came > 0 else (len(places.along) - 1, 0)
    start, end = _split_ends(mesh, places, ends) if not is_closed else (_first_of_loop(mesh, places),) * 2
    is_whole = abs(came) > length / 2 and start == end
    if start == end and not is_whole:
        raise BadCurve("A curve along a border that ends where it begins", remedy="Give a longer one, or another.")
    path = [start]
    while (after := _next_on_border(mesh, path[-1])) != start:
        path.append(after)
        if after == end:
            break
    found = np.array(path, np.int64)
    if np.isin(found, fixed).any():
        raise _touching()
    return found, is_whole


def _touching() -> BadCurve:
    return BadCurve("A curve along a border that touches another origin", remedy="Shorten one of both, or omit one.")


def _first_of_loop(mesh: GrowingMesh, places: BorderPlaces) -> int:
    """The least vertex of the loop, at which it begins among the borders too."""
    first = at = mesh.tail(int(places.halfedge[0]))
    least = first
    while (at := _next_on_border(mesh, at)) != first:
        least = min(least, at)
    return least


def _split_ends(mesh: GrowingMesh, places: BorderPlaces, ends: tuple[int, int]) -> tuple[int, int]:
    """The vertices at two of the places, made where there are none."""
    found: dict[int, int] = {}
    order = sorted(ends, key=lambda row: float(places.along[row]), reverse=True)
    for row in order:  # The later one first: what is left of the halfedge then is its first part.
        halfedge = int(places.halfedge[row])
        tail, head = mesh.tail(halfedge), mesh.head(halfedge)
        reach = _AT_VERTEX * places.edge_length[row]
        place = places.place[row]
        close = [v for v in (tail, head) if np.linalg.norm(mesh.point(v) - place) <= reach]
        found[row] = close[0] if close else mesh.split_edge(halfedge, place)
    return found[ends[0]], found[ends[1]]


def _next_on_border(mesh: GrowingMesh, vertex: int) -> int:
    """The vertex after this one on its border loop."""
    return next(mesh.head(h) for h in mesh.fan(vertex) if mesh.twin(h) == NO_TWIN)
