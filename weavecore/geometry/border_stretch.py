"""Curves beside the border of a mesh: which points lie on it, and the stretch of it that a curve runs along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.errors import BadCurve
from weavecore.geometry.arrays import Floats, Ints
from weavecore.geometry.closest import closest_faces
from weavecore.geometry.curve_refining import flags_of_edges
from weavecore.geometry.growing import GrowingMesh
from weavecore.geometry.halfedges import NO_TWIN, border_loops, halfedge_ends

_AT_VERTEX = 1e-3
"""The end of a stretch is put on a vertex that is no further away than this part of the edge."""


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


def nearest_on_border(vertices: Floats, faces: Ints, twins: Ints, points: Floats) -> BorderPlaces | None:
    """The nearest places on the border; None for a closed mesh.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    twins : (3F,) int64
    points : (n, 3) float64
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
    """The path along the border edges between the first and the last of some places, split there, surface on the left.

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
        Also where an open curve comes round the whole loop.

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
    return BadCurve(
        "A curve along a border that touches another origin", remedy="Shorten one of both, or leave one away."
    )


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
