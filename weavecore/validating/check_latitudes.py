"""Checks of `Latitudes`: the origins come first, polylines lie on the surface, are simple and have the right parents.

Generation 0 is the origins, point for point; all polylines of a generation have one distance; every vertex of the
surface is within 1.05 spacings of a polyline (Yan et al. 2016, §4).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from weavecore.geometry.arrays import Floats, next_in_loop, offsets_of, rows_of
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.validating.band_boundaries import check_ends
from weavecore.validating.check_bands import check_bands
from weavecore.validating.check_crossings import check_crossings, hold_segments
from weavecore.validating.report import Finding, count

_OFF_SURFACE = 1e-9
"""Parts of the surface's size by which a point may miss its place in its face: rounding."""

_COVERAGE = 1.05
"""Greatest distance of a vertex from the nearest latitude, in spacings: `LEAST_CAP` of the tolerances leaves 1.04."""

_FREE_BORDER_COVERAGE = 1.4
"""The same with free borders: right before one there is no room for a polyline."""

_SAMPLES_PER_SPACING = 20
"""Samples along polylines in one spacing: a gap of one spacing is overestimated by less than 0.001."""

_ROUNDING = 1e-9
"""Parts of the spacing by which distances may be off."""


def check_latitudes(latitudes: Latitudes) -> Iterator[Finding]:
    """Check the polylines, their graph and their bands.

    Parameters
    ----------
    latitudes : Latitudes
    """
    yield from _check_borders(latitudes)
    yield from _check_places(latitudes)
    held = hold_segments(latitudes.surface, latitudes.polylines)
    yield count("segments_in_no_face", latitudes.polylines.owner[held.lost], "polyline")
    yield from check_crossings(latitudes.surface, latitudes.polylines, held)
    yield from _check_generations(latitudes)
    most = _FREE_BORDER_COVERAGE if latitudes.surface.is_free_border.any() else _COVERAGE
    yield Finding("coverage_gap_of_spacing", _coverage_gap(latitudes), most)
    yield from check_bands(latitudes)


def _check_borders(latitudes: Latitudes) -> Iterator[Finding]:
    """The origins, by default borders and then cuts, are generation 0: point for point, in order, to the last bit."""
    surface, polylines = latitudes.surface, latitudes.polylines
    origins = surface.origins
    lost = [
        k
        for k, (path, is_closed) in enumerate(zip(origins.paths, origins.closed.tolist()))
        if k >= len(polylines)
        or polylines.closed[k] != is_closed
        or not _same_points(surface.vertices[path], polylines.polyline(k), is_closed=is_closed)
    ]
    yield count("border_loops_lost", lost, "loop")
    first = np.flatnonzero(latitudes.generation == 0)
    yield count("borders_not_first", np.setxor1d(first, np.arange(len(origins))), "polyline")
    rises = np.diff(latitudes.generation) >= 0
    yield count("generations_out_of_order", np.flatnonzero(~rises), "polyline")


def _same_points(wanted: Floats, points: Floats, *, is_closed: bool) -> bool:
    """Whether two polylines have the same points in the same order, which for closed ones may begin anywhere."""
    if wanted.shape != points.shape:
        return False
    starts = np.flatnonzero((points == wanted[0]).all(1)) if is_closed else np.zeros(1, np.int64)
    return any(np.array_equal(np.roll(points, -start, axis=0), wanted) for start in starts.tolist())


def _check_places(latitudes: Latitudes) -> Iterator[Finding]:
    """Each point lies where its face and barycentric coordinates say; polylines are closed, or end on free borders."""
    surface, polylines = latitudes.surface, latitudes.polylines
    barycentric = polylines.barycentric
    place = np.einsum("nk,nkd->nd", barycentric, surface.vertices[surface.faces[polylines.face]])
    off = np.linalg.norm(place - polylines.points, axis=1)
    yield Finding("off_surface_of_size", float(off.max(initial=0.0)) / surface.size, _OFF_SURFACE)
    outside = np.maximum(np.abs(barycentric.sum(1) - 1), np.maximum(-barycentric, 0).max(1))
    yield Finding("outside_face", float(outside.max(initial=0.0)), _OFF_SURFACE)
    short = polylines.counts < np.where(polylines.closed, 3, 2)
    yield count("short_polylines", np.flatnonzero(short), "polyline")
    yield from check_ends(latitudes)


def _check_generations(latitudes: Latitudes) -> Iterator[Finding]:
    """Parents are one generation up, and all polylines but the origins have one (§4.4, §4.5)."""
    generation, parents = latitudes.generation, latitudes.parents
    known = ((parents >= 0) & (parents < len(latitudes))).all(1)
    yield count("parents_unknown", np.flatnonzero(~known), "link")
    parents = parents[known]
    step = generation[parents[:, 1]] - generation[parents[:, 0]]
    yield count("parent_links_wrong", np.flatnonzero(step != 1), "link")
    orphans = np.setdiff1d(np.flatnonzero(generation > 0), parents[:, 1])
    yield count("orphans", orphans, "polyline")
    yield from _check_distances(latitudes)


def _check_distances(latitudes: Latitudes) -> Iterator[Finding]:
    """The origins are at distance 0, all polylines of a generation at one, and no step is wider than the spacing."""
    distance, spacing = latitudes.distance, latitudes.spacing
    of_generation = np.zeros(latitudes.n_generations)
    of_generation[latitudes.generation] = distance
    off = np.abs(distance - np.where(latitudes.generation > 0, of_generation[latitudes.generation], 0.0))
    yield Finding("distance_off_of_spacing", float(off.max(initial=0.0)) / spacing, _ROUNDING)
    step = np.diff(of_generation)
    yield Finding("step_over_spacing", float(step.max(initial=0.0)) / spacing - 1.0, _ROUNDING)
    yield count("distances_not_rising", np.flatnonzero(step <= 0) + 1, "generation")


def _coverage_gap(latitudes: Latitudes) -> float:
    """Straight distance from the farthest vertex to the nearest latitude, in spacings."""
    from scipy.spatial import cKDTree

    samples = _samples(latitudes.polylines, latitudes.spacing / _SAMPLES_PER_SPACING)
    if len(samples) == 0:
        return float("inf")
    gap = np.asarray(cKDTree(samples).query(latitudes.surface.vertices)[0])
    return float(gap.max()) / latitudes.spacing


def _samples(polylines: Polylines, step: float) -> Floats:
    """Points along polylines, no further apart than ``step``; the polylines' own among them."""
    points, length = polylines.points, polylines.segment_lengths
    side = points[next_in_loop(polylines.offsets)] - points
    ragged = offsets_of(np.maximum(1, np.ceil(length / step)))
    row = rows_of(ragged)
    part = (np.arange(ragged[-1]) - ragged[row]) / np.diff(ragged)[row]
    samples: Floats = points[row] + side[row] * part[:, None]
    return samples
