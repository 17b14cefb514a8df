"""How long the triangles' edges should be at every place: by curvature, by features, graded.

On a surface of curvature k an edge of length h lies k h²/8 off at its midpoint, and a triangle k h²/6 at its centre.
With the chord error c allowed the wanted length is

    h = min(√(3.5 c / k), 0.6 / k, longest edge),      never below 4 c

(3.5 rather than 6 leaves room for longer edges beside wanted ones).  Short features ask for edges no longer than
they are. The lengths are then graded to grow by no more than a quarter of the distance, which keeps triangles well
shaped: the greatest function below h with that slope is a shortest path from a virtual source (Persson 2006), O(n
log n) by Dijkstra.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from weavecore.errors import Degenerate, TooMuchWork
from weavecore.geometry.arrays import Floats, Ints
from weavecore.reading.nurbs_mesher.edge_paths import EdgePath
from weavecore.reading.nurbs_mesher.face_grid import FaceGrid

CHORD_SHARE = 1e-3
"""Chord error allowed, as a part of the size (the diagonal of the box about the surface)."""

_EDGE_SHARE = 1 / 50
"""Longest edge by default, as a part of the size."""

_MOST_EDGE_SHARE, _MOST_CHORD_SHARE = 1 / 4, 0.02
"""Longest edge and greatest chord error whatever is asked for: coarser meshes no longer have the surface's
shape."""

_EDGES_OF_SPACING, _LEAST_EDGE_SHARE = 0.5, 1 / 150
"""A spacing asks for edges of half its length, down to this part of the size: some 100,000 triangles, for the
offset refines flat triangles by itself."""

_CHORD_OF_SPACING, _LEAST_CHORD_SHARE = 0.02, 1e-4
"""A spacing asks for a chord error of this part of it, down to that part of the size."""

_CHORD_FACTOR = 3.5
"""h² k / c: 6 would use up the chord error at the centre of a triangle with edges of exactly h; they reach 1.3
h."""

_ANGLE = 0.6
"""Radians that an edge may turn: about ten edges around the smallest cylinder."""

_LEAST_IN_CHORDS = 4.0
"""Shortest edge in chord errors: shorter ones follow detail that the error allowed hides."""

_SEGMENTS_OF_CLOSED = 8
"""Segments of a closed edge, so that a small hole stays round."""

_GRADING = 0.25
"""Growth of the wanted length by distance."""

_NEIGHBOURS = 6
"""Nearest points, across faces and edges, that gradation also follows."""

_MOST_TRIANGLES = 5_000_000
"""Triangles of a mesh: far more than a weave needs, and what a mistyped edge target asks for."""

_HEXAGONAL = np.sqrt(3) / 4
"""Area of an equilateral triangle of edge 1."""


@dataclass(frozen=True)
class SizeLimits:
    """Longest edge, chord error allowed, and the size of the whole, in the model's unit."""

    edge: float
    chord: float
    extent: float


@dataclass(frozen=True)
class Fineness:
    """The edge length and chord error that a caller asks for: see `mesh_object`."""

    edge_target: float | None = None
    chord: float | None = None
    spacing: float | None = None

    def limits(self, extent: float) -> SizeLimits:
        """The limits for a surface of that size."""
        edge, chord = self.edge_target or _EDGE_SHARE * extent, self.chord or CHORD_SHARE * extent
        if self.spacing and not self.edge_target:
            edge = min(edge, max(_EDGES_OF_SPACING * self.spacing, _LEAST_EDGE_SHARE * extent))
        if self.spacing and not self.chord:
            chord = min(chord, max(_CHORD_OF_SPACING * self.spacing, _LEAST_CHORD_SHARE * extent))
        return SizeLimits(min(edge, _MOST_EDGE_SHARE * extent), min(chord, _MOST_CHORD_SHARE * extent), extent)


DEFAULT_FINENESS = Fineness()
"""Edges of a fiftieth of the size, and a chord error of a thousandth of it."""


def size_limits(grids: Sequence[FaceGrid], paths: Sequence[EdgePath], fineness: Fineness) -> SizeLimits:
    """Limits from what the caller asks for, or from the surface's size.

    Parameters
    ----------
    grids : sequence of FaceGrid
    paths : sequence of EdgePath
    fineness : Fineness

    Returns
    -------
    SizeLimits

    Raises
    ------
    Degenerate
    """
    corners = [g.points[g.inside] for g in grids] + [p.points for p in paths]
    cloud = np.concatenate(corners)
    extent = float(np.linalg.norm(np.ptp(cloud, axis=0)))
    if not extent > 0:
        raise Degenerate("The surface has no extent", remedy="Give a surface that has an area.")
    return fineness.limits(extent)


