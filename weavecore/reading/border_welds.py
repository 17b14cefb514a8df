"""Almost equal vertices of borders, welded within a tolerance.

Files written in single precision, or with few digits, hold the two sides of a seam a little apart.  Take the borders
that are left after vertices in the same place are welded; pairs of their vertices nearer than the tolerance make
clusters, and a cluster becomes one place::

      ──a──────b──────c──            ──a──────b──────c──
      ──a'─────b'─────c'─    ──▶       the two borders are gone

A weld must not close what is open: vertices are welded only if they are much nearer to each other than the border
edges beside them are long, and a weld after which an edge has more than two faces is undone.

A k-d tree finds the pairs: O(n log n) in the border vertices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from weavecore.geometry.arrays import Bools, Floats, Ints, connected, edge_lengths, used_rows
from weavecore.geometry.halfedges import halfedge_ends
from weavecore.reading.orientation import NO_PARTNER, pair_edges
from weavecore.reading.slivers import has_three_places

_TOLERANCE = 1e-6
"""Of the size, where the file states no tolerance: the last digit of single precision, and of text with six digits."""

_OF_EDGE = 0.1
"""Of the median border edge: the tolerance never exceeds it, so that a fine mesh in a coarse file keeps its shape."""

_MOST_SHIFT = 0.3
"""Of the shorter border edges beside two vertices: they are welded only if nearer, so that no triangle turns over."""

_MOST_ROUNDS = 8
"""Rounds in which welds are undone; each undoes all that crowd an edge, and more than two are rare."""


@dataclass(frozen=True, eq=False)
class BorderWelds:
    """The weld map with near vertices, and how many there were.

    Parameters
    ----------
    weld : (V,) int64
        The least vertex of the place of each vertex.
    n_welded : int
        Places that were joined to another.
    furthest : float
        The greatest distance by which a vertex moved.
    where : (k,) int64
        Vertices that moved.
    """

    weld: Ints
    n_welded: int
    furthest: float
    where: Ints


def tolerance_of(vertices: Floats, faces: Ints, tolerance: float) -> float:
    """How far apart vertices of borders may be to be welded.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    tolerance : float
        That of the file; 0 where it is not known.

    Returns
    -------
    float
    """
    size = float(np.linalg.norm(np.ptp(used_rows(vertices, faces), axis=0)))
    edge = float(np.median(edge_lengths(vertices, faces)))
    return min(max(tolerance, _TOLERANCE * size), _OF_EDGE * edge)


def weld_borders(vertices: Floats, faces: Ints, weld: Ints, distance: float) -> BorderWelds:
    """Weld vertices of borders that are almost in one place.

    Parameters
    ----------
    vertices : (V, 3) float64
    faces : (F, 3) int64
    weld : (V,) int64
        The least vertex in the same place as each vertex.
    distance : float
        How far apart they may be.

    Returns
    -------
    BorderWelds
    """
    partner, before = pair_edges(faces, weld)
    a, b = _near_pairs(vertices, faces, weld, np.flatnonzero(partner == NO_PARTNER), distance)
    if len(a) == 0:
        return BorderWelds(weld, 0, 0.0, a)
    for _ in range(_MOST_ROUNDS):
        merged = _merged(weld, a, b)
        keep = has_three_places(faces, merged)
        crowded = pair_edges(faces[keep], merged)[1]
        crowded = np.setdiff1d(np.flatnonzero(np.repeat(keep, 3))[crowded], before)
        if len(crowded) == 0:
            break
        ends = np.concatenate([weld[end[crowded]] for end in halfedge_ends(faces)])
        bad = np.isin(merged[a], merged[ends])
        a, b = a[~bad], b[~bad]
    else:
        merged = weld
    moved = np.unique(np.flatnonzero(merged[weld] != weld[weld]))
    places = np.unique(weld[moved])
    shift = np.linalg.norm(vertices[moved] - vertices[merged[moved]], axis=1)
    return BorderWelds(merged, len(places), float(shift.max(initial=0.0)), places)


def _near_pairs(vertices: Floats, faces: Ints, weld: Ints, alone: Ints, distance: float) -> tuple[Ints, Ints]:
    """Pairs (k,), (k,) of places of the border nearer than ``distance`` and than the edges beside them are long.

    The border are the halfedges ``alone``.
    """
    from scipy.spatial import cKDTree

    tail, head = (weld[end[alone]] for end in halfedge_ends(faces))
    length = np.linalg.norm(vertices[tail] - vertices[head], axis=1)
    least = np.full(len(vertices), np.inf)
    is_long = length > distance
    np.minimum.at(least, tail[is_long], length[is_long])
    np.minimum.at(least, head[is_long], length[is_long])
    border = np.unique(np.concatenate([tail, head]))
    if len(border) < 2 or not distance > 0:
        return border[:0], border[:0]
    pairs = cKDTree(vertices[border]).query_pairs(distance, output_type="ndarray")
    a, b = border[pairs[:, 0]], border[pairs[:, 1]]
    apart = np.linalg.norm(vertices[a] - vertices[b], axis=1)
    keep: Bools = apart <= _MOST_SHIFT * np.minimum(least[a], least[b])
    return a[keep], b[keep]


def _merged(weld: Ints, a: Ints, b: Ints) -> Ints:
    """The weld map with the places ``a`` and ``b`` made one, named by the least vertex."""
    n_groups, group = connected(a, b, len(weld))
    least = np.full(n_groups, len(weld), np.int64)
    np.minimum.at(least, group, np.arange(len(weld)))
    merged: Ints = least[group][weld]
    return merged
