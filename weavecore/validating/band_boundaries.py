"""The closed curves that bound the bands: sides of polylines, joined where these end by stretches of free border.

A *free border* is a border from which no distance starts.  Open polylines end there, and from each end the border leads
on to the next one.  A border runs with the surface on its left::

      left │ right     beyond the end of a polyline (top) the border continues along its left side,
           │           beyond its beginning (bottom) along its right side
    ←──────┴──────── border, surface below
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.check_crossings import carriers_of
from weavecore.validating.report import Finding, count

_INSIDE = -1
"""In place of the border of a point inside the surface."""

_LEFT, _RIGHT = 0, 1


@dataclass(frozen=True, eq=False)
class BandBoundaries:
    """The closed curves that bound the bands.

    Parameters
    ----------
    of_side : (2P,) int64
        The curve that the left side of polyline ``p`` belongs to, at ``2 * p``, and its right side, at ``2 * p + 1``.
    stretches : (s, 2) int64
        The sides that each stretch of border leads from and to.
    n_whole : int
        Free borders on which no polyline ends: each is a curve of its own, of a band that is not known.
    """

    of_side: Ints
    stretches: Ints
    n_whole: int


def find_band_boundaries(latitudes: Latitudes) -> BandBoundaries:
    """Follow the borders from each end of an open polyline to the next.

    Parameters
    ----------
    latitudes : Latitudes

    Returns
    -------
    BandBoundaries
    """
    surface, polylines = latitudes.surface, latitudes.polylines
    open_ = np.flatnonzero(~polylines.closed & (polylines.counts > 0))
    ends = np.concatenate([polylines.offsets[:-1][open_], polylines.offsets[1:][open_] - 1])
    owner, is_last = np.tile(open_, 2), np.arange(2 * len(open_)) >= len(open_)
    corners, carries = (part[ends] for part in carriers_of(surface, polylines))
    loop, place = _places_on_borders(surface, corners, carries, polylines.barycentric[ends])
    on_border = loop != _INSIDE
    ahead = 2 * owner + np.where(is_last, _LEFT, _RIGHT)
    along = np.isin(owner, np.flatnonzero(origins_along_borders(surface)))
    # The right side of an origin along a border has no surface: its left side is on both sides of its ends.
    ahead, behind = np.where(along, 2 * owner + _LEFT, ahead), np.where(along, 2 * owner + _LEFT, ahead ^ 1)
    here = np.flatnonzero(on_border)
    here = here[np.lexsort([place[here], loop[here]])]
    first = np.searchsorted(loop[here], loop[here], side="left")
    n_here = np.searchsorted(loop[here], loop[here], side="right") - first
    following = here[first + (np.arange(len(here)) - first + 1) % np.maximum(n_here, 1)]
    stretches = np.stack([ahead[here], behind[following]], axis=1)
    # Around an end inside the surface the left side continues as the right one.
    turns = np.stack([ahead[~on_border], ahead[~on_border] ^ 1], axis=1)
    one, other = np.concatenate([stretches, turns]).T
    n = 2 * len(polylines)
    links = coo_matrix((np.ones(len(one), bool), (one, other)), shape=(n, n))
    _, label = connected_components(links, directed=False)
    return BandBoundaries(label.astype(np.int64), stretches, _n_whole_free_borders(surface, np.unique(loop[here])))


def _places_on_borders(surface: SurfaceMesh, corners: Ints, carries: Bools, weights: Floats) -> tuple[Ints, Floats]:
    """Where points (n,) lie on the borders: loop (n,), or -1 inside, and place (n,) in edges from its first vertex."""
    n = surface.n_vertices
    loops = [np.zeros(0, np.int64), *surface.borders]
    tail = np.concatenate(loops)
    head = np.concatenate([np.roll(loop, -1) for loop in loops])
    loop = rows_of(offsets_of([len(one) for one in loops])) - 1
    rank = np.concatenate([np.arange(len(one)) for one in loops])
    low = np.where(carries, corners, n).min(1)
    high = np.where(carries, corners, -1).max(1)
    part_high = (weights * (carries & (corners == high[:, None]))).sum(1)
    is_single, on_edge = carries.sum(1) == 1, carries.sum(1) == 2
    found, place = np.full(len(corners), _INSIDE), np.zeros(len(corners))
    if len(tail) == 0:
        return found, place
    for key, wanted, share, may in (
        (tail, low, np.zeros(len(low)), is_single),
        (tail * n + head, low * n + high, part_high, on_edge),
        (tail * n + head, high * n + low, 1.0 - part_high, on_edge),
    ):
        order = np.argsort(key, kind="stable")
        at = order[np.minimum(np.searchsorted(key, wanted, sorter=order), len(key) - 1)]
        hit = may & (key[at] == wanted)
        found[hit], place[hit] = loop[at[hit]], rank[at[hit]] + share[hit]
    return found, place


def _n_whole_free_borders(surface: SurfaceMesh, ended_on: Ints) -> int:
    """How many borders are no closed origin, and have no end of a polyline."""
    vertices = surface.origins.vertices()
    others = [k for k, loop in enumerate(surface.borders) if not np.isin(loop[:2], vertices).all()]
    return len(np.setdiff1d(others, ended_on))


def origins_along_borders(surface: SurfaceMesh) -> Bools:
    """Whether each origin runs along a border, by its first edge.

    Parameters
    ----------
    surface : SurfaceMesh

    Returns
    -------
    (O,) bool
    """
    n = surface.n_vertices
    loops = [np.zeros(0, np.int64), *surface.borders]
    keys = np.concatenate([loop * n + np.roll(loop, -1) for loop in loops])
    first = np.array([path[0] * n + path[1] for path in surface.origins.paths], np.int64)
    along: Bools = np.isin(first, keys)
    return along


def check_ends(latitudes: Latitudes) -> Iterator[Finding]:
    """Check that open polylines begin and end on free borders and touch them nowhere else, origins excepted.

    Parameters
    ----------
    latitudes : Latitudes
    """
    surface, polylines = latitudes.surface, latitudes.polylines
    corners, carries = carriers_of(surface, polylines)
    after = surface.faces[:, [1, 2, 0]].ravel()
    tail, head = surface.faces.ravel()[surface.is_free_border], after[surface.is_free_border]
    beside = np.zeros(surface.n_vertices, bool)
    beside[tail] = beside[head] = True
    n = surface.n_vertices
    low, high = np.where(carries, corners, n).min(1), np.where(carries, corners, -1).max(1)
    keys = np.minimum(tail, head) * n + np.maximum(tail, head)
    inside = (carries.sum(1) == 2) & np.isin(low * n + high, keys)
    at = np.concatenate([polylines.offsets[:-1], polylines.offsets[1:] - 1])
    owner = np.tile(np.arange(len(polylines)), 2)
    asked = ~polylines.closed[owner] & (latitudes.generation[owner] > 0) & (polylines.counts[owner] > 0)
    at, owner = at[asked], owner[asked]
    on_free_border = inside[at] | ((low[at] == high[at]) & beside[np.minimum(low[at], n - 1)])
    yield count("ends_off_free_borders", owner[~on_free_border], "polyline")
    inside[at] = False
    yield count("free_borders_touched_between_ends", polylines.owner[inside], "polyline")
