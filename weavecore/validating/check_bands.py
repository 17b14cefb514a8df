"""Checks of `Bands`: each polyline lies between two bands, and their Euler characteristics sum to the surface's.

A band with b boundary curves and g handles has Euler characteristic χ = 2 - 2g - b.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Ints, ranges, rows_of
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.band_boundaries import find_band_boundaries, origins_along_borders
from weavecore.validating.report import Finding, count


def check_bands(latitudes: Latitudes) -> Iterator[Finding]:
    """Check the bands' Euler characteristics, their sides, and that they give the same parents.

    Parameters
    ----------
    latitudes : Latitudes
    """
    bands, surface = latitudes.bands, latitudes.surface
    # Cutting along a loop keeps the sum; cutting along an open polyline from border to border adds 1.
    n_open = int((~latitudes.polylines.closed[len(surface.origins) :]).sum())
    wanted = surface.euler_characteristic + n_open + _gain_of_origins(surface)
    yield Finding("euler_sum_off", float(abs(int(bands.euler.sum()) - wanted)))
    yield from _check_kinds(latitudes)
    yield from _check_sides(latitudes)
    pairs = _pairs_of_bands(latitudes)
    stated = latitudes.parents[:, 0] * len(latitudes) + latitudes.parents[:, 1]
    differ = np.setxor1d(pairs, stated)
    yield count("parents_differ_from_bands", differ % max(1, len(latitudes)), "polyline")


def _gain_of_origins(surface: SurfaceMesh) -> int:
    """How much cutting along the open origins inside the surface adds to the Euler characteristic.

    A cut from border to border adds 1, one with a single end on a border 0, and a slit -1.
    """
    on_border = np.zeros(surface.n_vertices, bool)
    on_border[np.concatenate([np.zeros(0, np.int64), *surface.borders])] = True
    inside = ~origins_along_borders(surface) & ~surface.origins.closed
    return sum(int(on_border[surface.origins.paths[k][[0, -1]]].sum()) - 1 for k in np.flatnonzero(inside).tolist())


def _check_kinds(latitudes: Latitudes) -> Iterator[Finding]:
    """A band with ``b`` curves around it and ``g`` handles has Euler characteristic 2 - 2g - b.

    The curves are sides of polylines, and chains of sides joined by free borders.  A free border where no polyline ends
    is a curve too, of one of the bands that would otherwise miss one.
    """
    bands, boundaries = latitudes.bands, find_band_boundaries(latitudes)
    band = rows_of(bands.offsets)
    curve = boundaries.of_side[2 * bands.polyline + ~bands.is_left]
    around, _ = np.unique(np.stack([band, curve], axis=1), axis=0).T
    handles = 2 - np.bincount(around, minlength=len(bands)) - bands.euler
    odd = np.flatnonzero(handles % 2 != 0)
    wrong = odd if len(odd) > boundaries.n_whole else odd[:0]
    yield count("bands_of_no_surface", np.union1d(np.flatnonzero(handles < 0), wrong), "band")
    of_side = np.full(2 * len(latitudes), -1, np.int64)
    of_side[2 * bands.polyline + ~bands.is_left] = band
    one, other = of_side[boundaries.stretches].T
    yield count("free_borders_between_bands", boundaries.stretches[one != other] // 2, "polyline")
    above = bands.depth[band] < np.where(bands.is_parent, latitudes.distance[bands.polyline], -np.inf)
    yield count("bands_above_their_parents", band[above], "band")


def _check_sides(latitudes: Latitudes) -> Iterator[Finding]:
    """An origin along a border has one band, on its left; one inside the surface has one on each side.

    All other polylines have a band before them and one beyond.
    """
    bands, n = latitudes.bands, len(latitudes)
    seen = np.zeros((n, 2, 2), np.int64)
    np.add.at(seen, (bands.polyline, bands.is_parent.astype(int), bands.is_left.astype(int)), 1)
    wanted = np.zeros((n, 2, 2), np.int64)
    wanted[:, 1, 1] = 1
    along = origins_along_borders(latitudes.surface)
    wanted[: len(along), 1, 0] = ~along[:n]
    wanted[len(along) :, 0, 0] = 1
    yield count("sides_wrong", np.flatnonzero((seen != wanted).any((1, 2))), "polyline")


def _pairs_of_bands(latitudes: Latitudes) -> Ints:
    """Every parent with every child around the same band, as ``parent * n + child``."""
    bands, n = latitudes.bands, len(latitudes)
    first, last = bands.offsets[:-1], bands.offsets[1:]
    band = rows_of(bands.offsets)
    partners = (last - first)[band]
    a = np.repeat(np.arange(len(band)), partners)
    b = ranges(first[band], partners)
    related = bands.is_parent[a] & ~bands.is_parent[b]
    pairs: Ints = np.unique(bands.polyline[a[related]] * n + bands.polyline[b[related]])
    return pairs