def size_by_curvature(curvature: Floats, limits: SizeLimits) -> Floats:
    """The edge length that keeps the chord error.

    Parameters
    ----------
    curvature : float64 array
        Greatest principal curvature, without sign.
    limits : SizeLimits

    Returns
    -------
    float64 array of the same shape
    """
    bent = np.maximum(curvature, 1e-300)
    length = np.minimum(np.sqrt(_CHORD_FACTOR * limits.chord / bent), _ANGLE / bent)
    sizes: Floats = np.clip(length, min(_LEAST_IN_CHORDS * limits.chord, limits.edge), limits.edge)
    return sizes


def graded_sizes(
    grids: Sequence[FaceGrid], paths: Sequence[EdgePath], closed: Sequence[bool], limits: SizeLimits
) -> tuple[list[Floats], list[Floats]]:
    """Wanted edge lengths at the points of all grids and of all edge tables.

    Parameters
    ----------
    grids : sequence of FaceGrid
    paths : sequence of EdgePath
    closed : sequence of bool
        Whether each edge is closed.
    limits : SizeLimits

    Returns
    -------
    sizes : list of (N, M) float64
        At the grids.
    along : list of (M,) float64
        At the edge tables.

    Raises
    ------
    TooMuchWork
        Where they ask for more than five million triangles.
    """
    at_grids = [np.where(g.inside, size_by_curvature(g.curvature, limits), limits.edge) for g in grids]
    at_paths = [_size_along(p, c, limits) for p, c in zip(paths, closed)]
    points = np.concatenate([g.points.reshape(-1, 3) for g in grids] + [p.points for p in paths])
    wanted = np.concatenate([s.ravel() for s in at_grids] + at_paths)
    wanted = _graded(points, wanted, _grid_links(grids))
    ends = np.cumsum([s.size for s in at_grids] + [len(s) for s in at_paths])
    parts = np.split(wanted, ends[:-1])
    sizes = [part.reshape(s.shape) for part, s in zip(parts, at_grids)]
    _check_work(grids, sizes)
    return sizes, parts[len(grids) :]


def _size_along(path: EdgePath, closed: bool, limits: SizeLimits) -> Floats:
    share = _SEGMENTS_OF_CLOSED if closed else 1
    feature = max(path.length / share, min(limits.chord, limits.edge))
    return np.minimum(size_by_curvature(path.curvature, limits), feature)


def _grid_links(grids: Sequence[FaceGrid]) -> Ints:
    """Pairs (L, 2) of points that are neighbours in a grid."""
    links, start = [], 0
    for g in grids:
        index = start + np.arange(g.inside.size).reshape(g.inside.shape)
        links += [np.column_stack([index[:-1].ravel(), index[1:].ravel()])]
        links += [np.column_stack([index[:, :-1].ravel(), index[:, 1:].ravel()])]
        start += g.inside.size
    return np.concatenate(links)


def _graded(points: Floats, wanted: Floats, links: Ints) -> Floats:
    """The greatest lengths that are nowhere above ``wanted`` and grow slowly: a shortest path from a virtual
    source.
    """
    from scipy.spatial import cKDTree

    n = len(points)
    _, near = cKDTree(points).query(points, k=min(_NEIGHBOURS + 1, n))
    near = np.asarray(near).reshape(n, -1)[:, 1:]
    pairs = np.concatenate([links, np.column_stack([np.repeat(np.arange(n), near.shape[1]), near.ravel()])])
    apart = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    (low, high), first = _without_doubles(pairs, n)
    weights = np.concatenate([_GRADING * apart[first], wanted])
    rows = np.concatenate([low, np.full(n, n)])
    columns = np.concatenate([high, np.arange(n)])
    graph = csr_matrix((np.maximum(weights, 1e-300), (rows, columns)), shape=(n + 1, n + 1))
    reached: Floats = dijkstra(graph, directed=False, indices=[n])[0, :n]
    return reached


def _without_doubles(pairs: Ints, n: int) -> tuple[tuple[Ints, Ints], Ints]:
    """Least and greatest of each pair, every pair once, and the row where it was first."""
    key, first = np.unique(pairs.min(1) * np.int64(n) + pairs.max(1), return_index=True)
    return (key // n, key % n), first


def _check_work(grids: Sequence[FaceGrid], sizes: Sequence[Floats]) -> None:
    total = 0.0
    for g, size in zip(grids, sizes):
        du, dv = np.gradient(g.u), np.gradient(g.v)
        area = g.speeds[..., 0] * g.speeds[..., 1] * du[:, None] * dv
        total += float((area * g.inside / (_HEXAGONAL * size**2)).sum())
    if total > _MOST_TRIANGLES:
        raise TooMuchWork(
            f"The surface would take about {total:.2g} triangles",
            remedy="Give a longer edge target or a larger chord error.",
        )
