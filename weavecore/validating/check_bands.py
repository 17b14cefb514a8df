"""What must hold of `Bands`: each polyline between two bands, and the surface's topology in all."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Ints, rows_of
from weavecore.model.latitudes import Latitudes
from weavecore.model.surface import SurfaceMesh
from weavecore.validating.free_borders_of_bands import find_outlines, origins_along_borders
from weavecore.validating.report import Finding, count


def check_bands(latitudes: Latitudes) -> Iterator[Finding]:
    """The bands' Euler characteristics, their sides, and that they tell the same parents."""
    bands, surface = latitudes.bands, latitudes.surface
    # A loop has Euler characteristic 0, so cutting along it leaves the sum as it is; an open polyline from border to
    # border has 1, and is there twice after the cut.
    n_open = int((~latitudes.polylines.closed[len(surface.origins) :]).sum())
    wanted = surface.euler_characteristic + n_open + _gain_of_origins(surface)
    yield Finding("euler_sum_off", float(abs(int(bands.euler.sum()) - wanted)))
    yield from _check_kinds(latitudes)
    yield from _check_sides(latitudes)
    pairs = _pairs_of_bands(latitudes)
    told = latitudes.parents[:, 0] * len(latitudes) + latitudes.parents[:, 1]
    differ = np.setxor1d(pairs, told)
    yield count("parents_differ_from_bands", differ % max(1, len(latitudes)), "polyline")


def _gain_of_origins(surface: SurfaceMesh) -> int:
    """What the Euler characteristic gains by cutting the surface along the open origins inside it.

    A cut from border to border gains 1, one with a single end on a border nothing, and a slit loses 1.
    """
    on_border = np.zeros(surface.n_vertices, bool)
    on_border[np.concatenate([np.zeros(0, np.int64), *surface.borders])] = True
    inside = ~origins_along_borders(surface) & ~surface.origins.closed
    return sum(int(on_border[surface.origins.paths[k][[0, -1]]].sum()) - 1 for k in np.flatnonzero(inside).tolist())


def _check_kinds(latitudes: Latitudes) -> Iterator[Finding]:
    """A band with ``b`` curves around it and ``g`` handles has Euler characteristic 2 - 2g - b.

    The curves are sides, and chains of sides that selvedges join.  A selvedge where no polyline ends
    is a curve too, of one of the bands that otherwise miss one.
    """
    bands, outlines = latitudes.bands, find_outlines(latitudes)
    band = rows_of(bands.offsets)
    curve = outlines.of_side[2 * bands.polyline + ~bands.is_left]
    around, _ = np.unique(np.stack([band, curve], axis=1), axis=0).T
    handles = 2 - np.bincount(around, minlength=len(bands)) - bands.euler
    odd = np.flatnonzero(handles % 2 != 0)
    wrong = odd if len(odd) > outlines.n_whole else odd[:0]
    yield count("bands_of_no_surface", np.union1d(np.flatnonzero(handles < 0), wrong), "band")
    of_side = np.full(2 * len(latitudes), -1, np.int64)
    of_side[2 * bands.polyline + ~bands.is_left] = band
    one, other = of_side[outlines.stretches].T
    yield count("selvedges_between_bands", outlines.stretches[one != other] // 2, "polyline")
    above = bands.depth[band] < np.where(bands.is_parent, latitudes.distance[bands.polyline], -np.inf)
    yield count("bands_above_their_parents", band[above], "band")


def _check_sides(latitudes: Latitudes) -> Iterator[Finding]:
    """An origin along a border has one band, on its left, one inside has one on each side.

    The others have a band before them and one beyond.
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
    rank = np.arange(len(a)) - np.repeat(np.cumsum(partners) - partners, partners)
    b = first[band[a]] + rank
    related = bands.is_parent[a] & ~bands.is_parent[b]
    pairs: Ints = np.unique(bands.polyline[a[related]] * n + bands.polyline[b[related]])
    return pairs
