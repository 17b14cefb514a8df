"""Polylines that run close along a selvedge, where no rod has room beside them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.geometry.arrays import Bools, Ints, offsets_of, rows_of
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.offsetting.bands import find_parents, order_bands
from weavecore.tolerances import LEAST_HEM


def drop_shallow(latitudes: Latitudes) -> Latitudes:
    """Leave out the last polylines before a selvedge, where what lies beyond is less than `LEAST_HEM` spacings deep.

    A border that distances start from is met by fronts from all sides, so that what is left between them ends
    in a ridge; a selvedge cuts off what comes, at any depth.
    """
    if not latitudes.surface.is_selvedge.any():
        return latitudes
    gone = _close_to_selvedges(latitudes)
    return _without(latitudes, gone) if gone.any() else latitudes


def _close_to_selvedges(latitudes: Latitudes) -> Bools:
    """(P,) polylines around bands without children that touch a selvedge and are shallow."""
    bands, closed = latitudes.bands, latitudes.polylines.closed
    band = rows_of(bands.offsets)
    n_sides = np.diff(bands.offsets)
    is_last = np.bincount(band[~bands.is_parent], minlength=len(bands)) == 0
    n_open = np.bincount(band[~closed[bands.polyline]], minlength=len(bands))
    # Of closed polylines around a band without handles: one selvedge more than there are polylines.
    touches = (n_open > 0) | (bands.euler == 1 - n_sides)
    lowest = latitudes.distance[bands.polyline[bands.offsets[:-1]]]
    generation = latitudes.generation[bands.polyline[bands.offsets[:-1]]]
    step = np.append(latitudes.steps, latitudes.steps[-1])[np.minimum(generation, len(latitudes.steps))]
    is_shallow = is_last & touches & (bands.depth - lowest < LEAST_HEM * step)
    gone = np.zeros(len(latitudes), bool)
    gone[bands.polyline[is_shallow[band]]] = True
    # Of the first generation some stay: those of a band that would have no child left.
    child = ~bands.is_parent
    left = np.bincount(band[child], ~gone[bands.polyline[child]], minlength=len(bands)) > 0
    first = bands.polyline[child][~left[band[child]] & (latitudes.generation[bands.polyline[child]] == 1)]
    gone[first] = False
    return gone


def _without(latitudes: Latitudes, gone: Bools) -> Latitudes:
    bands, lines = latitudes.bands, latitudes.polylines
    band = rows_of(bands.offsets)
    side = np.flatnonzero(gone[bands.polyline])
    pair = side[np.argsort(bands.polyline[side], kind="stable")].reshape(-1, 2)
    a, b = band[pair[:, 0]], band[pair[:, 1]]
    links = coo_matrix((np.ones(len(a), np.int8), (a, b)), shape=(len(bands), len(bands)))
    count, merged = connected_components(links, directed=False)
    is_arc = ~lines.closed[bands.polyline[pair[:, 0]]]
    euler, depth = np.zeros(count, np.int64), np.zeros(count)
    np.add.at(euler, merged, bands.euler)
    np.subtract.at(euler, merged[a], is_arc.astype(np.int64))
    np.maximum.at(depth, merged, bands.depth)
    kept = ~gone[bands.polyline]
    number = np.cumsum(~gone) - 1
    made = order_bands(
        number[bands.polyline[kept]],
        merged[band[kept]].astype(np.int64),
        bands.is_parent[kept],
        bands.is_left[kept],
        euler,
        depth,
    )
    return replace(
        latitudes,
        polylines=_taken(lines, ~gone),
        generation=latitudes.generation[~gone],
        distance=latitudes.distance[~gone],
        parents=find_parents(made),
        bands=made,
    )


def _taken(lines: Polylines, kept: Bools) -> Polylines:
    point: Ints = np.flatnonzero(kept[lines.owner])
    offsets = offsets_of(lines.counts[kept])
    return Polylines(lines.points[point], offsets, lines.closed[kept], lines.face[point], lines.barycentric[point])
