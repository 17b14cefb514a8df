"""What must hold of `Bands`: each polyline between two bands, and the surface's topology in all."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Ints, rows_of
from weavecore.model.latitudes import Latitudes
from weavecore.validating.report import Finding, count


def check_bands(latitudes: Latitudes) -> Iterator[Finding]:
    """The bands' Euler characteristics, their sides, and that they tell the same parents."""
    bands, surface = latitudes.bands, latitudes.surface
    # A loop has Euler characteristic 0, so cutting along polylines leaves the sum as it is.
    surplus = abs(int(bands.euler.sum()) - surface.euler_characteristic)
    yield Finding("euler_sum_off", float(surplus))
    yield from _check_kinds(latitudes)
    yield from _check_sides(latitudes)
    pairs = _pairs_of_bands(latitudes)
    told = latitudes.parents[:, 0] * len(latitudes) + latitudes.parents[:, 1]
    differ = np.setxor1d(pairs, told)
    yield count("parents_differ_from_bands", differ % max(1, len(latitudes)), "polyline")


def _check_kinds(latitudes: Latitudes) -> Iterator[Finding]:
    """A band with ``b`` sides and ``g`` handles has Euler characteristic 2 - 2g - b."""
    bands = latitudes.bands
    handles = 2 - np.diff(bands.offsets) - bands.euler
    yield count("bands_of_no_surface", np.flatnonzero((handles < 0) | (handles % 2 != 0)), "band")
    band = rows_of(bands.offsets)
    above = bands.depth[band] < np.where(bands.is_parent, latitudes.distance[bands.polyline], -np.inf)
    yield count("bands_above_their_parents", band[above], "band")


def _check_sides(latitudes: Latitudes) -> Iterator[Finding]:
    """A border has one band, on its left; a cut has one on each side; the others a band before and one beyond."""
    bands, n = latitudes.bands, len(latitudes)
    seen = np.zeros((n, 2, 2), np.int64)
    np.add.at(seen, (bands.polyline, bands.is_parent.astype(int), bands.is_left.astype(int)), 1)
    wanted = np.zeros((n, 2, 2), np.int64)
    wanted[:, 1, 1] = 1
    n_borders, n_cuts = len(latitudes.surface.borders), len(latitudes.surface.cuts)
    wanted[n_borders : n_borders + n_cuts, 1, 0] = 1
    wanted[n_borders + n_cuts :, 0, 0] = 1
    yield count("sides_wrong", np.flatnonzero((seen != wanted).any((1, 2))), "polyline")


def _pairs_of_bands(latitudes: Latitudes) -> Ints:
    """Every parent with every child around the same band, as ``parent * n + child``."""
    bands, n = latitudes.bands, len(latitudes)
    first, last = bands.offsets[:-1], bands.offsets[1:]
    band = rows_of(bands.offsets)
    partners = (last - first)[band]
    a = np.repeat(np.arange(len(band)), partners)
    rank = np.arange(len(a)) - np.repeat(np.cumsum(partners) - partners, partners)
    b = first[band[a]] + rank
    related = bands.is_parent[a] & ~bands.is_parent[b]
    pairs: Ints = np.unique(bands.polyline[a[related]] * n + bands.polyline[b[related]])
    return pairs
