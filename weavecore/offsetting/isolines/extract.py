"""From the distance field to the latitudes: levels, loops and bands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from weavecore.errors import SpacingTooLarge, TooMuchWork
from weavecore.geometry.arrays import Bools, Floats, Ints, offsets_of, rows_of
from weavecore.model.latitudes import Latitudes
from weavecore.model.polylines import Polylines
from weavecore.model.surface import SurfaceMesh
from weavecore.offsetting.distance.solver import DistanceField
from weavecore.offsetting.isolines.bands import find_bands, find_parents, order_bands
from weavecore.offsetting.isolines.crossings import (
    Crossings,
    Loops,
    chain_loops,
    count_crossings,
    find_crossings,
    place_crossings,
)
from weavecore.offsetting.isolines.cut_locus import split_ridges
from weavecore.offsetting.isolines.cut_mesh import Sheet, open_sheet
from weavecore.offsetting.isolines.simplify import group_nodes
from weavecore.offsetting.spacing import Ladder, Spacing
from weavecore.tolerances import LEAST_HEM

MOST_POINTS = 30_000_000


def trace_latitudes(surface: SurfaceMesh, field: DistanceField, *, spacing: Spacing) -> Latitudes:
    """Trace the levels of a distance field and find the bands between them.

    Parameters
    ----------
    surface : SurfaceMesh
    field : DistanceField
        Finite everywhere.
    spacing : float or sequence of float
        From one level to the next, in the model's unit; of several the last goes on.

    Raises
    ------
    SpacingTooLarge
        When no level lies inside the surface.
    TooMuchWork
        When the polylines would have more than 30 million points.
    """
    ladder = Ladder.of(spacing)
    refuse_too_many_points(float(ladder.height(field.distance).max()), ladder.least)
    sheet = split_ridges(open_sheet(surface, field), surface.edge_lengths, ladder=ladder)
    regions = group_nodes(sheet, ladder=ladder)
    if not regions.band.any():
        raise too_large(float(ladder.steps[0]), least_depth(surface, field.distance))
    refuse_too_many_points(count_crossings(sheet, regions.band), ladder.least)
    crossings = find_crossings(sheet, regions.band)
    part = place_crossings(sheet, regions, crossings, ladder=ladder)
    loops = chain_loops(crossings)
    bands = find_bands(sheet, regions, crossings, loops, ladder=ladder)
    traced = crossings.level[loops.order[loops.offsets[:-1]]]
    generation = np.concatenate([np.zeros(len(sheet.origins), np.int64), traced])
    return Latitudes(
        surface=surface,
        polylines=_polylines(surface, sheet, crossings, part, loops),
        generation=generation,
        distance=ladder.distance(generation.astype(np.float64)),
        parents=find_parents(bands),
        bands=bands,
        spacing=ladder.widest(int(generation.max()) + 1),
        vertex_distance=field.distance,
    )


def _polylines(surface: SurfaceMesh, sheet: Sheet, crossings: Crossings, part: Floats, loops: Loops) -> Polylines:
    """The origins, vertex for vertex, then the traced ones."""
    origin = sheet.origins.vertices()
    origin_face, origin_barycentric = corners_at(surface, origin)
    halfedge, part = crossings.halfedge[loops.order], part[loops.order]
    deep, shallow = crossings.deep[loops.order], crossings.shallow[loops.order]
    points = sheet.points[deep] + (sheet.points[shallow] - sheet.points[deep]) * part[:, None]
    face, barycentric = sheet.locate(halfedge, part)
    counts = np.concatenate([[len(path) for path in sheet.origins.paths], np.diff(loops.offsets)])
    return Polylines(
        points=np.concatenate([surface.vertices[origin], points]),
        offsets=offsets_of(counts),
        closed=np.concatenate([sheet.origins.closed, loops.closed]),
        face=np.concatenate([origin_face, face]),
        barycentric=np.concatenate([origin_barycentric, barycentric]),
    )


def corners_at(surface: SurfaceMesh, vertices: Ints) -> tuple[Ints, Floats]:
    """A face at each of the vertices, and the barycentric coordinates of the vertex in it."""
    corner = np.empty(surface.n_vertices, np.int64)
    corner[surface.faces.ravel()[::-1]] = np.arange(3 * surface.n_faces)[::-1]
    at = corner[vertices]
    barycentric = np.zeros((len(vertices), 3))
    barycentric[np.arange(len(vertices)), at % 3] = 1.0
    return at // 3, barycentric


def refuse_too_many_points(points: float, spacing: float) -> None:
    """Raise `TooMuchWork` where so many points are too many."""
    if points > MOST_POINTS:
        raise TooMuchWork(
            f"A spacing of {spacing:g} would give about {points:.2g} points, more than {MOST_POINTS:.2g}",
            remedy=f"Take a spacing of {_round_up(spacing * points / MOST_POINTS):g} or more.",
        )


def too_large(spacing: float, depth: float) -> SpacingTooLarge:
    """The refusal of a spacing at which no polyline fits."""
    return SpacingTooLarge(
        f"A spacing of {spacing:g} leaves no room for a polyline: the surface is about {depth:.3g} deep",
        remedy=f"Take a spacing of {_round_down(depth / 2):g} or less.",
    )


def least_depth(surface: SurfaceMesh, distance: Floats) -> float:
    """How deep the surface is at least: at a vertex, or in the middle of the largest circle inside a face."""
    a, b, c = (surface.vertices[surface.faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    perimeter = surface.edge_lengths.reshape(-1, 3).sum(1)
    radius = np.divide(2.0 * area, perimeter, out=np.zeros_like(area), where=perimeter > 0)
    return float(max(distance.max(), radius.max()))


def _round_down(value: float) -> float:
    """Two significant digits, not more than the value."""
    if value <= 0:
        return 0.0
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(np.floor(value / unit) * unit)


def _round_up(value: float) -> float:
    """Two significant digits, not less than the value."""
    unit = 10.0 ** (np.floor(np.log10(value)) - 1)
    return float(np.ceil(value / unit) * unit)


# ----------------------------------------------------------------------
# Polylines that run close along a selvedge, where no rod has room beside them.


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
